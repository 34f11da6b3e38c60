//! What can be typed behind `rhumb calibrate`.

use std::path::PathBuf;

use clap::{Args, Subcommand, ValueEnum};

use super::SettingsArguments;

/// Ways to a calibration.
#[derive(Debug, Subcommand)]
pub enum Calibrate {
    /// Make a calibration file of a log of magnets
    Fit(CalibrateFit),
    /// Search for the magnets on a machine and make a calibration of what is found
    Scan(Box<CalibrateScan>),
    /// Write the pins to print, or find the nozzle's own centre from their distances
    Pins(CalibratePins),
    /// Find the pivot of a head that tilts the nozzle, from touches of one point
    Pivot(CalibratePivot),
    /// Explain a calibration file, and draw what printing without it would miss
    Show(CalibrateShow),
}

/// Arguments of `calibrate fit`.
#[derive(Debug, Args)]
pub struct CalibrateFit {
    /// The log: located magnets, readings or switchings of a sensor; `-` reads standard input
    pub log: PathBuf,
    /// Where the calibration goes; `-` writes standard output [default: LOG.toml]
    #[arg(short, long, value_name = "CAL.toml")]
    pub output: Option<PathBuf>,
    /// Draw the magnets and what they miss their places by
    #[arg(long, value_name = "FILE.svg")]
    pub picture: Option<PathBuf>,
    /// A calibration that `calibrate pins` wrote: its distance from sensor to nozzle is taken off
    #[arg(long, value_name = "CAL.toml")]
    pub pins: Option<PathBuf>,
}

/// Arguments of `calibrate scan`.
#[derive(Debug, Args)]
pub struct CalibrateScan {
    /// The printer's serial device
    #[arg(long, value_name = "DEV", required_unless_present = "simulate")]
    pub port: Option<PathBuf>,
    /// Search on a simulated machine instead; a number chooses which
    #[arg(long, value_name = "N", conflicts_with = "port", num_args = 0..=1, default_missing_value = "0")]
    pub simulate: Option<u64>,
    /// How to search
    #[arg(long, value_enum, default_value_t = Procedure::Fast)]
    pub procedure: Procedure,
    /// Where the calibration goes [default: calibration.toml]
    #[arg(short, long, value_name = "CAL.toml")]
    pub output: Option<PathBuf>,
    /// Write what the sensor saw
    #[arg(long, value_name = "LOG.csv")]
    pub log: Option<PathBuf>,
    /// Draw the magnets and what they miss their places by
    #[arg(long, value_name = "FILE.svg")]
    pub picture: Option<PathBuf>,
    /// A calibration that `calibrate pins` wrote: its distance from sensor to nozzle is taken off
    #[arg(long, value_name = "CAL.toml")]
    pub pins: Option<PathBuf>,
    /// Magnets round the ring
    #[arg(long, value_name = "N", default_value_t = 16, value_parser = clap::value_parser!(u8).range(3..=72))]
    pub magnets: u8,
    /// Radius of the ring, mm
    #[arg(long, value_name = "MM", default_value_t = 100.0)]
    pub ring_radius: f64,
    /// Radius on which inner magnets stand, mm, for rails that do not reach the ring's far side
    #[arg(long, value_name = "MM")]
    pub inner_radius: Option<f64>,
    /// Speed of the bed while the sensor is watched, degrees a second
    #[arg(long, value_name = "DEG", default_value_t = 60.0)]
    pub speed: f64,
    /// Speed of the serial line
    #[arg(long, value_name = "BAUD", default_value_t = 250_000)]
    pub baud: u32,
    /// Longest time without an answer, s
    #[arg(long, value_name = "S", default_value_t = 60.0)]
    pub timeout: f64,
    /// Step of the carriage in the stepwise procedure, mm
    #[arg(long, value_name = "MM", default_value_t = 0.2)]
    pub rail_step: f64,
    /// Step of the bed in the stepwise procedure, degrees
    #[arg(long, value_name = "DEG", default_value_t = 0.0225)]
    pub bed_step: f64,
    /// Reading at which the sensor has found a magnet in the stepwise procedure
    #[arg(long, value_name = "LEVEL", default_value_t = 20.0)]
    pub fires_at: f64,
    /// Which settings to use
    #[command(flatten)]
    pub settings: SettingsArguments,
}

/// Ways to search.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Procedure {
    /// Whole turns at a few carriage positions, both ways and from both sides.
    Fast,
    /// The source's: step by step to the largest reading. Slow, and blind to b.
    Stepwise,
}

/// Arguments of `calibrate pins`.
#[derive(Debug, Args)]
pub struct CalibratePins {
    /// What the caliper showed, CSV: from,to,over_mm,between_mm; without it the model is written
    pub readings: Option<PathBuf>,
    /// Where the calibration goes [default: READINGS.toml], or the model [default: pins.stl]
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// The calibration that the pins were printed with
    #[arg(long, value_name = "CAL.toml")]
    pub calibration: Option<PathBuf>,
    /// Radius on which the outer pins stand, mm
    #[arg(long, value_name = "MM", default_value_t = 60.0)]
    pub outer: f64,
    /// Radius on which the inner pins stand, mm
    #[arg(long, value_name = "MM", default_value_t = 15.0)]
    pub inner: f64,
    /// Radius of a pin, mm
    #[arg(long, value_name = "MM", default_value_t = 3.0)]
    pub pin: f64,
    /// Standard deviation of one reading of the caliper, mm
    #[arg(long, value_name = "MM", default_value_t = 0.03)]
    pub caliper_sd: f64,
}

/// Arguments of `calibrate pivot`.
#[derive(Debug, Args)]
pub struct CalibratePivot {
    /// The words at which the tip touched a fixed point, tilted now one way and now another, CSV:
    /// s_mm,theta_deg,z_mm,a_deg,b_deg, or without a_deg where there is one tilt; `-` reads standard input
    #[arg(required_unless_present = "simulate")]
    pub log: Option<PathBuf>,
    /// Where the calibration goes [default: LOG.toml], or the simulated log [default: pivot.csv]; `-`
    /// writes standard output
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Standard deviation of one touch in each coordinate, mm
    #[arg(long, value_name = "MM", default_value_t = 0.01)]
    pub touch_sd: f64,
    /// Write the log of a simulated machine instead: its true length from pivot to tip, and how far the
    /// tip lies beside the line down from the pivot, mm
    #[arg(long, value_name = "LENGTH[,X,Y]", conflicts_with = "log", allow_hyphen_values = true)]
    pub simulate: Option<String>,
    /// How far the simulated machine tilts, degrees
    #[arg(long, value_name = "DEG", default_value_t = 30.0, requires = "simulate")]
    pub tilt: f64,
    /// Chooses the errors of the simulated touches
    #[arg(long, value_name = "N", default_value_t = 0, requires = "simulate")]
    pub seed: u64,
    /// Which settings to use
    #[command(flatten)]
    pub settings: SettingsArguments,
}

/// Arguments of `calibrate show`.
#[derive(Debug, Args)]
pub struct CalibrateShow {
    /// The calibration
    pub file: PathBuf,
    /// Draw what printing without it would miss
    #[arg(long, value_name = "FILE.svg")]
    pub picture: Option<PathBuf>,
    /// Radius of the bed, mm
    #[arg(long, value_name = "MM", default_value_t = 100.0)]
    pub radius: f64,
}

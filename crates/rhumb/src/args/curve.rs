//! What can be typed behind `rhumb curve`.

use std::path::PathBuf;

use clap::{Args, Subcommand};

/// Bare curves on a sphere.
#[derive(Debug, Subcommand)]
#[command(after_long_help = FORMATS)]
pub enum Curve {
    /// The Archimedean spherical spiral, whose turns are equally far apart
    #[command(visible_alias = "archimedean", after_long_help = FORMATS)]
    Archimedes(Archimedes),
    /// The loxodrome, which crosses all meridians at the same angle; its turns come closer to each
    /// other towards the poles
    #[command(after_long_help = FORMATS)]
    Loxodrome(LoxodromeCurve),
}

/// Arguments of `curve archimedes`.
#[derive(Debug, Args)]
pub struct Archimedes {
    /// Radius of the sphere, mm
    #[arg(long, value_name = "MM", default_value_t = 70.0)]
    pub radius: f64,
    /// Turns from pole to pole [default: 17]
    #[arg(long, value_name = "N", conflicts_with = "bead_width")]
    pub turns: Option<f64>,
    /// As many turns as lay beads of this width side by side, n = πR/h, mm
    #[arg(long, value_name = "MM", visible_aliases = ["width", "spacing"])]
    pub bead_width: Option<f64>,
    /// What the parameter gains from point to point; from pole to pole it runs over twice the radius
    /// [default: 0.25, or its half, quarter … where a turn would have less than 24 points]
    #[arg(long, value_name = "MM", visible_alias = "fineness")]
    pub step: Option<f64>,
    /// How far the axis through the poles leans, degrees
    #[arg(
        long,
        value_name = "DEG",
        visible_alias = "lean",
        default_value_t = 0.0,
        allow_hyphen_values = true
    )]
    pub leaning: f64,
    /// Where the curve goes, in the format that the end of the name says; `-` writes .sldcrv to
    /// standard output [default: line-RADIUS-TURNS.sldcrv]
    #[arg(short, long, value_name = "FILE.(sldcrv|csv|svg)")]
    pub output: Option<PathBuf>,
}

/// Arguments of `curve loxodrome`.
#[derive(Debug, Args)]
pub struct LoxodromeCurve {
    /// Radius of the sphere, mm
    #[arg(long, value_name = "MM", default_value_t = 70.0)]
    pub radius: f64,
    /// Turns, half of them below the equator [default: 17; with --bead-width up to 85° latitude]
    #[arg(long, value_name = "N")]
    pub turns: Option<f64>,
    /// Slope against the parallels, m [default: so that the turns end at 85° latitude]
    #[arg(
        long,
        value_name = "M",
        visible_alias = "m",
        conflicts_with = "bead_width",
        allow_hyphen_values = true
    )]
    pub slope: Option<f64>,
    /// The slope at which neighbouring turns are as far apart as this at the equator, where they are
    /// farthest, mm
    #[arg(long, value_name = "MM", visible_aliases = ["width", "spacing"])]
    pub bead_width: Option<f64>,
    /// Azimuth at which it crosses the equator, degrees
    #[arg(long, value_name = "DEG", default_value_t = 0.0, allow_hyphen_values = true)]
    pub meridian: f64,
    /// Azimuth from point to point, degrees
    #[arg(long, value_name = "DEG", default_value_t = 5.0)]
    pub step: f64,
    /// Where the curve goes, in the format that the end of the name says; `-` writes .sldcrv to
    /// standard output [default: loxodrome-RADIUS-TURNS.sldcrv]
    #[arg(short, long, value_name = "FILE.(sldcrv|csv|svg)")]
    pub output: Option<PathBuf>,
}

impl Curve {
    /// Where it is to go.
    #[must_use]
    pub fn output(&self) -> &Option<PathBuf> {
        match self {
            Self::Archimedes(a) => &a.output,
            Self::Loxodrome(a) => &a.output,
        }
    }
}

/// The formats, for the help.
const FORMATS: &str = "\
Formats:
  .sldcrv  a point a line for a curve through XYZ points in CAD, three decimals; the poles are on the
           second coordinate, as in the listing that the spiral comes from: y z x of the .csv
  .csv     x_mm,y_mm,z_mm,length_mm,turn,latitude_deg,spacing_mm: the poles are on z; the length from the
           first point along the curve, the turns made, the latitude before the axis leans, and how far
           the turn above is along the meridian
  .svg     the curve from its upper pole and from the side";

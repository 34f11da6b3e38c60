//! `rhumb calibrate`: the true rotation centre of a machine, found and explained.

mod file;
mod fit;
mod pins;
mod pivot;
mod scan;
mod serial;
mod show;

use std::path::{Path, PathBuf};

use crate::args::{Calibrate, Manner};
use crate::calibration::Calibration;
use crate::failure::Failure;
use crate::input;

use super::display_name;

pub(super) fn run(calibrate: &Calibrate, manner: &Manner) -> Result<u8, Failure> {
    match calibrate {
        Calibrate::Fit(arguments) => fit::run(arguments, manner),
        Calibrate::Scan(arguments) => scan::run(arguments, manner),
        Calibrate::Pins(arguments) => pins::run(arguments, manner),
        Calibrate::Pivot(arguments) => pivot::run(arguments, manner),
        Calibrate::Show(arguments) => show::run(arguments, manner),
    }
}

/// Reads a text file.
fn text(path: &Path) -> Result<String, Failure> {
    String::from_utf8(input::read(path)?).map_err(|_| {
        Failure::new("Encoding", format!("{}: the file is not UTF-8", display_name(path)))
    })
}

fn calibration(path: &Path) -> Result<Calibration, Failure> {
    Calibration::read(&input::read(path)?, &display_name(path))
}

/// The calibration file that belongs to an input, in the working directory.
fn target(output: Option<&PathBuf>, input: &Path) -> PathBuf {
    output.cloned().unwrap_or_else(|| {
        let stem = input.file_stem().filter(|stem| *stem != "-").unwrap_or("calibration".as_ref());
        Path::new(stem).with_extension("toml")
    })
}

/// From the sensor to the nozzle, mm along and across the rail, where a print has shown it.
fn sensor_offset(found: &Calibration) -> Option<[f64; 2]> {
    let pair = found.quality.get("sensor_offset_mm")?.as_array()?;
    match pair.as_slice() {
        [along, across] => Some([along.as_float()?, across.as_float()?]),
        _ => None,
    }
}

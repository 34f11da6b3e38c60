//! The commands, one a file. Each returns the exit status of a run that went through.

mod batch;
mod calibrate;
mod completions;
mod convert;
mod curve;
mod files;
mod inspect;
mod model;
mod motor;
mod orient;
mod preview;
mod profile;
mod send;
mod slice;
mod steps;
mod verify;

use std::io::{self, Write};
use std::path::Path;

use mesh::cut::Keep;
use mesh::health::Health;
use mesh::model::Format;
use mesh::topology::Solid;

use crate::args::{Arguments, Axis, Command, Part, PlaceArguments, SettingsArguments};
use crate::calibration::Calibration;
use crate::failure::Failure;
use crate::input;
use crate::models::{self, Model};
use crate::output::{self, Output};
use crate::place::{Pose, Wish, parse_centre};
use crate::settings::{Job, Settings};

/// Exit status of a run with nothing to remark.
pub const DONE: u8 = 0;

/// Exit status of a run whose result needs a look.
pub const LOOK: u8 = 1;

/// Runs a command and returns its exit status.
///
/// # Errors
///
/// Why it could not go on.
pub fn run(arguments: &Arguments) -> Result<u8, Failure> {
    let manner = &arguments.manner;
    files::check(&arguments.command)?;
    match &arguments.command {
        Command::Slice(arguments) => slice::run(arguments, manner),
        Command::Batch(arguments) => batch::run(arguments, manner),
        Command::Inspect(arguments) => inspect::run(arguments, manner),
        Command::Orient(arguments) => orient::run(arguments, manner),
        Command::Convert(arguments) => convert::run(arguments, manner),
        Command::Calibrate(calibrate) => calibrate::run(calibrate, manner),
        Command::Verify(arguments) => verify::run(arguments, manner),
        Command::Preview(arguments) => preview::run(arguments),
        Command::Send(arguments) => send::run(arguments, manner),
        Command::Motor(arguments) => motor::run(arguments, manner),
        Command::Steps(arguments) => steps::run(arguments, manner),
        Command::Curve(curve) => curve::run(curve, manner),
        Command::Completions(arguments) => completions::run(arguments),
        Command::Profile(profile) => profile::run(profile, manner),
        Command::Model(arguments) => model::run(arguments),
    }
}

/// Prints to standard output.
fn say(text: &str) -> Result<(), Failure> {
    let mut out = io::stdout().lock();
    out.write_all(text.as_bytes())
        .and_then(|()| out.flush())
        .map_err(|error| output::failed(Path::new("standard output"), &error))
}

/// Prints an object as JSON to standard output.
fn say_json(value: &impl serde::Serialize) -> Result<(), Failure> {
    say(&format!("{}\n", to_json(value)?))
}

fn to_json(value: &impl serde::Serialize) -> Result<String, Failure> {
    serde_json::to_string_pretty(value).map_err(|error| Failure::new("Bug", error.to_string()))
}

/// Writes a whole file, or nothing.
fn write_file(target: &Path, inputs: &[&Path], bytes: &[u8]) -> Result<(), Failure> {
    let mut out = Output::create(target, inputs)?;
    out.file().write_all(bytes).map_err(|error| output::failed(target, &error))?;
    out.commit()
}

fn settings(arguments: &SettingsArguments) -> Result<(Settings, Job), Failure> {
    let settings = Settings::load(&arguments.sources(), &input::read)?;
    let mut job = Job::resolve(&settings)?;
    if let Some(path) = &arguments.calibration {
        let calibration = Calibration::read(&input::read(path)?, &display_name(path))?;
        calibration.apply(&mut job.printer, job.bed_map_fade)?;
    }
    Ok((settings, job))
}

/// Reads the mesh of a file; of the wish, scale and mirrors count.
fn solid(path: &Path, bytes: &[u8], wish: &Wish) -> Result<(Solid, Health), Failure> {
    let model = Model { name: path, format: Format::of(path, bytes), bytes: bytes.into() };
    models::repaired(&models::read(&model, wish)?, path)
}

fn wish(arguments: &PlaceArguments) -> Result<Wish, Failure> {
    let scale = arguments.scale * arguments.units.mm();
    if !(scale.is_finite() && scale > 0.0) {
        return Err(Failure::new("Usage", format!("--scale {} is not above 0", arguments.scale)));
    }
    let turns = [arguments.rotate_x, arguments.rotate_y, arguments.rotate_z];
    let heights = arguments.cut.into_iter();
    if let Some(odd) = turns.into_iter().chain(heights).find(|number| !number.is_finite()) {
        return Err(Failure::new("Usage", format!("{odd} is neither an angle nor a height")));
    }
    let [x, y, z] = turns.map(f64::to_radians);
    let pose = match &arguments.orient {
        Some(text) => Pose::parse(text)?,
        None if x != 0.0 || y != 0.0 => Pose::Turned([x, y, 0.0]),
        None => Pose::Usual,
    };
    let is_along = |axis| arguments.mirror.contains(&axis);
    let keep = if arguments.keep == Part::Upper { Keep::Upper } else { Keep::Lower };
    Ok(Wish {
        pose,
        centre: parse_centre(&arguments.place)?,
        scale,
        mirror: [Axis::X, Axis::Y, Axis::Z].map(is_along),
        turn: z,
        cut: arguments.cut.map(|height| (height, keep)),
    })
}

/// The name of a file for people, without its folder.
fn display_name(path: &Path) -> String {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}

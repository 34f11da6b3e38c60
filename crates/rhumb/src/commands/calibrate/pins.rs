//! `rhumb calibrate pins`: the pins to print, and what their distances say of the nozzle.

use std::f64::consts::{FRAC_PI_2, TAU};
use std::path::{Path, PathBuf};

use machine::calibration::pins::{Artefact, PinsError, Printed, evaluate, parse};
use mesh::mesh::Mesh;
use mesh::{shapes, stl};

use super::file::Draft;
use super::{calibration, sensor_offset, target, text};
use crate::args::{CalibratePins, Manner};
use crate::calibration::Calibration;
use crate::clock;
use crate::commands::{DONE, display_name, say, say_json, write_file};
use crate::failure::Failure;

/// Height of the pins, mm: enough for the jaws of a caliper.
const HEIGHT_MM: f64 = 8.0;

/// Corners of a pin: its faces lie within 2 µm of the circle.
const CORNERS: u32 = 96;

/// How far outside of the pin `A0` its mark stands, mm, so that the pins can be told apart.
const MARK_MM: f64 = 10.0;

pub(super) fn run(arguments: &CalibratePins, manner: &Manner) -> Result<u8, Failure> {
    let artefact = Artefact { outer: arguments.outer, inner: arguments.inner, pin: arguments.pin };
    check(&artefact, arguments.caliper_sd)?;
    match &arguments.readings {
        Some(path) => evaluate_readings(arguments, &artefact, path, manner),
        None => {
            let target = arguments.output.clone().unwrap_or_else(|| PathBuf::from("pins.stl"));
            write_file(&target, &[], &stl::write(&model(&artefact)))?;
            if !manner.quiet && target != Path::new("-") {
                say(&format!("{}written  {}\n", instructions(), display_name(&target)))?;
            }
            Ok(DONE)
        }
    }
}

fn check(artefact: &Artefact, caliper_sd: f64) -> Result<(), Failure> {
    let Artefact { outer, inner, pin } = *artefact;
    // Pins apart from each other and from the axis, on a bed that exists.
    let is_sound =
        0.5 <= pin && 2.0 * pin <= inner && inner + 4.0 * pin <= outer && outer <= 1000.0;
    let has_sd = (1e-4..=1.0).contains(&caliper_sd);
    match (is_sound, has_sd) {
        (true, true) => Ok(()),
        (false, _) => Err(Failure::new(
            "Usage",
            format!("pins of {pin} mm radius at {inner} and {outer} mm are not apart"),
        )),
        (_, false) => {
            Err(Failure::new("Usage", format!("--caliper-sd {caliper_sd} is no caliper's")))
        }
    }
}

/// Eight pins and the mark of the first.
fn model(artefact: &Artefact) -> Mesh {
    let circle = |radius: f64, x: f64, y: f64| -> Vec<[f64; 2]> {
        (0..CORNERS)
            .map(|k| TAU * f64::from(k) / f64::from(CORNERS))
            .map(|angle| [x + radius * angle.cos(), y + radius * angle.sin()])
            .collect()
    };
    let mut outlines = vec![circle(artefact.pin / 2.0, artefact.outer + MARK_MM, 0.0)];
    for radius in [artefact.outer, artefact.inner] {
        for quarter in 0..4 {
            let (sin, cos) = (FRAC_PI_2 * f64::from(quarter)).sin_cos();
            outlines.push(circle(artefact.pin, radius * cos, radius * sin));
        }
    }
    let mut all = Mesh { vertices: Vec::new(), triangles: Vec::new() };
    for outline in outlines {
        let pin = shapes::extruded(&outline, &[], HEIGHT_MM);
        let first = all.vertices.len() as u32;
        all.vertices.extend(pin.vertices);
        all.triangles.extend(pin.triangles.iter().map(|corners| corners.map(|k| k + first)));
    }
    all
}

fn instructions() -> &'static str {
    "Print it unturned and unmoved (--orient keep --place 0,0), with the calibration so far, if \
     any.\nThe pin with the small mark outside of it is A0, the others follow counter-clockwise; \
     the inner\nones are C0 to C270. Measure and write as CSV:\n\
     from,to,over_mm,between_mm\nA0,C90, A90,C180, A180,C270, A270,C0     a quarter turn ahead\n\
     A0,C270, A90,C0, A180,C90, A270,C180     a quarter turn behind\n\
     A0,A180, A90,A270, C0,C180, C90,C270     across\n"
}

fn evaluate_readings(
    arguments: &CalibratePins,
    artefact: &Artefact,
    path: &Path,
    manner: &Manner,
) -> Result<u8, Failure> {
    let name = display_name(path);
    let failed = |error: PinsError| {
        let class =
            if matches!(error, PinsError::Row { .. }) { "LogSyntax" } else { "NoCalibration" };
        Failure::new(class, format!("{name}: {error}"))
    };
    let distances = parse(&text(path)?, artefact).map_err(failed)?;
    let printed = evaluate(artefact, &distances, arguments.caliper_sd).map_err(failed)?;
    let before = match &arguments.calibration {
        Some(path) => calibration(path)?,
        None => Calibration::default(),
    };
    let target = target(arguments.output.as_ref(), path);
    let mut inputs = vec![path];
    inputs.extend(arguments.calibration.as_deref());
    // A calibration is brought up to date in place when the user says so.
    let is_update = arguments.calibration.as_ref() == arguments.output.as_ref();
    let kept = if is_update { &inputs[..1] } else { &inputs[..] };
    let draft = draft(&before, &printed, arguments.calibration.is_some(), distances.len());
    draft.write(&target, kept)?;
    if target == Path::new("-") {
        return Ok(DONE);
    }
    report(&before, &printed, &target, manner)?;
    Ok(DONE)
}

/// The earlier calibration with what the print shows added to it.
fn draft(before: &Calibration, printed: &Printed, has_sensor: bool, n_readings: usize) -> Draft {
    let mut draft = Draft::default();
    draft.number("rail", "a_mm", Some(before.rail.a_mm + printed.a.value));
    draft.number("rail", "b_mm", Some(before.rail.b_mm + printed.b.value));
    for (key, value) in [("a1", before.column.a1), ("b1", before.column.b1)] {
        draft.number("column", key, Some(value).filter(|value| *value != 0.0));
    }
    let plate = &before.plate;
    for (key, value) in [("ex_mm", plate.ex_mm), ("ey_mm", plate.ey_mm), ("psi_deg", plate.psi_deg)]
    {
        draft.number("plate", key, Some(value));
    }
    if let Some(shift) = plate.shift_mm {
        draft.pair("plate", "shift_mm", shift);
    }
    let bed = &before.bed;
    draft.number("bed", "theta_zero_deg", Some(bed.theta_zero_deg));
    draft.number("bed", "backlash_deg", Some(bed.backlash_deg));
    if !bed.probes.is_empty() {
        draft.triples("bed", "probes", &bed.probes);
    }
    draft.keep_head(before);
    draft.number("quality", "a_sd_mm", Some(printed.a.sd));
    draft.number("quality", "b_sd_mm", Some(printed.b.sd));
    draft.number("quality", "shrinkage", Some(printed.shrinkage.value));
    draft.count("quality", "readings", n_readings);
    if has_sensor {
        // What an earlier print had taken off already still lies between sensor and nozzle.
        let earlier = sensor_offset(before).unwrap_or_default();
        let offset = [earlier[0] - printed.a.value, earlier[1] - printed.b.value];
        draft.pair("quality", "sensor_offset_mm", offset);
    }
    draft.words("quality", "method", "printed pins");
    draft.words("quality", "date", &clock::now());
    draft
}

fn report(
    before: &Calibration,
    printed: &Printed,
    target: &Path,
    manner: &Manner,
) -> Result<(), Failure> {
    let (a, b) = (before.rail.a_mm + printed.a.value, before.rail.b_mm + printed.b.value);
    if manner.json {
        return say_json(&serde_json::json!({
            "a_mm": {"value": a, "sd": printed.a.sd},
            "b_mm": {"value": b, "sd": printed.b.sd},
            "left_mm": [printed.a.value, printed.b.value],
            "shrinkage": {"value": printed.shrinkage.value, "sd": printed.shrinkage.sd},
        }));
    }
    if manner.quiet {
        return Ok(());
    }
    say(&format!(
        "a        {a:>9.4} ± {:.4} mm   the print shows {:.4} mm more than was allowed for\n\
         b        {b:>9.4} ± {:.4} mm   the print shows {:.4} mm more than was allowed for\n\
         scale    {:>9.5} ± {:.5}\n\
         a calibration from magnets: its sensor stands {:.4} mm along and {:.4} mm across from the \
         nozzle\nwritten  {}\n",
        printed.a.sd,
        printed.a.value,
        printed.b.sd,
        printed.b.value,
        printed.shrinkage.value,
        printed.shrinkage.sd,
        -printed.a.value,
        -printed.b.value,
        display_name(target)
    ))
}

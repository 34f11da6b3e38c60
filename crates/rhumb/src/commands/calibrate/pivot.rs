//! `rhumb calibrate pivot`: the pivot of a head that tilts, from touches of one point.

use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use machine::calibration::fit::Estimate;
use machine::calibration::pivot::{Pivot, PivotError, Touch, fit, parse};
use machine::head::tilting::Tilting;
use machine::head::{Head, Pose};
use machine::profile::Printer;
use machine::program::BedTurn;
use nalgebra::{Point3, UnitVector3, Vector2, Vector3};
use twin::magnets::Chance;

use super::file::Draft;
use super::{calibration, target, text};
use crate::args::{CalibratePivot, Manner};
use crate::calibration::Calibration;
use crate::clock;
use crate::commands::{DONE, LOOK, display_name, say, say_json, settings, write_file};
use crate::failure::Failure;

/// Touches that miss the point by more than so many standard deviations need a look.
const MANY_SDS: f64 = 5.0;

pub(super) fn run(arguments: &CalibratePivot, manner: &Manner) -> Result<u8, Failure> {
    if !(1e-5..=1.0).contains(&arguments.touch_sd) {
        return Err(Failure::new(
            "Usage",
            format!("--touch-sd {} is no touch's: it is from 0.00001 to 1 mm", arguments.touch_sd),
        ));
    }
    let (_, job) = settings(&arguments.settings)?;
    let Some(Head::Tilting(head)) = &job.printer.head else {
        return Err(Failure::new(
            "ConfigConflict",
            format!("{} has no head that tilts about a pivot", job.printer.name),
        )
        .hint("choose a printer with head = \"tilt\" or \"two-axis\" (--printer polar-two-axis)"));
    };
    if let Some(truth) = &arguments.simulate {
        return simulate(arguments, truth, &job.printer, head);
    }
    // Required where nothing is simulated.
    let log = arguments.log.clone().unwrap_or_else(|| PathBuf::from("-"));
    let name = display_name(&log);
    let failed = |error: PivotError| {
        let class =
            if matches!(error, PivotError::Row { .. }) { "LogSyntax" } else { "NoCalibration" };
        Failure::new(class, format!("{name}: {error}"))
    };
    let touches = parse(&text(&log)?).map_err(failed)?;
    let pivot = fit(&touches, head, &job.printer.alignment, arguments.touch_sd).map_err(failed)?;
    let before = match &arguments.settings.calibration {
        Some(path) => calibration(path)?,
        None => Calibration::default(),
    };
    let target = target(arguments.output.as_ref(), &log);
    // A calibration is brought up to date in place when the user says so.
    let is_update = arguments.settings.calibration.as_ref() == arguments.output.as_ref();
    let mut inputs = vec![log.as_path()];
    inputs.extend(arguments.settings.calibration.as_deref().filter(|_| !is_update));
    draft(&before, &pivot, touches.len()).write(&target, &inputs)?;
    let is_odd = pivot.worst.1 > MANY_SDS * arguments.touch_sd;
    if target != Path::new("-") {
        report(&pivot, head, is_odd, &target, manner)?;
    }
    Ok(if is_odd { LOOK } else { DONE })
}

/// The earlier calibration with the pivot added to it.
fn draft(before: &Calibration, pivot: &Pivot, touches: usize) -> Draft {
    let mut draft = Draft::kept(before);
    draft.number("head", "pivot_length_mm", Some(pivot.length.value));
    if let Some([along, across]) = pivot.offset {
        draft.pair("head", "offset_mm", [along.value, across.value]);
        draft.pair("quality", "pivot_offset_sd_mm", [along.sd, across.sd]);
    }
    draft.number("quality", "pivot_length_sd_mm", Some(pivot.length.sd));
    draft.number("quality", "pivot_residual_rms_mm", Some(pivot.residual_rms));
    draft.count("quality", "pivot_touches", touches);
    draft.words("quality", "pivot_date", &clock::now());
    draft
}

fn report(
    pivot: &Pivot,
    head: &Tilting,
    is_odd: bool,
    target: &Path,
    manner: &Manner,
) -> Result<(), Failure> {
    let (line, miss) = pivot.worst;
    if manner.json {
        let estimate = |e: Estimate| serde_json::json!({"value": e.value, "sd": e.sd});
        return say_json(&serde_json::json!({
            "pivot_length_mm": estimate(pivot.length),
            "offset_mm": pivot.offset.map(|offset| offset.map(estimate)),
            "residual_rms_mm": pivot.residual_rms,
            "worst": {"line": line, "miss_mm": miss},
            "was_mm": head.pivot_length,
        }));
    }
    if manner.quiet {
        return Ok(());
    }
    let mut out = String::new();
    let mut row = |name: &str, meaning: &str, e: Estimate| {
        // Writing to a string cannot fail.
        let _ = writeln!(out, "{name:<8} {:>9.4} ± {:.4} mm   {meaning}", e.value, e.sd);
    };
    let more = pivot.length.value - head.pivot_length;
    row("length", &format!("from pivot to tip, {more:+.4} mm beside what it was"), pivot.length);
    if let Some([along, across]) = pivot.offset {
        row("along", "the tip beside the line down from the pivot, along the rail", along);
        row("across", "the same across", across);
    }
    let _ = writeln!(
        out,
        "touches miss the point by {:.4} mm rms, that of line {line} by {miss:.4} mm",
        pivot.residual_rms
    );
    if is_odd {
        let _ = writeln!(
            out,
            "look at line {line}: leave it out and see whether the others agree, or say how good a \
             touch is (--touch-sd)"
        );
    }
    say(&format!("{out}written  {}\n", display_name(target)))
}

/// Where the simulated point stands in the part frame, mm: far enough out for tilts to either side.
const POINT_MM: [f64; 3] = [60.0, 0.0, 20.0];

/// Directions that the simulated nozzle leans to, besides standing upright.
const SIDES: u32 = 6;

/// Writes the log of touches on a machine with another pivot than its profile's.
fn simulate(
    arguments: &CalibratePivot,
    truth: &str,
    printer: &Printer,
    head: &Tilting,
) -> Result<u8, Failure> {
    let wrong = || {
        Failure::new(
            "Usage",
            format!("--simulate {truth:?} is neither a length nor LENGTH,X,Y in mm"),
        )
    };
    let numbers: Option<Vec<f64>> = truth
        .split(',')
        .map(|number| number.trim().parse::<f64>().ok().filter(|n| n.abs() <= 1000.0))
        .collect();
    let (length, offset) = match numbers.as_deref() {
        Some([length]) => (*length, Vector2::zeros()),
        Some([length, x, y]) => (*length, Vector2::new(*x, *y)),
        _ => return Err(wrong()),
    };
    let has_two = head.axes.len() == 2;
    if length <= 0.0 || !(0.0..=85.0).contains(&arguments.tilt) || !has_two && offset.norm() > 0.0 {
        return Err(
            wrong().hint("heads with one tilt have no offset; --tilt is from 0 to 85 degrees")
        );
    }
    let real = Tilting { pivot_length: length, offset, ..head.clone() };
    let touches = touched(&real, printer, arguments)?;
    let path = arguments.output.clone().unwrap_or_else(|| PathBuf::from("pivot.csv"));
    write_file(&path, &[], log(&touches, has_two).as_bytes())?;
    Ok(DONE)
}

/// The words at which the tip of a real head touches the point.
fn touched(
    real: &Tilting,
    printer: &Printer,
    arguments: &CalibratePivot,
) -> Result<Vec<Touch>, Failure> {
    let has_two = real.axes.len() == 2;
    let lean = arguments.tilt.to_radians();
    let mut leans = vec![[0.0, 0.0]];
    if has_two {
        leans.extend((0..SIDES).map(|k| {
            let (sin, cos) = (TAU * f64::from(k) / f64::from(SIDES)).sin_cos();
            [lean * cos, lean * sin]
        }));
    } else {
        leans.extend([-1.0, -0.5, 0.5, 1.0].map(|share| [share * lean, 0.0]));
    }
    let real = Head::Tilting(real.clone());
    let mut chance = Chance::new(arguments.seed);
    let touches = leans.iter().map(|[along, across]| {
        let axis = Vector3::new(along.sin(), across.sin(), along.cos() * across.cos());
        let pose = Pose { at: Point3::from(POINT_MM), axis: UnitVector3::new_normalize(axis) };
        let stance = real.stance(&pose, BedTurn::default(), &printer.alignment);
        let mut stance =
            stance.map_err(|error| Failure::new("OutOfEnvelope", error.to_string()))?.stance;
        stance.base.s += chance.normal(arguments.touch_sd);
        stance.base.z += chance.normal(arguments.touch_sd);
        let across = chance.normal(arguments.touch_sd) / POINT_MM[0];
        stance.base.turn = BedTurn::accumulated(stance.base.turn.radians() + across);
        let [first, second] = [stance.head[0], stance.head[1]];
        let (across, along) = if has_two { (first, second) } else { (0.0, first) };
        Ok(Touch { line: 0, base: stance.base, across, along })
    });
    touches.collect()
}

fn log(touches: &[Touch], has_two: bool) -> String {
    let tilts = if has_two { "a_deg,b_deg" } else { "b_deg" };
    let mut out = format!("# simulated touches of one point\ns_mm,theta_deg,z_mm,{tilts}\n");
    for touch in touches {
        let theta = touch.base.turn.radians().to_degrees();
        let _ = write!(out, "{:.5},{theta:.6},{:.5}", touch.base.s, touch.base.z);
        if has_two {
            let _ = write!(out, ",{:.6}", touch.across.to_degrees());
        }
        let _ = writeln!(out, ",{:.6}", touch.along.to_degrees());
    }
    out
}

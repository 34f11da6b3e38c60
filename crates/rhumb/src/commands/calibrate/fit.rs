//! `rhumb calibrate fit`: a log of magnets to a calibration file.

use std::path::{Path, PathBuf};

use machine::calibration::fit::{Estimate, Fate, Fit, Undetermined, fit_log};
use machine::calibration::log;
use machine::calibration::log::Log;
use twin::picture;

use super::file::Draft;
use super::{calibration, sensor_offset, target, text};
use crate::args::{CalibrateFit, Manner};
use crate::clock;
use crate::commands::{DONE, LOOK, display_name, say, say_json, write_file};
use crate::failure::Failure;

pub(super) fn run(arguments: &CalibrateFit, manner: &Manner) -> Result<u8, Failure> {
    let name = display_name(&arguments.log);
    let log = log::parse(&text(&arguments.log)?)
        .map_err(|error| Failure::new("LogSyntax", format!("{name}: {error}")))?;
    let offset = offset(arguments.pins.as_ref())?;
    let fit = fitted(&log, &name)?;
    let target = target(arguments.output.as_ref(), &arguments.log);
    draft(&fit, offset).write(&target, &[&arguments.log])?;
    if let Some(path) = &arguments.picture {
        write_file(path, &[&arguments.log], picture::fit::draw(&fit).as_bytes())?;
    }
    if target != Path::new("-") {
        report(&fit, &target, manner)?;
    }
    Ok(status(&fit))
}

/// Fits a log, and refuses a machine that must be put right by hand.
pub(super) fn fitted(log: &Log, name: &str) -> Result<Fit, Failure> {
    fit_log(log).map_err(|error| {
        Failure::new("NoCalibration", format!("{name}: {error}"))
            .hint("give the ring with lines `# magnets = 16` and `# ring_radius_mm = 100`")
    })
}

/// A log that does not say all, or from which much was left out, needs a look.
pub(super) fn status(fit: &Fit) -> u8 {
    let has_doubt =
        fit.undetermined.iter().any(|what| !matches!(what, Undetermined::IndexMagnet { .. }));
    if has_doubt || fit.unresolved > 0 || fit.one_way > 0 { LOOK } else { DONE }
}

/// From the sensor to the nozzle, as `calibrate pins` found it.
pub(super) fn offset(pins: Option<&PathBuf>) -> Result<[f64; 2], Failure> {
    let Some(path) = pins else { return Ok([0.0; 2]) };
    sensor_offset(&calibration(path)?).ok_or_else(|| {
        let name = display_name(path);
        Failure::new(
            "ConfigType",
            format!("{name}: quality.sensor_offset_mm is no pair of numbers"),
        )
        .hint("rhumb calibrate pins READINGS.csv --calibration CAL.toml writes it")
    })
}

/// The calibration file of a fit; the offset from sensor to nozzle is taken off.
pub(super) fn draft(fit: &Fit, [along, across]: [f64; 2]) -> Draft {
    let mut draft = Draft::default();
    let value = |estimate: Option<Estimate>| estimate.map(|estimate| estimate.value);
    let sd = |estimate: Option<Estimate>| estimate.map(|estimate| estimate.sd);
    draft.number("rail", "a_mm", value(fit.a).map(|a| a - along));
    draft.number("rail", "b_mm", value(fit.b).map(|b| b - across));
    let has_index = !fit
        .undetermined
        .iter()
        .any(|what| matches!(what, Undetermined::IndexMagnet { .. } | Undetermined::PlateAngle));
    let angle = fit.angle.filter(|_| has_index);
    if let Some([ex, ey]) = fit.centre {
        draft.number("plate", "ex_mm", Some(ex.value));
        draft.number("plate", "ey_mm", Some(ey.value));
        draft.number("plate", "psi_deg", value(angle).map(f64::to_degrees));
    }
    for (key, estimate) in [("a_sd_mm", fit.a), ("b_sd_mm", fit.b)] {
        draft.number("quality", key, sd(estimate));
    }
    if let Some([ex, ey]) = fit.centre {
        draft.number("quality", "ex_sd_mm", Some(ex.sd));
        draft.number("quality", "ey_sd_mm", Some(ey.sd));
    }
    draft.number("quality", "psi_sd_deg", sd(angle).map(f64::to_degrees));
    draft.number("quality", "ring_radius_mm", value(fit.radius));
    draft.number("quality", "residual_rms_mm", Some(fit.residual_rms));
    draft.count("quality", "magnets_used", magnets_used(fit));
    draft.count("quality", "sightings_rejected", fit.n_rejected());
    if along != 0.0 || across != 0.0 {
        draft.pair("quality", "sensor_offset_mm", [along, across]);
    }
    draft.words("quality", "method", fit.method());
    draft.words("quality", "date", &clock::now());
    draft
}

/// Magnets, not sightings.
fn magnets_used(fit: &Fit) -> usize {
    let n_inner = fit.sightings.iter().filter(|one| one.fate == Fate::Inner);
    fit.n_ring() + n_inner.filter(|one| one.seen.s > 0.0).count()
}

pub(super) fn report(fit: &Fit, target: &Path, manner: &Manner) -> Result<(), Failure> {
    if manner.json {
        return say_json(&json(fit));
    }
    if manner.quiet {
        return Ok(());
    }
    say(&format!("{}written  {}\n", words(fit), display_name(target)))
}

fn json(fit: &Fit) -> serde_json::Value {
    let estimate = |estimate: Option<Estimate>| {
        estimate.map(|e| serde_json::json!({"value": e.value, "sd": e.sd}))
    };
    let degrees = |e: Estimate| Estimate { value: e.value.to_degrees(), sd: e.sd.to_degrees() };
    serde_json::json!({
        "a_mm": estimate(fit.a),
        "b_mm": estimate(fit.b),
        "ex_mm": estimate(fit.centre.map(|centre| centre[0])),
        "ey_mm": estimate(fit.centre.map(|centre| centre[1])),
        "ring_radius_mm": estimate(fit.radius),
        "psi_deg": estimate(fit.angle.map(degrees)),
        "sightings": fit.sightings.iter().map(|one| serde_json::json!({
            "s_mm": one.seen.s,
            "theta_deg": one.seen.theta.to_degrees(),
            "place": match one.fate {
                Fate::Ring(label) => label.into(),
                Fate::Inner => "inner".into(),
                Fate::Rejected => serde_json::Value::Null,
            },
            "miss_mm": one.miss.map(|miss| [miss.x, miss.y]),
        })).collect::<Vec<_>>(),
        "pairs": fit.n_pairs,
        "residual_rms_mm": fit.residual_rms,
        "rank": fit.rank,
        "condition": if fit.condition.is_finite() { fit.condition.into() } else { serde_json::Value::Null },
        "undetermined": fit.undetermined.iter().map(ToString::to_string).collect::<Vec<_>>(),
        "unresolved": fit.unresolved,
        "one_way": fit.one_way,
        "method": fit.method(),
    })
}

fn words(fit: &Fit) -> String {
    let mut out = String::new();
    let mut length = |name: &str, meaning: &str, estimate: Option<Estimate>| {
        if let Some(Estimate { value, sd }) = estimate {
            out.push_str(&format!("{name:<8} {value:>9.4} ± {sd:.4} mm   {meaning}\n"));
        }
    };
    length("a", "true minus commanded position on the rail", fit.a);
    length("b", "by how much the rail misses the axis", fit.b);
    length("ex", "the ring's centre from the axis", fit.centre.map(|centre| centre[0]));
    length("ey", "the same across", fit.centre.map(|centre| centre[1]));
    length("radius", "of the ring", fit.radius);
    out.push_str(&format!(
        "{} of {} sightings used, {} magnets seen from both sides, residual {:.4} mm rms, {}\n",
        fit.n_used(),
        fit.sightings.len(),
        fit.n_pairs,
        fit.residual_rms,
        fit.method()
    ));
    let rejected = fit.sightings.iter().filter(|one| one.fate == Fate::Rejected);
    for one in rejected {
        out.push_str(&format!(
            "rejected: s {:.3} mm, theta {:.3} degrees\n",
            one.seen.s,
            one.seen.theta.to_degrees()
        ));
    }
    let condition = if fit.condition.is_finite() {
        format!("condition {:.1}", fit.condition)
    } else {
        "singular".to_owned()
    };
    out.push_str(&format!("rank {}, {condition}\n", fit.rank));
    for what in &fit.undetermined {
        out.push_str(&format!("not determined: {what}\n"));
    }
    if fit.unresolved > 0 {
        out.push_str(&format!("{} magnets were scanned too little to locate\n", fit.unresolved));
    }
    if fit.one_way > 0 {
        out.push_str(&format!(
            "{} magnets were scanned in one direction only: they are off by some 0.05 mm\n",
            fit.one_way
        ));
    }
    out
}

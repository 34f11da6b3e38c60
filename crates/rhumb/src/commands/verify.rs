//! `rhumb verify`: a program proved on a model of the machine.

use std::fmt::Write as _;
use std::path::Path;

use machine::gcode::dialect::Space;
use twin::check::head::HeadTotals;
use twin::form::FormError;
use twin::motor::lag::{Lag, Worst};
use twin::thorough::Thorough;

use super::{DONE, LOOK, display_name, say, say_json, settings};
use crate::args::{Manner, Proof, SettingsArguments, Verify};
use crate::calibration::Calibration;
use crate::check::{check, findings};
use crate::failure::Failure;
use crate::input;
use crate::place::Wish;
use crate::program_text::duration;
use crate::settings::Job;

pub(super) fn run(arguments: &Verify, manner: &Manner) -> Result<u8, Failure> {
    let program = read_program(&arguments.program)?;
    let job = job_of(&program, &arguments.settings)?;
    let part = arguments.model.as_deref().map(part).transpose()?;
    let mut lag = arguments.load_angle.then(|| Lag::new(job.bed_drive));
    let full = arguments.proof == Proof::Full;
    let verdict = check(program.as_slice(), &job, part.as_ref(), full, |segment| {
        if let Some(lag) = &mut lag {
            lag.add(segment);
        }
    })?;
    let lag = lag.map(|lag| lag.worst());
    let form = arguments.machine_error.as_deref();
    let form = form.map(|path| form_error(&program, &job, path)).transpose()?;
    if manner.json {
        say_json(&serde_json::json!({
            "verify": {"findings": findings(&verdict)},
            "moves": verdict.totals.moves,
            "time_s": verdict.totals.time,
            "filament_mm": verdict.totals.filament,
            "surface_residual_mm": verdict.totals.surface_residual,
            "notes": verdict.notes,
            "form_error": form.map(|form| serde_json::json!({
                "greatest_mm": form.greatest,
                "rms_mm": form.rms,
                "greatest_fitted_mm": form.greatest_fitted,
                "rms_fitted_mm": form.rms_fitted,
                "places": form.places,
            })),
            "load_angle": lag.as_ref().map(load_angle),
            "head": verdict.totals.head.as_ref().map(head),
            "support": verdict.totals.thorough.as_ref().map(support),
        }))?;
    } else {
        let mut out = String::new();
        for finding in &verdict.findings {
            // Writing to a string cannot fail.
            let _ = writeln!(out, "{finding}");
        }
        for omitted in &verdict.omitted {
            let _ = writeln!(out, "{omitted}");
        }
        for note in &verdict.notes {
            let _ = writeln!(out, "note: {note}");
        }
        let totals = &verdict.totals;
        let _ = writeln!(
            out,
            "{} findings; {} moves, {} of motion, bed {:.0} °/s, carriage {:.0} mm/s at most, beads \
             within {:.1} µm of their layers",
            verdict.findings.len(),
            totals.moves,
            duration(totals.time),
            totals.bed_speed.to_degrees(),
            totals.rail_speed,
            totals.surface_residual * 1e3
        );
        if let Some(head) = &totals.head {
            let _ = writeln!(out, "{}", tilted(head));
        }
        if let Some(thorough) = &totals.thorough {
            let _ = writeln!(out, "{}", laid(thorough));
        }
        if let Some(lag) = lag {
            let _ = writeln!(out, "{}", lagging(&lag));
        }
        if let Some(form) = form {
            let _ = writeln!(
                out,
                "on that machine places are {:.3} mm off at most, {:.3} mm rms; laid over the part \
                 as well as can be {:.3} mm at most, {:.3} mm rms",
                form.greatest, form.rms, form.greatest_fitted, form.rms_fitted
            );
        }
        say(&out)?;
    }
    Ok(if verdict.findings.is_empty() { DONE } else { LOOK })
}

/// What a head that turns the nozzle did, for people.
fn tilted(head: &HeadTotals) -> String {
    format!(
        "nozzle tilted by {:.1}° at most, {:.1}° off the layers' normal, its tip {:.1} µm off its way; \
         drives at {:.0} % of their speeds",
        head.tilt.to_degrees(),
        head.off_normal.to_degrees(),
        head.off_path * 1e3,
        head.speed_share * 100.0
    )
}

/// The same for programs.
fn head(head: &HeadTotals) -> serde_json::Value {
    serde_json::json!({
        "tilt_deg": head.tilt.to_degrees(),
        "off_normal_deg": head.off_normal.to_degrees(),
        "off_path_mm": head.off_path,
        "speed_share": head.speed_share,
    })
}

/// The error of the part's form on a machine that misses the ideal one as the file says.
fn form_error(program: &[u8], job: &Job, path: &Path) -> Result<FormError, Failure> {
    if job.dialect.space == Space::Part {
        return Err(Failure::new(
            "Usage",
            format!(
                "--machine-error: a program in dialect {} does not say where the joints are",
                job.dialect.name
            ),
        ));
    }
    let calibration = Calibration::read(&input::read(path)?, &display_name(path))?;
    let mut off = job.printer.clone();
    calibration.apply(&mut off, job.bed_map_fade)?;
    let text = String::from_utf8_lossy(program);
    twin::form::compare(text.lines(), &job.printer, &off, job.dialect)
        .ok_or_else(|| Failure::new("NothingToPrint", "the program lays nothing"))
}

/// How far the bed lags behind its motor, as data.
fn load_angle(lag: &Worst) -> serde_json::Value {
    serde_json::json!({
        "worst_mm": lag.distance,
        "bed_deg": lag.angle.to_degrees(),
        "line": lag.line,
        "too_weak": lag.too_weak,
    })
}

/// The same in a line.
fn lagging(lag: &Worst) -> String {
    format!(
        "the bed lags by {:.4}° at most, which is {:.1} µm of a bead (line {}); its motor is too weak \
         on {} lines",
        lag.angle.to_degrees(),
        lag.distance * 1e3,
        lag.line,
        lag.too_weak
    )
}

/// What lies below and around the beads, as data.
fn support(thorough: &Thorough) -> serde_json::Value {
    let support = &thorough.support;
    serde_json::json!({
        "laid_mm": support.laid,
        "carried_mm": support.carried,
        "over_infill_mm": support.over_infill,
        "bridged_mm": support.bridged,
        "hanging_mm": support.hanging,
        "hanging_beads": support.hanging_beads,
        "mid_air_beads": support.in_mid_air,
        "laid_twice_mm": thorough.laid_twice,
        "deepest_touch_mm": thorough.deepest_touch,
        "hollow_mm3": thorough.hollow,
    })
}

/// One line on what lies below and around the beads.
fn laid(thorough: &Thorough) -> String {
    let support = &thorough.support;
    let share = |length: f64| 100.0 * length / support.laid.max(f64::MIN_POSITIVE);
    format!(
        "{:.1} m of beads, {:.2} % carried, {:.2} % over infill, {:.2} % bridges, {:.2} % hanging ({} beads, {} from \
         mid-air); {:.1} mm laid twice, hot end at most {:.2} mm in the print",
        support.laid / 1e3,
        share(support.carried),
        share(support.over_infill),
        share(support.bridged),
        share(support.hanging),
        support.hanging_beads,
        support.in_mid_air,
        thorough.laid_twice,
        thorough.deepest_touch
    )
}

/// Reads a program. A file of nothing is what a download leaves that went wrong, and proves nothing.
pub(super) fn read_program(path: &Path) -> Result<Vec<u8>, Failure> {
    let bytes = input::read(path)?;
    if bytes.is_empty() {
        return Err(Failure::new("EmptyFile", format!("{} is empty", path.display())));
    }
    Ok(bytes)
}

/// The settings to judge a program by: the dialect and the filament are those that it names itself
/// at its end, unless the user says otherwise.
pub(super) fn job_of(program: &[u8], arguments: &SettingsArguments) -> Result<Job, Failure> {
    let mut arguments = arguments.clone();
    let mut named = Vec::new();
    for (name, key) in [
        ("dialect", "dialect"),
        ("filament_diameter", "filament_diameter_mm"),
        ("filament_max_volumetric_speed", "max_volumetric_speed_mm3_per_s"),
    ] {
        if let Some(value) = setting_at_end(program, name) {
            named.push(format!("{key}={value}"));
        }
    }
    if setting_at_end(program, "fill_density").as_deref() == Some("100%") {
        named.push("fill_density=1".into());
    }
    named.append(&mut arguments.set);
    arguments.set = named;
    Ok(settings(&arguments)?.1)
}

/// Whether a program says in which words it is written, as those of rhumb do.
pub(super) fn names_itself(program: &[u8]) -> bool {
    program.starts_with(b"; generated by rhumb ") || setting_at_end(program, "dialect").is_some()
}

/// The last `; name = value` among the final lines of a program.
fn setting_at_end(program: &[u8], name: &str) -> Option<String> {
    // Settings stand in the last 400 kB.
    let tail = &program[program.len().saturating_sub(400_000)..];
    let start = format!("; {name} = ");
    tail.rsplit(|&c| c == b'\n')
        .find_map(|line| line.strip_prefix(start.as_bytes()))
        .map(|value| String::from_utf8_lossy(value).trim().to_owned())
}

/// Reads a mesh that was sliced.
pub(super) fn part(path: &Path) -> Result<mesh::mesh::Mesh, Failure> {
    let bytes = input::read(path)?;
    let (solid, _) = super::solid(path, &bytes, &Wish::default())?;
    Ok(solid.into_mesh())
}

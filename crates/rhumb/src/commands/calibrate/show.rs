//! `rhumb calibrate show`: what a calibration file says, in words and as a map.

use machine::kinematics::Alignment;
use nalgebra::Vector2;
use twin::picture::error_map::{draw, errors};

use super::calibration;
use crate::args::{CalibrateShow, Manner};
use crate::calibration::{Calibration, HeadTable};
use crate::commands::{DONE, say, say_json, write_file};
use crate::failure::Failure;
use crate::settings::{Job, Settings};

/// Above this a hole stays in the middle of a print with a 0.4 mm bead, mm.
const HOLE_MM: f64 = 0.2;

/// Largest bed, mm.
const LARGEST_BED_MM: f64 = 2000.0;

pub(super) fn run(arguments: &CalibrateShow, manner: &Manner) -> Result<u8, Failure> {
    let in_range = 1.0 <= arguments.radius && arguments.radius <= LARGEST_BED_MM;
    if !in_range {
        return Err(Failure::new("Usage", format!("--radius {} is no bed", arguments.radius)));
    }
    let found = calibration(&arguments.file)?;
    let mut printer = Job::resolve(&Settings::defaults())?.printer;
    // The map is that of an upright nozzle, which no pivot moves.
    Calibration { head: HeadTable::default(), ..found.clone() }.apply(&mut printer, 0.0)?;
    let all = errors(&printer.alignment, arguments.radius);
    // A plate that lies off the axis moves the whole print and bends nothing.
    let bent = Alignment { plate_offset: Vector2::zeros(), plate_angle: 0.0, ..printer.alignment };
    let bent = errors(&bent, arguments.radius);
    if let Some(path) = &arguments.picture {
        let text = draw(&bent, arguments.radius);
        write_file(path, &[&arguments.file], text.as_bytes())?;
    }
    if manner.json {
        say_json(&serde_json::json!({
            "calibration": found,
            "missed_mm": {"most": all.most, "rms": all.rms},
            "missed_by_the_rail_mm": {"most": bent.most, "rms": bent.rms},
        }))?;
    } else {
        let mut text = explained(&found);
        text.push_str(&format!(
            "\nwithout it, a bed of {} mm radius would miss by up to {:.3} mm ({:.3} mm rms) for \
             the rail,\nand by up to {:.3} mm with the place of the plate, which moves a print but \
             does not bend it\n",
            arguments.radius, bent.most, bent.rms, all.most
        ));
        say(&text)?;
    }
    Ok(DONE)
}

fn explained(found: &Calibration) -> String {
    let mut lines = of_rail(found);
    lines.extend(of_plate(found));
    lines.extend(of_bed(found));
    lines.extend(of_head(found));
    if !found.bed.probes.is_empty() {
        lines.push(format!("bed.probes: {} heights of the bed", found.bed.probes.len()));
    }
    for (key, value) in &found.quality {
        lines.push(format!("quality.{key} = {value}"));
    }
    lines.join("\n") + "\n"
}

/// How sure a number is, with what stands before it.
fn sd(found: &Calibration, key: &str) -> String {
    let sd = found.quality.get(key).and_then(toml::Value::as_float);
    sd.map_or_else(String::new, |sd| format!(" ± {sd:.4}"))
}

fn of_rail(found: &Calibration) -> Vec<String> {
    let sd = |key| sd(found, key);
    let mut lines = Vec::new();
    let (a, b) = (found.rail.a_mm, found.rail.b_mm);
    let way = if a < 0.0 { "nearer to" } else { "farther from" };
    lines.push(format!(
        "rail.a_mm = {a}{}: the nozzle stands {:.3} mm {way} the axis than the rail says; circles \
         would come out with radii as much too {}",
        sd("a_sd_mm"),
        a.abs(),
        if a < 0.0 { "small" } else { "large" }
    ));
    let side = if b < 0.0 { "-y" } else { "+y" };
    lines.push(format!(
        "rail.b_mm = {b}{}: the rail passes the axis {:.3} mm on its {side} side; a line through \
         the middle would break by {:.3} mm",
        sd("b_sd_mm"),
        b.abs(),
        2.0 * b.abs()
    ));
    if b.abs() > HOLE_MM {
        lines.push(format!(
            "  no nozzle gets nearer to the axis than that: a 0.4 mm bead leaves a hole; shim the \
             rail to less than {HOLE_MM} mm"
        ));
    }
    let (a1, b1) = (found.column.a1, found.column.b1);
    if a1 != 0.0 || b1 != 0.0 {
        lines.push(format!(
            "column.a1 = {a1}, column.b1 = {b1}: over 100 mm of height the nozzle wanders {:.3} mm \
             along the rail and {:.3} mm across it",
            100.0 * a1,
            100.0 * b1
        ));
    }
    lines
}

fn of_plate(found: &Calibration) -> Vec<String> {
    let sd = |key| sd(found, key);
    let (ex, ey) = (found.plate.ex_mm, found.plate.ey_mm);
    let mut lines = vec![format!(
        "plate.ex_mm = {ex}{}, plate.ey_mm = {ey}{}: the plate's centre lies {:.3} mm off the axis",
        sd("ex_sd_mm"),
        sd("ey_sd_mm"),
        ex.hypot(ey)
    )];
    if found.plate.psi_deg != 0.0 {
        lines.push(format!(
            "plate.psi_deg = {}{}: the plate is turned so far on the bed",
            found.plate.psi_deg,
            sd("psi_sd_deg")
        ));
    }
    if let Some([x, y]) = found.plate.shift_mm {
        lines.push(format!(
            "plate.shift_mm = [{x}, {y}]: an older converter's constant shift, taken off every \
             coordinate"
        ));
    }
    lines
}

fn of_bed(found: &Calibration) -> Vec<String> {
    let mut lines = Vec::new();
    if found.bed.theta_zero_deg != 0.0 {
        lines.push(format!(
            "bed.theta_zero_deg = {}: azimuth of the rail where the bed counts zero",
            found.bed.theta_zero_deg
        ));
    }
    if found.bed.backlash_deg != 0.0 {
        lines.push(format!(
            "bed.backlash_deg = {}: play of the drive, {:.3} mm at 100 mm from the axis",
            found.bed.backlash_deg,
            100.0 * found.bed.backlash_deg.to_radians()
        ));
    }
    lines
}

fn of_head(found: &Calibration) -> Vec<String> {
    let mut lines = Vec::new();
    if let Some(length) = found.head.pivot_length_mm {
        lines.push(format!(
            "head.pivot_length_mm = {length}{}: from the pivot that the nozzle is tilted about to its \
             tip",
            sd(found, "pivot_length_sd_mm")
        ));
    }
    if let Some([along, across]) = found.head.offset_mm {
        lines.push(format!(
            "head.offset_mm = [{along}, {across}]: the tip beside the line down from the pivot, along \
             the rail and across it"
        ));
    }
    lines
}

//! Whether a printer may do with a material what is asked: said before the work, and not by the proof of the
//! finished program.
//!
//! Only programs that are made here are asked about: other slicers' programs bring their own temperatures.

use super::lookup::Lookup;
use super::merge::Settings;
use crate::failure::Failure;

/// Checks temperatures against the limits of the printer, and what is fed after a retraction against what
/// was drawn back.
///
/// # Errors
///
/// `ConfigConflict`.
pub fn check(settings: &Settings) -> Result<(), Failure> {
    let get = Lookup(settings);
    let nozzle = ["temperature_c", "first_layer_temperature_c"];
    let bed = ["bed_temperature_c", "first_layer_bed_temperature_c"];
    for name in nozzle {
        not_above(&get, name, "max_nozzle_temperature_c")?;
        not_above(&get, "min_extrude_temperature_c", name)?;
    }
    for name in bed {
        not_above(&get, name, "max_bed_temperature_c")?;
    }
    let (extra, length) = (get.number("retract_restart_extra_mm"), get.number("retract_length_mm"));
    if length > 0.0 && extra < -length {
        let what = format!(
            "retract_restart_extra_mm = {extra} leaves out more than retract_length_mm = {length} draws back"
        );
        return Err(Failure::new("ConfigConflict", what));
    }
    Ok(())
}

fn not_above(get: &Lookup<'_>, low: &str, high: &str) -> Result<(), Failure> {
    let (least, most) = (get.number(low), get.number(high));
    if least <= most {
        return Ok(());
    }
    let what = format!("{low} = {least} is above {high} = {most}");
    Err(Failure::new("ConfigConflict", what)
        .hint("max_ and min_extrude_ temperatures belong to the printer settings"))
}

//! The machine, from settings.

use machine::drive::{Drive, Drives, Transmission};
use machine::gcode::dialect::Space;
use machine::gcode::{Dialect, LEAST_FEED};
use machine::height_map::HeightMap;
use machine::kinematics::{Alignment, BedScale};
use machine::profile::{Axis, NozzleShape, Printer, Turntable};
use machine::program::{BedTurn, Joints};

use super::head;
use super::lookup::Lookup;
use super::resolve::conflict;
use crate::failure::{Failure, shown};

pub(super) fn printer(get: &Lookup<'_>) -> Result<Printer, Failure> {
    Ok(Printer {
        name: get.text("printer_model").to_owned(),
        rail: Axis {
            min: get.number("rail_min_mm"),
            max: get.number("rail_max_mm"),
            speed: get.number("rail_speed_mm_per_s"),
            acceleration: get.number("rail_acceleration_mm_per_s2"),
        },
        lift: Axis {
            min: get.number("z_min_mm"),
            max: get.number("z_max_mm"),
            speed: get.number("z_speed_mm_per_s"),
            acceleration: get.number("z_acceleration_mm_per_s2"),
        },
        bed: Turntable {
            speed: get.number("bed_speed_deg_per_s").to_radians(),
            acceleration: get.number("bed_acceleration_deg_per_s2").to_radians(),
        },
        path_acceleration: get.number("path_acceleration_mm_per_s2"),
        rail_jerk: get.number("rail_jerk_mm_per_s"),
        bed_jerk: get.number("bed_jerk_deg_per_s").to_radians(),
        extruder_speed: get.number("extruder_speed_mm_per_s"),
        nozzle_diameter: get.number("nozzle_diameter_mm"),
        nozzle: NozzleShape {
            flat_radius: get.number("nozzle_flat_radius_mm"),
            half_angle: get.number("nozzle_half_angle_deg").to_radians(),
            block_height: get.number("nozzle_block_height_mm"),
            block_radius: get.number("nozzle_block_radius_mm"),
            carriage_height: get.number("carriage_height_mm"),
            carriage_width: get.number("carriage_width_mm"),
        },
        axis_clearance: get.number("axis_clearance_mm"),
        moves_per_second: get.number("moves_per_second"),
        home: Joints {
            s: get.number("home_rail_mm"),
            turn: BedTurn::default(),
            z: get.number("home_z_mm"),
        },
        nozzle_temperature_max: get.number("max_nozzle_temperature_c"),
        nozzle_temperature_min_extrude: get.number("min_extrude_temperature_c"),
        bed_temperature_max: get.number("max_bed_temperature_c"),
        alignment: Alignment {
            bed: BedScale { is_reversed: get.switch("bed_reversed"), ..BedScale::IDEAL },
            ..Alignment::IDEAL
        },
        bed_map: HeightMap::default(),
        most_turn: most_turn(get.number("turns_max")),
        head: head::head(get)?,
    })
}

pub(super) fn drives(get: &Lookup<'_>) -> Result<Drives, Failure> {
    let drive = |axis: &str| -> Result<Drive, Failure> {
        let transmission = if axis == "bed" {
            Transmission::Shaft
        } else {
            let name = format!("{axis}_transmission");
            let text = get.text(&name);
            Transmission::parse(text).ok_or_else(|| {
                let wanted = Transmission::WANTED;
                Failure::new("ConfigRange", format!("{name} = {text:?} is not {wanted}"))
            })?
        };
        Ok(Drive {
            motor_steps: get.count(&format!("{axis}_motor_steps")) as u32,
            microsteps: get.count(&format!("{axis}_microsteps")) as u32,
            gear_ratio: get.number(&format!("{axis}_gear_ratio")),
            transmission,
        })
    };
    Ok(Drives {
        rail: drive("rail")?,
        bed: drive("bed")?,
        lift: drive("z")?,
        filament: drive("extruder")?,
    })
}

/// Takes from a printer what its firmware cannot use.
pub(super) fn suit(printer: &mut Printer, dialect: &Dialect) -> Result<(), Failure> {
    if printer.head.is_some() && !dialect.speaks_of_heads() && dialect.space != Space::Part {
        return Err(conflict(
            "a firmware that turns part coordinates into joints itself knows of no tilt",
            dialect.name,
        )
        .hint("use dialect = \"polar\" or \"rrf-direct\""));
    }
    told_in_time(printer, dialect)?;
    if dialect.space != Space::IdealPlane {
        return Ok(());
    }
    // A radius is never negative, wherever the rail may reach.
    printer.rail.min = printer.rail.min.max(0.0);
    if printer.most_turn.is_finite() {
        return Err(conflict(
            "turns_max cannot be kept where the firmware turns the bed",
            dialect.name,
        ));
    }
    Ok(())
}

/// Sees that the slowest move that the bed asks for, round the axis, has a speed that can be written.
fn told_in_time(printer: &Printer, dialect: &Dialect) -> Result<(), Failure> {
    let least = LEAST_FEED / SECONDS_PER_MINUTE / printer.axis_clearance;
    let is_path_speed = dialect.space != Space::Part && !dialect.speed.is_of_one_move();
    if !is_path_speed || printer.bed.speed >= least {
        return Ok(());
    }
    let what = format!(
        "bed_speed_deg_per_s = {} is too slow for axis_clearance_mm = {}: the program could not say how slow \
         a move round the axis is, {LEAST_FEED} mm/min at least",
        shown(printer.bed.speed.to_degrees()),
        shown(printer.axis_clearance),
    );
    let wide = LEAST_FEED / SECONDS_PER_MINUTE / printer.bed.speed;
    Err(Failure::new("ConfigConflict", what)
        .hint(format!("set axis_clearance_mm to {:.3} or more", wide + 5e-4)))
}

const SECONDS_PER_MINUTE: f64 = 60.0;

/// Bound of the bed's turn, radians; 0 turns stand for none.
fn most_turn(turns: f64) -> f64 {
    if turns > 0.0 { turns * std::f64::consts::TAU } else { f64::INFINITY }
}

pub(super) fn check_printer(printer: &Printer) -> Result<(), Failure> {
    let (rail, lift) = (&printer.rail, &printer.lift);
    if rail.min >= rail.max {
        return Err(Failure::new(
            "ConfigConflict",
            format!("rail_min_mm = {} is not below rail_max_mm = {}", rail.min, rail.max),
        ));
    }
    if !rail.reaches(printer.home.s) || !lift.reaches(printer.home.z) {
        return Err(Failure::new(
            "ConfigConflict",
            format!(
                "home_rail_mm = {} or home_z_mm = {} lies outside of the travel of its axis",
                printer.home.s, printer.home.z
            ),
        ));
    }
    Ok(())
}

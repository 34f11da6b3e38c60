//! A printer for tests.

use machine::kinematics::Alignment;
use machine::profile::{Axis, Printer, Turntable};
use machine::program::{BedTurn, Joints};

/// A small polar printer whose carriage passes the centre by 25 mm.
pub(crate) fn printer() -> Printer {
    Printer {
        name: "test".into(),
        rail: Axis { min: -25.0, max: 120.0, speed: 150.0, acceleration: 1500.0 },
        lift: Axis { min: 0.0, max: 200.0, speed: 15.0, acceleration: 300.0 },
        bed: Turntable { speed: 360_f64.to_radians(), acceleration: 3000_f64.to_radians() },
        path_acceleration: 1500.0,
        rail_jerk: 8.0,
        bed_jerk: 0.5,
        extruder_speed: 120.0,
        nozzle_diameter: 0.4,
        nozzle: machine::profile::NozzleShape::COMMON,
        axis_clearance: 0.02,
        moves_per_second: 500.0,
        home: Joints { s: 120.0, turn: BedTurn::default(), z: 5.0 },
        nozzle_temperature_max: 280.0,
        nozzle_temperature_min_extrude: 170.0,
        bed_temperature_max: 110.0,
        alignment: Alignment::default(),
        bed_map: Default::default(),
        most_turn: f64::INFINITY,
        head: None,
    }
}

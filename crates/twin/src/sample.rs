//! A printer, segments and small programs for the tests of this crate.

use nalgebra::Point3;

use crate::curve::Curve;
use crate::segment::Segment;
use machine::kinematics::Alignment;
use machine::profile::{Axis, Printer, Turntable};
use machine::program::{BedTurn, Feed, Joints, Role};

/// A printer whose carriage stops short of the centre.
pub(crate) fn printer() -> Printer {
    Printer {
        name: "sample".into(),
        rail: Axis { min: 0.0, max: 120.0, speed: 150.0, acceleration: 1500.0 },
        lift: Axis { min: 0.0, max: 150.0, speed: 10.0, acceleration: 100.0 },
        bed: Turntable { speed: 6.0, acceleration: 50.0 },
        path_acceleration: 1500.0,
        rail_jerk: 0.0,
        bed_jerk: 0.0,
        extruder_speed: 120.0,
        nozzle_diameter: 0.4,
        nozzle: machine::profile::NozzleShape::COMMON,
        axis_clearance: 0.5,
        moves_per_second: 1000.0,
        home: joints(100.0, 0.0, 20.0),
        nozzle_temperature_max: 260.0,
        nozzle_temperature_min_extrude: 170.0,
        bed_temperature_max: 110.0,
        alignment: Alignment::default(),
        bed_map: Default::default(),
        most_turn: f64::INFINITY,
        head: None,
    }
}

pub(crate) fn joints(s: f64, turn: f64, z: f64) -> Joints {
    Joints { s, turn: BedTurn::accumulated(turn), z }
}

/// A segment between two positions of an ideal machine at `feed` mm/s, line 1, no filament.
pub(crate) fn segment(from: Joints, to: Joints, feed: f64) -> Segment {
    let ideal = Alignment::default();
    let curve = Curve::between_joints(&from, &to, &ideal);
    let path = curve.length();
    Segment {
        line: 1,
        layer: Some(0),
        role: Role::Perimeter,
        width: 0.45,
        joints: Some([from, to]),
        part: [ideal.part_from_joints(&from), ideal.part_from_joints(&to)],
        nearest: curve.nearest_to_axis(),
        curve,
        path,
        filament: 0.0,
        feed: Feed::mm_per_s(feed),
        duration: path / feed,
        height: None,
        slopes: false,
        is_paced: false,
    }
}

/// The same at z = 0.2, ends given as carriage (mm) and bed turn (radians).
pub(crate) fn polar_segment(from: [f64; 2], to: [f64; 2], feed: f64) -> Segment {
    segment(joints(from[0], from[1], 0.2), joints(to[0], to[1], 0.2), feed)
}

/// A segment of filament alone.
pub(crate) fn filament_segment(filament: f64, feed: f64) -> Segment {
    let here = joints(20.0, 0.0, 0.2);
    let mut still = segment(here, here, feed);
    still.filament = filament;
    still.duration = filament.abs() / feed;
    still
}

/// A segment in part coordinates.
pub(crate) fn part_segment(from: Point3<f64>, to: Point3<f64>) -> Segment {
    let curve = Curve::between_points(&from, &to, &Alignment::default());
    let mut moved = segment(joints(20.0, 0.0, 0.0), joints(21.0, 0.0, 0.0), 20.0);
    moved.joints = None;
    moved.part = [from, to];
    moved.curve = curve;
    moved.path = curve.length();
    moved.nearest = curve.nearest_to_axis();
    moved.duration = moved.path / 20.0;
    moved
}

/// Carriage and bed turn as the text would give them.
pub(crate) fn rounded(end: [f64; 2]) -> [f64; 2] {
    let place = crate::rounding::last_place(end[0]);
    let degrees = (end[1].to_degrees() * 1e4).round() / 1e4;
    [(end[0] / place).round() * place, degrees.to_radians()]
}

//! What turns the nozzle, from settings.

use machine::head::Head;
use machine::head::hexapod::{Hexapod, JointLimits, LEGS, Layout, Rods};
use machine::head::tilting::Tilting;
use machine::profile::Axis;
use nalgebra::Vector3;
use plan::tilt::Tilt;

use super::lookup::Lookup;
use crate::failure::Failure;

/// The head of a printer; `None` where its nozzle always stands upright.
pub(super) fn head(get: &Lookup<'_>) -> Result<Option<Head>, Failure> {
    let pivot_length = get.number("pivot_length_mm");
    let along = Axis {
        min: get.number("tilt_min_deg").to_radians(),
        max: get.number("tilt_max_deg").to_radians(),
        speed: get.number("tilt_speed_deg_per_s").to_radians(),
        acceleration: get.number("tilt_acceleration_deg_per_s2").to_radians(),
    };
    Ok(match get.text("head") {
        "tilt" => Some(Head::Tilting(Tilting::one_axis(pivot_length, along))),
        "two-axis" => {
            let most = along.max.max(-along.min);
            let across = Axis { min: -most, max: most, ..along };
            Some(Head::Tilting(Tilting::two_axes(pivot_length, across, along)))
        }
        "hexapod" => Some(Head::Hexapod(Box::new(hexapod(get, pivot_length)?))),
        _ => None,
    })
}

fn hexapod(get: &Lookup<'_>, pivot_length: f64) -> Result<Hexapod, Failure> {
    let half = |name| f64::to_radians(get.number(name));
    let (base_half, platform_half) =
        (half("hexapod_base_half_angle_deg"), half("hexapod_platform_half_angle_deg"));
    let kind = get.text("hexapod_layout");
    let layout = Layout {
        base_radius: get.number("hexapod_base_radius_mm"),
        platform_radius: get.number("hexapod_platform_radius_mm"),
        base_half_angle: if kind == "3-3" { 0.0 } else { base_half },
        platform_half_angle: if kind == "6-6" { platform_half } else { 0.0 },
    };
    let joints = if kind == "joints" {
        [
            six_points(get.text("hexapod_base_joints_mm"), "hexapod_base_joints_mm")?,
            six_points(get.text("hexapod_platform_joints_mm"), "hexapod_platform_joints_mm")?,
        ]
    } else {
        layout.joints()
    };
    let height = match get.number("hexapod_home_mm") {
        0.0 => layout.height_at_45(),
        height => height,
    };
    let place = Vector3::new(get.number("hexapod_x_mm"), 0.0, get.number("hexapod_z_mm"));
    // A base that is higher than a nozzle on the bed has its platform below it.
    let down = place.z > pivot_length;
    let home = Vector3::new(0.0, 0.0, if down { -height } else { height });
    let limits = JointLimits {
        cone: get.number("leg_cone_deg").to_radians(),
        home,
        apart: get.number("leg_distance_mm"),
        condition: get.number("leg_condition_max"),
        tilt: get.number("tilt_max_deg").to_radians(),
    };
    let leg = Axis {
        min: get.number("leg_min_mm"),
        max: get.number("leg_max_mm"),
        speed: get.number("leg_speed_mm_per_s"),
        acceleration: get.number("leg_acceleration_mm_per_s2"),
    };
    if leg.min >= leg.max {
        return Err(conflict(format!(
            "leg_min_mm = {} is not below leg_max_mm = {}",
            leg.min, leg.max
        )));
    }
    let length = get.number("rod_length_mm");
    // Carriages lie behind their rods, away from the platform.
    let direction = if down { -Vector3::z_axis() } else { Vector3::z_axis() };
    Ok(Hexapod {
        place,
        turns_bed: get.text("hexapod_bed") == "turning",
        rods: (length > 0.0).then_some(Rods { length, direction }),
        ..Hexapod::new(joints, pivot_length, leg, limits)
    })
}

/// Six points, "x,y,z; x,y,z; …".
fn six_points(text: &str, name: &str) -> Result<[Vector3<f64>; LEGS], Failure> {
    let wanted = || {
        conflict(format!("{name} = {text:?} is not six points \"x,y,z; x,y,z; …\""))
            .hint("joint coordinates come from the drawing of the machine, in mm")
    };
    let points = text.split(';').map(|point| {
        let numbers: Option<Vec<f64>> = point
            .split(',')
            .map(|number| number.trim().parse::<f64>().ok().filter(|number| number.is_finite()))
            .collect();
        match numbers.as_deref() {
            Some([x, y, z]) => Some(Vector3::new(*x, *y, *z)),
            _ => None,
        }
    });
    let points: Option<Vec<Vector3<f64>>> = points.collect();
    points.and_then(|points| points.try_into().ok()).ok_or_else(wanted)
}

/// How far the nozzle is tilted.
pub(super) fn tilt(get: &Lookup<'_>) -> Tilt {
    match get.text("tilt") {
        "none" => Tilt::None,
        "normal" => Tilt::Normal,
        _ => Tilt::Needed,
    }
}

fn conflict(message: String) -> Failure {
    Failure::new("ConfigConflict", message)
}

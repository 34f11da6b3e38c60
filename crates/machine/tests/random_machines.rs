//! The kinematics of any machine: forward undoes inverse, on both sides of the axis.

use machine::kinematics::{Alignment, BedScale, Branch, Unreachable};
use machine::program::BedTurn;
use nalgebra::{Point3, Vector2};
use proptest::prelude::*;
use std::f64::consts::PI;

fn machines() -> impl Strategy<Value = Alignment> {
    let rail = (-2.0..2.0_f64, -2.0..2.0_f64);
    let column = (-0.02..0.02_f64, -0.02..0.02_f64);
    let plate = (-5.0..5.0_f64, -5.0..5.0_f64, -PI..PI);
    let bed = (-PI..PI, any::<bool>(), 0.0..0.02_f64);
    (rail, column, plate, bed).prop_map(|((a, b), (a1, b1), (ex, ey, psi), bed)| Alignment {
        a,
        b,
        a1,
        b1,
        plate_offset: Vector2::new(ex, ey),
        plate_angle: psi,
        bed: BedScale { zero: bed.0, is_reversed: bed.1, backlash: bed.2 },
    })
}

proptest! {
    #[test]
    fn forward_undoes_inverse(
        machine in machines(),
        (x, y, z) in (-150.0..150.0_f64, -150.0..150.0_f64, 0.0..200.0_f64),
        near in -500.0..500.0_f64,
    ) {
        let part = Point3::new(x, y, z);
        let near = BedTurn::accumulated(near);
        for branch in [Branch::Near, Branch::Far] {
            match machine.joints_from_part(&part, branch, near) {
                Ok(joints) => {
                    let off = (machine.part_from_joints(&joints) - part).norm();
                    prop_assert!(off < 1e-10, "{off}");
                    let turned = joints.turn.radians() - near.radians();
                    prop_assert!(turned.abs() <= PI + 1e-9, "{turned}");
                    let side = machine.nozzle(&joints).x * branch.sign();
                    prop_assert!(side >= 0.0);
                }
                Err(out) => {
                    let radius = machine.over_bed(&part.xy()).norm();
                    prop_assert!(radius <= machine.miss(z).abs());
                    let expected = Unreachable::Disc { radius, miss: machine.miss(z).abs() };
                    prop_assert_eq!(out, expected);
                }
            }
        }
    }

    #[test]
    fn outside_of_the_clear_radius_the_carriage_keeps_its_distance(
        machine in machines(),
        (angle, beyond, height) in (-PI..PI, 1e-6..50.0_f64, 0.0..200.0_f64),
        clearance in 0.01..5.0_f64,
    ) {
        let radius = machine.clear_radius(clearance, height) + beyond;
        let over_bed = Vector2::new(radius * angle.cos(), radius * angle.sin());
        let part = machine.part_from_bed(&over_bed);
        for z in [0.0, 0.5 * height, height] {
            let at = Point3::new(part.x, part.y, z);
            let joints = machine.joints_from_part(&at, Branch::Near, BedTurn::default());
            let s = joints.expect("outside of the disc that the rail misses").s;
            prop_assert!(s >= clearance, "{s}");
        }
    }
}

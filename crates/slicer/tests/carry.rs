//! Regions taken from layer to layer.

use std::f64::consts::TAU;

use geom::region::{Fill, Region};
use nalgebra::Point2;
use slicer::chart::{carried, carried_point};
use slicer::surface::{Caps, Cone, LayerSurface, Plane, Spheres};

fn square(half: f64) -> Region {
    let ring = [[-half, -half], [half, -half], [half, half], [-half, half]].map(Point2::from);
    Region::from_rings([ring.as_slice()], Fill::NonZero)
}

fn surfaces() -> Vec<Box<dyn LayerSurface>> {
    vec![
        Box::new(Plane),
        Box::new(Cone::new(0.5).expect("an angle")),
        Box::new(Cone::new(-0.6).expect("an angle")),
        Box::new(Spheres::new(-10.0).expect("a height")),
        Box::new(Caps::new(40.0).expect("a radius")),
    ]
}

#[test]
fn there_and_back_is_the_same_place() {
    for surface in surfaces() {
        let region = square(12.0);
        let there = carried(surface.as_ref(), &region, 20.0, 20.2);
        there.check();
        let back = carried(surface.as_ref(), &there, 20.2, 20.0);
        let apart = region.difference(&back).area() + back.difference(&region).area();
        assert!(apart < 0.003 * region.perimeter(), "{apart} mm²");
        for k in 0..20 {
            let (sin, cos) = (f64::from(k) * TAU / 20.0).sin_cos();
            let p = Point2::new(9.0 * cos, 9.0 * sin);
            let there = carried_point(surface.as_ref(), &p, 20.0, 20.2);
            let back = carried_point(surface.as_ref(), &there, 20.2, 20.0);
            // Caps are carried to first order: 0.2²/40 mm is what the next order amounts to.
            assert!((back - p).norm() < 1e-3);
        }
    }
}

#[test]
fn straight_sides_are_carried_as_closely_as_corners() {
    let surface = Cone::new(0.7).expect("an angle");
    let carried = carried(&surface, &square(10.0), 20.0, 20.5);
    let shift = 0.5 * 0.7_f64.sin();
    // The middle of a side is nearest to the axis and moves straight out.
    let reach = carried.bounds().expect("not empty").max;
    assert!((geom::grid::mm(reach).x - 10.0 - shift).abs() < 0.003);
}

#[test]
fn volume_of_a_block_between_two_spheres() {
    // Normals of spheres meet in their centre: what they cover grows as the square of the radius.
    let surface = Spheres::new(-10.0).expect("a height");
    let region = square(9.0);
    let carried = carried(&surface, &region, 20.0, 21.0);
    let [a, b] = [(20.0, &region), (21.0, &carried)]
        .map(|(level, region)| surface.chart(level).area(region));
    assert!((b / a - (31.0_f64 / 30.0).powi(2)).abs() < 1e-6, "{}", b / a);
}

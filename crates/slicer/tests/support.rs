//! Supports as regions: what hangs over, where columns pass, how far they keep away.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use geom::region::{Fill, Region};
use nalgebra::Point2;
use slicer::chart::Chart;
use slicer::support::{Column, MARGIN_MM, Shade, SupportParams, SupportPattern, columns, hanging};

const PARAMS: SupportParams = SupportParams {
    threshold: 0.0,
    wall_width: 0.45,
    on_bed_only: false,
    longest_bridge: 0.0,
    xy_gap: 0.3,
    top_gap: 0.2,
    bottom_gap: 0.4,
    top_interface: 2,
    bottom_interface: 1,
    width: 0.4,
    spacing: 2.5,
    interface_spacing: 0.0,
    angle: 0.0,
    pattern: SupportPattern::Rectilinear,
    sheath: true,
    reach: 100.0,
};

fn square(half: f64) -> Region {
    let ring = [[-half, -half], [half, -half], [half, half], [-half, half]].map(Point2::from);
    Region::from_rings([ring.as_slice()], Fill::NonZero)
}

/// What of a square hangs over a smaller one, mm².
fn hangs(half: f64, below: f64, threshold_deg: f64) -> f64 {
    let params = SupportParams { threshold: threshold_deg.to_radians(), ..PARAMS };
    hanging(&square(half), &square(below), &Chart::Plane, 0.2, &params).area()
}

#[test]
fn slopes_are_supported_from_the_threshold_on() {
    // A side that rises by 45° moves by a layer, 0.2 mm; half a bead is 0.225 mm.
    assert_eq!(hangs(10.0, 9.8, 40.0), 0.0);
    assert!(hangs(10.0, 9.8, 50.0) > 0.9 * (400.0 - 19.6 * 19.6));
    assert_eq!(hangs(10.0, 9.8, 0.0), 0.0);
    assert!(hangs(10.0, 9.7, 0.0) > 0.9 * (400.0 - 19.4 * 19.4));
    assert_eq!(hangs(10.0, 10.0, 89.0), 0.0);
    // What begins in mid-air is supported as a whole, however small.
    let speck = square(0.1);
    let found = hanging(&speck, &Region::default(), &Chart::Plane, 0.2, &PARAMS);
    assert!((found.area() - speck.area()).abs() < 1e-6);
}

#[test]
fn cones_carry_further_than_planes() {
    // On a cone of 45° true lengths around the axis are shorter, and along it as on the plane.
    let cone = Chart::cone(45.0_f64.to_radians());
    let params = SupportParams { threshold: 50.0_f64.to_radians(), ..PARAMS };
    let found = hanging(&square(10.0), &square(9.95), &cone, 0.2, &params);
    assert!(found.is_empty());
    assert!(!hanging(&square(10.0), &square(9.5), &cone, 0.2, &params).is_empty());
}

/// A foot of 3 layers, a stem of 10 and a plate of 2, 0.2 mm each.
fn layers() -> Vec<Shade> {
    let mut layers = Vec::new();
    let mut below = Region::default();
    for k in 0..15 {
        let half = match k {
            0..3 => 8.0,
            3..13 => 2.0,
            _ => 6.0,
        };
        let material = square(half);
        let hanging = if k == 0 {
            Region::default()
        } else {
            hanging(&material, &below, &Chart::Plane, 0.2, &PARAMS)
        };
        below.clone_from(&material);
        layers.push(Shade { material, hanging, thickness: 0.2 });
    }
    layers
}

fn has_support(column: &Column, at: [f64; 2]) -> bool {
    column.whole.contains(&Point2::from(at))
}

#[test]
fn columns_keep_their_gaps() {
    let layers = layers();
    let columns = columns(&layers, &PARAMS);
    assert!((columns[13].carried.difference(&square(6.0 + MARGIN_MM + 0.01))).is_empty());
    for (k, column) in columns.iter().enumerate() {
        // A layer below the plate and two above the foot stay free.
        assert_eq!(has_support(column, [4.0, 0.0]), (5..12).contains(&k), "layer {k}");
        let interface = column.interface.contains(&Point2::new(4.0, 0.0));
        assert_eq!(interface, [5, 10, 11].contains(&k), "interface of layer {k}");
        assert!(!has_support(column, [2.25, 0.0]), "layer {k} touches the stem");
        assert!(column.whole.intersection(&layers[k].material).is_empty());
    }
    let on_bed = SupportParams { on_bed_only: true, ..PARAMS };
    assert!(columns_of(&layers, &on_bed).iter().all(|column| column.whole.is_empty()));
    let wide = SupportParams { top_gap: 0.5, ..PARAMS };
    let last = columns_of(&layers, &wide).iter().rposition(|c| has_support(c, [4.0, 0.0]));
    assert_eq!(last, Some(9), "three layers stay free for 0.5 mm");
}

#[test]
fn a_gap_that_misses_by_a_hair_takes_no_further_layer() {
    // Layers on a cone are a little thinner than asked for, where a whole number of them has to fit.
    let mut layers = layers();
    for layer in &mut layers {
        layer.thickness = 0.199;
    }
    let last = columns_of(&layers, &PARAMS).iter().rposition(|c| has_support(c, [4.0, 0.0]));
    assert_eq!(last, Some(11), "a layer stays free for 0.2 mm");
}

fn columns_of(layers: &[Shade], params: &SupportParams) -> Vec<Column> {
    columns(layers, params)
}

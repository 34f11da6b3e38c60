//! Regions and points taken from one layer to another, along the normals.

use geom::grid::{mm, snap};
use geom::polyline::{distance_to_segment, share_nearest};
use geom::region::{Fill, Region, Ring, ring_sides};
use nalgebra::Point2;

use super::Chart;
use crate::surface::LayerSurface;

/// How far the image of a straight side may lie from its chords, mm: layers that are compared are
/// known to about as much.
const CARRY_TOLERANCE_MM: f64 = 0.002;

/// Returns the place on layer `to` that the normal through `uv` of layer `from` leads to, both in
/// the charts of their layers.
#[must_use]
pub fn carried_point(
    surface: &dyn LayerSurface,
    uv: &Point2<f64>,
    from: f64,
    to: f64,
) -> Point2<f64> {
    let s = uv.coords.norm();
    if s == 0.0 { *uv } else { uv * (surface.carry(s, from, to) / s) }
}

/// Returns what the normals through a region of layer `from` cover on layer `to`, both in the
/// charts of their layers. On planes it is the region itself.
#[must_use]
pub fn carried(surface: &dyn LayerSurface, region: &Region, from: f64, to: f64) -> Region {
    if from == to || surface.chart(from).is_flat() {
        return region.clone();
    }
    image_of(region, |p| carried_point(surface, p, from, to))
}

/// Returns what the normals of a layer cover of it that lead to a region of another, flatter or steeper
/// one, both in the charts of their layers. `outwards` is how far the normals lead from the axis, by the
/// distance that they begin at, mm.
#[must_use]
pub fn carried_to_side(
    region: &Region,
    [from, to]: [&Chart; 2],
    outwards: impl Fn(f64) -> f64,
) -> Region {
    image_of(region, |p| {
        let s = p.coords.norm();
        if s == 0.0 {
            return *p;
        }
        let r = from.radius(s);
        p * (to.meridian((r + outwards(r)).max(0.0)) / s)
    })
}

/// Returns the image of a region under a map that keeps the order of places and bends sides gently;
/// sides get points until they are followed to within a few µm.
pub(super) fn image_of(region: &Region, image: impl Fn(&Point2<f64>) -> Point2<f64>) -> Region {
    let rings: Vec<Ring> = region
        .rings()
        .map(|ring| {
            let mut carried = Ring::with_capacity(ring.len());
            for (a, b) in ring_sides(ring) {
                let (a, b) = (mm(a), mm(b));
                let ends = (image(&a), image(&b));
                carried.push(snap(&ends.0));
                let Some(foot) = foot(&a, &b) else {
                    side((&a, &b), (&ends.0, &ends.1), &image, &mut carried);
                    continue;
                };
                let at = image(&foot);
                side((&a, &foot), (&ends.0, &at), &image, &mut carried);
                carried.push(snap(&at));
                side((&foot, &b), (&at, &ends.1), &image, &mut carried);
            }
            carried
        })
        .collect();
    Region::from_grid_rings(&rings, Fill::Positive)
}

/// The place where a side passes the axis, if it passes so near that its image may be bent sharply
/// there. On the axis it has no azimuth and is taken to lie to the left of the side, where material
/// is: what is in doubt is left out.
fn foot(a: &Point2<f64>, b: &Point2<f64>) -> Option<Point2<f64>> {
    let share = share_nearest(a, b, &Point2::origin());
    let along = b - a;
    let foot = a + along * share;
    let is_near = foot.coords.norm_squared() < NEAR_AXIS_MM * NEAR_AXIS_MM;
    if !(is_near && 0.0 < share && share < 1.0) {
        return None;
    }
    let left = nalgebra::Vector2::new(-along.y, along.x).normalize() * OFF_AXIS_MM;
    Some(if foot.coords.norm_squared() < OFF_AXIS_MM * OFF_AXIS_MM {
        Point2::from(left)
    } else {
        foot
    })
}

/// Layers are carried by half their thickness or a few of them; only nearer to the axis than that
/// are images bent, mm.
const NEAR_AXIS_MM: f64 = 2.0;

/// Nearer to the axis than this a place has no azimuth to speak of, mm: a grid step.
const OFF_AXIS_MM: f64 = 1e-5;

/// Appends points of the image of a side until chords are near enough.
fn side(
    (a, b): (&Point2<f64>, &Point2<f64>),
    ends: (&Point2<f64>, &Point2<f64>),
    image: &impl Fn(&Point2<f64>) -> Point2<f64>,
    carried: &mut Ring,
) {
    let middle = nalgebra::center(a, b);
    let at = image(&middle);
    // The image never strays farther than the ends move, so short sides end the recursion.
    let is_short = (b - a).norm_squared() <= CARRY_TOLERANCE_MM * CARRY_TOLERANCE_MM;
    if is_short || distance_to_segment(ends.0, ends.1, &at) <= CARRY_TOLERANCE_MM {
        return;
    }
    side((a, &middle), (ends.0, &at), image, carried);
    carried.push(snap(&at));
    side((&middle, b), (&at, ends.1), image, carried);
}

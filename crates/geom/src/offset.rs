//! Regions whose border is moved inwards or outwards by a true distance.
//!
//! Method: every ring is replaced by a *raw* ring of its sides moved along their normals, and the
//! places that the raw rings wind round a positive number of times are the result (X. Chen,
//! S. McMains (2005), "Polygon offsetting by computing winding numbers", DETC2005-85513).
//!
//! At a corner whose moved sides drift apart the raw ring follows an arc; where they run into each
//! other it takes their crossing, which is exact, or, where a side is too short for that, returns
//! to the corner itself, so that the winding of the loop it leaves is negative. Differences from
//! the source: the exact crossings (they keep the point count of smooth outlines), arcs only where
//! a single point would be off by more than the tolerance, and sides that bound nothing are left
//! out beforehand ([`MovedSides`]), so that most raw rings have no loops at all.
//!
//! Guarantee: no point of the new border is nearer to the old one than the distance less
//! [`ARC_TOLERANCE_MM`] and a grid step; convex corners of an inset stay sharp.

mod moved_sides;

use nalgebra::{Point2, Vector2};

use crate::grid::{GridPoint, STEPS_PER_MM, mm};
use crate::region::{Fill, Region, Ring, signed_area};

pub use moved_sides::{MovedSides, ShortSides};

/// How far an arc's chords may cut into it, mm. Larger shows in outer walls at concave corners
/// (their budget is 4 µm rms); smaller multiplies the points of every later step.
pub const ARC_TOLERANCE_MM: f64 = 0.001;

/// The same where nobody looks closely: for [`Region::opened`], which looks for places and does not draw
/// them, and for supports. A tenth of the points of exact arcs, which every later step would pay for.
pub const COARSE_TOLERANCE_MM: f64 = 0.01;

impl Region {
    /// Returns the points of the region at least `distance` (mm, not negative) from its border.
    #[must_use]
    pub fn inset(&self, distance: f64) -> Self {
        self.shifted(distance, &EXACT)
    }

    /// Returns the points at most `distance` (mm, not negative) from the region; its convex
    /// corners become round.
    #[must_use]
    pub fn outset(&self, distance: f64) -> Self {
        self.shifted(-distance, &EXACT)
    }

    /// Like [`inset`](Self::inset), with arcs to within [`COARSE_TOLERANCE_MM`].
    #[must_use]
    pub fn inset_coarsely(&self, distance: f64) -> Self {
        self.shifted(distance, &COARSE)
    }

    /// Like [`outset`](Self::outset), with arcs to within [`COARSE_TOLERANCE_MM`].
    #[must_use]
    pub fn outset_coarsely(&self, distance: f64) -> Self {
        self.shifted(-distance, &COARSE)
    }

    /// Like [`outset`](Self::outset), with convex corners kept sharp as long as they reach no
    /// farther than [`LONGEST_MITER`] times the distance, and arcs to within
    /// [`COARSE_TOLERANCE_MM`].
    #[must_use]
    pub fn outset_sharp(&self, distance: f64) -> Self {
        self.shifted(
            -distance,
            &Arcs { tolerance: COARSE_TOLERANCE_MM, longest_miter: LONGEST_MITER },
        )
    }

    /// Returns the part of the region that a disc of `radius` (mm) inside it can sweep, to within
    /// [`COARSE_TOLERANCE_MM`].
    #[must_use]
    pub fn opened(&self, radius: f64) -> Self {
        self.shifted(radius, &COARSE).shifted(-radius, &COARSE)
    }

    /// Returns the inset and the area (mm²) over which its border ran into itself: zero, up to
    /// rounding, when every part of the region is at least twice `distance` thick.
    ///
    /// That area is what the raw rings enclose with the wrong winding, small loops included: a
    /// thin place with a rounded end has no more.
    #[must_use]
    pub fn inset_with_loss(&self, distance: f64) -> (Self, f64) {
        let looped = self.raw_rings(distance, &EXACT, ShortSides::Loop);
        let enclosed: f64 = looped.iter().map(|ring| signed_area(ring)).sum();
        let inset = self.shifted(distance, &EXACT);
        let lost = inset.area() - enclosed;
        (inset, lost)
    }

    /// Moves the border to the left of its direction, that is inwards, by `shift` mm.
    fn shifted(&self, shift: f64, arcs: &Arcs) -> Self {
        if self.is_empty() || shift == 0.0 {
            return self.clone();
        }
        let raw = self.raw_rings(shift, arcs, ShortSides::LeftOut);
        Self::from_grid_rings(&raw, Fill::Positive)
    }

    fn raw_rings(&self, shift: f64, arcs: &Arcs, short_sides: ShortSides) -> Vec<Ring> {
        debug_assert!(shift.is_finite());
        let in_steps = shift * STEPS_PER_MM;
        let rings = match short_sides {
            ShortSides::Loop => self.rings().collect(),
            ShortSides::LeftOut => lasting_rings(self, shift),
        };
        rings.into_iter().map(|ring| raw_ring(ring, in_steps, arcs, short_sides)).collect()
    }
}

/// Returns the rings of a region without those of which nothing is left when its border moves
/// inwards by `shift` (mm; outwards when negative): islands too small for it, or holes that close.
///
/// The raw rings of such places cross themselves many times, only to bound nothing.
#[must_use]
pub fn lasting_rings(region: &Region, shift: f64) -> Vec<&Ring> {
    let islands = region.islands().iter();
    if shift > 0.0 {
        return islands.filter(|island| !vanishes(island, shift)).flatten().collect();
    }
    let stays = |hole: &&Ring| !vanishes(std::slice::from_ref(*hole), -shift);
    islands.flat_map(|island| island[..1].iter().chain(island[1..].iter().filter(stays))).collect()
}

/// Returns whether an island, or a hole alone, is plainly too small to hold a disc of `radius` (mm):
/// it is no wider, or has less area. `false` says nothing.
///
/// True of charts too, where no line is longer and no disc smaller than the chart shows it.
#[must_use]
pub fn vanishes(island: &[Ring], radius: f64) -> bool {
    let Some(outer) = island.first() else { return true };
    let mut points = outer.iter().map(|&p| mm(p));
    let Some(first) = points.next() else { return true };
    let (min, max) = points.fold((first, first), |(min, max), p| (min.inf(&p), max.sup(&p)));
    let size = max - min;
    if size.x.min(size.y) <= 2.0 * radius {
        return true;
    }
    // Hardly any ring is so small that its area need be told.
    let disc = std::f64::consts::PI * radius * radius;
    size.x * size.y < 4.0 * disc
        && island.iter().map(|ring| signed_area(ring)).sum::<f64>().abs() < 0.99 * disc
}

/// How corners are rounded whose moved sides drift apart.
struct Arcs {
    /// How far chords may cut into arcs, mm.
    tolerance: f64,
    /// Corners whose sides cross within this many distances are not rounded at all; 0 rounds all.
    longest_miter: f64,
}

impl Arcs {
    /// How far chords may cut into arcs about a corner, in grid steps like `shift`.
    fn tolerance(&self, shift: f64) -> f64 {
        (self.tolerance * STEPS_PER_MM).min(shift.abs() / 2.0)
    }

    /// Whether an outer corner ends at the crossing of its moved sides: near enough to the arc, or
    /// wanted sharp. The crossing lies |shift|/cos(turn/2) from the corner.
    fn leave_sharp(&self, corner: &Corner, shift: f64) -> bool {
        let cos_half = f64::midpoint(1.0, corner.turn.0).max(0.0).sqrt();
        shift.abs() * (1.0 - cos_half) <= self.tolerance(shift) * cos_half
            || cos_half * self.longest_miter >= 1.0
    }
}

const EXACT: Arcs = Arcs { tolerance: ARC_TOLERANCE_MM, longest_miter: 0.0 };

const COARSE: Arcs = Arcs { tolerance: COARSE_TOLERANCE_MM, longest_miter: 0.0 };

/// Corners of an outset that may stay sharp reach this many distances at most: those over 19°.
pub const LONGEST_MITER: f64 = 6.0;

/// One side of a ring, in grid steps.
struct Side {
    direction: Vector2<f64>,
    length: f64,
}

/// The corner between two sides.
struct Corner {
    at: Point2<f64>,
    /// Left normals of the side before and the side after.
    normals: [Vector2<f64>; 2],
    /// Cosine and sine of the turn.
    turn: (f64, f64),
}

impl Corner {
    /// Whether the moved sides run into each other here.
    fn is_inner(&self, shift: f64) -> bool {
        self.turn.1 * shift > 0.0
    }

    /// What each side loses when both end at their crossing; negative where it grows.
    fn consumed(&self, shift: f64) -> f64 {
        let (cos, sin) = self.turn;
        shift * sin / (1.0 + cos)
    }

    /// The crossing of the two moved sides.
    fn crossing(&self, shift: f64) -> Point2<f64> {
        self.at + (self.normals[0] + self.normals[1]) * (shift / (1.0 + self.turn.0))
    }
}

/// The raw ring of one ring; `shift` in grid steps.
fn raw_ring(ring: &[GridPoint], shift: f64, arcs: &Arcs, short_sides: ShortSides) -> Ring {
    let count = ring.len();
    let float = |p: GridPoint| Point2::new(f64::from(p.x), f64::from(p.y));
    let sides: Vec<Side> = (0..count)
        .map(|i| {
            let along = float(ring[(i + 1) % count]) - float(ring[i]);
            let length = along.norm();
            Side { direction: along / length, length }
        })
        .collect();
    let corners: Vec<Corner> = (0..count)
        .map(|i| {
            let (before, after) = (&sides[(i + count - 1) % count], &sides[i]);
            let left = |d: &Vector2<f64>| Vector2::new(-d.y, d.x);
            Corner {
                at: float(ring[i]),
                normals: [left(&before.direction), left(&after.direction)],
                turn: (
                    before.direction.dot(&after.direction),
                    before.direction.perp(&after.direction),
                ),
            }
        })
        .collect();
    let lengths: Vec<f64> = sides.iter().map(|side| side.length).collect();
    let lost: Vec<Option<[f64; 2]>> = corners
        .iter()
        .map(|corner| {
            let meet = corner.is_inner(shift) || arcs.leave_sharp(corner, shift);
            meet.then(|| [corner.consumed(shift); 2])
        })
        .collect();
    // Where the image of a side begins, or would if it lost nothing.
    let start = |side: usize| corners[side].at + corners[side].normals[1] * shift;
    let mut moved = MovedSides::new(&lengths, &lost);
    if short_sides == ShortSides::LeftOut {
        moved.leave_out_short(|one, other| {
            let (d, e) = (sides[one].direction, sides[other].direction);
            let sine = d.perp(&e);
            let between = start(other) - start(one);
            (sine * shift.signum() >= LEAST_SINE)
                .then(|| [between.perp(&e) / sine, between.perp(&d) / sine])
        });
    }
    let mut raw = Vec::with_capacity(count + count / 4);
    for side in moved.kept() {
        let both_fit = moved.fit_around(side);
        if both_fit && moved.meets_across(side) {
            raw.push(rounded(start(side) + sides[side].direction * moved.from(side)));
            continue;
        }
        for corner in moved.corners(side) {
            join(&corners[corner], shift, arcs, both_fit, &mut raw);
        }
    }
    raw
}

/// Sides that turn by a smaller sine (3°) are not made to meet across what lies between: nearly
/// parallel, they would meet far away, and nearly opposite, they are the flanks of a thin place,
/// whose end is not to be skipped.
pub const LEAST_SINE: f64 = 0.05;

fn rounded(p: Point2<f64>) -> GridPoint {
    // The sum of a grid coordinate and an offset, both far below 2^31.
    GridPoint::new(p.x.round() as i32, p.y.round() as i32)
}

/// Appends the raw ring's points at one corner.
fn join(corner: &Corner, shift: f64, arcs: &Arcs, sides_fit: bool, raw: &mut Ring) {
    let mut push = |p: Point2<f64>| raw.push(rounded(p));
    let ends = corner.normals.map(|normal| corner.at + normal * shift);
    if corner.is_inner(shift) {
        if sides_fit {
            push(corner.crossing(shift));
        } else {
            push(ends[0]);
            push(corner.at);
            push(ends[1]);
        }
        return;
    }
    if arcs.leave_sharp(corner, shift) {
        push(corner.crossing(shift));
        return;
    }
    let (cos, sin) = corner.turn;
    let turn = sin.atan2(cos);
    let largest_step = 2.0 * (1.0 - arcs.tolerance(shift) / shift.abs()).acos();
    let pieces = (turn.abs() / largest_step).ceil().max(1.0);
    push(ends[0]);
    let (step_sin, step_cos) = (turn / pieces).sin_cos();
    let mut spoke = corner.normals[0] * shift;
    for _ in 1..pieces as u32 {
        spoke = Vector2::new(
            spoke.x * step_cos - spoke.y * step_sin,
            spoke.x * step_sin + spoke.y * step_cos,
        );
        push(corner.at + spoke);
    }
    push(ends[1]);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::{mm, snap};
    use crate::polyline::distance_to_segment;
    use crate::region::ring_sides;
    use std::f64::consts::{PI, TAU};

    fn region(rings: &[Vec<[f64; 2]>]) -> Region {
        let rings: Vec<Vec<Point2<f64>>> =
            rings.iter().map(|ring| ring.iter().map(|&p| Point2::from(p)).collect()).collect();
        Region::from_rings(rings.iter().map(Vec::as_slice), Fill::NonZero)
    }

    fn square(size: f64) -> Region {
        region(&[vec![[0.0, 0.0], [size, 0.0], [size, size], [0.0, size]]])
    }

    /// A wavy star with radial fins and a hole, the kind of ring that breaks careless offsets.
    fn star(fins: u32, seed: f64) -> Region {
        let outer = (0..fins * 4)
            .map(|i| {
                let angle = f64::from(i) * TAU / f64::from(fins * 4);
                let wave = [9.0, 9.3, 4.0, 4.2][i as usize % 4];
                let radius = wave + (f64::from(i) * seed).sin();
                [radius * angle.cos(), radius * angle.sin()]
            })
            .collect();
        let hole = vec![[0.5, -0.4], [-0.8, 0.9], [1.2, 0.7]];
        region(&[outer]).difference(&region(&[hole]))
    }

    fn distance_to_border(border: &Region, p: &Point2<f64>) -> f64 {
        border
            .rings()
            .flat_map(|ring| ring_sides(ring))
            .map(|(a, b)| distance_to_segment(&mm(a), &mm(b), p))
            .fold(f64::INFINITY, f64::min)
    }

    #[test]
    fn convex_corners_of_an_inset_stay_sharp() {
        let inner = square(10.0).inset(0.225);
        inner.check();
        assert_eq!(
            inner.islands(),
            [vec![vec![
                snap(&Point2::new(0.225, 9.775)),
                snap(&Point2::new(0.225, 0.225)),
                snap(&Point2::new(9.775, 0.225)),
                snap(&Point2::new(9.775, 9.775)),
            ]]]
        );
        assert!(square(10.0).inset(5.001).is_empty());
        assert!((square(10.0).inset(4.9).area() - 0.04).abs() < 1e-6);
    }

    #[test]
    fn what_holds_no_disc_vanishes_and_nothing_else() {
        let circle = |radius: f64| {
            let point = |k: u32| {
                let (sin, cos) = (f64::from(k) * TAU / 64.0).sin_cos();
                [radius * cos, radius * sin]
            };
            region(&[(0..64).map(point).collect()])
        };
        let vanishes = |region: &Region, radius| vanishes(&region.islands()[0], radius);
        assert!(vanishes(&circle(0.39), 0.4) && !vanishes(&circle(0.41), 0.4));
        // As wide as the disc, but a triangle; long, but too narrow.
        let triangle = region(&[vec![[0.0, 0.0], [0.9, 0.0], [0.45, 0.9]]]);
        assert!(vanishes(&triangle, 0.4) && triangle.inset(0.4).is_empty());
        assert!(vanishes(&region(&[vec![[0.0, 0.0], [9.0, 0.0], [9.0, 0.7], [0.0, 0.7]]]), 0.4));
        // Moved inwards a small island goes, moved outwards a small hole does.
        let plate = square(9.0).difference(&region(&[vec![[4.0, 4.0], [4.5, 4.0], [4.2, 4.5]]]));
        assert_eq!(lasting_rings(&plate, 0.4).len(), 2);
        assert_eq!(lasting_rings(&plate, -0.4).len(), 1);
        assert_eq!(plate.outset(0.4), square(9.0).outset(0.4));
        let both = plate.union(&region(&[vec![[20.0, 0.0], [20.5, 0.0], [20.2, 0.5]]]));
        assert_eq!((lasting_rings(&both, 0.4).len(), lasting_rings(&both, 0.1).len()), (2, 3));
    }

    #[test]
    fn corners_of_an_outset_are_round() {
        let grown = square(10.0).outset(2.0);
        let expected = 100.0 + 4.0 * 10.0 * 2.0 + PI * 4.0;
        assert!((grown.area() - expected).abs() < 0.01, "{}", grown.area());
    }

    #[test]
    fn corners_of_a_sharp_outset_are_sharp_unless_they_are_spikes() {
        let grown = square(10.0).outset_sharp(2.0);
        assert!((grown.area() - 196.0).abs() < 1e-6, "{}", grown.area());
        let spike = region(&[vec![[0.0, 0.0], [20.0, -1.0], [20.0, 1.0]]]);
        let reach = spike.outset_sharp(0.5).bounds().unwrap().min;
        assert!(mm(reach).x > -0.6, "{}", mm(reach));
    }

    #[test]
    fn holes_grow_when_the_region_shrinks_and_vanish_when_it_grows() {
        let frame = square(10.0).difference(&region(&[vec![
            [4.0, 4.0],
            [6.0, 4.0],
            [6.0, 6.0],
            [4.0, 6.0],
        ]]));
        let inner = frame.inset(0.5);
        inner.check();
        let expected = 81.0 - (4.0 + 4.0 * 2.0 * 0.5 + PI * 0.25);
        assert!((inner.area() - expected).abs() < 0.005, "{}", inner.area());
        assert_eq!(frame.outset(1.01).islands()[0].len(), 1, "the hole is closed");
    }

    #[test]
    fn every_new_border_point_is_at_the_distance() {
        for fins in [3, 7, 19] {
            for seed in [0.3, 1.7, 2.9] {
                let shape = star(fins, seed);
                for distance in [0.05, 0.225, 0.6, 1.5, 3.0] {
                    for moved in [shape.inset(distance), shape.outset(distance)] {
                        moved.check();
                        for (a, b) in moved.rings().flat_map(|ring| ring_sides(ring)) {
                            let middle = nalgebra::center(&mm(a), &mm(b));
                            for p in [mm(a), middle] {
                                let actual = distance_to_border(&shape, &p);
                                assert!(
                                    (actual - distance).abs() < ARC_TOLERANCE_MM + 3e-5,
                                    "fins {fins}, seed {seed}: {actual} instead of {distance}"
                                );
                            }
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn random_points_are_classified_by_their_distance() {
        let shape = star(11, 0.9);
        for distance in [0.1, 0.5, 1.1] {
            let (inner, outer) = (shape.inset(distance), shape.outset(distance));
            for i in 0..2000_u32 {
                let angle = f64::from(i) * 2.399_963;
                let radius = 11.0 * (f64::from(i) / 2000.0).sqrt();
                let p = Point2::new(radius * angle.cos(), radius * angle.sin());
                let from_border = distance_to_border(&shape, &p);
                if (from_border - distance).abs() < 0.002 {
                    continue;
                }
                let inside = shape.contains(&p);
                assert_eq!(inner.contains(&p), inside && from_border > distance);
                assert_eq!(outer.contains(&p), inside || from_border < distance);
            }
        }
    }

    #[test]
    fn loss_tells_whether_anything_is_too_thin() {
        let solid = square(10.0);
        assert!(solid.inset_with_loss(4.9).1.abs() < 1e-9);
        let bar = region(&[vec![[0.0, 0.0], [10.0, 0.0], [10.0, 0.8], [0.0, 0.8]]]);
        assert!(bar.inset_with_loss(0.39).1.abs() < 1e-9);
        assert!(bar.inset_with_loss(0.41).1 > 0.1, "{}", bar.inset_with_loss(0.41).1);
        // A smooth outline with short sides keeps its thickness too.
        let wavy: Vec<[f64; 2]> = (0..600)
            .map(|i| {
                let angle = f64::from(i) * TAU / 600.0;
                let radius = 15.0 + 0.5 * (9.0 * angle).sin();
                [radius * angle.cos(), radius * angle.sin()]
            })
            .collect();
        assert!(region(&[wavy]).inset_with_loss(0.9).1.abs() < 1e-3);
    }

    #[test]
    fn opening_removes_what_is_thinner_than_the_disc() {
        let bar_with_fin =
            square(10.0).union(&region(&[vec![[9.0, 4.0], [20.0, 4.0], [20.0, 4.4], [9.0, 4.4]]]));
        let opened = bar_with_fin.opened(0.25);
        assert!((opened.area() - 100.0).abs() < 0.1, "{}", opened.area());
    }
}

//! Borders moved by a true distance within the layer.
//!
//! Method as in [`geom::offset`]: every ring is replaced by a raw ring of moved points, and the
//! places that raw rings wind round a positive number of times are the result. What differs is the
//! step from a border to the moved one: it goes along the geodesic that leaves the border at a right
//! angle, to the place that [`Chart::walk`] knows exactly. The image of a side is curved in the
//! chart; it gets as many points as the arc tolerance asks for, which away from the axis are none.
//!
//! At a corner whose moved sides run into each other the raw ring takes their crossing, found by
//! Newton's method on the two curves, or returns to the corner itself where a side is too short;
//! elsewhere it follows the geodesic circle about the corner.
//!
//! On a plane all of this is [`geom::offset`] itself, unchanged.

use geom::grid::{GridPoint, mm, snap};
use geom::offset::{
    ARC_TOLERANCE_MM, LEAST_SINE, LONGEST_MITER, MovedSides, OPENING_TOLERANCE_MM, ShortSides,
};
use geom::polyline::{distance_to_segment, share_nearest};
use geom::region::{Fill, Region, Ring, signed_area};
use nalgebra::{Point2, Vector2};

use super::Chart;

impl Chart {
    /// Returns the points of the region at least `distance` (mm, not negative) from its border.
    #[must_use]
    pub fn inset(&self, region: &Region, distance: f64) -> Region {
        match self {
            Self::Plane => region.inset(distance),
            _ => self.shifted(region, distance, &EXACT),
        }
    }

    /// Returns the points at most `distance` (mm, not negative) from the region; its convex
    /// corners become round.
    #[must_use]
    pub fn outset(&self, region: &Region, distance: f64) -> Region {
        match self {
            Self::Plane => region.outset(distance),
            _ => self.shifted(region, -distance, &EXACT),
        }
    }

    /// Like [`outset`](Self::outset), with convex corners kept sharp as long as they reach no
    /// farther than [`LONGEST_MITER`] times the distance, and curves to within
    /// [`OPENING_TOLERANCE_MM`].
    #[must_use]
    pub fn outset_sharp(&self, region: &Region, distance: f64) -> Region {
        match self {
            Self::Plane => region.outset_sharp(distance),
            _ => self.shifted(region, -distance, &SHARP),
        }
    }

    /// Returns the part of the region that a disc of `radius` (mm) inside it can sweep, to within
    /// [`OPENING_TOLERANCE_MM`].
    #[must_use]
    pub fn opened(&self, region: &Region, radius: f64) -> Region {
        match self {
            Self::Plane => region.opened(radius),
            _ => self.shifted(&self.shifted(region, radius, &COARSE), -radius, &COARSE),
        }
    }

    /// Returns the inset and the area (mm² of the chart) over which its border ran into itself:
    /// zero, up to rounding, when every part of the region is at least twice `distance` thick.
    #[must_use]
    pub fn inset_with_loss(&self, region: &Region, distance: f64) -> (Region, f64) {
        if self.is_flat() {
            return region.inset_with_loss(distance);
        }
        let looped = self.raw_rings(region, distance, &EXACT, ShortSides::Loop);
        let enclosed: f64 = looped.iter().map(|ring| signed_area(ring)).sum();
        let inset = self.shifted(region, distance, &EXACT);
        let lost = inset.area() - enclosed;
        (inset, lost)
    }

    /// Moves the border to the left of its direction, that is inwards, by `shift` mm.
    fn shifted(&self, region: &Region, shift: f64, curves: &Curves) -> Region {
        if region.is_empty() || shift == 0.0 {
            return region.clone();
        }
        let raw = self.raw_rings(region, shift, curves, ShortSides::LeftOut);
        Region::from_grid_rings(&raw, Fill::Positive)
    }

    fn raw_rings(
        &self,
        region: &Region,
        shift: f64,
        curves: &Curves,
        short_sides: ShortSides,
    ) -> Vec<Ring> {
        debug_assert!(shift.is_finite());
        region.rings().map(|ring| raw_ring(self, ring, shift, curves, short_sides)).collect()
    }

    /// How much the image of a side of 1 mm, moved by 1 mm, may bend away from a chord, mm, at
    /// distance `from_axis` (mm) from the axis.
    fn bending(&self, from_axis: f64) -> f64 {
        match *self {
            Self::Plane => 0.0,
            // Straight lines of the chart have the curvature tan²/p on the unrolled cone, with p
            // their distance from the apex; moved by w, they lack w·tan²·(1 + tan²)/p² of it.
            Self::Cone { cos } => {
                let square = (1.0 / (cos * cos) - 1.0) / (cos * cos);
                square / (8.0 * from_axis * from_axis)
            }
            Self::Sphere { radius } => 1.0 / (4.0 * radius * radius),
        }
    }
}

/// How closely curves are followed.
struct Curves {
    /// How far chords may lie from curves, mm.
    tolerance: f64,
    /// Corners whose sides cross within this many distances are not rounded at all; 0 rounds all.
    longest_miter: f64,
}

const EXACT: Curves = Curves { tolerance: ARC_TOLERANCE_MM, longest_miter: 0.0 };

const COARSE: Curves = Curves { tolerance: OPENING_TOLERANCE_MM, longest_miter: 0.0 };

const SHARP: Curves = Curves { tolerance: OPENING_TOLERANCE_MM, longest_miter: LONGEST_MITER };

/// Points nearer to the axis than this, mm, have no azimuth to speak of and are moved that far out.
/// A grid step: what depends on it is as small.
const AXIS_MM: f64 = 1e-5;

/// Sides are never cut into pieces shorter than this, mm: beside the apex of a cone the image of a
/// side jumps, and no number of points would follow it.
const SHORTEST_PIECE_MM: f64 = 0.05;

/// Where sides turn by less than this sine, the crossing of their images is that of straight lines
/// to within a fraction of a grid step.
const SMALL_TURN: f64 = 0.05;

/// How near to each other two curves count as crossing, mm: a tenth of a grid step.
const CROSSING_MM: f64 = 1e-6;

/// Newton steps to a crossing; each gains two digits and more.
const NEWTON_STEPS: usize = 6;

/// One side of a ring in the chart, mm.
struct Side {
    from: Point2<f64>,
    direction: Vector2<f64>,
    length: f64,
}

impl Side {
    fn at(&self, t: f64) -> Point2<f64> {
        self.from + self.direction * t
    }
}

/// What a raw ring does at a corner.
struct Corner {
    /// The points, in order; none twice.
    points: Vec<Point2<f64>>,
    /// Where on the side before the first of them belongs, mm from the corner back.
    before: f64,
    /// Where on the side after the last belongs, mm from the corner on.
    after: f64,
}

/// The border of a ring while it is moved.
struct Mover<'a> {
    chart: &'a Chart,
    shift: f64,
    curves: &'a Curves,
}

/// The raw ring of one ring; `shift` in mm.
fn raw_ring(
    chart: &Chart,
    ring: &[GridPoint],
    shift: f64,
    curves: &Curves,
    short_sides: ShortSides,
) -> Ring {
    let mover = Mover { chart, shift, curves };
    let count = ring.len();
    let sides: Vec<Side> = (0..count)
        .map(|i| {
            let (from, to) = (mm(ring[i]), mm(ring[(i + 1) % count]));
            let along = to - from;
            let length = along.norm();
            Side { from, direction: along / length, length }
        })
        .collect();
    let before = |i: usize| &sides[(i + count - 1) % count];
    let turns: Vec<Turn> = (0..count).map(|i| mover.turn(before(i), &sides[i])).collect();
    let lengths: Vec<f64> = sides.iter().map(|side| side.length).collect();
    let lost: Vec<Option<[f64; 2]>> =
        turns.iter().map(|turn| mover.meet(turn).then_some(turn.consumed)).collect();
    let mut moved = MovedSides::new(&lengths, &lost);
    if short_sides == ShortSides::LeftOut {
        moved.leave_out_short(|one, other| mover.crossing_of(&sides[one], &sides[other]));
    }
    let places: Vec<(usize, Vec<Corner>)> = moved
        .kept()
        .map(|side| {
            let both_fit = moved.fit_around(side);
            if both_fit && moved.meets_across(side) {
                let before = moved.before(side);
                let at = sides[side].at(moved.from(side));
                let corner = Corner {
                    points: vec![mover.moved(&at, &sides[side])],
                    before: sides[before].length - moved.to(before),
                    after: moved.from(side),
                };
                return (side, vec![corner]);
            }
            let corner = |i: usize| mover.corner(before(i), &sides[i], &turns[i], both_fit);
            (side, moved.corners(side).map(corner).collect())
        })
        .collect();
    let mut raw = Ring::with_capacity(count + count / 4);
    for (k, (side, corners)) in places.iter().enumerate() {
        raw.extend(corners.iter().flat_map(|corner| &corner.points).map(snap));
        let (_, next) = &places[(k + 1) % places.len()];
        let (Some(here), Some(next)) = (corners.last(), next.first()) else { continue };
        let (Some(from), Some(to)) = (here.points.last(), next.points.first()) else { continue };
        let range = (here.after, sides[*side].length - next.before);
        mover.along(&sides[*side], range, (from, to), &mut raw);
    }
    raw
}

/// A corner in true angles and lengths.
struct Turn {
    at: Point2<f64>,
    /// Left normals of the side before and the side after: (along the meridian, across it).
    normals: [Vector2<f64>; 2],
    cos: f64,
    sin: f64,
    /// What each side loses when both end at their crossing, chart mm; negative where it grows.
    consumed: [f64; 2],
}

impl Mover<'_> {
    fn turn(&self, before: &Side, after: &Side) -> Turn {
        let at = off_axis(after.from, &before.direction);
        let [b, a] = [before, after].map(|side| self.chart.in_metric(&at, &side.direction));
        let (b_speed, a_speed) = (b.norm(), a.norm());
        let (b, a) = (b / b_speed, a / a_speed);
        let (cos, sin) = (b.dot(&a), b.perp(&a));
        let lost = self.shift * sin / (1.0 + cos);
        let normals = [b, a].map(|t| Vector2::new(-t.y, t.x));
        Turn { at, normals, cos, sin, consumed: [lost / b_speed, lost / a_speed] }
    }

    /// Whether the sides at a corner end at their crossing: they run into each other, or it is near
    /// enough to the arc, or wanted sharp. It lies |shift|/cos(turn/2) from the corner.
    fn meet(&self, turn: &Turn) -> bool {
        let radius = self.shift.abs();
        let tolerance = self.curves.tolerance.min(radius / 2.0);
        let cos_half = f64::midpoint(1.0, turn.cos).max(0.0).sqrt();
        turn.sin * self.shift > 0.0
            || radius * (1.0 - cos_half) <= tolerance * cos_half
            || cos_half * self.curves.longest_miter >= 1.0
    }

    fn corner(&self, before: &Side, after: &Side, turn: &Turn, sides_fit: bool) -> Corner {
        let apart = |points| Corner { points, before: 0.0, after: 0.0 };
        let ends = || turn.normals.map(|normal| self.walk(&turn.at, &(normal * self.shift)));
        if turn.sin * self.shift > 0.0 {
            if sides_fit && let Some(corner) = self.crossing(before, after, turn) {
                return corner;
            }
            let [end, begin] = ends();
            return apart(vec![end, turn.at, begin]);
        }
        if self.meet(turn)
            && let Some(corner) = self.crossing(before, after, turn)
        {
            return corner;
        }
        let radius = self.shift.abs();
        let tolerance = self.curves.tolerance.min(radius / 2.0);
        let angle = turn.sin.atan2(turn.cos);
        let largest_step = 2.0 * (1.0 - tolerance / radius).acos();
        let pieces = (angle.abs() / largest_step).ceil().max(1.0);
        let [end, begin] = ends();
        let mut points = vec![end];
        for k in 1..pieces as u32 {
            let (sin, cos) = (angle * f64::from(k) / pieces).sin_cos();
            let [normal, _] = turn.normals;
            let spoke =
                Vector2::new(normal.x * cos - normal.y * sin, normal.x * sin + normal.y * cos);
            points.push(self.walk(&turn.at, &(spoke * self.shift)));
        }
        points.push(begin);
        apart(points)
    }

    /// The crossing of the images of two sides, produced beyond the corner where they drift apart;
    /// `None` when they do not meet nearby.
    fn crossing(&self, before: &Side, after: &Side, turn: &Turn) -> Option<Corner> {
        let half = self.shift / (1.0 + turn.cos);
        if turn.sin.abs() <= SMALL_TURN && turn.cos > 0.0 {
            let at = self.walk(&turn.at, &((turn.normals[0] + turn.normals[1]) * half));
            let [before, after] = turn.consumed;
            return Some(Corner { points: vec![at], before, after });
        }
        let cross = before.direction.perp(&after.direction);
        if cross == 0.0 {
            return None;
        }
        let guess = [before.length - turn.consumed[0], turn.consumed[1]];
        let ([to, from], at) = self.newton(before, after, guess)?;
        Some(Corner { points: vec![at], before: before.length - to, after: from })
    }

    /// Where the images of two sides that are not neighbours run into each other, as lengths on
    /// either side.
    fn crossing_of(&self, one: &Side, other: &Side) -> Option<[f64; 2]> {
        let sine = one.direction.perp(&other.direction) * self.shift.signum();
        if sine < LEAST_SINE {
            return None;
        }
        self.newton(one, other, [one.length, 0.0]).map(|(lengths, _)| lengths)
    }

    /// The crossing of the images of two sides and its places on them, from a guess of these;
    /// `None` when it is not nearby.
    fn newton(
        &self,
        one: &Side,
        other: &Side,
        [mut to, mut from]: [f64; 2],
    ) -> Option<([f64; 2], Point2<f64>)> {
        let cross = one.direction.perp(&other.direction);
        for _ in 0..NEWTON_STEPS {
            let end = self.moved(&one.at(to), one);
            let begin = self.moved(&other.at(from), other);
            let gap = end - begin;
            if gap.norm() <= CROSSING_MM {
                return Some(([to, from], end));
            }
            // The images run nearly along the sides themselves.
            to -= gap.perp(&other.direction) / cross;
            from += one.direction.perp(&gap) / cross;
            if (one.length - to).abs().max(from.abs()) > 2.0 * LONGEST_MITER * self.shift.abs() {
                return None;
            }
        }
        None
    }

    /// Appends points of the image of a side between two places on it, chart mm from its begin,
    /// whose own images are known.
    fn along(
        &self,
        side: &Side,
        (from, to): (f64, f64),
        ends: (&Point2<f64>, &Point2<f64>),
        raw: &mut Ring,
    ) {
        let foot = share_nearest(&side.at(from), &side.at(to), &Point2::origin());
        let nearest = side.at(from + (to - from) * foot).coords.norm();
        let bend = self.chart.bending(nearest) * (to - from).powi(2) * self.shift.abs();
        if to - from <= SHORTEST_PIECE_MM || bend <= self.curves.tolerance {
            return;
        }
        // The image bends most where the side is nearest to the axis.
        let foot = if (0.05..0.95).contains(&foot) { foot } else { 0.5 };
        let middle = from + (to - from) * foot;
        let image = self.moved(&side.at(middle), side);
        if distance_to_segment(ends.0, ends.1, &image) <= self.curves.tolerance / 2.0 {
            return;
        }
        self.along(side, (from, middle), (ends.0, &image), raw);
        raw.push(snap(&image));
        self.along(side, (middle, to), (&image, ends.1), raw);
    }

    /// The image of a point of a side.
    fn moved(&self, p: &Point2<f64>, side: &Side) -> Point2<f64> {
        let p = off_axis(*p, &side.direction);
        let along = self.chart.in_metric(&p, &side.direction);
        let normal = Vector2::new(-along.y, along.x) * (self.shift / along.norm());
        self.walk(&p, &normal)
    }

    fn walk(&self, p: &Point2<f64>, step: &Vector2<f64>) -> Point2<f64> {
        let s = p.coords.norm();
        self.chart.walk_along(s, &(p.coords / s), step)
    }
}

/// A point on the axis moved off it, to the left of `direction`.
fn off_axis(p: Point2<f64>, direction: &Vector2<f64>) -> Point2<f64> {
    if p.coords.norm_squared() >= AXIS_MM * AXIS_MM {
        return p;
    }
    Point2::new(-direction.y * AXIS_MM, direction.x * AXIS_MM)
}

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
//! On a cone a geodesic that passes the apex closely turns about it by more than half a turn of the
//! chart, to either side. What lies behind the apex is thus reached from both sides, and the image of
//! a side that comes nearer to the apex than the border is moved is torn there: the raw ring goes to
//! the apex and back, so that it winds round every place as often as strips cover it. Ways back to a
//! corner get a point abreast of the apex for the same reason.
//!
//! On a plane all of this is [`geom::offset`] itself, unchanged.

use geom::grid::{GridPoint, STEPS_PER_MM, mm, snap};
use geom::offset::{
    ARC_TOLERANCE_MM, COARSE_TOLERANCE_MM, LEAST_SINE, LONGEST_MITER, MovedSides, lasting_rings,
    vanishes,
};
use geom::polyline::{distance_to_segment, share_nearest};
use geom::region::{Fill, Island, Region, Ring, ring_length, signed_area};
use nalgebra::{Point2, Vector2};
use std::ops::Range;

use super::{Chart, turned};

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
    /// [`COARSE_TOLERANCE_MM`].
    #[must_use]
    pub fn outset_sharp(&self, region: &Region, distance: f64) -> Region {
        match self {
            Self::Plane => region.outset_sharp(distance),
            _ => self.shifted(region, -distance, &SHARP),
        }
    }

    /// Returns the part of the region that a disc of `radius` (mm) inside it can sweep, to within
    /// [`COARSE_TOLERANCE_MM`].
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
        let mover = Mover { chart: self, shift: distance, curves: &EXACT };
        let (mut raw, mut lost) = (Vec::new(), 0.0);
        for island in region.islands() {
            if vanishes(island, distance) {
                lost += island.iter().map(|ring| signed_area(ring)).sum::<f64>();
                continue;
            }
            for ring in island {
                let mut border = Border::new(&mover, ring);
                let looped = border.raw_ring();
                lost -= signed_area(&looped);
                raw.push(if border.leave_out_short() { border.raw_ring() } else { looped });
            }
        }
        let inset = resolved(&raw);
        let lost = lost + inset.area();
        (inset, lost)
    }

    /// Moves the border to the left of its direction, that is inwards, by `shift` mm.
    fn shifted(&self, region: &Region, shift: f64, curves: &Curves) -> Region {
        if region.is_empty() || shift == 0.0 {
            return region.clone();
        }
        let mover = Mover { chart: self, shift, curves };
        let raw: Vec<Ring> = lasting_rings(region, shift)
            .into_iter()
            .map(|ring| {
                let mut border = Border::new(&mover, ring);
                border.leave_out_short();
                border.raw_ring()
            })
            .collect();
        resolved(&raw)
    }

    /// The greatest curvature that a straight line of the chart has on the layer at distance
    /// `from_axis` from the axis, 1/mm; that of its image, moved by less than that, is the like.
    fn curvature(&self, from_axis: f64) -> f64 {
        match *self {
            Self::Plane => 0.0,
            Self::Cone { cos } => (1.0 / (cos * cos) - 1.0) / (cos * cos * from_axis),
            Self::Sphere { radius } => 1.0 / radius,
        }
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

/// The places that raw rings wind round a positive number of times.
fn resolved(raw: &[Ring]) -> Region {
    let moved = Region::from_grid_rings(raw, Fill::Positive);
    if moved.islands().iter().all(|island| is_wider_than_rounding(&island)) {
        return moved;
    }
    moved.filtered(is_wider_than_rounding)
}

/// Whether an island is more than what rounding leaves of strips that lie against each other, as
/// images that pass the apex of a cone to either side do.
fn is_wider_than_rounding(island: &&Island) -> bool {
    // Both sides of a strip are off by a grid step and more.
    const ROUNDING_MM: f64 = 10.0 / STEPS_PER_MM;
    let (area, perimeter) = island.iter().fold((0.0, 0.0), |(area, perimeter), ring| {
        (area + signed_area(ring), perimeter + ring_length(ring))
    });
    2.0 * area > ROUNDING_MM * perimeter
}

/// How closely curves are followed.
struct Curves {
    /// How far chords may lie from curves, mm.
    tolerance: f64,
    /// Corners whose sides cross within this many distances are not rounded at all; 0 rounds all.
    longest_miter: f64,
}

const EXACT: Curves = Curves { tolerance: ARC_TOLERANCE_MM, longest_miter: 0.0 };

const COARSE: Curves = Curves { tolerance: COARSE_TOLERANCE_MM, longest_miter: 0.0 };

const SHARP: Curves = Curves { tolerance: COARSE_TOLERANCE_MM, longest_miter: LONGEST_MITER };

/// Points nearer to the axis than this, mm, have no azimuth to speak of and are moved that far out.
/// A grid step: what depends on it is as small.
const AXIS_MM: f64 = 1e-5;

/// Sides are never cut into pieces shorter than this, mm: the image of such a piece lies within a
/// few µm of its chord unless it passes the apex of a cone within a tenth of that.
const SHORTEST_PIECE_MM: f64 = 0.02;

/// Ways that may pass the apex of a cone are cut into so many pieces by the cosine of its angle: a
/// chord that turned by half a turn would pass the apex on the wrong side, and longer ones would
/// leave slivers between the strips of neighbouring sides.
const WAY_PIECES: f64 = 8.0;

/// How far a side near the apex may be from straight on the unrolled cone, mm.
const BENT_SIDE_MM: f64 = 1e-3;

/// Where sides turn by less than this sine, the crossing of their images is that of straight lines
/// to within a fraction of a grid step.
const SMALL_TURN: f64 = 0.05;

/// Images that bend by no more than this between corner and crossing, mm, cross where straight lines
/// would: a fifth of the tolerance of arcs.
const STRAIGHT_MM: f64 = ARC_TOLERANCE_MM / 5.0;

/// How near to each other two curves count as crossing, mm: a tenth of a grid step.
const CROSSING_MM: f64 = 1e-6;

/// Newton steps to a crossing; each gains two digits and more.
const NEWTON_STEPS: usize = 6;

/// One side of a ring, mm.
struct Side {
    from: Point2<f64>,
    /// Along its chord in the chart, of length 1.
    direction: Vector2<f64>,
    /// Of its chord in the chart.
    length: f64,
    /// For a side that is straight on the unrolled cone rather than in the chart: the way to its
    /// end, in lengths (along the meridian of its begin, across it).
    unrolled: Option<Vector2<f64>>,
}

impl Side {
    fn new(from: Point2<f64>, to: Point2<f64>, unrolled: Option<Vector2<f64>>) -> Self {
        let along = to - from;
        let length = along.norm();
        Self { from, direction: along / length, length, unrolled }
    }

    /// The place `t` mm along the side, and the direction there in true lengths by chart mm.
    fn at(&self, chart: &Chart, t: f64) -> (Point2<f64>, Vector2<f64>) {
        if let (Some(way), Chart::Cone { cos }) = (self.unrolled, chart) {
            let s = self.from.coords.norm();
            let along = way / self.length;
            let (x, y) = (s + along.x * t, along.y * t);
            let turn = y.atan2(x);
            let (sin, cosine) = turn.sin_cos();
            let here =
                Vector2::new(along.x * cosine + along.y * sin, along.y * cosine - along.x * sin);
            return (turned(&(self.from.coords / s), x.hypot(y), turn / cos), here);
        }
        let p = off_axis(self.from + self.direction * t, &self.direction);
        (p, chart.in_metric(&p, &self.direction))
    }

    /// Where the side is nearest to the axis, mm along it, and how far to its left the axis lies
    /// there, true mm.
    fn foot(&self) -> (f64, f64) {
        match self.unrolled {
            None => {
                let left = Vector2::new(-self.direction.y, self.direction.x);
                (-self.from.coords.dot(&self.direction), -left.dot(&self.from.coords))
            }
            Some(way) => {
                let (s, length) = (self.from.coords.norm(), way.norm());
                (-s * way.x / (length * length) * self.length, s * way.y / length)
            }
        }
    }
}

/// The sides of a ring. Near the apex of a cone they are cut into pieces so short that they may as
/// well be straight on the unrolled cone: what is straight in the chart is strongly bent there, and
/// the ways from a bent side would cross each other.
fn sides_of(chart: &Chart, ring: &[GridPoint], shift: f64) -> Vec<Side> {
    let count = ring.len();
    // Both sides at a corner on the axis begin from one meridian, or their turn would not be seen.
    let points: Vec<Point2<f64>> = (0..count)
        .map(|i| {
            let before = mm(ring[i]) - mm(ring[(i + count - 1) % count]);
            off_axis(mm(ring[i]), &before.normalize())
        })
        .collect();
    let Chart::Cone { cos } = *chart else {
        return (0..count).map(|i| Side::new(points[i], points[(i + 1) % count], None)).collect();
    };
    // A side that passes the apex at p has the curvature tan²/p.
    let near = 2.0 * shift.abs() * (1.0 / (cos * cos) - 1.0).max(1.0);
    let mut sides = Vec::with_capacity(count);
    for i in 0..count {
        let (from, to) = (points[i], points[(i + 1) % count]);
        let foot = share_nearest(&from, &to, &Point2::origin());
        let nearest = from + (to - from) * foot;
        if nearest.coords.norm() >= near {
            sides.push(Side::new(from, to, None));
        } else if foot > 0.0 && foot < 1.0 {
            let nearest = off_axis(nearest, &(to - from).normalize());
            cut_side(cos, (from, nearest), near, &mut sides);
            cut_side(cos, (nearest, to), near, &mut sides);
        } else {
            cut_side(cos, (from, to), near, &mut sides);
        }
    }
    sides
}

/// Appends the pieces of a side whose distance to the axis changes evenly.
fn cut_side(cos: f64, (from, to): (Point2<f64>, Point2<f64>), near: f64, sides: &mut Vec<Side>) {
    let (s, length) = (from.coords.norm(), (to - from).norm());
    if s.min(to.coords.norm()) >= near || length <= AXIS_MM {
        if length > 0.0 {
            sides.push(Side::new(from, to, None));
        }
        return;
    }
    let turn = from.coords.perp(&to.coords).atan2(from.coords.dot(&to.coords)) * cos;
    let end = Vector2::new(turn.cos(), turn.sin()) * to.coords.norm();
    let way = end - Vector2::new(s, 0.0);
    let side = Side::new(from, to, Some(way));
    let (middle, _) = side.at(&Chart::Cone { cos }, length / 2.0);
    if distance_to_segment(&from, &to, &middle) <= BENT_SIDE_MM {
        sides.push(side);
        return;
    }
    let middle = nalgebra::center(&from, &to);
    cut_side(cos, (from, middle), near, sides);
    cut_side(cos, (middle, to), near, sides);
}

/// Where on the sides around it the points that a raw ring takes at a corner belong: the first on the
/// side before, mm from the corner back, the last on the side after, mm from the corner on.
#[derive(Clone, Copy)]
struct Ends {
    before: f64,
    after: f64,
}

impl Ends {
    /// Those of the corner itself.
    const CORNER: Self = Self { before: 0.0, after: 0.0 };
}

/// What a raw ring does between a kept side and the kept one before it.
struct Passage {
    /// The side.
    side: usize,
    /// Its points, in order, none twice, among those of the whole ring.
    points: Range<usize>,
    /// Where they belong.
    ends: Ends,
}

/// The border of a ring while it is moved.
struct Mover<'a> {
    chart: &'a Chart,
    shift: f64,
    curves: &'a Curves,
}

/// A ring, ready to be moved.
struct Border<'a> {
    mover: &'a Mover<'a>,
    sides: Vec<Side>,
    /// The corner before each side.
    turns: Vec<Turn>,
    moved: MovedSides,
}

impl<'a> Border<'a> {
    fn new(mover: &'a Mover<'a>, ring: &[GridPoint]) -> Self {
        let sides = sides_of(mover.chart, ring, mover.shift);
        let count = sides.len();
        let turns: Vec<Turn> =
            (0..count).map(|i| mover.turn(&sides[(i + count - 1) % count], &sides[i])).collect();
        let lengths: Vec<f64> = sides.iter().map(|side| side.length).collect();
        let lost: Vec<Option<[f64; 2]>> =
            turns.iter().map(|turn| mover.meet(turn).then_some(turn.consumed)).collect();
        let moved = MovedSides::new(&lengths, &lost);
        Self { mover, sides, turns, moved }
    }

    /// Leaves out the sides that are too short to bound anything; returns whether there can be any.
    fn leave_out_short(&mut self) -> bool {
        if self.moved.all_fit() {
            return false;
        }
        let Self { mover, sides, moved, .. } = self;
        moved.leave_out_short(|one, other| mover.crossing_across(&sides[one], &sides[other]));
        true
    }

    fn raw_ring(&self) -> Ring {
        let Self { mover, sides, moved, .. } = self;
        let mut points = Vec::with_capacity(sides.len() + sides.len() / 4);
        let passages: Vec<Passage> =
            moved.kept().map(|side| self.passage(side, &mut points)).collect();
        let mut raw = Ring::with_capacity(points.len());
        for (k, here) in passages.iter().enumerate() {
            let next = &passages[(k + 1) % passages.len()];
            raw.extend(points[here.points.clone()].iter().map(snap));
            let (from, to) = (&points[here.points.end - 1], &points[next.points.start]);
            let side = &sides[here.side];
            mover.side(
                side,
                (here.ends.after, side.length - next.ends.before),
                (from, to),
                &mut raw,
            );
        }
        raw
    }

    /// Appends the points of the raw ring between a kept side and the kept one before it: one at least.
    fn passage(&self, side: usize, points: &mut Vec<Point2<f64>>) -> Passage {
        let Self { mover, sides, turns, moved } = self;
        let start = points.len();
        let both_fit = moved.fit_around(side);
        if both_fit && moved.meets_across(side) {
            let before = moved.before(side);
            points.push(mover.moved(&sides[side], moved.from(side)));
            let ends =
                Ends { before: sides[before].length - moved.to(before), after: moved.from(side) };
            return Passage { side, points: start..points.len(), ends };
        }
        let count = sides.len();
        let mut ends: Option<Ends> = None;
        for i in moved.corners(side) {
            let before = &sides[(i + count - 1) % count];
            let corner = mover.corner((before, &sides[i]), &turns[i], both_fit, points);
            ends =
                Some(Ends { before: ends.map_or(corner.before, |first| first.before), ..corner });
        }
        Passage { side, points: start..points.len(), ends: ends.unwrap_or(Ends::CORNER) }
    }
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
        let (_, b) = before.at(self.chart, before.length);
        let (at, a) = after.at(self.chart, 0.0);
        let (b_speed, a_speed) = (b.norm(), a.norm());
        let (b, a) = (b / b_speed, a / a_speed);
        let (cos, sin) = (b.dot(&a), b.perp(&a));
        let lost = self.shift * sin / (1.0 + cos);
        let normals = [b, a].map(|t| Vector2::new(-t.y, t.x));
        Turn { at, normals, cos, sin, consumed: [lost / b_speed, lost / a_speed] }
    }

    fn tolerance(&self) -> f64 {
        self.curves.tolerance.min(self.shift.abs() / 2.0)
    }

    /// Whether the sides at a corner end at their crossing: they run into each other, or it is near
    /// enough to the arc, or wanted sharp. It lies |shift|/cos(turn/2) from the corner.
    fn meet(&self, turn: &Turn) -> bool {
        let radius = self.shift.abs();
        let cos_half = f64::midpoint(1.0, turn.cos).max(0.0).sqrt();
        if turn.sin * self.shift > 0.0 {
            // With the apex between corner and crossing, the two images pass it on either side.
            return !self.has_apex() || turn.at.coords.norm() * cos_half > radius;
        }
        radius * (1.0 - cos_half) <= self.tolerance() * cos_half
            || cos_half * self.curves.longest_miter >= 1.0
    }

    /// Appends the points that the raw ring takes at a corner: one at least.
    fn corner(
        &self,
        (before, after): (&Side, &Side),
        turn: &Turn,
        sides_fit: bool,
        points: &mut Vec<Point2<f64>>,
    ) -> Ends {
        let meet = self.meet(turn);
        let runs_into_itself = turn.sin * self.shift > 0.0;
        if meet
            && (sides_fit || !runs_into_itself)
            && let Some((at, ends)) = self.crossing(before, after, turn)
        {
            points.push(at);
            return ends;
        }
        if runs_into_itself {
            let [end, begin] = turn.normals.map(|normal| self.way(&turn.at, &normal));
            points.extend(end.iter().rev());
            points.push(turn.at);
            points.extend(begin);
        } else {
            self.arc(turn, points);
        }
        Ends::CORNER
    }

    /// Appends the geodesic circle about a corner, from the image of the side before to that of the side
    /// after.
    fn arc(&self, turn: &Turn, points: &mut Vec<Point2<f64>>) {
        let angle = turn.sin.atan2(turn.cos);
        let largest_step = 2.0 * (1.0 - self.tolerance() / self.shift.abs()).acos();
        let pieces = (angle.abs() / largest_step).ceil().max(1.0);
        let [first, last] = turn.normals;
        let spoke = |k: u32| {
            if k == pieces as u32 {
                return last * self.shift;
            }
            let (sin, cos) = (angle * f64::from(k) / pieces).sin_cos();
            Vector2::new(first.x * cos - first.y * sin, first.x * sin + first.y * cos) * self.shift
        };
        let s = turn.at.coords.norm();
        points.push(self.walk(&turn.at, &spoke(0)));
        for k in 1..=pieces as u32 {
            let (old, new) = (spoke(k - 1), spoke(k));
            let passes_behind = s + new.x < 0.0 && old.y * new.y < 0.0;
            if passes_behind && self.has_apex() {
                points.extend(self.tear(&(turn.at.coords / s), s, old.y.signum()));
            }
            points.push(self.walk(&turn.at, &new));
        }
    }

    fn has_apex(&self) -> bool {
        matches!(self.chart, Chart::Cone { .. })
    }

    /// The tear of an image that passes behind the apex of a cone, seen from radius `s` on the
    /// meridian `outwards`: the place straight behind the apex as it is reached from one side
    /// (`side` is the sign of the turn), the apex, and the place as it is reached from the other.
    fn tear(&self, outwards: &Vector2<f64>, s: f64, side: f64) -> [Point2<f64>; 3] {
        // On the branch cut of the turn; zeros have signs.
        let behind = |side: f64| Vector2::new(-self.shift.abs(), 0.0_f64.copysign(side));
        let image = |side| self.chart.walk_along(s, outwards, &behind(side));
        [image(side), Point2::origin(), image(-side)]
    }

    /// The way from a point to its image along `normal`, without the point. Near the apex of a cone
    /// all ways are cut into as many pieces, which turn equally far about the apex, so that ways
    /// that differ a little stay side by side.
    fn way(&self, from: &Point2<f64>, normal: &Vector2<f64>) -> Vec<Point2<f64>> {
        let (s, step) = (from.coords.norm(), normal * self.shift);
        let pieces = match *self.chart {
            Chart::Cone { cos } if s < 2.0 * self.shift.abs() => (WAY_PIECES / cos).ceil(),
            _ => 1.0,
        };
        let turn = step.y.atan2(s + step.x);
        let mut way: Vec<Point2<f64>> = (1..pieces as u32)
            .map(|k| {
                // Where the straight way of the unrolled cone has turned by this much.
                let (sin, cos) = (turn * f64::from(k) / pieces).sin_cos();
                let ahead = step.y * cos - step.x * sin;
                let share = if ahead == 0.0 { f64::from(k) / pieces } else { s * sin / ahead };
                self.walk(from, &(step * share))
            })
            .collect();
        way.push(self.walk(from, &step));
        way
    }

    /// The crossing of the images of two sides, produced beyond the corner where they drift apart;
    /// `None` when they do not meet nearby.
    fn crossing(&self, before: &Side, after: &Side, turn: &Turn) -> Option<(Point2<f64>, Ends)> {
        let half = self.shift / (1.0 + turn.cos);
        let from_axis = turn.at.coords.norm();
        let is_clear = !self.has_apex() || from_axis > self.shift.abs();
        let [lost, other] = turn.consumed;
        let lost = lost.abs().max(other.abs());
        let is_slight = turn.sin.abs() <= SMALL_TURN && turn.cos > 0.0;
        let is_straight = || self.chart.curvature(from_axis) * lost * lost <= STRAIGHT_MM;
        if is_clear && (is_slight || is_straight()) {
            let at = self.walk(&turn.at, &((turn.normals[0] + turn.normals[1]) * half));
            let [before, after] = turn.consumed;
            return Some((at, Ends { before, after }));
        }
        let cross = before.direction.perp(&after.direction);
        if cross == 0.0 {
            return None;
        }
        let guess = [before.length - turn.consumed[0], turn.consumed[1]];
        let ([to, from], at) = self.newton(before, after, guess)?;
        Some((at, Ends { before: before.length - to, after: from }))
    }

    /// Where the images of two sides that are not neighbours run into each other, mm along either;
    /// `None` where they are nearly parallel or the apex of a cone is near.
    fn crossing_across(&self, one: &Side, other: &Side) -> Option<[f64; 2]> {
        let sine = one.direction.perp(&other.direction) * self.shift.signum();
        let is_near_apex = |side: &Side| side.from.coords.norm() < 2.0 * self.shift.abs();
        if sine < LEAST_SINE || (self.has_apex() && (is_near_apex(one) || is_near_apex(other))) {
            return None;
        }
        self.newton(one, other, [one.length, 0.0]).map(|(places, _)| places)
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
            let end = self.moved(one, to);
            let begin = self.moved(other, from);
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
    fn side(
        &self,
        side: &Side,
        (from, to): (f64, f64),
        (begin, end): (&Point2<f64>, &Point2<f64>),
        raw: &mut Ring,
    ) {
        let (foot, left_gap) = side.foot();
        // Positive where the side moves towards the axis.
        let gap = left_gap * self.shift.signum();
        let is_torn =
            self.has_apex() && (from..to).contains(&foot) && gap > 0.0 && gap < self.shift.abs();
        if !is_torn {
            self.along(side, (from, to), (begin, end), raw);
            return;
        }
        // Before the foot the apex lies ahead, and the way to the left passes it clockwise.
        let (nearest, _) = side.at(self.chart, foot);
        let outwards = nearest.coords.normalize();
        let tear = self.tear(&outwards, gap, -self.shift.signum());
        self.along(side, (from, foot), (begin, &tear[0]), raw);
        raw.extend(tear.iter().map(snap));
        self.along(side, (foot, to), (&tear[2], end), raw);
    }

    /// As [`side`](Self::side), for a part of it whose image is not torn.
    fn along(
        &self,
        side: &Side,
        (from, to): (f64, f64),
        ends: (&Point2<f64>, &Point2<f64>),
        raw: &mut Ring,
    ) {
        let at = |t: f64| side.from + side.direction * t;
        let foot = share_nearest(&at(from), &at(to), &Point2::origin());
        let nearest = at(from + (to - from) * foot).coords.norm();
        let bend = self.chart.bending(nearest) * (to - from).powi(2) * self.shift.abs();
        if to - from <= SHORTEST_PIECE_MM || bend <= self.curves.tolerance {
            return;
        }
        // The image bends most where the side is nearest to the axis.
        let foot = if (0.05..0.95).contains(&foot) { foot } else { 0.5 };
        let middle = from + (to - from) * foot;
        let image = self.moved(side, middle);
        if distance_to_segment(ends.0, ends.1, &image) <= self.curves.tolerance / 2.0 {
            return;
        }
        self.along(side, (from, middle), (ends.0, &image), raw);
        raw.push(snap(&image));
        self.along(side, (middle, to), (&image, ends.1), raw);
    }

    /// The image of the place `t` mm along a side.
    fn moved(&self, side: &Side, t: f64) -> Point2<f64> {
        let (p, along) = side.at(self.chart, t);
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
    // Half of it decides: places are 0 or a grid step from the axis and more, so that the rounding of a
    // step, or of a place that was moved before, never moves it to another meridian.
    if p.coords.norm_squared() >= AXIS_MM * AXIS_MM / 4.0 {
        return p;
    }
    Point2::new(-direction.y * AXIS_MM, direction.x * AXIS_MM)
}

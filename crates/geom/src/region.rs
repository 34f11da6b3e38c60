//! Closed planar areas: islands with holes, and their booleans.
//!
//! A [`Region`] is a set of islands on the integer [grid](crate::grid). Each island is one outer
//! ring (counter-clockwise) and its holes (clockwise); an island inside a hole is an island of its
//! own. Rings never cross; they may touch in points. Every operation returns a region in this
//! form, in an order that depends on the input alone.
//!
//! The overlay engine underneath is i_overlay (integer coordinates, exact predicates); this module
//! and [`offset`](crate::offset), which builds on it, are the only ones that know.

use i_overlay::core::fill_rule::FillRule;
use i_overlay::core::overlay::{Overlay, ShapeType};
use i_overlay::core::overlay_rule::OverlayRule;
use nalgebra::Point2;

use crate::boolean::{self, Side, Windings};
use crate::grid::{GridPoint, STEPS_PER_MM, mm, snap};
use crate::simplify::simplify_ring;

/// One closed ring; the last point is joined to the first.
pub type Ring = Vec<GridPoint>;

/// An outer ring and the holes in it.
pub type Island = Vec<Ring>;

/// Which windings are inside when rings overlap.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fill {
    /// Every place that is wound round at all: overlapping solids merge, and a solid turned inside
    /// out still counts.
    NonZero,
    /// Places wound round counter-clockwise more often than clockwise.
    Positive,
}

/// A planar area, possibly empty. See the [module](self).
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Region {
    islands: Vec<Island>,
}

/// A part of a segment that lies inside a region or outside, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Part {
    /// Where it begins.
    pub from: Point2<f64>,
    /// Where it ends.
    pub to: Point2<f64>,
    /// Whether it lies inside.
    pub inside: bool,
}

impl Part {
    /// Returns its length.
    #[must_use]
    pub fn length(&self) -> f64 {
        (self.to - self.from).norm()
    }
}

/// The least and greatest coordinates of a region, in grid steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct GridBounds {
    /// The least corner.
    pub min: GridPoint,
    /// The greatest corner.
    pub max: GridPoint,
}

impl Region {
    /// Returns the area that `rings` (mm) enclose; overlaps and crossings are resolved by `fill`.
    #[must_use]
    pub fn from_rings<'a>(rings: impl IntoIterator<Item = &'a [Point2<f64>]>, fill: Fill) -> Self {
        let rings: Vec<Ring> =
            rings.into_iter().map(|ring| ring.iter().map(snap).collect()).collect();
        Self::from_grid_rings(&rings, fill)
    }

    /// Like [`from_rings`](Self::from_rings), for rings already on the grid.
    #[must_use]
    pub fn from_grid_rings(rings: &[Ring], fill: Fill) -> Self {
        let all = rings.iter().map(|ring| (ring.as_slice(), Side::Subject));
        let resolved = boolean::resolved(all, |windings| match fill {
            Fill::NonZero => windings.subject != 0,
            Fill::Positive => windings.subject > 0,
        });
        resolved.map_or_else(|| Self::swept(rings, fill), |islands| Self { islands })
    }

    /// The overlay engine's answer.
    fn swept(rings: &[Ring], fill: Fill) -> Self {
        let mut overlay = Overlay::new(rings.iter().map(Vec::len).sum());
        for ring in rings {
            overlay.add_contour(ring, ShapeType::Subject);
        }
        Self { islands: overlay.overlay(OverlayRule::Subject, engine_rule(fill)) }
    }

    /// Returns the region of one island, as handed out by [`islands`](Self::islands).
    #[must_use]
    pub fn from_island(island: Island) -> Self {
        Self { islands: vec![island] }
    }

    /// Returns whether there is nothing in it.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.islands.is_empty()
    }

    /// Returns the islands: outer ring first, holes after it.
    #[must_use]
    pub fn islands(&self) -> &[Island] {
        &self.islands
    }

    /// Returns all rings, island by island.
    pub fn rings(&self) -> impl Iterator<Item = &Ring> {
        self.islands.iter().flatten()
    }

    /// Returns the number of points of all rings.
    #[must_use]
    pub fn point_count(&self) -> usize {
        self.rings().map(Vec::len).sum()
    }

    /// Returns the area, mm².
    #[must_use]
    pub fn area(&self) -> f64 {
        self.rings().map(|ring| signed_area(ring)).sum()
    }

    /// Returns the length of all rings, mm.
    #[must_use]
    pub fn perimeter(&self) -> f64 {
        self.rings().map(|ring| ring_length(ring)).sum()
    }

    /// Returns the bounding box; `None` when empty.
    #[must_use]
    pub fn bounds(&self) -> Option<GridBounds> {
        bounds_of(self.islands.iter().filter_map(|island| island.first()).flatten())
    }

    /// Returns what lies in either region.
    #[must_use]
    pub fn union(&self, other: &Self) -> Self {
        match (self.is_empty(), other.is_empty()) {
            (true, _) => other.clone(),
            (_, true) => self.clone(),
            _ => self.combined(other, OverlayRule::Union),
        }
    }

    /// Returns what lies in both regions.
    #[must_use]
    pub fn intersection(&self, other: &Self) -> Self {
        if self.is_empty() || other.is_empty() || !self.boxes_meet(other) {
            return Self::default();
        }
        self.combined(other, OverlayRule::Intersect)
    }

    /// Returns what lies in this region and not in `other`.
    #[must_use]
    pub fn difference(&self, other: &Self) -> Self {
        if self.is_empty() || other.is_empty() || !self.boxes_meet(other) {
            return self.clone();
        }
        self.combined(other, OverlayRule::Difference)
    }

    /// Returns the region with rings thinned out to within `tolerance` (mm); rings that collapse
    /// are dropped. Crossings that thinning may cause between close rings are resolved.
    #[must_use]
    pub fn simplified(&self, tolerance: f64) -> Self {
        let rings: Vec<Ring> = self
            .rings()
            .map(|ring| simplify_ring(ring, tolerance))
            .filter(|ring| ring.len() >= 3)
            .collect();
        Self::from_grid_rings(&rings, Fill::Positive)
    }

    /// Returns the region with rings thinned out to within `tolerance` (mm), and nothing resolved:
    /// rings closer than that may touch or cross. For regions that go into a boolean or an offset
    /// next, which resolve it, and never out to toolpaths.
    #[must_use]
    pub fn thinned(&self, tolerance: f64) -> Self {
        let thin = |island: &Island| -> Island {
            let mut rings: Island =
                island.iter().map(|ring| simplify_ring(ring, tolerance)).collect();
            // An outer ring that collapsed takes its holes along.
            if rings.first().is_none_or(|outer| outer.len() < 3) {
                rings.clear();
            }
            rings.retain(|ring| ring.len() >= 3);
            rings
        };
        let islands = self.islands.iter().map(thin).filter(|island| !island.is_empty());
        Self { islands: islands.collect() }
    }

    /// Returns the islands of these numbers, in their order.
    ///
    /// # Panics
    ///
    /// When there is no island of a number.
    #[must_use]
    pub fn selected(&self, numbers: &[u32]) -> Self {
        Self { islands: numbers.iter().map(|&k| self.islands[k as usize].clone()).collect() }
    }

    /// Returns the islands that `keep` accepts.
    #[must_use]
    pub fn filtered(&self, keep: impl Fn(&&Island) -> bool) -> Self {
        Self { islands: self.islands.iter().filter(keep).cloned().collect() }
    }

    /// Returns the region without the islands smaller than `least_area` (mm²).
    #[must_use]
    pub fn without_small_islands(&self, least_area: f64) -> Self {
        self.filtered(|island| {
            island.iter().map(|ring| signed_area(ring)).sum::<f64>() >= least_area
        })
    }

    /// Returns whether the point (mm) lies inside; undecided exactly on a ring.
    #[must_use]
    pub fn contains(&self, p: &Point2<f64>) -> bool {
        self.islands.iter().any(|island| is_inside(island, p))
    }

    /// Returns whether the whole segment from `a` to `b` (mm) lies inside.
    #[must_use]
    pub fn contains_segment(&self, a: &Point2<f64>, b: &Point2<f64>) -> bool {
        let crosses =
            |ring: &Ring| ring_sides(ring).any(|(c, d)| segments_cross(a, b, &mm(c), &mm(d)));
        self.contains(a) && !self.rings().any(crosses)
    }

    /// Returns the segment from `a` to `b` (mm) cut where it meets a ring, in order.
    #[must_use]
    pub fn parts(&self, a: &Point2<f64>, b: &Point2<f64>) -> Vec<Part> {
        let sides = self.rings().flat_map(|ring| ring_sides(ring)).map(|(c, d)| [mm(c), mm(d)]);
        parts(a, b, sides, |p| self.contains(p))
    }

    /// Checks what the module promises of every region: rings of three points or more, outer rings
    /// counter-clockwise, holes clockwise. For tests.
    ///
    /// # Panics
    ///
    /// When a promise is broken.
    pub fn check(&self) {
        for island in &self.islands {
            assert!(!island.is_empty(), "an island has an outer ring");
            for (k, ring) in island.iter().enumerate() {
                assert!(ring.len() >= 3, "a ring has three points");
                let area = signed_area(ring);
                assert!(if k == 0 { area > 0.0 } else { area < 0.0 }, "ring {k} has area {area}");
            }
        }
    }

    fn combined(&self, other: &Self, rule: OverlayRule) -> Self {
        let subject = self.rings().map(|ring| (ring.as_slice(), Side::Subject));
        let clip = other.rings().map(|ring| (ring.as_slice(), Side::Clip));
        let both = subject.chain(clip);
        let resolved = boolean::resolved(both, |windings| wanted(rule, windings));
        resolved.map_or_else(|| self.swept_with(other, rule), |islands| Self { islands })
    }

    /// The overlay engine's answer.
    fn swept_with(&self, other: &Self, rule: OverlayRule) -> Self {
        let mut overlay = Overlay::from_subj_and_clip(&self.islands, &other.islands);
        Self { islands: overlay.overlay(rule, FillRule::NonZero) }
    }

    fn boxes_meet(&self, other: &Self) -> bool {
        let (Some(a), Some(b)) = (self.bounds(), other.bounds()) else { return false };
        a.min.x <= b.max.x && b.min.x <= a.max.x && a.min.y <= b.max.y && b.min.y <= a.max.y
    }
}

fn bounds_of<'a>(mut points: impl Iterator<Item = &'a GridPoint>) -> Option<GridBounds> {
    let first = *points.next()?;
    let mut bounds = GridBounds { min: first, max: first };
    for p in points {
        bounds.min = GridPoint::new(bounds.min.x.min(p.x), bounds.min.y.min(p.y));
        bounds.max = GridPoint::new(bounds.max.x.max(p.x), bounds.max.y.max(p.y));
    }
    Some(bounds)
}

/// Whether places with these windings belong to a boolean of two regions.
fn wanted(rule: OverlayRule, windings: Windings) -> bool {
    let (subject, clip) = (windings.subject != 0, windings.clip != 0);
    match rule {
        OverlayRule::Union => subject || clip,
        OverlayRule::Intersect => subject && clip,
        _ => subject && !clip,
    }
}

fn engine_rule(fill: Fill) -> FillRule {
    match fill {
        Fill::NonZero => FillRule::NonZero,
        Fill::Positive => FillRule::Positive,
    }
}

/// Returns the sides of a ring as pairs of ends, the closing side last.
pub fn ring_sides(ring: &[GridPoint]) -> impl Iterator<Item = (GridPoint, GridPoint)> + '_ {
    let next = ring.iter().cycle().skip(1);
    ring.iter().zip(next).map(|(a, b)| (*a, *b))
}

/// Returns the signed area of a ring, mm²: positive when counter-clockwise.
#[must_use]
pub fn signed_area(ring: &[GridPoint]) -> f64 {
    let Some(&origin) = ring.first() else { return 0.0 };
    // Differences from one corner stay below 2^31, their products below 2^62: exact.
    let local =
        |p: GridPoint| (i64::from(p.x) - i64::from(origin.x), i64::from(p.y) - i64::from(origin.y));
    let twice: i128 = ring_sides(ring)
        .map(|(a, b)| {
            let ((ax, ay), (bx, by)) = (local(a), local(b));
            i128::from(ax * by - bx * ay)
        })
        .sum();
    twice as f64 / (2.0 * STEPS_PER_MM * STEPS_PER_MM)
}

/// Returns the length of a ring, mm.
#[must_use]
pub fn ring_length(ring: &[GridPoint]) -> f64 {
    ring_sides(ring).map(|(a, b)| (mm(b) - mm(a)).norm()).sum()
}

/// Returns the segment from `a` to `b` cut where it meets these sides, in order.
pub(crate) fn parts(
    a: &Point2<f64>,
    b: &Point2<f64>,
    sides: impl Iterator<Item = [Point2<f64>; 2]>,
    is_inside: impl Fn(&Point2<f64>) -> bool,
) -> Vec<Part> {
    let along = b - a;
    let mut cuts: Vec<f64> = Vec::new();
    for [c, d] in sides {
        let (c_side, d_side) = (along.perp(&(c - a)), along.perp(&(d - a)));
        if (c_side > 0.0) != (d_side > 0.0) {
            let meeting = c + (d - c) * (c_side / (c_side - d_side));
            cuts.push((meeting - a).dot(&along) / along.norm_squared());
        }
    }
    cuts.retain(|share| 0.0 < *share && *share < 1.0);
    cuts.sort_unstable_by(f64::total_cmp);
    let points: Vec<Point2<f64>> = std::iter::once(*a)
        .chain(cuts.iter().map(|share| a + along * *share))
        .chain([*b])
        .collect();
    let part = |ends: &[Point2<f64>]| Part {
        from: ends[0],
        to: ends[1],
        inside: is_inside(&nalgebra::center(&ends[0], &ends[1])),
    };
    points.windows(2).map(part).collect()
}

/// Returns whether two segments cross or touch, apart from rounding.
pub(crate) fn segments_cross(
    a: &Point2<f64>,
    b: &Point2<f64>,
    c: &Point2<f64>,
    d: &Point2<f64>,
) -> bool {
    let side = |p: &Point2<f64>, q: &Point2<f64>, r: &Point2<f64>| (q - p).perp(&(r - p));
    let (c_side, d_side) = (side(a, b, c), side(a, b, d));
    let (a_side, b_side) = (side(c, d, a), side(c, d, b));
    c_side * d_side <= 0.0 && a_side * b_side <= 0.0 && (c_side != d_side || a_side != b_side)
}

/// Returns whether a point (mm) lies inside an island; undecided exactly on a ring.
#[must_use]
pub fn is_inside(island: &Island, p: &Point2<f64>) -> bool {
    let mut inside = false;
    for ring in island {
        let Some(last) = ring.last() else { continue };
        let mut a = mm(*last);
        for b in ring {
            let b = mm(*b);
            if (a.y > p.y) != (b.y > p.y) {
                let x = a.x + (p.y - a.y) / (b.y - a.y) * (b.x - a.x);
                inside ^= p.x < x;
            }
            a = b;
        }
    }
    inside
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rectangle(x: f64, y: f64, width: f64, height: f64) -> Vec<Point2<f64>> {
        [[x, y], [x + width, y], [x + width, y + height], [x, y + height]].map(Point2::from).into()
    }

    fn region(rings: &[Vec<Point2<f64>>]) -> Region {
        let region = Region::from_rings(rings.iter().map(Vec::as_slice), Fill::NonZero);
        region.check();
        region
    }

    fn near(actual: f64, expected: f64) {
        assert!((actual - expected).abs() < 1e-6, "{actual} is not {expected}");
    }

    #[test]
    fn nesting_gives_islands_and_holes() {
        let mut hole = rectangle(1.0, 1.0, 8.0, 8.0);
        hole.reverse();
        let nested =
            region(&[rectangle(0.0, 0.0, 10.0, 10.0), hole, rectangle(4.0, 4.0, 2.0, 2.0)]);
        assert_eq!(nested.islands().len(), 2);
        near(nested.area(), 100.0 - 64.0 + 4.0);
        near(nested.perimeter(), 40.0 + 32.0 + 8.0);
        assert!(nested.contains(&Point2::new(5.0, 5.0)));
        assert!(!nested.contains(&Point2::new(2.0, 2.0)));
    }

    /// A wavy ring about (x, y), grid steps.
    fn wavy(x: i32, y: i32, radius: f64, corners: u32, seed: f64) -> Ring {
        (0..corners)
            .map(|k| {
                let angle = std::f64::consts::TAU * f64::from(k) / f64::from(corners) + seed;
                let radius = radius * (1.0 + 0.1 * (angle * 5.0 + seed).sin());
                GridPoint::new(x + (radius * angle.cos()) as i32, y + (radius * angle.sin()) as i32)
            })
            .collect()
    }

    #[test]
    fn rings_that_do_not_cross_give_what_the_sweep_gives() {
        for seed in 0..60 {
            let seed = f64::from(seed) * 0.7;
            let mut rings = vec![
                wavy(0, 0, 100_000.0, 40, seed),
                wavy(20_000, 0, 30_000.0, 20, seed + 1.0),
                wavy(-50_000, 20_000, 9_000.0, 20, seed + 2.0),
                wavy(20_000, 1_000, 10_000.0, 9, seed + 3.0),
                wavy(300_000, 1_000, 90_000.0, 30, seed + 4.0),
                wavy(-300_000, 1_000, 90_000.0, 30, seed + 4.0),
            ];
            rings[1].reverse();
            rings[2].reverse();
            // A point twice, and one in the middle of a straight side.
            let twice = rings[0][3];
            rings[0].insert(3, twice);
            let (a, b) = (rings[4][0], rings[4][1]);
            let half = ((b.x - a.x) / 2, (b.y - a.y) / 2);
            rings[4][1] = GridPoint::new(a.x + 2 * half.0, a.y + 2 * half.1);
            rings[4].insert(1, GridPoint::new(a.x + half.0, a.y + half.1));
            for fill in [Fill::NonZero, Fill::Positive] {
                let region = Region::from_grid_rings(&rings, fill);
                assert_eq!(region, Region::swept(&rings, fill));
                assert_eq!(region.islands().len(), 4);
            }
            let region = Region::from_grid_rings(&rings, Fill::Positive);
            let inner = region.inset(0.02);
            for other in [&inner, &Region::from_grid_rings(&rings[3..4], Fill::Positive)] {
                for rule in [OverlayRule::Union, OverlayRule::Intersect, OverlayRule::Difference] {
                    assert_eq!(region.combined(other, rule), region.swept_with(other, rule));
                }
            }
        }
    }

    /// What lies in only one of two regions, mm².
    fn differing(a: &Region, b: &Region) -> f64 {
        let rest = |a: &Region, b: &Region| a.swept_with(b, OverlayRule::Difference).area();
        rest(a, b) + rest(b, a)
    }

    /// Rings of `corners` corners whose steps are drawn from a small generator, and which cross
    /// themselves and each other.
    fn tangled(seed: u64, rings: usize, corners: usize) -> Vec<Ring> {
        let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
        let mut draw = |reach: i32| {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 33) as i32 % reach
        };
        let ring = |draw: &mut dyn FnMut(i32) -> i32| -> Ring {
            let (x, y, size) = (draw(300_000), draw(300_000), 20_000 + draw(150_000).abs());
            (0..corners).map(|_| GridPoint::new(x + draw(size), y + draw(size))).collect()
        };
        (0..rings).map(|_| ring(&mut draw)).collect()
    }

    #[test]
    fn rings_that_cross_give_what_the_sweep_gives() {
        let mut without_sweep = 0;
        for seed in 0..400_u64 {
            let rings = tangled(seed, 1 + seed as usize % 4, 3 + seed as usize % 9);
            let length: f64 = rings.iter().map(|ring| ring_length(ring)).sum();
            // Each crossing may be rounded by a step, the other way than the engine does.
            let rounding = length * 2.0 / STEPS_PER_MM;
            for fill in [Fill::NonZero, Fill::Positive] {
                let all = rings.iter().map(|ring| (ring.as_slice(), Side::Subject));
                without_sweep += usize::from(
                    boolean::resolved(all, |windings| match fill {
                        Fill::NonZero => windings.subject != 0,
                        Fill::Positive => windings.subject > 0,
                    })
                    .is_some(),
                );
                let region = Region::from_grid_rings(&rings, fill);
                region.check();
                assert!(differing(&region, &Region::swept(&rings, fill)) <= rounding, "{seed}");
            }
            let region = Region::from_grid_rings(&rings, Fill::Positive);
            let others = tangled(seed + 1000, 3, 5);
            let other = Region::from_grid_rings(&others, Fill::NonZero);
            let rounding = rounding + other.perimeter() * 2.0 / STEPS_PER_MM;
            for rule in [OverlayRule::Union, OverlayRule::Intersect, OverlayRule::Difference] {
                let (ours, swept) =
                    (region.combined(&other, rule), region.swept_with(&other, rule));
                ours.check();
                assert!(differing(&ours, &swept) <= rounding, "{seed} {rule:?}");
            }
        }
        assert!(without_sweep > 400, "only {without_sweep} of 800 without a sweep");
    }

    /// Layers between upright walls share rings, whole: as outlines, as holes, or as the hole of one that
    /// the other fills.
    #[test]
    fn regions_with_rings_in_common_need_no_sweep() {
        for seed in 0..40 {
            let seed = f64::from(seed) * 0.7;
            let turned = |mut ring: Ring| {
                ring.reverse();
                ring
            };
            let outer = wavy(0, 0, 100_000.0, 40, seed);
            let shared = turned(wavy(40_000, 0, 20_000.0, 20, seed + 1.0));
            let own = turned(wavy(-40_000, 0, 20_000.0, 20, seed + 2.0));
            let plug = turned(own.clone());
            let of = |rings: &[&Ring]| {
                let rings: Vec<Ring> = rings.iter().map(|ring| (*ring).clone()).collect();
                Region::from_grid_rings(&rings, Fill::Positive)
            };
            // A hole that crosses one of the other, beside rings in common.
            let crossing = turned(wavy(-25_000, 7_000, 20_000.0, 20, seed + 3.0));
            let one = of(&[&outer, &shared, &own]);
            for other in [of(&[&outer, &shared]), of(&[&plug]), of(&[&outer]), one.clone()] {
                for rule in [OverlayRule::Union, OverlayRule::Intersect, OverlayRule::Difference] {
                    for (a, b) in [(&one, &other), (&other, &one)] {
                        let subject = a.rings().map(|ring| (ring.as_slice(), Side::Subject));
                        let clip = b.rings().map(|ring| (ring.as_slice(), Side::Clip));
                        let resolved = boolean::resolved(subject.chain(clip), |windings| {
                            wanted(rule, windings)
                        });
                        let resolved = resolved.expect("rings only coincide");
                        assert_eq!(resolved, a.swept_with(b, rule).islands, "{seed} {rule:?}");
                    }
                }
            }
            let other = of(&[&outer, &shared, &crossing]);
            for rule in [OverlayRule::Union, OverlayRule::Intersect, OverlayRule::Difference] {
                let (ours, swept) = (one.combined(&other, rule), one.swept_with(&other, rule));
                ours.check();
                let rounding = crossing_rounding(&one, &other);
                assert!(differing(&ours, &swept) <= rounding, "{seed} {rule:?}");
            }
        }
    }

    /// What the rounding of crossings may change of a boolean, mm²: each by a step, the other way than the
    /// engine does.
    fn crossing_rounding(one: &Region, other: &Region) -> f64 {
        (one.perimeter() + other.perimeter()) * 2.0 / STEPS_PER_MM
    }

    #[test]
    fn area_identities_hold() {
        let a = region(&[rectangle(0.0, 0.0, 10.0, 10.0)]);
        let b = region(&[rectangle(4.0, 5.0, 10.0, 3.0)]);
        near(a.intersection(&b).area(), 18.0);
        near(a.union(&b).area() + a.intersection(&b).area(), a.area() + b.area());
        near(a.difference(&b).area(), a.area() - 18.0);
    }

    #[test]
    fn reversed_solid_still_counts_and_overlaps_merge() {
        let mut reversed = rectangle(5.0, 0.0, 10.0, 10.0);
        reversed.reverse();
        near(region(&[rectangle(20.0, 0.0, 1.0, 1.0), reversed]).area(), 101.0);
        near(
            region(&[rectangle(0.0, 0.0, 10.0, 10.0), rectangle(5.0, 0.0, 10.0, 10.0)]).area(),
            150.0,
        );
    }

    #[test]
    fn a_segment_is_cut_at_the_rings() {
        let mut hole = rectangle(4.0, 4.0, 2.0, 2.0);
        hole.reverse();
        let frame = region(&[rectangle(0.0, 0.0, 10.0, 10.0), hole]);
        let parts = frame.parts(&Point2::new(-1.0, 5.0), &Point2::new(8.0, 5.0));
        let shown: Vec<(f64, bool)> =
            parts.iter().map(|part| (part.length(), part.inside)).collect();
        assert_eq!(shown, [(1.0, false), (4.0, true), (2.0, false), (2.0, true)]);
        let away = frame.parts(&Point2::new(20.0, 0.0), &Point2::new(20.0, 5.0));
        assert_eq!((away.len(), away[0].inside), (1, false));
    }

    #[test]
    fn segments_that_leave_are_noticed() {
        let mut hole = rectangle(4.0, 4.0, 2.0, 2.0);
        hole.reverse();
        let frame = region(&[rectangle(0.0, 0.0, 10.0, 10.0), hole]);
        let p = Point2::new;
        assert!(frame.contains_segment(&p(1.0, 1.0), &p(9.0, 1.0)));
        assert!(!frame.contains_segment(&p(1.0, 5.0), &p(9.0, 5.0)), "through the hole");
        assert!(!frame.contains_segment(&p(1.0, 1.0), &p(11.0, 1.0)), "out");
        assert!(!frame.contains_segment(&p(-2.0, 1.0), &p(12.0, 1.0)), "both ends outside");
    }
}

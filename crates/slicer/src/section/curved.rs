//! The cut by a curved layer: up to two crossings on a side, curves inside facets.
//!
//! All in convex coordinates (see [`Form`]), where the layer bounds a convex solid K. A vertex is
//! in K or not; the one exactly on the layer counts as above it. A side with one end in K is
//! crossed once; with both, never; with none, twice when it dips into K at its least place, or not
//! at all. A crossing is the number of the side doubled, plus one where the side, run from its lower
//! vertex to the higher, leaves K.
//!
//! Around a facet crossings alternate. Each that leaves K is joined with the next, which enters: in
//! between the boundary of K runs through the facet. As each crossing leaves K in one facet of the
//! side and enters it in the other, it has one successor and one predecessor, and every outline
//! closes, whatever the rounding. A facet without crossings may still hold a closed curve around
//! its own least place.

use mesh::topology::Solid;
use nalgebra::Point3;

use super::Cutter;
use super::arc::Cut;
use super::chain::{Chain, Step, Trails};
use crate::surface::Form;
use geom::grid::snap;
use geom::region::Ring;

/// F on a solid, vertex by vertex.
#[derive(Clone, Copy)]
pub(super) struct Field<'a> {
    pub(super) solid: &'a Solid,
    pub(super) form: &'a Form,
    pub(super) vertex_levels: &'a [f64],
}

/// The least place of F inside a facet.
struct FacetLow {
    at: Point3<f64>,
    value: f64,
}

/// How far F at a computed crossing may be from that of the layer, relative to 1 mm more than its
/// own size: ten times what rounding makes of well-conditioned crossings. Beyond it, the crossing
/// is found again by bisection.
const RESIDUAL: f64 = 1e-10;

/// Bisections from a whole side down to its last bit.
const BISECTIONS: u32 = 60;

impl Field<'_> {
    /// The least F of a facet when that is not at one of its corners.
    pub(super) fn low(&self, facet: u32) -> Option<f64> {
        let vertices = self.solid.mesh().triangles[facet as usize];
        let values = vertices.map(|v| self.value(v));
        let lowest = least_of(&values);
        let from = self.at(vertices[lowest]);
        // F that rises from the lowest corner along both sides rises into the facet: only a corner
        // on the axis of cones may have a furrow between.
        let falls = |k: usize| {
            let to = self.at(vertices[(lowest + k) % 3]);
            self.form.falls_towards(&from, values[lowest], &to)
        };
        if !falls(1) && !falls(2) && (from.x != 0.0 || from.y != 0.0) {
            return None;
        }
        let corners = vertices.map(|v| self.at(v));
        let dips = |i: usize, j: usize| {
            let (low, high) = if values[i] <= values[j] { (i, j) } else { (j, i) };
            self.form.falls_towards(&corners[low], values[low], &corners[high])
        };
        let on_sides = [(0, 1), (1, 2), (2, 0)]
            .into_iter()
            .filter(|&(i, j)| dips(i, j))
            .filter_map(|(i, j)| self.side_low(vertices[i], vertices[j]));
        let least = on_sides.reduce(f64::min)?;
        Some(self.facet_low(facet).map_or(least, |low| low.value.min(least)))
    }

    /// F at the least place inside the side between two vertices, if it has one. Always computed
    /// from the lower vertex to the higher: both facets must decide alike.
    fn side_low(&self, v: u32, w: u32) -> Option<f64> {
        let (low, high) = (v.min(w), v.max(w));
        let ((a, b), (value_a, value_b)) =
            ((self.at(low), self.at(high)), (self.value(low), self.value(high)));
        // F that falls from the end where it is less must rise again.
        let dips = if value_a <= value_b {
            self.form.falls_towards(&a, value_a, &b)
        } else {
            self.form.falls_towards(&b, value_b, &a)
        };
        if !dips {
            return None;
        }
        let t = self.form.lowest_on_line(&a, &(b - a)).filter(|t| 0.0 < *t && *t < 1.0)?;
        Some(self.form.value(&a.lerp(&b, t))).filter(|least| *least < value_a.min(value_b))
    }

    /// The least place inside a facet, if it has one. Only facets with a dipping side do: from the
    /// lowest corner F must fall into the facet, hence into a side, whose other end is higher.
    fn facet_low(&self, facet: u32) -> Option<FacetLow> {
        let corners = self.solid.mesh().triangles[facet as usize].map(|v| self.at(v));
        let normal = (corners[1] - corners[0]).cross(&(corners[2] - corners[0]));
        let lowest = self.form.lowest_in_plane(&corners[0], &normal)?;
        let is_inside = (0..3).all(|k| {
            let side = corners[(k + 1) % 3] - corners[k];
            side.cross(&(lowest - corners[k])).dot(&normal) > 0.0
        });
        is_inside.then(|| FacetLow { at: lowest, value: self.form.value(&lowest) })
    }

    /// A vertex, in convex coordinates.
    fn at(&self, v: u32) -> Point3<f64> {
        self.form.convex(&self.solid.mesh().vertices[v as usize])
    }

    fn value(&self, v: u32) -> f64 {
        self.form.value_of_level(self.vertex_levels[v as usize])
    }
}

fn least_of(values: &[f64; 3]) -> usize {
    let [a, b, c] = *values;
    if a <= b && a <= c {
        0
    } else if b <= c {
        1
    } else {
        2
    }
}

/// One cut of a solid by a curved layer.
pub(super) struct CurvedCut<'a> {
    cutter: &'a Cutter<'a>,
    form: &'a Form,
    field: Field<'a>,
    /// Level of the layer.
    level: f64,
    /// F of the layer.
    pub(super) value: f64,
    /// How far outlines may lie from the curves, mm.
    tolerance: f64,
}

impl<'a> CurvedCut<'a> {
    pub(super) fn new(cutter: &'a Cutter<'a>, level: f64, tolerance: f64) -> Self {
        let form = &cutter.form;
        let field = cutter.field();
        Self { cutter, form, field, level, value: form.value_of_level(level), tolerance }
    }

    /// Appends the ways of the outlines through a facet, and the facet itself to `closed` when it
    /// holds a closed curve.
    pub(super) fn steps(&self, facet: u32, steps: &mut Vec<Step>, closed: &mut Vec<u32>) {
        let corners = self.cutter.solid.mesh().triangles[facet as usize];
        let inside = corners.map(|v| self.holds_vertex(v));
        if inside == [true; 3] {
            return;
        }
        let sides = self.cutter.solid.sides()[facet as usize];
        let mut crossings = [(0, false); 6];
        let mut count = 0;
        let mut add = |side: u32, is_backwards: bool, leaves: bool| {
            crossings[count] = (2 * side + u32::from(leaves != is_backwards), leaves);
            count += 1;
        };
        for (from, to, side) in self.round() {
            let is_backwards = corners[from] > corners[to];
            match (inside[from], inside[to]) {
                (true, true) => {}
                (true, false) => add(sides[side], is_backwards, true),
                (false, true) => add(sides[side], is_backwards, false),
                (false, false) => {
                    if self.dips(corners[from], corners[to]) {
                        add(sides[side], is_backwards, false);
                        add(sides[side], is_backwards, true);
                    }
                }
            }
        }
        for (k, &(leave, leaves)) in crossings[..count].iter().enumerate() {
            if leaves {
                let (enter, _) = crossings[(k + 1) % count];
                steps.push(Step { enter, leave, facet });
            }
        }
        // Facets come here without crossings only when they dip below their corners.
        if count == 0 && self.field.facet_low(facet).is_some_and(|low| low.value < self.value) {
            closed.push(facet);
        }
    }

    /// Whether the side between two vertices outside K reaches into it.
    pub(super) fn dips(&self, v: u32, w: u32) -> bool {
        self.field.side_low(v, w).is_some_and(|least| least < self.value)
    }

    /// The corners of a facet in pairs with their side, counter-clockwise in convex coordinates.
    fn round(&self) -> [(usize, usize, usize); 3] {
        if self.form.is_mirrored() {
            [(0, 2, 2), (2, 1, 1), (1, 0, 0)]
        } else {
            [(0, 1, 0), (1, 2, 1), (2, 0, 2)]
        }
    }

    /// Whether a vertex lies in K.
    pub(super) fn holds_vertex(&self, v: u32) -> bool {
        (self.cutter.vertex_levels[v as usize] < self.level) != self.form.is_mirrored()
    }

    /// The outlines in the chart.
    pub(super) fn chains(&self, trails: &Trails, closed: &[u32]) -> Vec<Chain> {
        let mut inner = Vec::new();
        let outlines = trails.outlines.iter().map(|(range, is_closed)| {
            let steps = &trails.steps[range.clone()];
            Chain { points: self.points(steps, *is_closed, &mut inner), closed: *is_closed }
        });
        let mut chains: Vec<Chain> = outlines.collect();
        chains.extend(closed.iter().filter_map(|&facet| {
            let low = self.field.facet_low(facet)?;
            let curve = self.cut(facet).closed_curve(&low.at);
            Some(Chain { points: curve.iter().map(|p| self.chart(p)).collect(), closed: true })
        }));
        chains
    }

    fn points(&self, steps: &[Step], is_closed: bool, inner: &mut Vec<Point3<f64>>) -> Ring {
        let mut ring = Ring::with_capacity(steps.len() + 1);
        let Some(&first) = steps.first() else { return ring };
        let begin = self.crossing(first.enter);
        let mut enter = begin;
        for (k, step) in steps.iter().enumerate() {
            let is_last = k + 1 == steps.len();
            let leave = if is_last && is_closed { begin } else { self.crossing(step.leave) };
            ring.push(self.chart(&enter));
            inner.clear();
            let sides =
                || [step.enter, step.leave].map(|crossing| self.place(step.facet, crossing));
            self.cut(step.facet).between(&enter, &leave, sides, inner);
            ring.extend(inner.iter().map(|p| self.chart(p)));
            if is_last && !is_closed {
                ring.push(self.chart(&leave));
            }
            enter = leave;
        }
        ring
    }

    /// Which side of the facet, counted as [`round`](Self::round) does, a crossing lies on.
    pub(super) fn place(&self, facet: u32, crossing: u32) -> usize {
        let sides = self.cutter.solid.sides()[facet as usize];
        self.round().iter().position(|&(_, _, side)| sides[side] == crossing / 2).unwrap_or(0)
    }

    pub(super) fn cut(&self, facet: u32) -> Cut<'_> {
        let corners = self.cutter.solid.mesh().triangles[facet as usize];
        let ordered = self.round().map(|(from, _, _)| self.field.at(corners[from]));
        Cut::new(self.form, self.value, ordered, self.tolerance)
    }

    fn chart(&self, p: &Point3<f64>) -> geom::grid::GridPoint {
        snap(&self.cutter.surface.flatten(&self.form.convex(p)))
    }

    /// Where a side meets the layer; computed from its lower vertex to its higher, so that both
    /// facets get the same bits.
    pub(super) fn crossing(&self, crossing: u32) -> Point3<f64> {
        let [low, high] = self.cutter.solid.ends(crossing / 2);
        let (a, b) = (self.field.at(low), self.field.at(high));
        let leaves = crossing % 2 == 1;
        let along = b - a;
        let quadratic = self.form.quadratic(self.value, &a, &along);
        let (mut from, mut to) = (0.0, 1.0);
        if !self.holds_vertex(low) && !self.holds_vertex(high) {
            let least = self.form.lowest_on_line(&a, &along).unwrap_or(0.5);
            if leaves {
                from = least;
            } else {
                to = least;
            }
        }
        let t = if leaves { quadratic.leaves() } else { quadratic.enters() };
        let near = a.lerp(&b, t.clamp(from, to));
        if quadratic.is_steep() || self.is_on_layer(&near) {
            return near;
        }
        a.lerp(&b, self.bisected(&a, &b, from, to, leaves))
    }

    fn is_on_layer(&self, p: &Point3<f64>) -> bool {
        let residual = (self.form.value(p) - self.value).abs();
        residual <= RESIDUAL * (1.0 + self.value.abs())
    }

    fn bisected(
        &self,
        a: &Point3<f64>,
        b: &Point3<f64>,
        mut from: f64,
        mut to: f64,
        leaves: bool,
    ) -> f64 {
        for _ in 0..BISECTIONS {
            let middle = f64::midpoint(from, to);
            let is_in = self.form.value(&a.lerp(b, middle)) < self.value;
            if is_in == leaves {
                from = middle;
            } else {
                to = middle;
            }
        }
        f64::midpoint(from, to)
    }
}

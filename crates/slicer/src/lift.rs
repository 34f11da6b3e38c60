//! From the chart of a layer to the part frame: where the nozzle runs, and how thick the bead is.
//!
//! Lines are straight between the stations of a toolpath, and a straight line of a chart is not:
//! it is halved until its pieces lie on the layer to within [`CHORD_MM`].
//!
//! Where layers begin on a flat floor, beads are as thick as [`stacking`](crate::stacking) says; where
//! the wedge there is too narrow for any bead, the layer above goes down to the floor instead.

use geom::grid::{GridPoint, mm};
use geom::polyline::distance_to_segment;
use geom::region::{Fill, Part, Region, ring_sides};
use nalgebra::{Point2, Point3, center};

use crate::bead::Bead;
use crate::blend::Side;
use crate::level::Level;
use crate::stacking::{Stair, WedgeRule, depth};
use crate::surface::LayerSurface;
use crate::toolpath::{Overhang, Station};

/// How far the straight pieces of a toolpath may leave their layer, mm. With the machine's own chord
/// tolerance on top, beads stay within 10 µm of their surface.
pub const CHORD_MM: f64 = 0.002;

/// How much thickness may differ from an even change along a piece, as a share of the layer's.
const EVEN_SHARE: f64 = 0.02;

/// Along a piece over edges of curved layers the ground may change by so much of a step at most: from
/// edge to edge its depth rises and falls, which three places of a piece over several edges may miss.
const SEEN_STEPS: f64 = 0.5;

/// Pieces are not cut shorter than this for their thickness, mm.
const SHORTEST_MM: f64 = 0.05;

/// Nor than this for their course, mm: on a layer of 45° that is as far as it can leave the layer by
/// [`CHORD_MM`], on the tip of a cone.
const SHORTEST_COURSE_MM: f64 = 2.0 * CHORD_MM;

/// Rounding of a height, mm: a layer that just reaches the ceiling is laid.
const CEILING_SLACK_MM: f64 = 1e-6;

/// The least printable thickness of a wedge, as a share of the layer's.
pub const LEAST_WEDGE_SHARE: f64 = 0.5;

/// How far from the border of a wedge on the floor places may be narrow, as a multiple of the least width
/// of a bead: the wedge itself, and as much again that its corners taper off in.
const NARROW_IN_WIDTHS: f64 = 2.0;

/// What is left bare counts from here, mm²: a quarter of a square millimetre under half a layer is the
/// volume of 0.3 mm of a bead.
const LEAST_BARE_MM2: f64 = 0.25;

/// By how much the depth of a place changes along a layer, at most: that of layers of 60°.
const STEEPEST_WEDGE: f64 = 1.75;

/// One layer in space. See the [module](self).
#[derive(Clone, Copy)]
pub struct Lift<'a> {
    /// The family of the layer.
    pub surface: &'a dyn LayerSurface,
    /// The layer.
    pub level: Level,
    /// Height of the flat floor that the layer begins on, mm; `None` where it has none.
    pub floor: Option<f64>,
    /// Height that no place of the layer's upper side is above, mm; `None` where it has none.
    pub ceiling: Option<f64>,
    /// The curved layers that a planar one lies on.
    pub stair: Option<Stair<'a>>,
    /// The layer below, where it is another surface than this one lifted.
    pub below: Option<Side>,
    /// Where the layer below leaves the floor bare because no bead fits there, in the chart of this one:
    /// here this layer goes down to the floor.
    pub bare: Option<&'a Region>,
}

impl Lift<'_> {
    /// Returns the point of the layer's upper side that the chart shows at `uv`.
    #[must_use]
    pub fn point(&self, uv: &Point2<f64>) -> Point3<f64> {
        self.surface.lift(self.level.upper, uv)
    }

    /// Returns how thick a bead is at a point of the upper side, mm; zero where none is laid.
    #[must_use]
    pub fn thickness(&self, at: &Point3<f64>) -> f64 {
        if let Some(stair) = &self.stair {
            return stair.thickness(at.x.hypot(at.y));
        }
        if let Some(below) = &self.below {
            return below.depth(self.surface, at);
        }
        let step = self.level.thickness();
        let full = step * self.surface.thickness_per_level(at);
        let Some(base) = self.floor else { return full };
        let rule = WedgeRule { base, least: LEAST_WEDGE_SHARE * full };
        rule.thickness(self.surface, at, step)
    }

    /// Returns the part of a region of the chart where the layer is thick enough to be laid, and
    /// below its ceiling.
    #[must_use]
    pub fn printable(&self, region: &Region) -> Region {
        let laid = self.where_holds(region, self.floor.is_some(), |p| self.thickness(p) > 0.0);
        let ceiling = self.ceiling.unwrap_or(f64::INFINITY) + CEILING_SLACK_MM;
        self.where_holds(&laid, self.ceiling.is_some(), |p| p.z <= ceiling)
    }

    /// Returns the part of a region of the chart where the layer is as thick as everywhere, and one
    /// more such layer fits between it and the floor.
    #[must_use]
    pub fn clear_of_floor(&self, region: &Region) -> Region {
        let Some(floor) = self.floor else { return region.clone() };
        let upright = |p: &Point3<f64>| {
            self.level.thickness() * self.surface.thickness_per_level(p) / self.surface.slope_cos(p)
        };
        self.where_holds(region, true, |p| p.z - floor >= 2.0 * upright(p))
    }

    /// Returns where less than `least_width` (mm) of the layer lies between where it ends on the floor and a
    /// side of the part; `material` is its section, thick enough to be laid or not.
    #[must_use]
    pub fn too_narrow(&self, material: &Region, least_width: f64) -> Region {
        let (Some(_), Some(bounds)) = (self.floor, material.bounds()) else {
            return Region::default();
        };
        let corner = |p: GridPoint| mm(p).coords.abs();
        let reach = corner(bounds.min).sup(&corner(bounds.max)).norm();
        let is_laid = |s: f64| self.thickness(&self.point(&Point2::new(s, 0.0))) > 0.0;
        // From the border to where another side of the part no longer matters.
        let (border, inwards) = match (is_laid(0.0), is_laid(reach)) {
            (true, false) => (border(0.0, reach, is_laid), -least_width),
            (false, true) => (border(reach, 0.0, is_laid), least_width),
            _ => return Region::default(),
        };
        if !passes(material, border, border + NARROW_IN_WIDTHS * inwards) {
            return Region::default();
        }
        let rim = between(material, border, border + 2.0 * NARROW_IN_WIDTHS * inwards);
        let chart = self.surface.chart(self.level.upper);
        let held = chart.outset(&chart.opened(&rim, least_width / 2.0), least_width / 2.0);
        // At its other side the rim has corners that the material has not.
        between(&rim.difference(&held), border, border + NARROW_IN_WIDTHS * inwards)
            .without_small_islands(LEAST_BARE_MM2)
    }

    /// The part of a region where a condition holds that changes once on the meridian: layers fall
    /// outwards all the way, or rise.
    fn where_holds(
        &self,
        region: &Region,
        is_limited: bool,
        holds: impl Fn(&Point3<f64>) -> bool,
    ) -> Region {
        let (true, Some(bounds)) = (is_limited, region.bounds()) else { return region.clone() };
        let corner = |p: GridPoint| mm(p).coords.abs();
        let reach = corner(bounds.min).sup(&corner(bounds.max)).norm();
        let holds_at = |s: f64| holds(&self.point(&Point2::new(s, 0.0)));
        match (holds_at(0.0), holds_at(reach)) {
            (true, true) => region.clone(),
            (false, false) => Region::default(),
            (true, false) => region.intersection(&disc(border(0.0, reach, holds_at))),
            (false, true) => region.difference(&disc(border(reach, 0.0, holds_at))),
        }
    }

    /// Returns the stations of a line of the chart, whose beads are given for the full thickness;
    /// where the layer is thinner they become thinner, in the same place.
    #[must_use]
    pub fn stations(&self, line: &[(Point2<f64>, Bead)], closed: bool) -> Vec<Station> {
        let mut stations = Vec::with_capacity(line.len());
        let closing = closed.then(|| line.first()).flatten();
        for (k, from) in line.iter().enumerate() {
            stations.push(self.station(&from.0, from.1));
            if let Some(to) = line.get(k + 1).or(closing) {
                self.between(from, to, &mut stations);
            }
        }
        stations
    }

    /// Returns the stations of a closed line whose pieces hang over by known degrees.
    #[must_use]
    pub fn hanging_stations(&self, line: &[(Point2<f64>, Bead, Overhang)]) -> Vec<Station> {
        let mut stations = Vec::with_capacity(line.len());
        for (k, (at, bead, overhang)) in line.iter().enumerate() {
            let (to, to_bead, _) = line[(k + 1) % line.len()];
            let first = stations.len();
            stations.push(self.station(at, *bead));
            self.between(&(*at, *bead), &(to, to_bead), &mut stations);
            for station in &mut stations[first..] {
                station.overhang = *overhang;
            }
        }
        stations
    }

    /// Whether lines stay straight and beads as thick as the layer.
    fn is_even(&self) -> bool {
        let is_plain = self.floor.is_none() && self.stair.is_none() && self.below.is_none();
        is_plain && self.surface.form().is_flat()
    }

    fn station(&self, uv: &Point2<f64>, bead: Bead) -> Station {
        let overhang = Overhang::None;
        let at = self.point(uv);
        if self.is_even() {
            return Station { at, bead, overhang };
        }
        let thickness = match (&self.stair, self.floor.filter(|_| self.below.is_none())) {
            // The bead lies over edges of curved layers.
            (Some(stair), _) => stair.mean_thickness(at.x.hypot(at.y), bead.spacing()),
            (None, Some(base)) => self.mean_thickness(uv, bead.spacing(), base),
            (None, None) => self.thickness(&at),
        };
        if thickness == bead.thickness {
            return Station { at, bead, overhang };
        }
        Station { at, bead: Bead::with_spacing(bead.spacing(), thickness), overhang }
    }

    /// The mean thickness across a bead of a layer on a floor, mm: over a wedge it changes within the width
    /// of a bead, and over places that the layer below leaves bare the bead goes down to the floor.
    fn mean_thickness(&self, uv: &Point2<f64>, width: f64, base: f64) -> f64 {
        let at = self.point(uv);
        let nominal = self.level.thickness() * self.surface.thickness_per_level(&at);
        let rule = WedgeRule { base, least: LEAST_WEDGE_SHARE * nominal };
        let depth_here = depth(self.surface, &at, base);
        let shallowest = depth_here - width / 2.0 * STEEPEST_WEDGE;
        let s = uv.coords.norm();
        if self.bare.is_none() && shallowest > nominal + rule.least || s <= width {
            return rule.thickness_at_depth(depth_here, nominal);
        }
        let end = |share: f64| uv * (1.0 + share * width / s);
        let ends = (end(-0.5), end(0.5));
        let parts = match self.bare {
            Some(bare) => bare.parts(&ends.0, &ends.1),
            None => vec![Part { from: ends.0, to: ends.1, inside: false }],
        };
        let volume = parts.iter().map(|part| {
            let depths = [part.from, part.to].map(|p| depth(self.surface, &self.point(&p), base));
            let mean = if part.inside {
                f64::midpoint(depths[0], depths[1])
            } else {
                rule.mean_thickness(depths, nominal)
            };
            part.length() * mean
        });
        volume.sum::<f64>() / width
    }

    /// Appends the stations strictly between two points of the chart.
    fn between(
        &self,
        from: &(Point2<f64>, Bead),
        to: &(Point2<f64>, Bead),
        stations: &mut Vec<Station>,
    ) {
        if self.is_even() {
            return;
        }
        let ends = [self.station(&from.0, from.1), self.station(&to.0, to.1)];
        self.halve([from.0, to.0], ends, from.1, stations);
    }

    fn halve(
        &self,
        line: [Point2<f64>; 2],
        ends: [Station; 2],
        bead: Bead,
        stations: &mut Vec<Station>,
    ) {
        let [a, b] = &ends;
        let length = (b.at - a.at).norm();
        if length < SHORTEST_COURSE_MM {
            return;
        }
        let half = center(&line[0], &line[1]);
        let middle = self.station(&half, bead);
        let bulge = (middle.at - center(&a.at, &b.at)).norm();
        let uneven =
            (middle.bead.thickness - f64::midpoint(a.bead.thickness, b.bead.thickness)).abs();
        let is_known =
            uneven <= EVEN_SHARE * bead.thickness && self.is_seen([&a.at, &middle.at, &b.at]);
        let is_even = length < SHORTEST_MM || is_known;
        if bulge <= CHORD_MM && is_even {
            return;
        }
        self.halve([line[0], half], [*a, middle], bead, stations);
        stations.push(middle);
        self.halve([half, line[1]], [middle, *b], bead, stations);
    }

    /// Returns whether no edge of a curved layer below can run unseen between places of a piece.
    fn is_seen(&self, places: [&Point3<f64>; 3]) -> bool {
        let Some(stair) = &self.stair else { return true };
        let steps = places.map(|p| stair.steps(p.x.hypot(p.y)));
        let (least, most) =
            steps.into_iter().fold((f64::MAX, f64::MIN), |(a, b), s| (a.min(s), b.max(s)));
        most - least <= SEEN_STEPS
    }
}

/// The place between `inside`, where `holds` does, and `outside`, where it does not, at which that
/// changes.
fn border(mut inside: f64, mut outside: f64, holds: impl Fn(f64) -> bool) -> f64 {
    // A millimetre halved 40 times is far below a grid step.
    for _ in 0..40 {
        let middle = f64::midpoint(inside, outside);
        if holds(middle) {
            inside = middle;
        } else {
            outside = middle;
        }
    }
    inside
}

/// Whether an outline comes between these distances from the axis.
fn passes(region: &Region, a: f64, b: f64) -> bool {
    let (near, far) = (a.min(b), a.max(b));
    let origin = Point2::origin();
    region.rings().any(|ring| {
        ring_sides(ring).any(|(p, q)| {
            let (p, q) = (mm(p), mm(q));
            let most = p.coords.norm().max(q.coords.norm());
            most >= near && distance_to_segment(&p, &q, &origin) <= far
        })
    })
}

/// The part of a region between these distances from the axis.
fn between(region: &Region, a: f64, b: f64) -> Region {
    let (near, far) = (a.min(b), a.max(b));
    if far <= 0.0 {
        return Region::default();
    }
    let within = region.intersection(&disc(far));
    if near > 0.0 { within.difference(&disc(near)) } else { within }
}

/// A disc about the axis, to within [`CHORD_MM`].
fn disc(radius: f64) -> Region {
    let step = 2.0 * (1.0 - (CHORD_MM / radius).min(0.5)).acos();
    let count = (std::f64::consts::TAU / step).ceil();
    let point = |k: u32| {
        let angle = std::f64::consts::TAU * f64::from(k) / count;
        Point2::new(radius * angle.cos(), radius * angle.sin())
    };
    let ring: Vec<Point2<f64>> = (0..count as u32).map(point).collect();
    Region::from_rings([ring.as_slice()], Fill::NonZero)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::{Cone, Plane, Spheres};

    const BEAD: Bead = Bead { width: 0.45, thickness: 0.2 };

    fn line(points: &[[f64; 2]]) -> Vec<(Point2<f64>, Bead)> {
        points.iter().map(|&p| (Point2::from(p), BEAD)).collect()
    }

    /// A layer on nothing but the one below.
    fn free(surface: &dyn LayerSurface, level: Level) -> Lift<'_> {
        let (floor, ceiling, stair, below, bare) = (None, None, None, None, None);
        Lift { surface, level, floor, ceiling, stair, below, bare }
    }

    #[test]
    fn flat_lines_keep_their_points() {
        let level = Level { index: 3, lower: 0.6, upper: 0.8 };
        let lift = free(&Plane, level);
        let stations = lift.stations(&line(&[[-8.0, 1.0], [8.0, 1.0], [0.0, 9.0]]), true);
        assert_eq!(stations.len(), 3);
        assert!(stations.iter().all(|s| s.bead == BEAD && s.at.z == 0.8));
    }

    #[test]
    fn pieces_lie_on_their_layer() {
        let cone = Cone::new(0.5).unwrap();
        let spheres = Spheres::new(-20.0).unwrap();
        let families: [(&dyn LayerSurface, f64); 2] = [(&cone, 0.5_f64.cos()), (&spheres, 1.0)];
        for (surface, cos) in families {
            let level = Level { index: 0, lower: 20.0, upper: 20.0 + 0.2 / cos };
            let lift = free(surface, level);
            // The last passes the axis as near as lines of an infill may.
            let turns = [[-12.0, 3.0], [9.0, 3.0], [4.0, -11.0], [-0.0375, 0.001], [0.0625, 0.001]];
            let stations = lift.stations(&line(&turns), false);
            assert!((20..400).contains(&stations.len()), "{}", stations.len());
            for pair in stations.windows(2) {
                for share in [0.0, 0.25, 0.5, 0.75] {
                    let at = pair[0].at + (pair[1].at - pair[0].at) * share;
                    let off = (surface.level(&at) - level.upper).abs();
                    assert!(off < 1.2 * CHORD_MM / cos, "{off} at {at}");
                }
                assert!((pair[0].bead.thickness - 0.2).abs() < 1e-6);
            }
        }
    }

    /// Over layers that fall gently, edges lie several beads apart.
    #[test]
    fn beads_over_a_stair_are_as_thick_as_the_ground_is_deep_everywhere() {
        for angle in [4.0_f64, 6.0, 8.0, 15.0, 30.0] {
            let angle = angle.to_radians();
            let cone = Cone::new(angle).unwrap();
            let stair = Stair {
                surface: &cone,
                level: 9.1,
                step: 0.2 / angle.cos(),
                floor: 0.4,
                top: 9.4,
                least: 0.1,
            };
            let level = Level { index: 50, lower: 9.2, upper: 9.4 };
            let lift = Lift { stair: Some(stair), ..free(&Plane, level) };
            for k in 0..40 {
                let off = 0.4 * f64::from(k);
                let stations = lift.stations(&line(&[[-9.0, off - 6.0], [9.0, off]]), false);
                let mut wrong = 0.0;
                let mut length = 0.0;
                for pair in stations.windows(2) {
                    let along = pair[1].at - pair[0].at;
                    for i in 0..20 {
                        let share = (f64::from(i) + 0.5) / 20.0;
                        let at = pair[0].at + along * share;
                        let depth = stair.mean_thickness(at.x.hypot(at.y), BEAD.spacing());
                        let ends = [pair[0].bead.thickness, pair[1].bead.thickness];
                        let laid = ends[0] + (ends[1] - ends[0]) * share;
                        wrong += (laid - depth).abs() * along.norm() / 20.0;
                    }
                    length += along.norm();
                }
                assert!(wrong / length < 0.007, "{angle}, {off}: {} mm", wrong / length);
            }
        }
    }

    #[test]
    fn wedges_thin_out_and_end() {
        let angle = 30.0_f64.to_radians();
        let cone = Cone::new(angle).unwrap();
        let step = 0.2 / angle.cos();
        let level = Level { index: 0, lower: 5.0 - step, upper: 5.0 };
        let lift = Lift {
            surface: &cone,
            level,
            floor: Some(0.4),
            ceiling: None,
            stair: None,
            below: None,
            bare: None,
        };
        let at = |z: f64| Point3::new((5.0 - z) / angle.tan(), 0.0, z);
        assert!((lift.thickness(&at(3.0)) - 0.2).abs() < 1e-6);
        // tau of 0.15 mm: 0.13 mm above the floor.
        assert!((lift.thickness(&at(0.4 + 0.15 * angle.cos())) - 0.15).abs() < 1e-12);
        assert!((lift.thickness(&at(0.4 + 0.29 * angle.cos())) - 0.29).abs() < 1e-12);
        assert_eq!(lift.thickness(&at(0.4 + 0.09 * angle.cos())), 0.0);
        let rim = (5.0 - 0.4) / angle.tan() / angle.cos();
        let stations = lift.stations(&line(&[[0.0, 1.0], [rim - 0.22, 0.3]]), false);
        let thin = stations.iter().filter(|s| s.bead.thickness < 0.19).count();
        assert!(thin >= 1);
        for station in &stations {
            assert!((station.bead.spacing() - BEAD.spacing()).abs() < 1e-12);
        }
    }
}

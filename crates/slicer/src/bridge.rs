//! Bridges: solid areas with nothing below them, spanned by straight lines from one firm place to
//! another.
//!
//! For every direction the lines across the gap are looked at: one is *anchored* when a little
//! beyond either end the layer below is there. The direction in which the greatest share of the
//! gap's lines is anchored is taken, and among those nearly as good the one with the shortest
//! spans. A gap that no direction spans for the most part is an overhang and no bridge.
//!
//! On curved layers lines are straight as seen along the axis.

use geom::bands::Bands;
use geom::region::{Fill, Region};
use nalgebra::{Point2, Vector2};

use crate::chart::Chart;
use crate::infill::straight_lines;
use crate::skins::Skins;

/// An area that is spanned.
#[derive(Debug, Clone, PartialEq)]
pub struct Bridge {
    /// The gap, and the firm ground around it that lines reach onto.
    pub area: Region,
    /// Direction of the lines as seen along the axis, radians.
    pub angle: f64,
}

/// Directions that are tried, in half a turn.
const DIRECTIONS: u32 = 36;

/// A bridge has at least this share of its lines anchored at both ends.
const LEAST_ANCHORED: f64 = 0.5;

/// Directions anchored by less than this share worse than the best count as equally good.
const NEARLY_AS_GOOD: f64 = 0.03;

/// How far lines reach onto firm ground, in spacings.
const ANCHOR_IN_SPACINGS: f64 = 2.0;

/// Gaps narrower than this many spacings are spanned by any line.
const LEAST_GAP_IN_SPACINGS: f64 = 3.0;

/// Takes the bridges out of the solid areas of an island; `below` is the material of the layer
/// below, `spacing` that of the lines, mm.
#[must_use]
pub fn bridges(skins: &mut Skins, below: &Region, chart: &Chart, spacing: f64) -> Vec<Bridge> {
    let radius = LEAST_GAP_IN_SPACINGS * spacing / 2.0;
    let gaps = chart.opened(&skins.unsupported, radius);
    let mut bridges = Vec::new();
    for island in gaps.islands() {
        let gap = Region::from_island(island.clone());
        let Some(angle) = direction(&gap, below, chart, spacing) else { continue };
        let reach = chart.outset(&gap, ANCHOR_IN_SPACINGS * spacing);
        let take = |from: &mut Region| {
            let taken = from.intersection(&reach);
            if !taken.is_empty() {
                *from = from.difference(&reach);
            }
            taken
        };
        let area = take(&mut skins.top).union(&take(&mut skins.solid));
        let area = area.union(&take(&mut skins.sparse));
        if !area.is_empty() {
            bridges.push(Bridge { area, angle });
        }
    }
    bridges
}

/// The lines of a gap in one direction.
#[derive(Debug, Clone, Copy)]
struct Spans {
    angle: f64,
    /// Length of the anchored ones, as a share of all.
    anchored: f64,
    /// Length of the longest anchored one, mm.
    longest: f64,
}

/// The direction that spans a gap best; `None` where none does.
fn direction(gap: &Region, below: &Region, chart: &Chart, spacing: f64) -> Option<f64> {
    let near = below.intersection(&chart.outset(gap, 2.0 * ANCHOR_IN_SPACINGS * spacing));
    let (gap, near) = (chart.region_from_above(gap), chart.region_from_above(&near));
    let near = Bands::of(&near);
    let spans: Vec<Spans> = (0..DIRECTIONS)
        .map(|k| f64::from(k) * std::f64::consts::PI / f64::from(DIRECTIONS))
        .filter_map(|angle| spans(&gap, &near, angle, spacing))
        .collect();
    let best = spans.iter().map(|s| s.anchored).fold(0.0, f64::max);
    spans
        .iter()
        .filter(|s| s.anchored >= LEAST_ANCHORED && s.anchored >= best - NEARLY_AS_GOOD)
        .min_by(|a, b| a.longest.total_cmp(&b.longest).then(a.angle.total_cmp(&b.angle)))
        .map(|s| s.angle)
}

fn spans(gap: &Region, near: &Bands, angle: f64, spacing: f64) -> Option<Spans> {
    let along = Vector2::new(angle.cos(), angle.sin());
    let (mut all, mut anchored, mut longest) = (0.0, 0.0, 0.0_f64);
    for [from, to] in straight_lines(gap, spacing, angle) {
        let length = (to - from).norm();
        all += length;
        let sign = (to - from).dot(&along).signum();
        let beyond =
            |p: Point2<f64>, way: f64| near.contains(&(p + along * (way * sign * spacing)));
        if beyond(from, -1.0) && beyond(to, 1.0) {
            anchored += length;
            longest = longest.max(length);
        }
    }
    (anchored > 0.0).then(|| Spans { angle, anchored: anchored / all, longest })
}

/// Returns where gaps are spanned by straight lines of at most `longest` mm that are anchored at both
/// ends; `below` is the material of the layer below, `spacing` that of the lines, mm.
#[must_use]
pub fn spanned(gaps: &Region, below: &Region, chart: &Chart, spacing: f64, longest: f64) -> Region {
    let mut strips: Vec<Vec<Point2<f64>>> = Vec::new();
    let gaps = chart.opened(gaps, LEAST_GAP_IN_SPACINGS * spacing / 2.0);
    if gaps.is_empty() {
        return gaps;
    }
    let seen_below = Bands::of(&chart.region_from_above(below));
    for island in gaps.islands() {
        let gap = Region::from_island(island.clone());
        let Some(angle) = direction(&gap, below, chart, spacing) else { continue };
        let along = Vector2::new(angle.cos(), angle.sin());
        // A little wider than their distance, so that strips beside each other leave nothing.
        let aside = Vector2::new(-along.y, along.x) * (0.51 * spacing);
        let gap = chart.region_from_above(&gap);
        for [from, to] in straight_lines(&gap, spacing, angle) {
            let way = along * (to - from).dot(&along).signum() * spacing;
            let (from, to) = (from - way, to + way);
            let is_anchored = seen_below.contains(&from) && seen_below.contains(&to);
            if is_anchored && (to - from).norm() <= longest + 2.0 * spacing {
                strips.push(vec![from - aside, to - aside, to + aside, from + aside]);
            }
        }
    }
    let strips = Region::from_rings(strips.iter().map(Vec::as_slice), Fill::NonZero);
    chart.region_under(&strips)
}

/// Returns the places of an interior with nothing below, but for those narrower than a line;
/// `spacing` is that of the lines, mm.
#[must_use]
pub fn unsupported(interior: &Region, below: &Region, chart: &Chart, spacing: f64) -> Region {
    /// What simplified outlines of a vertical wall differ by.
    const NEGLIGIBLE_MM2: f64 = 0.01;
    let bare = interior.difference(below);
    if bare.area() <= NEGLIGIBLE_MM2 { Region::default() } else { chart.opened(&bare, spacing) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{FRAC_PI_2, PI};

    fn rectangle(x: [f64; 2], y: [f64; 2]) -> Region {
        let ring = [[x[0], y[0]], [x[1], y[0]], [x[1], y[1]], [x[0], y[1]]].map(Point2::from);
        Region::from_rings([ring.as_slice()], Fill::NonZero)
    }

    /// The bridges of an interior over a layer below.
    fn found(interior: &Region, below: &Region) -> (Vec<Bridge>, Skins) {
        let mut skins = Skins {
            solid: interior.clone(),
            unsupported: unsupported(interior, below, &Chart::Plane, 0.4),
            ..Skins::default()
        };
        (bridges(&mut skins, below, &Chart::Plane, 0.4), skins)
    }

    fn off(a: f64, b: f64) -> f64 {
        ((a - b + FRAC_PI_2).rem_euclid(PI) - FRAC_PI_2).abs()
    }

    #[test]
    fn lines_go_from_pillar_to_pillar() {
        // A plate on two walls 10 mm apart.
        let plate = rectangle([-8.0, 8.0], [-15.0, 15.0]);
        let walls =
            rectangle([-8.0, -5.0], [-15.0, 15.0]).union(&rectangle([5.0, 8.0], [-15.0, 15.0]));
        let (bridges, skins) = found(&plate, &walls);
        assert_eq!(bridges.len(), 1);
        assert!(off(bridges[0].angle, 0.0) < 0.01, "{}", bridges[0].angle);
        // Onto the walls by two lines on either side, and nothing twice.
        let area = bridges[0].area.area();
        assert!((area - (10.0 + 1.6) * 30.0).abs() < 2.0, "{area}");
        assert!((skins.solid.area() + area - plate.area()).abs() < 1e-3);
    }

    #[test]
    fn a_hole_is_spanned_the_short_way() {
        let plate = rectangle([-20.0, 20.0], [-20.0, 20.0]);
        let hole = rectangle([-12.0, 12.0], [-3.0, 3.0]);
        let (bridges, _) = found(&plate, &plate.difference(&hole));
        assert_eq!(bridges.len(), 1);
        assert!(off(bridges[0].angle, FRAC_PI_2) < 0.01, "{}", bridges[0].angle);
    }

    #[test]
    fn a_ledge_is_no_bridge_and_a_wall_none() {
        let plate = rectangle([0.0, 20.0], [0.0, 20.0]);
        let (bridges, skins) = found(&plate, &rectangle([0.0, 12.0], [0.0, 20.0]));
        assert!(bridges.is_empty(), "{bridges:?}");
        assert_eq!(skins.solid, plate);
        assert!(found(&plate, &plate).0.is_empty());
    }
}

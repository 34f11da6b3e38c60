//! How high the bed lies at each place, from scattered probes.
//!
//! Between the probes heights are interpolated by natural neighbours (R. Sibson, 1981: each probe
//! weighs as much as the area that a new point would take from its Voronoi cell), which reproduces
//! planes exactly and is smooth but at the probes. Outside of the hull of the probes the height is
//! that of the nearest point of the hull. The correction fades out linearly over a height, above
//! which layers are level again:
//!
//! `z_lift = z + (1 − z/fade)·h(q)` for `0 ≤ z ≤ fade`.
//!
//! Places are on the bed, mm from the axis of rotation, and turn with it.

use std::sync::Arc;

use nalgebra::{Point2, Vector2};
use spade::{DelaunayTriangulation, HasPosition, Triangulation};

/// Heights of the bed; flat unless probed.
#[derive(Debug, Clone, Default)]
pub struct HeightMap {
    shape: Option<Arc<Shape>>,
}

#[derive(Debug)]
struct Shape {
    probes: Vec<[f64; 3]>,
    fade: f64,
    greatest: f64,
    triangles: DelaunayTriangulation<Probe>,
}

#[derive(Debug, Clone, Copy)]
struct Probe {
    at: spade::Point2<f64>,
    height: f64,
}

impl HasPosition for Probe {
    type Scalar = f64;

    fn position(&self) -> spade::Point2<f64> {
        self.at
    }
}

/// Why probes are no height map.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum ProbeError {
    /// A number that is none, or no place on any bed.
    #[error("probe {index} is ({x}, {y}, {height}); each must be within {MOST_MM} mm")]
    OutOfRange {
        /// Counted from 0.
        index: usize,
        /// mm.
        x: f64,
        /// mm.
        y: f64,
        /// mm.
        height: f64,
    },
    /// The correction would turn heights over.
    #[error("the bed rises by {greatest} mm but the correction fades out over only {fade} mm")]
    FadesTooFast {
        /// Greatest height, mm.
        greatest: f64,
        /// mm.
        fade: f64,
    },
}

/// No bed is larger, mm from the axis.
const MOST_MM: f64 = 10_000.0;

/// The correction may use this share of the height over which it fades: more would squeeze layers
/// visibly.
const MOST_SQUEEZE: f64 = 0.5;

impl HeightMap {
    /// Returns the map of a bed with `[x, y, height]` at each probe, mm; none for a flat bed. Two
    /// probes at one place count as the later.
    ///
    /// # Errors
    ///
    /// [`ProbeError`].
    pub fn new(probes: &[[f64; 3]], fade: f64) -> Result<Self, ProbeError> {
        if probes.is_empty() {
            return Ok(Self::default());
        }
        let mut triangles = DelaunayTriangulation::new();
        let mut greatest: f64 = 0.0;
        for (index, &[x, y, height]) in probes.iter().enumerate() {
            let fault = ProbeError::OutOfRange { index, x, y, height };
            if ![x, y, height].iter().all(|n| n.is_finite() && n.abs() <= MOST_MM) {
                return Err(fault);
            }
            // A denormal coordinate is zero; the triangulation refuses it.
            let tame = |n: f64| if n.abs() < f64::MIN_POSITIVE.sqrt() { 0.0 } else { n };
            let at = spade::Point2::new(tame(x), tame(y));
            triangles.insert(Probe { at, height }).map_err(|_| fault)?;
            greatest = greatest.max(height.abs());
        }
        if greatest > MOST_SQUEEZE * fade {
            return Err(ProbeError::FadesTooFast { greatest, fade });
        }
        let shape = Shape { probes: probes.to_vec(), fade, greatest, triangles };
        Ok(Self { shape: Some(Arc::new(shape)) })
    }

    /// Returns whether the bed is taken as flat.
    #[must_use]
    pub fn is_flat(&self) -> bool {
        self.shape.is_none()
    }

    /// Returns the height above which nothing is corrected, mm.
    #[must_use]
    pub fn fade(&self) -> f64 {
        self.shape.as_ref().map_or(0.0, |shape| shape.fade)
    }

    /// Returns the greatest height of any probe, up or down, mm.
    #[must_use]
    pub fn greatest(&self) -> f64 {
        self.shape.as_ref().map_or(0.0, |shape| shape.greatest)
    }

    /// Returns how high the bed lies at a place on it, mm.
    #[must_use]
    pub fn height(&self, over_bed: &Vector2<f64>) -> f64 {
        let Some(shape) = &self.shape else { return 0.0 };
        let at = spade::Point2::new(over_bed.x, over_bed.y);
        let neighbours = shape.triangles.natural_neighbor();
        // Probes in a row span no triangle to interpolate in.
        let inside = (!shape.triangles.all_vertices_on_line())
            .then(|| neighbours.interpolate(|probe| probe.data().height, at))
            .flatten();
        inside.unwrap_or_else(|| shape.on_hull(&Point2::from(*over_bed)))
    }

    /// Returns the height of the lift that brings the nozzle `z` above the bed plane of the part.
    #[must_use]
    pub fn lift(&self, over_bed: &Vector2<f64>, z: f64) -> f64 {
        match self.share(z) {
            0.0 => z,
            share => z + share * self.height(over_bed),
        }
    }

    /// Returns how high the nozzle stands in the part when the lift stands at `lift`: the inverse
    /// of [`lift`](Self::lift).
    #[must_use]
    pub fn part_z(&self, over_bed: &Vector2<f64>, lift: f64) -> f64 {
        let Some(shape) = &self.shape else { return lift };
        if lift >= shape.fade {
            return lift;
        }
        let height = self.height(over_bed);
        let z = (lift - height) / (1.0 - height / shape.fade);
        // Below the bed plane the correction no longer grows.
        if z < 0.0 { lift - height } else { z }
    }

    /// The share of the correction that is left at a height.
    fn share(&self, z: f64) -> f64 {
        self.shape.as_ref().map_or(0.0, |shape| (1.0 - z / shape.fade).clamp(0.0, 1.0))
    }
}

impl Shape {
    /// The height of the nearest point of the hull.
    fn on_hull(&self, at: &Point2<f64>) -> f64 {
        let point = |probe: &Probe| Point2::new(probe.at.x, probe.at.y);
        let lone = self.triangles.vertices().next().map_or(0.0, |vertex| vertex.data().height);
        if self.triangles.num_vertices() < 2 {
            return lone;
        }
        self.triangles
            .convex_hull()
            .map(|edge| {
                let (from, to) = (edge.from(), edge.to());
                let (a, b) = (point(from.data()), point(to.data()));
                let along = b - a;
                let share = ((at - a).dot(&along) / along.norm_squared()).clamp(0.0, 1.0);
                let height = from.data().height * (1.0 - share) + to.data().height * share;
                ((a + along * share - at).norm_squared(), height)
            })
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .map_or(lone, |(_, height)| height)
    }
}

impl PartialEq for HeightMap {
    fn eq(&self, other: &Self) -> bool {
        let facts = |map: &Self| map.shape.as_ref().map(|shape| (shape.probes.clone(), shape.fade));
        facts(self) == facts(other)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn grid(height: impl Fn(f64, f64) -> f64) -> Vec<[f64; 3]> {
        (0..36)
            .map(|k| {
                let (x, y) = (f64::from(k % 6) * 40.0 - 100.0, f64::from(k / 6) * 40.0 - 100.0);
                [x, y, height(x, y)]
            })
            .collect()
    }

    #[test]
    fn a_tilted_bed_is_met_exactly() {
        let tilt = |x: f64, y: f64| 0.05 + 0.001 * x - 0.0015 * y;
        let map = HeightMap::new(&grid(tilt), 10.0).unwrap();
        for (x, y) in [(0.0, 0.0), (33.0, -71.0), (-99.0, 99.0), (20.0, 20.0)] {
            assert!((map.height(&Vector2::new(x, y)) - tilt(x, y)).abs() < 1e-9, "{x} {y}");
        }
        // Beyond the probes it goes on as at their rim.
        assert!((map.height(&Vector2::new(500.0, 13.0)) - tilt(100.0, 13.0)).abs() < 1e-12);
        assert!((map.height(&Vector2::new(500.0, 500.0)) - tilt(100.0, 100.0)).abs() < 1e-12);
    }

    #[test]
    fn few_probes_and_probes_in_a_row() {
        let at = |probes: &[[f64; 3]], x: f64, y: f64| {
            HeightMap::new(probes, 10.0).unwrap().height(&Vector2::new(x, y))
        };
        assert_eq!(at(&[], 3.0, 4.0), 0.0);
        assert_eq!(at(&[[1.0, 1.0, 0.2]], 30.0, 4.0), 0.2);
        let row = [[0.0, 0.0, 0.0], [10.0, 0.0, 0.2], [20.0, 0.0, 0.1]];
        assert!((at(&row, 5.0, 7.0) - 0.1).abs() < 1e-12);
        assert_eq!(at(&row, 99.0, -7.0), 0.1);
        assert_eq!(at(&[[1.0, 1.0, 0.2], [1.0, 1.0, 0.3]], 1.0, 1.0), 0.3);
    }

    #[test]
    fn what_is_no_map_is_refused() {
        assert!(HeightMap::new(&[[f64::NAN, 0.0, 0.0]], 10.0).is_err());
        assert!(HeightMap::new(&[[0.0, 1e9, 0.0]], 10.0).is_err());
        assert_eq!(
            HeightMap::new(&[[0.0, 0.0, 6.0]], 10.0).unwrap_err(),
            ProbeError::FadesTooFast { greatest: 6.0, fade: 10.0 }
        );
        assert!(HeightMap::new(&[[5e-324, 1e-200, 0.1]], 10.0).is_ok());
    }

    proptest! {
        #[test]
        fn the_lift_is_undone(
            heights in prop::collection::vec(-2.0..2.0_f64, 9),
            x in -80.0..80.0_f64, y in -80.0..80.0_f64, z in 0.0..20.0_f64,
        ) {
            let probes: Vec<[f64; 3]> = heights
                .iter()
                .zip(0..)
                .map(|(&h, k): (_, i32)| [f64::from(k % 3) * 60.0 - 60.0, f64::from(k / 3) * 60.0 - 60.0, h])
                .collect();
            let map = HeightMap::new(&probes, 10.0).unwrap();
            let q = Vector2::new(x, y);
            let lift = map.lift(&q, z);
            prop_assert!((map.part_z(&q, lift) - z).abs() < 1e-9);
            prop_assert!(z < 10.0 || lift == z);
            let (low, high) = heights.iter().fold((f64::MAX, f64::MIN), |(l, h), &n| (l.min(n), h.max(n)));
            let height = map.height(&q);
            prop_assert!(low - 1e-9 <= height && height <= high + 1e-9);
        }
    }
}

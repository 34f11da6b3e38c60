//! Spiral vases: one wall that climbs without a break.
//!
//! The wall of a layer is begun where the one below ended, and rises along its length from that one
//! to its own height; sideways too it goes over from the outline below to its own. Planes and cones
//! go over into each other by a shift along the axis, so on both the gap to the turn below is the
//! thickness of a layer everywhere.

use geom::polyline::nearest_on_ring;
use nalgebra::{Point2, Point3, Vector3, distance};
use slicer::bead::Bead;
use slicer::toolpath::{LayerPaths, Station};

use crate::order::{OrderedLine, begun_near};

/// Makes turns of the walls of layers.
#[derive(Debug, Clone, Default)]
pub struct Helix {
    /// The outline of the turn below; empty before the first.
    below: Vec<Point3<f64>>,
}

/// A jump of the outline from one layer to the next that still is a turn of the same helix, mm.
const LONGEST_STEP_MM: f64 = 5.0;

impl Helix {
    /// Returns the turn of a layer, begun at the nozzle; `None` for layers that are not to climb.
    pub fn turn(&mut self, layer: &LayerPaths, nozzle: Point2<f64>) -> Option<OrderedLine> {
        let wall = layer.rise.and_then(|rise| Some((rise, layer.only_wall()?)));
        let Some((rise, wall)) = wall else {
            self.below.clear();
            return None;
        };
        let line = begun_near(wall, &nozzle);
        let start = line.stations.first()?.at.xy();
        if distance(&start, &nozzle) > LONGEST_STEP_MM {
            self.below.clear();
        }
        let own: Vec<Point3<f64>> = line.stations.iter().map(|station| station.at).collect();
        let is_first = self.below.is_empty();
        let stations = climbing(&line.stations, is_first, |at| {
            let shifted = at - Vector3::z() * rise;
            if is_first { shifted } else { nearest(&self.below, &shifted) }
        });
        self.below = own;
        Some(OrderedLine { stations, island: Some(0), ..line })
    }
}

/// Stations that go over from what `below` says to their own places, evenly along the line. The
/// first turn lies on a flat floor and becomes as thick as a layer only at its end.
fn climbing(
    stations: &[Station],
    is_first: bool,
    below: impl Fn(&Point3<f64>) -> Point3<f64>,
) -> Vec<Station> {
    let steps = stations.windows(2).map(|pair| distance(&pair[0].at, &pair[1].at));
    let total: f64 = steps.clone().sum();
    let mut along = 0.0;
    let mut shares = vec![0.0];
    for step in steps {
        along += step;
        shares.push(along / total);
    }
    let climbing = stations.iter().zip(shares).map(|(station, share)| {
        let from = below(&station.at);
        let bead = if is_first {
            let thickness = station.bead.thickness * share.max(THINNEST_SHARE);
            Bead::with_spacing(station.bead.spacing(), thickness)
        } else {
            station.bead
        };
        Station { at: Point3::from(from.coords.lerp(&station.at.coords, share)), bead, ..*station }
    });
    climbing.collect()
}

/// The first turn begins with this share of a layer's thickness.
const THINNEST_SHARE: f64 = 0.1;

/// The place of a closed line nearest to a point as seen along the axis.
fn nearest(line: &[Point3<f64>], at: &Point3<f64>) -> Point3<f64> {
    let flat: Vec<Point2<f64>> = line.iter().map(Point3::xy).collect();
    let Some(place) = nearest_on_ring(&flat, &at.xy()) else { return *at };
    let next = line[(place.side + 1) % line.len()];
    Point3::from(line[place.side].coords.lerp(&next.coords, place.share))
}

#[cfg(test)]
mod tests {
    use super::*;
    use slicer::toolpath::{IslandPaths, Overhang, Role, Toolpath, WallGroup};
    use std::f64::consts::TAU;

    fn layer(index: usize, radius: f64) -> LayerPaths {
        let upper = 0.2 * (index + 1) as f64;
        let stations = (0..90).map(|k| {
            let angle = TAU * f64::from(k) / 90.0;
            Station {
                at: Point3::new(radius * angle.cos(), radius * angle.sin(), upper),
                bead: Bead { width: 0.45, thickness: 0.2 },
                overhang: Overhang::None,
            }
        });
        let role = Role::ExternalPerimeter;
        let wall = Toolpath { role, closed: true, stations: stations.collect() };
        let island =
            IslandPaths { walls: vec![WallGroup { loops: vec![wall] }], ..IslandPaths::default() };
        LayerPaths { index, upper, islands: vec![island], rise: Some(0.2), ..LayerPaths::default() }
    }

    #[test]
    fn turns_join_without_a_gap_and_climb_evenly() {
        let mut helix = Helix::default();
        let mut nozzle = Point2::new(10.0, 0.3);
        let mut all: Vec<Station> = Vec::new();
        for index in 4..10 {
            let radius = 10.0 + 0.05 * index as f64;
            let turn = helix.turn(&layer(index, radius), nozzle).unwrap();
            nozzle = turn.stations.last().unwrap().at.xy();
            if let Some(last) = all.last() {
                let gap = (turn.stations[0].at - last.at).norm();
                assert!(gap < 1e-3, "layer {index} begins {gap} mm from the one before");
            }
            all.extend(turn.stations);
        }
        assert!((all[0].at.z - 0.8).abs() < 1e-9);
        for (k, station) in all.iter().enumerate() {
            let share = k as f64 / all.len() as f64;
            assert!((station.at.z - (0.8 + 1.2 * share)).abs() < 0.01, "{k}: {}", station.at.z);
        }
        // The first turn lies on the flat floor.
        assert!(all[1].bead.thickness < 0.03 && all[200].bead.thickness == 0.2);
    }

    #[test]
    fn other_layers_are_left_alone() {
        let mut helix = Helix::default();
        let flat = LayerPaths { rise: None, ..layer(4, 10.0) };
        assert!(helix.turn(&flat, Point2::origin()).is_none());
        let mut two = layer(4, 10.0);
        two.islands.push(two.islands[0].clone());
        assert!(helix.turn(&two, Point2::origin()).is_none());
    }
}

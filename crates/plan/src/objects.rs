//! Which island belongs to which of several objects on the bed.

use geom::grid::mm;
use geom::polyline::distance_to_segment;
use geom::region::{Region, ring_sides};
use nalgebra::{Point2, Rotation2};
use slicer::toolpath::{IslandPaths, LayerPaths};

/// The outlines of several objects, seen from above, in the part frame.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Objects {
    /// One for each object.
    pub outlines: Vec<Region>,
}

impl Objects {
    /// Returns the object of each island of a layer, whose frame is turned by `azimuth` (radians) on
    /// the bed.
    #[must_use]
    pub fn of_islands(&self, layer: &LayerPaths, azimuth: f64) -> Vec<usize> {
        let turned = Rotation2::new(azimuth);
        let object = |island: &IslandPaths| begin(island).map_or(0, |p| self.of(&(turned * p)));
        layer.islands.iter().map(object).collect()
    }

    /// The object that a point lies in; the nearest where it lies in none.
    fn of(&self, p: &Point2<f64>) -> usize {
        let inside = self.outlines.iter().position(|outline| outline.contains(p));
        let away = |outline: &Region| {
            let sides = outline.rings().flat_map(|ring| ring_sides(ring));
            let far = sides.map(|(a, b)| distance_to_segment(&mm(a), &mm(b), p));
            far.fold(f64::INFINITY, f64::min)
        };
        inside.unwrap_or_else(|| {
            let all = self.outlines.iter().map(away).enumerate();
            all.min_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(k, _)| k)
        })
    }
}

/// A point of an island that lies within its object: of its outermost line.
fn begin(island: &IslandPaths) -> Option<Point2<f64>> {
    let walls = island.walls.iter().flat_map(|group| &group.loops);
    let first = walls.chain(island.all_fills()).flat_map(|path| &path.stations).next();
    first.map(|station| station.at.xy())
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom::region::Fill;
    use nalgebra::Point3;
    use slicer::bead::Bead;
    use slicer::toolpath::{Overhang, Role, Station, Toolpath};

    fn square(x: f64) -> Region {
        let ring = [[x - 5.0, -5.0], [x + 5.0, -5.0], [x + 5.0, 5.0], [x - 5.0, 5.0]];
        let ring = ring.map(Point2::from);
        Region::from_rings([ring.as_slice()], Fill::NonZero)
    }

    #[test]
    fn islands_are_found_again_on_a_turned_bed() {
        let objects = Objects { outlines: vec![square(-20.0), square(20.0)] };
        let island = |x: f64| {
            let station = |y| Station {
                at: Point3::new(x, y, 0.2),
                bead: Bead { width: 0.45, thickness: 0.2 },
                overhang: Overhang::None,
            };
            let stations = vec![station(0.0), station(1.0)];
            let line = Toolpath { role: Role::SolidInfill, closed: false, stations };
            IslandPaths { fills: vec![line], ..IslandPaths::default() }
        };
        let layer =
            LayerPaths { islands: vec![island(19.0), island(-26.0)], ..LayerPaths::default() };
        assert_eq!(objects.of_islands(&layer, 0.0), [1, 0]);
        assert_eq!(objects.of_islands(&layer, std::f64::consts::PI), [0, 1]);
    }
}

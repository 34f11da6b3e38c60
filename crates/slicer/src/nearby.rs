//! Islands of a region by where they lie: of thousands only those are looked at that can matter.

use std::borrow::Cow;
use std::collections::HashMap;

use geom::bounding::{Bounds, BoxTree};
use geom::grid::{GridPoint, steps};
use geom::region::{Island, Region, Ring};
use nalgebra::Point3;

/// How many islands a region may have without being looked through for those that are near.
const FEW_ISLANDS: usize = 16;

/// A region whose islands can be found by place.
pub(crate) struct Nearby<'a> {
    region: &'a Region,
    /// The boxes around the islands, in grid steps; `None` where there are few.
    boxes: Option<BoxTree>,
    /// By the least corners of their outer rings.
    numbers: HashMap<(i32, i32), u32>,
}

impl<'a> Nearby<'a> {
    pub(crate) fn of(region: &'a Region) -> Self {
        let islands = region.islands();
        let boxes = || BoxTree::new(islands.iter().map(box_around).collect());
        let boxes = (islands.len() > FEW_ISLANDS).then(boxes);
        let numbered =
            (0..).zip(islands).filter_map(|(k, island)| Some((least_corner(island)?, k)));
        let numbers = if boxes.is_some() { numbered.collect() } else { HashMap::new() };
        Self { region, boxes, numbers }
    }

    /// Returns the islands whose boxes come within `reach` (mm) of that of an island; all of a region of
    /// few.
    pub(crate) fn around(&self, island: &Island, reach: f64) -> Cow<'a, Region> {
        self.boxes.as_ref().map_or(Cow::Borrowed(self.region), |boxes| {
            let around = box_around(island).grown(f64::from(steps(reach)));
            Cow::Owned(self.region.selected(&boxes.meeting(&around)))
        })
    }

    /// Returns the islands that have a place in common with an island, and perhaps others near it; all
    /// of a region of few.
    pub(crate) fn sharing(&self, island: &Island) -> Cow<'a, Region> {
        self.boxes.as_ref().map_or(Cow::Borrowed(self.region), |boxes| {
            Cow::Owned(self.region.selected(&self.touching(boxes, island)))
        })
    }

    /// Returns the islands that have a place in common with an island, and perhaps others near it.
    pub(crate) fn meeting(&self, island: &Island) -> Vec<&'a Island> {
        let all = self.region.islands();
        match &self.boxes {
            None => {
                let around = box_around(island);
                all.iter().filter(|other| box_around(other).meets(&around)).collect()
            }
            Some(boxes) => {
                let found = self.touching(boxes, island);
                found.into_iter().map(|k| &all[k as usize]).collect()
            }
        }
    }

    fn touching(&self, boxes: &BoxTree, island: &Island) -> Vec<u32> {
        let all = self.region.islands();
        let like = least_corner(island).and_then(|corner| self.numbers.get(&corner));
        // Its like has all places in common with it, as in upright walls: whatever else is near adds none.
        if let Some(&k) = like.filter(|k| are_alike(island, &all[**k as usize])) {
            return vec![k];
        }
        boxes.meeting(&box_around(island))
    }
}

fn least_corner(island: &Island) -> Option<(i32, i32)> {
    island.first()?.iter().map(|p| (p.x, p.y)).min()
}

/// Whether islands have the same rings, wherever these begin.
fn are_alike(one: &Island, other: &Island) -> bool {
    let are_alike = |(a, b): (&Ring, &Ring)| {
        let shift = a.first().and_then(|first| b.iter().position(|p| p == first));
        a.len() == b.len()
            && shift.is_some_and(|shift| a.iter().eq(b[shift..].iter().chain(&b[..shift])))
    };
    one.len() == other.len() && one.iter().zip(other).all(are_alike)
}

/// The box around an island, grid steps, which are whole numbers here, too.
fn box_around(island: &Island) -> Bounds {
    let mut bounds = Bounds::default();
    let corner = |p: &GridPoint| Point3::new(f64::from(p.x), f64::from(p.y), 0.0);
    island.first().into_iter().flatten().for_each(|p| bounds.add(&corner(p)));
    bounds
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom::region::Fill;
    use nalgebra::Point2;

    /// Squares of 1 mm, 2 mm from corner to corner, `n` by `n`.
    fn squares(n: u32) -> Region {
        let square = |x: f64, y: f64| {
            [[x, y], [x + 1.0, y], [x + 1.0, y + 1.0], [x, y + 1.0]].map(Point2::from)
        };
        let at = |k: u32| square(2.0 * f64::from(k / n), 2.0 * f64::from(k % n));
        let rings: Vec<_> = (0..n * n).map(at).collect();
        Region::from_rings(rings.iter().map(|ring| &ring[..]), Fill::NonZero)
    }

    /// Frames 1 mm wide and 1 mm apart, each within the next.
    fn frames(n: u32) -> Region {
        let square = |half: f64| [[-half, -half], [half, -half], [half, half], [-half, half]];
        let rings: Vec<_> = (1..=2 * n).map(|k| square(f64::from(k)).map(Point2::from)).collect();
        let ring = |(k, ring): (usize, &[Point2<f64>; 4])| {
            let mut ring = ring.to_vec();
            if k % 2 == 0 {
                ring.reverse();
            }
            ring
        };
        let rings: Vec<_> = rings.iter().enumerate().map(ring).collect();
        Region::from_rings(rings.iter().map(|ring| &ring[..]), Fill::NonZero)
    }

    #[test]
    fn where_its_like_is_nothing_else_is_found() {
        let region = frames(20);
        assert_eq!(region.islands().len(), 20);
        let nearby = Nearby::of(&region);
        for island in region.islands() {
            assert_eq!(nearby.meeting(island), [island]);
            assert_eq!(nearby.sharing(island).islands(), std::slice::from_ref(island));
            let mut turned = island.clone();
            turned.iter_mut().for_each(|ring| ring.rotate_left(1));
            assert_eq!(nearby.meeting(&turned), [island]);
        }
        // A little to the side it has none, and all that may be near is looked at.
        let moved: Vec<GridPoint> =
            region.islands()[0][0].iter().map(|p| GridPoint::new(p.x + 1, p.y)).collect();
        assert!(nearby.meeting(&vec![moved]).len() > 1);
    }

    #[test]
    fn islands_are_found_by_place_among_few_and_many() {
        for n in [3, 9] {
            let region = squares(n);
            let nearby = Nearby::of(&region);
            for island in region.islands() {
                assert_eq!(nearby.meeting(island), [island]);
                let around = nearby.around(island, 1.0);
                assert!(around.islands().contains(island));
                // Its neighbours 1 mm away touch what is looked at.
                let count = around.islands().len();
                assert!(if n == 3 { count == 9 } else { matches!(count, 4 | 6 | 9) }, "{count}");
            }
        }
    }
}

//! Islands of a region by where they lie: of thousands only those are looked at that can matter.

use std::borrow::Cow;

use geom::bounding::{Bounds, BoxTree};
use geom::grid::{GridPoint, steps};
use geom::region::{Island, Region};
use nalgebra::Point3;

/// How many islands a region may have without being looked through for those that are near.
const FEW_ISLANDS: usize = 16;

/// A region whose islands can be found by place.
pub(crate) struct Nearby<'a> {
    region: &'a Region,
    /// The boxes around the islands, in grid steps; `None` where there are few.
    boxes: Option<BoxTree>,
}

impl<'a> Nearby<'a> {
    pub(crate) fn of(region: &'a Region) -> Self {
        let islands = region.islands();
        let boxes = || BoxTree::new(islands.iter().map(box_around).collect());
        Self { region, boxes: (islands.len() > FEW_ISLANDS).then(boxes) }
    }

    /// Returns the islands whose boxes come within `reach` (mm) of that of an island; all of a region of
    /// few.
    pub(crate) fn around(&self, island: &Island, reach: f64) -> Cow<'a, Region> {
        match &self.boxes {
            None => Cow::Borrowed(self.region),
            Some(boxes) => Cow::Owned(self.region.selected(&meeting(boxes, island, reach))),
        }
    }

    /// Returns the islands whose boxes meet that of an island.
    pub(crate) fn meeting(&self, island: &Island) -> Vec<&'a Island> {
        let all = self.region.islands();
        match &self.boxes {
            None => {
                let around = box_around(island);
                all.iter().filter(|other| box_around(other).meets(&around)).collect()
            }
            Some(boxes) => {
                meeting(boxes, island, 0.0).into_iter().map(|k| &all[k as usize]).collect()
            }
        }
    }
}

fn meeting(boxes: &BoxTree, island: &Island, reach: f64) -> Vec<u32> {
    boxes.meeting(&box_around(island).grown(f64::from(steps(reach))))
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

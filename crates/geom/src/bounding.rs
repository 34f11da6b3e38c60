//! Which boxes meet: a bounding volume hierarchy.
//!
//! Wraps the hierarchy of parry3d (f64 build), the only module that names it. Answers come in
//! ascending order of index, so that no result depends on the shape of the tree.

use nalgebra::Point3;
use parry3d_f64::bounding_volume::Aabb;
use parry3d_f64::math::Vector;
use parry3d_f64::partitioning::{Bvh, BvhBuildStrategy};

/// An axis-aligned box, mm. Empty until a point is added.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// The least corner.
    pub min: Point3<f64>,
    /// The greatest corner.
    pub max: Point3<f64>,
}

impl Default for Bounds {
    fn default() -> Self {
        Self { min: Point3::from([f64::INFINITY; 3]), max: Point3::from([f64::NEG_INFINITY; 3]) }
    }
}

impl Bounds {
    /// Returns the smallest box around `points`.
    pub fn of<'a>(points: impl IntoIterator<Item = &'a Point3<f64>>) -> Self {
        let mut bounds = Self::default();
        for p in points {
            bounds.add(p);
        }
        bounds
    }

    /// Grows the box to hold `p`.
    pub fn add(&mut self, p: &Point3<f64>) {
        self.min = self.min.inf(p);
        self.max = self.max.sup(p);
    }

    /// Returns the box grown by `margin` (mm) on every side.
    #[must_use]
    pub fn grown(&self, margin: f64) -> Self {
        Self { min: self.min.map(|c| c - margin), max: self.max.map(|c| c + margin) }
    }

    /// Returns whether no point has been added.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.min.x > self.max.x
    }

    /// Returns the extents along x, y, z, mm; zero when empty.
    #[must_use]
    pub fn size(&self) -> nalgebra::Vector3<f64> {
        if self.is_empty() { nalgebra::Vector3::zeros() } else { self.max - self.min }
    }

    /// Returns the length of the diagonal, mm; zero when empty.
    #[must_use]
    pub fn diagonal(&self) -> f64 {
        self.size().norm()
    }

    fn to_parry(self) -> Aabb {
        let vector = |p: Point3<f64>| Vector::new(p.x, p.y, p.z);
        Aabb::new(vector(self.min), vector(self.max))
    }
}

/// A set of boxes that answers "which of you meet this one?".
pub struct BoxTree {
    boxes: Vec<Bounds>,
    tree: Bvh,
}

impl BoxTree {
    /// Builds the hierarchy over `boxes`; box `i` keeps the name `i`.
    ///
    /// # Panics
    ///
    /// When there are more than 2³² boxes.
    #[must_use]
    pub fn new(boxes: Vec<Bounds>) -> Self {
        assert!(u32::try_from(boxes.len()).is_ok(), "box indices are 32 bits wide");
        let leaves: Vec<Aabb> = boxes.iter().map(|b| b.to_parry()).collect();
        Self { boxes, tree: Bvh::from_leaves(BvhBuildStrategy::Binned, &leaves) }
    }

    /// Returns the boxes that meet or touch `query`, ascending.
    #[must_use]
    pub fn meeting(&self, query: &Bounds) -> Vec<u32> {
        let query_box = query.to_parry();
        let mut found: Vec<u32> = self
            .tree
            .intersect_aabb(&query_box)
            // Inner nodes may be padded: the leaf decides.
            .filter(|&i| meet(&self.boxes[i as usize], query))
            .collect();
        found.sort_unstable();
        found
    }

    /// Returns every pair `(i, j)`, `i < j`, of boxes that meet or touch, in ascending order.
    #[must_use]
    pub fn meeting_pairs(&self) -> Vec<(u32, u32)> {
        let mut pairs = Vec::new();
        for (i, bounds) in (0_u32..).zip(&self.boxes) {
            pairs.extend(self.meeting(bounds).into_iter().filter(|&j| j > i).map(|j| (i, j)));
        }
        pairs
    }
}

fn meet(a: &Bounds, b: &Bounds) -> bool {
    (0..3).all(|k| a.min[k] <= b.max[k] && b.min[k] <= a.max[k])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn unit_box(x: f64, y: f64, z: f64) -> Bounds {
        Bounds::of([&Point3::new(x, y, z), &Point3::new(x + 1.0, y + 1.0, z + 1.0)])
    }

    #[test]
    fn pairs_equal_the_brute_force_answer() {
        let mut boxes = Vec::new();
        let mut state = 7_u64;
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            (state >> 33) as f64 / f64::from(1_u32 << 31) * 8.0
        };
        for _ in 0..300 {
            boxes.push(unit_box(next(), next(), next()));
        }
        let mut expected = Vec::new();
        for i in 0..300_u32 {
            for j in i + 1..300 {
                if meet(&boxes[i as usize], &boxes[j as usize]) {
                    expected.push((i, j));
                }
            }
        }
        assert!(!expected.is_empty());
        assert_eq!(BoxTree::new(boxes).meeting_pairs(), expected);
    }

    #[test]
    fn empty_tree_meets_nothing() {
        assert!(BoxTree::new(Vec::new()).meeting(&unit_box(0.0, 0.0, 0.0)).is_empty());
    }

    #[test]
    fn touching_boxes_meet() {
        let tree = BoxTree::new(vec![unit_box(0.0, 0.0, 0.0), unit_box(1.0, 0.0, 0.0)]);
        assert_eq!(tree.meeting_pairs(), vec![(0, 1)]);
    }
}

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

    /// Returns whether the boxes meet or touch.
    #[must_use]
    pub fn meets(&self, other: &Self) -> bool {
        (0..3).all(|k| self.min[k] <= other.max[k] && other.min[k] <= self.max[k])
    }

    fn to_parry(self) -> Aabb {
        let vector = |p: Point3<f64>| Vector::new(p.x, p.y, p.z);
        Aabb::new(vector(self.min), vector(self.max))
    }
}

/// A set of boxes that answers "which of you meet this one?".
///
/// Boxes that lie near each other share a leaf of the hierarchy, which would else be several times as
/// large as the boxes themselves.
pub struct BoxTree {
    boxes: Vec<Bounds>,
    /// The numbers of the boxes, those of a leaf behind each other.
    order: Vec<u32>,
    tree: Bvh,
}

/// Boxes that share a leaf.
const BOXES_IN_LEAF: usize = 8;

/// Bits of a place along each axis, as far as it decides on the order of boxes.
const PLACE_BITS: u32 = 21;

impl BoxTree {
    /// Builds the hierarchy over `boxes`; box `i` keeps the name `i`.
    ///
    /// # Panics
    ///
    /// When there are more than 2³² boxes.
    #[must_use]
    pub fn new(boxes: Vec<Bounds>) -> Self {
        assert!(u32::try_from(boxes.len()).is_ok(), "box indices are 32 bits wide");
        let order = along_curve(&boxes);
        let around = |leaf: &[u32]| {
            let mut all = Bounds::default();
            for &i in leaf {
                all.add(&boxes[i as usize].min);
                all.add(&boxes[i as usize].max);
            }
            all.to_parry()
        };
        let leaves: Vec<Aabb> = order.chunks(BOXES_IN_LEAF).map(around).collect();
        let tree = Bvh::from_leaves(BvhBuildStrategy::Binned, &leaves);
        Self { boxes, order, tree }
    }

    /// Returns the boxes that meet or touch `query`, ascending.
    #[must_use]
    pub fn meeting(&self, query: &Bounds) -> Vec<u32> {
        let query_box = query.to_parry();
        let leaf = |i: u32| {
            let first = i as usize * BOXES_IN_LEAF;
            &self.order[first..(first + BOXES_IN_LEAF).min(self.order.len())]
        };
        let leaves = self.tree.intersect_aabb(&query_box);
        let near = leaves.flat_map(|i| leaf(i).iter().copied());
        let mut found: Vec<u32> = near.filter(|&i| self.boxes[i as usize].meets(query)).collect();
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

/// The numbers of boxes, ordered along a curve that stays near: G. M. Morton (1966), "A computer
/// oriented geodetic data base and a new technique in file sequencing".
fn along_curve(boxes: &[Bounds]) -> Vec<u32> {
    let centres = || boxes.iter().map(|b| nalgebra::center(&b.min, &b.max));
    let mut all = Bounds::default();
    centres().for_each(|centre| all.add(&centre));
    let cells = f64::from((1_u32 << PLACE_BITS) - 1);
    let size = all.size().map(|side| if side > 0.0 { cells / side } else { 0.0 });
    let place = |p: Point3<f64>| {
        let [x, y, z] = [0, 1, 2].map(|k| spread(((p[k] - all.min[k]) * size[k]) as u64));
        x | y << 1 | z << 2
    };
    let mut keys: Vec<(u64, u32)> = centres().map(place).zip(0..).collect();
    keys.sort_unstable();
    keys.into_iter().map(|(_, i)| i).collect()
}

/// Puts two zeros before each of the lowest [`PLACE_BITS`] bits.
fn spread(bits: u64) -> u64 {
    [(32, 0x001f_0000_0000_ffff), (16, 0x001f_0000_ff00_00ff), (8, 0x100f_00f0_0f00_f00f)]
        .into_iter()
        .chain([(4, 0x10c3_0c30_c30c_30c3), (2, 0x1249_2492_4924_9249)])
        .fold(bits, |bits, (by, mask)| (bits | bits << by) & mask)
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
                if boxes[i as usize].meets(&boxes[j as usize]) {
                    expected.push((i, j));
                }
            }
        }
        assert!(!expected.is_empty());
        assert_eq!(BoxTree::new(boxes).meeting_pairs(), expected);
    }

    #[test]
    fn places_are_spread_to_every_third_bit() {
        for bit in 0..PLACE_BITS {
            assert_eq!(spread(1 << bit), 1 << (3 * bit));
        }
        assert_eq!(spread((1 << PLACE_BITS) - 1), 0x1249_2492_4924_9249);
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

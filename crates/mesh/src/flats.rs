//! Horizontal flat faces of a part: what a print must meet exactly to measure what the drawing
//! says.
//!
//! A flat face is made of facets that face straight up, or straight down, at one height. Part
//! frame, mm. Faces at one height are one, connected or not: one layer meets them all. Normals are
//! those of the corners; what a file says of them plays no part.
//!
//! Two tolerances. The *angle* is for facets: small facets of a scanned or finely tessellated flat
//! lean by chance. The *depth* is for heights: all corners of a facet, and all facets of a face,
//! lie within a slab of twice the depth. A facet that leans little but is large leaves the slab
//! and is a slope; so is a run of small facets that climbs through many slabs, such as a ramp of
//! half a degree or the top of a large dome, unless one slab holds most of it.

use crate::mesh::Mesh;
use rayon::prelude::*;

/// Which way a face looks.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Facing {
    /// To the bed.
    Down,
    /// Away from it.
    Up,
}

/// A flat face.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Flat {
    /// Its height: the mean over its area, mm.
    pub z_mm: f64,
    /// Its area, mm².
    pub area_mm2: f64,
    /// Which way it looks.
    pub facing: Facing,
}

/// What counts as flat.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FlatParams {
    /// Facets lean by at most this from the horizontal, rad. Usual: 1°. Smaller, and a rough flat
    /// falls apart; larger, and the first facets of a dome belong to its top.
    pub angle_rad: f64,
    /// Heights differ by at most this from that of the face, mm. Usual: 0.01. Smaller, and noise
    /// splits a face; larger than half of a layer, and steps that layers could show become one.
    pub depth_mm: f64,
}

/// A run of facets is a face when one slab holds this share of its area; otherwise it is a slope.
const LEAST_SHARE_OF_RUN: f64 = 0.5;

/// A facet that may belong to a face, or all those at one height that look the same way.
#[derive(Debug, Clone, Copy)]
struct Level {
    z: f64,
    area: Area,
    facing: Facing,
}

/// An area in whole parts of [`Area::UNIT_MM2`]: sums do not depend on the order of the facets.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Area(u128);

impl Area {
    /// A power of two, so that areas with few digits are exact; a million roundings are less than
    /// the last digit of a report.
    const UNIT_MM2: f64 = 1.0 / (1_u64 << 40) as f64;

    fn of(mm2: f64) -> Self {
        let units = mm2 * (1.0 / Self::UNIT_MM2) + 0.5;
        // Numbers of 64 bits, up to 16 m², are quicker.
        Self(if units < u64::MAX as f64 { u128::from(units as u64) } else { units as u128 })
    }

    fn mm2(self) -> f64 {
        self.0 as f64 * Self::UNIT_MM2
    }
}

/// Returns the flat faces, from the bed up; of two at one height the one that looks down is first.
///
/// The cost is one pass over the facets and a sort of the heights of those that are nearly
/// horizontal.
#[must_use]
pub fn flats(mesh: &Mesh, params: &FlatParams) -> Vec<Flat> {
    let cosine = params.angle_rad.cos();
    let piece = |triangles: &[[u32; 3]]| {
        let mut tally = Tally::default();
        for corners in triangles {
            if let Some(level) = level(mesh, corners, cosine, params.depth_mm) {
                tally.add(level);
            }
        }
        tally.levels
    };
    let pieces: Vec<_> = mesh.triangles.par_chunks(PIECE).map(piece).collect();
    let facets = levels(pieces.concat());
    let one_run = |a: &Level, b: &Level| a.facing == b.facing && b.z - a.z <= params.depth_mm;
    let mut flats: Vec<Flat> =
        facets.chunk_by(one_run).filter_map(|run| face(run, params.depth_mm)).collect();
    flats.sort_by(|a, b| a.z_mm.total_cmp(&b.z_mm).then(a.facing.cmp(&b.facing)));
    flats
}

/// Facets of one piece of work.
const PIECE: usize = 1 << 16;

/// A facet that is nearly horizontal; `None` for others.
fn level(mesh: &Mesh, corners: &[u32; 3], cosine: f64, depth: f64) -> Option<Level> {
    let corners = corners.map(|v| &mesh.vertices[v as usize]);
    let [a, b, c] = corners.map(|p| p.z);
    // Most facets leave here, ...
    if a.max(b).max(c) - a.min(b).min(c) > 2.0 * depth {
        return None;
    }
    let twice = (corners[1] - corners[0]).cross(&(corners[2] - corners[0]));
    let length = twice.norm();
    // ... and most of the others here.
    if !(length > 0.0 && twice.z.abs() >= length * cosine) {
        return None;
    }
    let facing = if twice.z < 0.0 { Facing::Down } else { Facing::Up };
    Some(Level { z: (a + b + c) / 3.0, area: Area::of(length / 2.0), facing })
}

/// Levels, of which those that were added lately are looked up: neighbours in a file are mostly
/// neighbours in space, and a flat side of a million facets is a few entries, not a million.
#[derive(Default)]
struct Tally {
    levels: Vec<Level>,
    /// Where in `levels` one of each family of heights is, plus one; 0 for none.
    lately: [u32; LATELY],
}

/// Heights that are looked up.
const LATELY: usize = 32;

impl Tally {
    fn add(&mut self, level: Level) {
        let (facing, z) = level.key();
        // A multiplicative hash (D. Knuth, TAOCP vol. 3, section 6.4): its upper bits are mixed best.
        let hash = (z as u64 ^ facing as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        let slot = &mut self.lately[(hash >> (64 - LATELY.ilog2())) as usize];
        let known = slot.checked_sub(1).map(|i| &mut self.levels[i as usize]);
        match known.filter(|known| known.key() == (facing, z)) {
            Some(known) => known.area.0 += level.area.0,
            None => {
                self.levels.push(level);
                *slot = self.levels.len() as u32;
            }
        }
    }
}

/// The facets at one height that look the same way as one, by that and by height.
fn levels(mut facets: Vec<Level>) -> Vec<Level> {
    facets.sort_unstable_by_key(Level::key);
    let sum = |same: &[Level]| {
        let area = same.iter().map(|facet| facet.area.0).sum();
        Level { area: Area(area), ..same[0] }
    };
    facets.chunk_by(|a, b| a.key() == b.key()).map(sum).collect()
}

impl Level {
    /// What levels are sorted by, and equal in when they are one.
    fn key(&self) -> (Facing, i64) {
        (self.facing, ordered_bits(self.z))
    }
}

/// The bits of a number as an integer of the same order.
fn ordered_bits(x: f64) -> i64 {
    let bits = (x + 0.0).to_bits() as i64;
    bits ^ (((bits >> 63) as u64) >> 1) as i64
}

/// The face in a run of facets, by height, without gaps larger than the depth.
fn face(run: &[Level], depth: f64) -> Option<Flat> {
    let total = |facets: &[Level]| facets.iter().map(|facet| facet.area.0).sum();
    let all = Area(total(run)).mm2();
    let slab = heaviest_slab(run, 2.0 * depth);
    let area = Area(total(slab)).mm2();
    if area < LEAST_SHARE_OF_RUN * all {
        return None;
    }
    // Relative to the lowest: the height of a face of one height is exactly that.
    let base = slab[0].z;
    let above: f64 = slab.iter().map(|facet| (facet.z - base) * facet.area.mm2()).sum();
    Some(Flat { z_mm: base + above / area, area_mm2: area, facing: slab[0].facing })
}

/// The facets of the slab of a height with the most area; the lowest of several.
fn heaviest_slab(run: &[Level], height: f64) -> &[Level] {
    let (mut best, mut most) = (0..0, None);
    let (mut start, mut area) = (0, 0);
    for (end, facet) in run.iter().enumerate() {
        area += facet.area.0;
        while facet.z - run[start].z > height {
            area -= run[start].area.0;
            start += 1;
        }
        if most.is_none_or(|most| area > most) {
            (best, most) = (start..end + 1, Some(area));
        }
    }
    &run[best]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shapes;
    use nalgebra::{Isometry3, Point3, Vector3};

    const USUAL: FlatParams =
        FlatParams { angle_rad: std::f64::consts::PI / 180.0, depth_mm: 0.01 };

    fn found(mesh: &Mesh) -> Vec<(f64, f64, Facing)> {
        let rounded = |x: f64| (x * 1e6).round() / 1e6;
        let flats = flats(mesh, &USUAL);
        flats.iter().map(|f| (rounded(f.z_mm), rounded(f.area_mm2), f.facing)).collect()
    }

    #[test]
    fn a_stepped_block_has_its_steps() {
        let steps = [(0.0, 1152.0, Facing::Down)]
            .into_iter()
            .chain([3.07, 7.33, 11.9, 15.0].map(|z| (z, 288.0, Facing::Up)));
        assert_eq!(found(&shapes::steps()), steps.collect::<Vec<_>>());
    }

    #[test]
    fn a_cross_has_ceilings_too() {
        let wanted = [
            (0.0, 400.0, Facing::Down),
            (20.0, 1600.0, Facing::Down),
            (40.0, 1600.0, Facing::Up),
            (60.0, 400.0, Facing::Up),
        ];
        assert_eq!(found(&shapes::cross(20.0)), wanted);
    }

    #[test]
    fn round_parts_have_none() {
        assert!(found(&shapes::icosphere(4, 20.0)).is_empty());
        assert!(found(&Mesh::default()).is_empty());
    }

    /// A strip of facets that rises by `rise` over each of `n` squares of 1 mm.
    fn ramp(n: usize, rise: impl Fn(usize) -> f64) -> Mesh {
        let mut mesh = Mesh::default();
        let mut z = 1.0;
        for i in 0..=n {
            let x = i as f64;
            mesh.vertices.extend([Point3::new(x, 0.0, z), Point3::new(x, 1.0, z)]);
            z += rise(i);
        }
        for i in 0..n as u32 {
            let [a, b, c, d] = [2 * i, 2 * i + 2, 2 * i + 3, 2 * i + 1];
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
        mesh
    }

    #[test]
    fn a_gentle_ramp_is_no_flat() {
        // 0.4° in facets of 7 µm height: every facet would pass, the whole does not.
        assert!(found(&ramp(100, |_| 0.007)).is_empty());
        // The same slope in two facets leaves the slab at once.
        let turned = shapes::cube(20.0).transformed(&Isometry3::rotation(Vector3::x() * 0.007));
        assert!(found(&turned).is_empty());
        assert_eq!(found(&ramp(100, |i| if i < 20 { 0.007 } else { 0.0 })).len(), 1);
    }

    #[test]
    fn noise_does_not_split_a_face() {
        let rough = ramp(200, |i| [0.006, -0.009, 0.004, -0.001][i % 4]);
        let flats = flats(&rough, &USUAL);
        assert_eq!(flats.len(), 1, "{flats:?}");
        assert!((flats[0].area_mm2 - 200.0).abs() < 0.1);
        assert!((flats[0].z_mm - 1.0).abs() < 0.005);
    }

    #[test]
    fn areas_add_up_however_large() {
        let huge = shapes::block(30_000.0, 20_000.0, 1.0);
        assert_eq!(found(&huge).iter().map(|f| f.1).collect::<Vec<_>>(), [6e8, 6e8]);
        // Far more heights than are looked up at once, each in several places of the file.
        let mut stairs = ramp(300, |i| if i % 2 == 0 { 0.0 } else { 0.5 });
        let flats = |mesh: &Mesh| flats(mesh, &USUAL);
        let once = flats(&stairs);
        assert_eq!(once.len(), 150);
        stairs.triangles.extend_from_within(..);
        let twice = flats(&stairs);
        assert!(once.iter().zip(&twice).all(|(a, b)| 2.0 * a.area_mm2 == b.area_mm2));
        assert_eq!(once.len(), twice.len());
    }

    #[test]
    fn the_order_of_the_facets_does_not_matter() {
        let mesh = ramp(200, |i| [0.006, -0.009, 0.004, -0.001][i % 4]);
        let mut shuffled = mesh.clone();
        shuffled.triangles.rotate_left(77);
        shuffled.triangles.reverse();
        assert_eq!(flats(&mesh, &USUAL), flats(&shuffled, &USUAL));
    }
}

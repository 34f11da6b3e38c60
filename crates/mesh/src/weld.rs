//! Joins the corners of loose triangles into vertices.
//!
//! In: a [`Soup`] (file units, Model frame). Out: a [`Mesh`] in the same frame.
//!
//! 1. *Exactly*: corners with equal coordinates (−0 = 0) are one vertex. Equal corners that stand
//!    near each other in the file are found first. Of those left, keys are brought together part by
//!    part (`parts`) and sorted within a part, so a crafted file cannot make it slow; vertices are
//!    numbered in the order of their first corner.
//! 2. *Nearly*, and only where it mends something: vertices on the ends of *open* sides (sides
//!    that one facet alone has) are joined within [`near_mm`]. A closed surface has no open sides,
//!    so no detail of it can be lost, however fine: facets of 20 nm survive. And a vertex is never
//!    joined over more than a quarter of the shortest side that ends there, so no facet collapses.
//!
//! Joined vertices take the least position (by x, then y, then z) of their group, so that the
//! shape does not depend on the order of the facets.

use crate::groups::Groups;
use crate::mesh::{Mesh, repeated};
use crate::note::Tally;
use crate::parts::{Parts, parts_for, sorted_by_bucket};
use crate::soup::Soup;
use crate::topology::Edges;
use geom::bounding::{Bounds, BoxTree};
use nalgebra::{Point3, Vector3, distance};
use rayon::prelude::*;

/// The least distance over which open seams are joined, mm.
///
/// Exporters leave gaps of 1 µm: a `f32` of a part 10 mm from the origin steps by 1 nm to 1 µm,
/// and text with three decimals by 1 µm. Below that, seams stay open and are closed as holes;
/// above some 10 µm, walls of printed text and screen holes begin to stick together.
pub const SEAM_MM: f64 = 0.002;

/// No more than this share of the model's diagonal is a seam: a model written in metres is a
/// thousandth of its size, and so are its seams.
const SEAM_SHARE: f64 = 1e-4;

/// How many steps of the file's `f32` coordinates two copies of a vertex may differ by. One copy
/// rounded up and the other down differ by one; two leave room for one more operation.
const SEAM_STEPS: f64 = 2.0;

/// A vertex moves no farther than this share of the shortest side that ends at it.
const SIDE_SHARE: f64 = 0.25;

/// Above this ratio of `f32` step to size the shape itself is damaged. A cube of 20 mm at
/// 10⁶ mm (0.3 %) keeps its size to 0.06 mm; at 10⁸ mm (40 %) it is no cube any more.
const LOST_SHARE: f64 = 0.01;

/// What welding did.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct WeldReport {
    /// Corners in the soup.
    pub corners: usize,
    /// Vertices that are left.
    pub vertices: usize,
    /// Sides that one facet alone has, after the exact weld.
    pub open_sides: usize,
    /// Vertices that were joined with a near one: how many, and how far the farthest moved, mm.
    pub joined: Tally,
    /// The tolerance used, mm.
    pub near_mm: f64,
    /// Set when the model is too far from the origin for the numbers of its file.
    pub precision_lost: Option<PrecisionLost>,
}

/// How coarse the numbers of a file are beside the model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PrecisionLost {
    /// The step of a `f32` at the farthest coordinate, mm.
    pub step: f64,
    /// The largest extent of the model, mm.
    pub size: f64,
}

/// Returns the step from the largest coordinate of `bounds` to the next `f32`, mm.
#[must_use]
pub fn step_mm(bounds: &Bounds) -> f64 {
    steps_mm(bounds).max()
}

/// Returns the same for x, y and z alone.
pub(crate) fn steps_mm(bounds: &Bounds) -> Vector3<f64> {
    let step = |k: usize| {
        let largest = bounds.min[k].abs().max(bounds.max[k].abs());
        if bounds.is_empty() || !largest.is_finite() {
            return 0.0;
        }
        let bits = (largest.min(f64::from(f32::MAX)) as f32).to_bits();
        f64::from(f32::from_bits(bits)) - f64::from(f32::from_bits(bits.saturating_sub(1)))
    };
    Vector3::new(step(0), step(1), step(2))
}

/// Returns the distance over which open seams of a model in `bounds` are joined, mm.
#[must_use]
pub fn near_mm(bounds: &Bounds) -> f64 {
    let seam = SEAM_MM.min(SEAM_SHARE * bounds.diagonal());
    seam.max(SEAM_STEPS * step_mm(bounds))
}

/// Welds a soup.
///
/// Facets stay in order, and stay even when two of their corners become one: dropping them is
/// for [`repair`](crate::repair::repair), which counts them.
///
/// # Panics
///
/// When there are more than 2³² corners.
#[must_use]
pub fn weld(soup: &Soup) -> (Mesh, WeldReport) {
    let mut mesh = exactly(soup);
    let edges = Edges::of(&mesh);
    let mut report = report_on(&mesh);
    report.open_sides = edges.n_open();
    join_seams(&mut mesh, &edges, &mut report);
    (mesh, report)
}

/// Returns the report on an exact weld.
pub(crate) fn report_on(mesh: &Mesh) -> WeldReport {
    let bounds = mesh.bounds();
    let (step, size) = (step_mm(&bounds), bounds.size().max());
    let precision_lost = (step > LOST_SHARE * size).then_some(PrecisionLost { step, size });
    WeldReport {
        corners: 3 * mesh.triangles.len(),
        vertices: mesh.vertices.len(),
        near_mm: near_mm(&bounds),
        precision_lost,
        ..WeldReport::default()
    }
}

/// Joins corners with equal coordinates.
pub(crate) fn exactly(soup: &Soup) -> Mesh {
    let corners = soup.facets.as_flattened();
    // Adding zero makes -0 into 0 and changes nothing else.
    let key = |i: u32| corners[i as usize].map(|c| (c + 0.0).to_bits());
    let mut triangles = vec![[0; 3]; soup.facets.len()];
    let vertex_of = triangles.as_flattened_mut();
    first_nearby(vertex_of, key);
    let own = |(i, first): (u32, &u32)| (i == *first).then_some(i);
    let left: Vec<u32> = (0..).zip(&*vertex_of).filter_map(own).collect();
    let card = |i: u32| {
        let [x, y, z] = key(left[i as usize]).map(u128::from);
        x << 96 | y << 64 | z << 32 | u128::from(i)
    };
    let n_parts = parts_for(left.len());
    let part_of = |card: u128| part_of(key_of(card), n_parts);
    let parts = Parts::deal_cards(left.len(), n_parts, card, part_of);
    let firsts = parts.work(|_, cards| first_equal(cards));
    let firsts: Vec<&[u32]> = firsts.iter().map(Vec::as_slice).collect();
    let mut vertex_of_left = parts.gather(&firsts);
    let mut vertices = Vec::with_capacity(corners.len() / 5);
    for i in 0..left.len() {
        let first = vertex_of_left[i] as usize;
        // Entries before `i` hold vertices already, the others still first corners.
        vertex_of_left[i] = if first == i {
            vertices.push(Point3::from(corners[left[i] as usize].map(|c| f64::from(c + 0.0))));
            vertices.len() as u32 - 1
        } else {
            vertex_of_left[first]
        };
    }
    let mut next = vertex_of_left.into_iter();
    for i in 0..vertex_of.len() {
        let first = vertex_of[i] as usize;
        vertex_of[i] = match first == i {
            true => next.next().expect("one for each corner left"),
            false => vertex_of[first],
        };
    }
    Mesh { vertices, triangles }
}

/// Corners among which equal ones are sought first: their table stays within the cache of a core.
const NEARBY: usize = 1 << 14;

/// Places of the table that are tried for a corner. Half of them are free, so real corners need a
/// few; in a file made to collide, some equal corners are not found here.
const MOST_TRIES: usize = 16;

/// Writes for each corner an equal one before it, if one is found nearby, or else itself. Facets that
/// lie side by side mostly stand near each other in the file, so this leaves few corners to look at.
fn first_nearby(firsts: &mut [u32], key: impl Fn(u32) -> [u32; 3] + Sync) {
    const FREE: u32 = u32::MAX;
    const PLACES: usize = 2 * NEARBY;
    firsts.par_chunks_mut(NEARBY).enumerate().for_each(|(chunk, firsts)| {
        let mut table = vec![FREE; PLACES];
        for (i, first) in ((chunk * NEARBY) as u32..).zip(firsts) {
            let own = key(i);
            *first = i;
            let start = (mix(own) >> 20) as usize;
            for place in (start..start + MOST_TRIES).map(|place| place % PLACES) {
                let other = table[place];
                if other == FREE {
                    table[place] = i;
                    break;
                }
                if key(other) == own {
                    *first = other;
                    break;
                }
            }
        }
    });
}

/// Parts this large hold corners that are not spread as those of a model are.
const LARGE_PART: usize = 1 << 20;

/// Spreads keys over the range of 64 bits.
fn mix(key: [u32; 3]) -> u64 {
    // Multipliers: odd numbers from the digits of the golden ratio, as in Fibonacci hashing
    // (D. Knuth, TAOCP vol. 3, section 6.4). A bad spread costs time only up to one big sort.
    let low = (u64::from(key[0]) | u64::from(key[1]) << 32).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    (low ^ (low >> 32) ^ u64::from(key[2])).wrapping_mul(0xf39c_c060_5ced_c835)
}

/// The part of a key: its place in the range of 64 bits.
fn part_of(key: [u32; 3], n_parts: usize) -> usize {
    (((mix(key) >> 32) * n_parts as u64) >> 32) as usize
}

/// The key on a card of `x`, `y`, `z` and an item's number.
fn key_of(card: u128) -> [u32; 3] {
    [(card >> 96) as u32, (card >> 64) as u32, (card >> 32) as u32]
}

/// For each card, the first item with the same key.
fn first_equal(cards: Vec<u128>) -> Vec<u32> {
    let items: Vec<u32> = cards.iter().map(|&card| card as u32).collect();
    // Items ascend with their position, which takes their place in the cards.
    let mut entries = cards;
    for (position, entry) in entries.iter_mut().enumerate() {
        *entry = *entry >> 32 << 32 | position as u128;
    }
    // The bits that chose the part are the high ones: these are fresh.
    let n_buckets = (items.len() / 4).next_power_of_two();
    let bucket_of = |entry: u128| (mix(key_of(entry)) >> 8) as usize & (n_buckets - 1);
    // A part far too large has few different keys: they are nearly in order, and need no copy.
    let sorted = if items.len() > LARGE_PART {
        entries.sort_unstable();
        entries
    } else {
        sorted_by_bucket(&entries, n_buckets, bucket_of)
    };
    let mut firsts = vec![0; items.len()];
    for run in sorted.chunk_by(|a, b| a >> 32 == b >> 32) {
        let first = items[run[0] as u32 as usize];
        for entry in run {
            firsts[*entry as u32 as usize] = first;
        }
    }
    firsts
}

/// Joins near vertices on open sides; returns whether anything changed.
pub(crate) fn join_seams(mesh: &mut Mesh, edges: &Edges, report: &mut WeldReport) -> bool {
    let loose = loose_vertices(mesh, edges, report.near_mm);
    if loose.is_empty() {
        return false;
    }
    let group = group_near(mesh, &loose);
    let mut moved = false;
    let mut target: Vec<u32> = (0..mesh.vertices.len() as u32).collect();
    for run in group.chunk_by(|a, b| a.0 == b.0).filter(|run| run.len() > 1) {
        let position = |v: u32| mesh.vertices[v as usize];
        let least = run.iter().map(|&(_, v)| position(v)).min_by(order).expect("not empty");
        let kept = run[0].1;
        for &(_, v) in &run[1..] {
            report.joined.add(distance(&position(v), &least), position(v));
            target[v as usize] = kept;
        }
        mesh.vertices[kept as usize] = least;
        moved = true;
    }
    if moved {
        for v in mesh.triangles.iter_mut().flatten() {
            *v = target[*v as usize];
        }
        mesh.drop_unused_vertices();
        report.vertices = mesh.vertices.len();
    }
    moved
}

fn order(a: &Point3<f64>, b: &Point3<f64>) -> std::cmp::Ordering {
    a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)).then(a.z.total_cmp(&b.z))
}

/// A vertex that may be joined, and how far.
struct Loose {
    vertex: u32,
    reach: f64,
}

/// The ends of open sides, ascending, each with the distance it may be joined over.
fn loose_vertices(mesh: &Mesh, edges: &Edges, near_mm: f64) -> Vec<Loose> {
    if edges.n_open() == 0 {
        return Vec::new();
    }
    const CLOSED: f64 = -1.0;
    let mut reach = vec![CLOSED; mesh.vertices.len()];
    for end in edges.open().flat_map(|edge| edges.ends(mesh, edge)) {
        reach[end as usize] = near_mm;
    }
    for corners in mesh.triangles.iter().filter(|t| repeated(t).is_none()) {
        for k in 0..3 {
            let (a, b) = (corners[k] as usize, corners[(k + 1) % 3] as usize);
            let most = SIDE_SHARE * distance(&mesh.vertices[a], &mesh.vertices[b]);
            for end in [a, b] {
                if reach[end] != CLOSED {
                    reach[end] = reach[end].min(most);
                }
            }
        }
    }
    let loose = (0..).zip(&reach).filter(|(_, reach)| **reach != CLOSED);
    loose.map(|(vertex, &reach)| Loose { vertex, reach }).collect()
}

/// How many pairs of near vertices are looked at in all. Real seams need a few for each vertex; a
/// file with thousands of vertices in one spot would take hours. Seams beyond stay open.
const MOST_PAIRS: usize = 50_000_000;

/// Groups of near vertices as (group, vertex), ascending; a group goes by its first vertex.
fn group_near(mesh: &Mesh, loose: &[Loose]) -> Vec<(u32, u32)> {
    let position = |i: usize| mesh.vertices[loose[i].vertex as usize];
    let boxes = (0..loose.len()).map(|i| Bounds::of([&position(i)])).collect();
    let tree = BoxTree::new(boxes);
    let mut groups = Groups::new(loose.len());
    let mut n_pairs = 0;
    for i in 0..loose.len() {
        let p = position(i);
        let near = tree.meeting(&Bounds::of([&p]).grown(loose[i].reach));
        n_pairs += near.len();
        if n_pairs > MOST_PAIRS {
            break;
        }
        for j in near {
            let j = j as usize;
            let reach = loose[i].reach.min(loose[j].reach);
            if j > i && distance(&p, &position(j)) <= reach {
                groups.join(i, j);
            }
        }
    }
    let mut group: Vec<(u32, u32)> =
        (0..loose.len()).map(|i| (loose[groups.leader(i)].vertex, loose[i].vertex)).collect();
    group.sort_unstable();
    group
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::soup::Facet;

    /// A tetrahedron with legs of 10 mm; `shift` is added to every corner of its last facet.
    fn tetrahedron(shift: f32) -> Vec<Facet> {
        let [o, x, y, z] = [[0.0; 3], [10.0, 0.0, 0.0], [0.0, 10.0, 0.0], [0.0, 0.0, 10.0_f32]];
        let last = [y, x, z].map(|p| p.map(|c| c + shift)).map(|[x, y, z]| [y, x, z]);
        vec![[o, y, x], [o, x, z], [o, z, y], last]
    }

    #[test]
    fn corners_are_numbered_by_first_use() {
        let facets = vec![
            [[1.0, 0.0, 0.0], [0.0; 3], [2.0, 0.0, 0.0]],
            [[2.0, 0.0, 0.0], [-0.0, 0.0, -0.0], [3.0, 0.0, 0.0]],
        ];
        let mesh = exactly(&Soup { facets });
        assert_eq!(mesh.triangles, [[0, 1, 2], [2, 1, 3]]);
        assert!(mesh.vertices[1].iter().all(|c| c.to_bits() == 0));
    }

    #[test]
    fn corners_far_apart_in_the_file_are_one_vertex() {
        let n = NEARBY as u32;
        let rim = |i: u32| [(i % n) as f32, 1.0, 0.0];
        let facets = (0..n).map(|i| [[0.0, 0.0, 5.0], rim(i), rim(i + 1)]).collect();
        let mesh = exactly(&Soup { facets });
        assert_eq!(mesh.vertices.len(), NEARBY + 1);
        assert!(mesh.triangles.iter().all(|t| t[0] == 0));
        assert_eq!(mesh.triangles[NEARBY - 1], [0, n, 1]);
    }

    #[test]
    fn seams_close_within_the_tolerance_only() {
        let (mesh, report) = weld(&Soup { facets: tetrahedron(0.0) });
        assert_eq!((mesh.vertices.len(), report.open_sides, report.joined.count), (4, 0, 0));
        let (mesh, report) = weld(&Soup { facets: tetrahedron(0.0005) });
        assert_eq!((mesh.vertices.len(), report.open_sides, report.joined.count), (4, 6, 3));
        assert!(report.joined.worst < 0.002);
        let (mesh, report) = weld(&Soup { facets: tetrahedron(0.01) });
        assert_eq!((mesh.vertices.len(), report.joined.count), (7, 0));
    }

    #[test]
    fn closed_detail_survives_however_small() {
        let mut facets = tetrahedron(0.0);
        facets.extend(tetrahedron(0.0).iter().map(|f| f.map(|p| p.map(|c| c * 1e-6 + 20.0))));
        let (mesh, report) = weld(&Soup { facets });
        // At 20 mm, f32 steps by 1.9 µm: the small one has four different corners all the same.
        assert_eq!((mesh.vertices.len(), report.joined.count), (8, 0));
    }

    #[test]
    fn facets_do_not_collapse() {
        // An open strip of facets 1 µm wide: its own sides limit what is joined.
        let facets = (0..50)
            .map(|i| {
                let x = |i: usize| i as f32 * 1e-3;
                [[x(i), 0.0, 0.0], [x(i + 1), 0.0, 0.0], [x(i), 1.0, 0.0]]
            })
            .collect();
        let (mesh, report) = weld(&Soup { facets });
        assert_eq!(report.joined.count, 0);
        assert!(mesh.triangles.iter().all(|t| repeated(t).is_none()));
    }

    #[test]
    fn far_from_the_origin_precision_is_lost() {
        let at = |d: f32| {
            let facets = tetrahedron(0.0).iter().map(|f| f.map(|p| p.map(|c| c + d))).collect();
            weld(&Soup { facets }).1.precision_lost
        };
        assert_eq!(at(1e4), None);
        assert_eq!(at(1e6), None);
        assert_eq!(at(1e8), Some(PrecisionLost { step: 8.0, size: 8.0 }));
    }

    #[test]
    fn tolerance_follows_the_numbers() {
        let size =
            |s: f64, d: f64| Bounds::of([&Point3::new(d, 0.0, 0.0), &Point3::new(d + s, s, s)]);
        assert_eq!(near_mm(&size(20.0, 0.0)), SEAM_MM);
        assert!(near_mm(&size(0.02, 0.0)) < 1e-5, "a model written in metres");
        assert_eq!(near_mm(&size(20.0, 1e6)), 0.125);
        assert_eq!(near_mm(&Bounds::default()), 0.0);
    }

    #[test]
    fn order_and_threads_do_not_matter() {
        let facets: Vec<Facet> = (0..40_000)
            .map(|i: u32| {
                let c =
                    |k: u32| (i.wrapping_mul(2_654_435_761).wrapping_add(k * 40_503) >> 22) as f32;
                [[c(0), c(1), c(2)], [c(3), c(4), c(5)], [c(6), c(7), c(8)]]
            })
            .collect();
        let soup = Soup { facets };
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
        let alone = pool.install(|| exactly(&soup));
        let mesh = exactly(&soup);
        assert_eq!(alone, mesh);
        let corners = soup.facets.as_flattened().iter();
        for (corner, &v) in corners.zip(mesh.triangles.as_flattened()) {
            assert_eq!(mesh.vertices[v as usize], Point3::from(corner.map(f64::from)));
        }
        let mut sorted = mesh.vertices.clone();
        sorted.sort_by(order);
        sorted.dedup();
        assert_eq!(sorted.len(), mesh.vertices.len());
    }
}

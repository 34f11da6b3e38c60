//! Surfaces that pass through each other, lie inside each other, or touch.
//!
//! Slicing with the nonzero rule makes one body of whatever overlaps, so this is for the report:
//! volumes are then not what they add up to, and a figure of eight has a wrong side out.
//!
//! * [`self_intersections`] looks at all pairs of triangles whose boxes meet.
//! * [`shell_meetings`] looks at pairs of shells only: it finds the first crossing of each pair;
//!   where there is none it asks, at some points of each solid shell, how often the other shells
//!   wind round them (by rays). A cavity lies in one shell, a solid in none.
//!   Solids that lie back to back on a common plane *touch*.
//!
//! Unit mm, frame that of the solid. Nothing shallower than [`depth_mm`] counts: parts that are
//! meant to touch differ by the rounding of their coordinates, and surfaces of sound models cross
//! by micrometres where thin triangles meet at a flat angle.

mod pair;

use crate::inside::{Rays, odd_point};
use crate::topology::{Shell, Solid};
use crate::weld::step_mm;
use geom::bounding::{Bounds, BoxTree};
use nalgebra::Point3;
use pair::Facet;
use rayon::prelude::*;

/// How deep a crossing must be, mm: a fifth of the thinnest layer that printers lay. Of 16 models
/// that people print, one crosses itself by 2 µm at 23 places that nobody has ever seen.
const DEPTH_MM: f64 = 0.01;

/// No more than this share of the model's diagonal is shallow, whatever its unit.
const DEPTH_SHARE: f64 = 1e-4;

/// How many `f32` steps deep a crossing must be at least.
const DEPTH_STEPS: f64 = 4.0;

/// A piece of wall that two solids have in common is larger than this share of the model's size;
/// a speck on a plate does not touch it in any way that shows.
const WALL_SHARE: f64 = 1e-4;

/// How many pairs of shells are looked at: thousands of shells inside each other have millions,
/// and the first tell the same as all.
const MOST_PAIRS: usize = 200_000;

/// How many triangles near each other are looked at for one pair of shells, and for all: a second
/// or two. What has not been found by then counts as not there.
const MOST_VISITS_OF_PAIR: usize = 4_000_000;
const MOST_VISITS: usize = 60_000_000;

/// How many pairs of triangles [`self_intersections`] looks at: some seconds. Thousands of
/// triangles in one spot have more, and are no model.
const MOST_TRIANGLE_PAIRS: usize = 100_000_000;

/// How many points of a shell tell whether it lies in another one.
const POINTS: usize = 3;

/// How many triangles of a shell are tried for such points.
const TRIES: usize = 64;

/// Two triangles that pass through each other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SelfIntersection {
    /// The triangles, the lower number first.
    pub triangles: [u32; 2],
    /// A point of both.
    pub at: Point3<f64>,
}

/// How two shells meet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MeetingKind {
    /// Their surfaces pass through each other.
    Crossing,
    /// The first lies at least partly in material of the second.
    Inside,
    /// Both are solid and have a piece of wall in common.
    Touching,
}

/// Two shells that meet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShellMeeting {
    /// How.
    pub kind: MeetingKind,
    /// Which.
    pub shells: [u32; 2],
    /// Where, at one point.
    pub at: Point3<f64>,
}

/// Returns the depth from which on a crossing counts, mm.
#[must_use]
pub fn depth_mm(bounds: &Bounds) -> f64 {
    DEPTH_MM.min(DEPTH_SHARE * bounds.diagonal()).max(DEPTH_STEPS * step_mm(bounds))
}

/// Returns the first `limit` pairs of triangles that pass through each other, in the order of
/// their numbers. Triangles that share a side are neighbours and do not count.
#[must_use]
pub fn self_intersections(solid: &Solid, limit: usize) -> Vec<SelfIntersection> {
    let mesh = solid.mesh();
    let depth = depth_mm(&mesh.bounds());
    let n = mesh.triangles.len() as u32;
    let bounds = |t: u32| Bounds::of(&mesh.corners(t));
    let tree = BoxTree::new((0..n).map(bounds).collect());
    let are_neighbours = |t: u32, u: u32| {
        let (of_t, of_u) = (&mesh.triangles[t as usize], &mesh.triangles[u as usize]);
        of_u.iter().filter(|v| of_t.contains(v)).count() >= 2
    };
    let with_later = |t: u32| -> (usize, Vec<SelfIntersection>) {
        let near = tree.meeting(&bounds(t));
        let n_pairs = near.len();
        let facet = Facet::new(mesh.corners(t));
        let others = near.into_iter().filter(|u| *u > t && !are_neighbours(t, *u));
        let crossing = |u: u32| {
            let at = facet.crossing(&Facet::new(mesh.corners(u)), depth)?;
            Some(SelfIntersection { triangles: [t, u], at })
        };
        (n_pairs, others.filter_map(crossing).collect::<Vec<_>>())
    };
    // In rows, so that a mesh full of crossings stops early.
    const ROW: u32 = 1 << 12;
    let mut found = Vec::new();
    let mut n_pairs = 0;
    for start in (0..n).step_by(ROW as usize) {
        let row = start..n.min(start.saturating_add(ROW));
        let in_row: Vec<_> = row.into_par_iter().map(with_later).collect();
        for (n, crossings) in in_row {
            n_pairs += n;
            found.extend(crossings);
        }
        if found.len() >= limit || n_pairs > MOST_TRIANGLE_PAIRS {
            break;
        }
    }
    found.truncate(limit);
    found
}

/// Returns how shells meet, in the order of their numbers, crossings before the rest.
#[must_use]
pub fn shell_meetings(solid: &Solid) -> Vec<ShellMeeting> {
    let depth = depth_mm(&solid.mesh().bounds());
    let pairs = near_pairs(solid.shells(), depth);
    if pairs.is_empty() {
        return Vec::new();
    }
    let near = Near::new(solid, &pairs, depth);
    let found = near.surfaces_that_meet(&pairs);
    let (mut meetings, touching): (Vec<_>, Vec<_>) =
        found.into_iter().partition(|m| m.kind == MeetingKind::Crossing);
    let mut crosses = vec![false; solid.shells().len()];
    meetings.iter().flat_map(|m| m.shells).for_each(|shell| crosses[shell as usize] = true);
    meetings.extend(near.contained(&crosses));
    meetings.extend(touching);
    meetings
}

/// Pairs of shells whose boxes meet, ascending.
fn near_pairs(shells: &[Shell], depth: f64) -> Vec<[u32; 2]> {
    if shells.len() < 2 {
        return Vec::new();
    }
    let tree = BoxTree::new(shells.iter().map(|s| s.bounds).collect());
    let mut pairs = Vec::new();
    for (i, shell) in (0..).zip(shells) {
        let meeting = tree.meeting(&shell.bounds.grown(depth));
        pairs.extend(meeting.into_iter().filter(|j| *j > i).map(|j| [i, j]));
        if pairs.len() > MOST_PAIRS {
            break;
        }
    }
    pairs.truncate(MOST_PAIRS);
    pairs
}

/// The triangles of some shells that lie near other shells.
struct Near<'a> {
    solid: &'a Solid,
    depth: f64,
    /// How far a piece of wall must reach to count.
    least_wall: f64,
    /// For each shell, the others near it.
    partners: Vec<Vec<u32>>,
    /// For each shell, its triangles near others.
    triangles: Vec<Vec<u32>>,
    /// All of these, and the tree of their boxes.
    all: Vec<u32>,
    tree: BoxTree,
}

impl<'a> Near<'a> {
    fn new(solid: &'a Solid, pairs: &[[u32; 2]], depth: f64) -> Self {
        let shells = solid.shells();
        let mut partners = vec![Vec::new(); shells.len()];
        let mut zones = vec![Bounds::default(); shells.len()];
        for &[i, j] in pairs {
            let common = common(&shells[i as usize].bounds, &shells[j as usize].bounds, depth);
            for (shell, partner) in [(i, j), (j, i)] {
                partners[shell as usize].push(partner);
                zones[shell as usize].add(&common.min);
                zones[shell as usize].add(&common.max);
            }
        }
        let mut triangles = vec![Vec::new(); shells.len()];
        let mut all = Vec::new();
        let box_of = |t: u32| Bounds::of(&solid.mesh().corners(t));
        for (t, &shell) in (0..).zip(solid.shell_of()) {
            let has_partner = !partners[shell as usize].is_empty();
            if has_partner && meet(&box_of(t), &zones[shell as usize]) {
                triangles[shell as usize].push(t);
                all.push(t);
            }
        }
        let boxes = all.iter().map(|t| box_of(*t)).collect();
        let least_wall = depth.max(WALL_SHARE * solid.mesh().bounds().diagonal());
        Self { solid, depth, least_wall, partners, triangles, all, tree: BoxTree::new(boxes) }
    }

    fn shell(&self, shell: u32) -> &Shell {
        &self.solid.shells()[shell as usize]
    }

    /// The meetings of surfaces, in the order of the pairs.
    fn surfaces_that_meet(&self, pairs: &[[u32; 2]]) -> Vec<ShellMeeting> {
        const ROW: usize = 64;
        let mut meetings = Vec::new();
        let mut n_visits = 0;
        for row in pairs.chunks(ROW) {
            let in_row: Vec<_> = row.par_iter().map(|pair| self.surfaces_meet(*pair)).collect();
            for (n, meeting) in in_row {
                n_visits += n;
                meetings.extend(meeting);
            }
            if n_visits > MOST_VISITS {
                break;
            }
        }
        meetings
    }

    /// The first crossing of two shells, or the first place where they touch, and how many
    /// triangles were looked at.
    fn surfaces_meet(&self, [i, j]: [u32; 2]) -> (usize, Option<ShellMeeting>) {
        let n = |shell: u32| self.triangles[shell as usize].len();
        let (few, many) = if n(i) <= n(j) { (i, j) } else { (j, i) };
        let zone = common(&self.shell(i).bounds, &self.shell(j).bounds, self.depth);
        let both_solid = self.shell(i).volume_mm3 > 0.0 && self.shell(j).volume_mm3 > 0.0;
        let mesh = self.solid.mesh();
        let meeting = |kind, at| ShellMeeting { kind, shells: [i, j], at };
        let mut touching = None;
        let mut n_visits = 0;
        for &t in &self.triangles[few as usize] {
            let bounds = Bounds::of(&mesh.corners(t)).grown(self.depth);
            if !meet(&bounds, &zone) || n_visits > MOST_VISITS_OF_PAIR {
                continue;
            }
            let facet = Facet::new(mesh.corners(t));
            let near = self.tree.meeting(&bounds);
            n_visits += near.len();
            for u in near.into_iter().map(|k| self.all[k as usize]) {
                if self.solid.shell_of()[u as usize] != many {
                    continue;
                }
                let other = Facet::new(mesh.corners(u));
                if let Some(at) = facet.crossing(&other, self.depth) {
                    return (n_visits, Some(meeting(MeetingKind::Crossing, at)));
                }
                if both_solid && touching.is_none() {
                    touching = facet.common_wall(&other, self.depth, self.least_wall);
                }
            }
        }
        (n_visits, touching.map(|at| meeting(MeetingKind::Touching, at)))
    }

    /// Solid shells that lie in material of others, but for those that cross anyway.
    fn contained(&self, crosses: &[bool]) -> Vec<ShellMeeting> {
        let wanted = |shell: &u32| {
            let s = self.shell(*shell);
            !crosses[*shell as usize]
                && !self.partners[*shell as usize].is_empty()
                && s.is_closed()
                && s.volume_mm3 > 0.0
        };
        let shells: Vec<u32> = (0..crosses.len() as u32).filter(wanted).collect();
        let is_near =
            |shell: u32| !self.partners[shell as usize].is_empty() && self.shell(shell).is_closed();
        let rays = Rays::new(self.solid, POINTS * shells.len(), is_near);
        shells.into_iter().filter_map(|shell| self.container(&rays, shell)).collect()
    }

    fn container(&self, rays: &Rays<'_>, shell: u32) -> Option<ShellMeeting> {
        let own = &self.triangles[shell as usize];
        let step = own.len().div_ceil(TRIES).max(1);
        let points = own.iter().step_by(step).map(|t| odd_point(&self.solid.mesh().corners(*t)));
        let within_another = |p: &Point3<f64>| {
            let bounds = |partner: &u32| self.shell(*partner).bounds.grown(-self.depth);
            self.partners[shell as usize].iter().any(|partner| holds(&bounds(partner), p))
        };
        let windings = points
            .filter(within_another)
            .filter_map(|p| Some((p, rays.windings(&p, shell, self.depth)?)))
            .take(POINTS);
        for (at, windings) in windings {
            let sum: i32 = windings.iter().map(|(_, winding)| winding).sum();
            let container = windings.iter().find(|(_, winding)| *winding > 0);
            if let (1.., Some(&(other, _))) = (sum, container)
                && !rays.touches(&at, other, self.depth)
            {
                let kind = MeetingKind::Inside;
                return Some(ShellMeeting { kind, shells: [shell, other], at });
            }
        }
        None
    }
}

fn meet(a: &Bounds, b: &Bounds) -> bool {
    (0..3).all(|k| a.min[k] <= b.max[k] && b.min[k] <= a.max[k])
}

fn holds(bounds: &Bounds, p: &Point3<f64>) -> bool {
    (0..3).all(|k| bounds.min[k] < p[k] && p[k] < bounds.max[k])
}

/// What two boxes have in common, grown by `depth`.
fn common(a: &Bounds, b: &Bounds, depth: f64) -> Bounds {
    Bounds { min: a.min.sup(&b.min), max: a.max.inf(&b.max) }.grown(depth)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Mesh;
    use crate::shapes;
    use nalgebra::Isometry3;

    fn inside_out(mut mesh: Mesh) -> Mesh {
        mesh.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        mesh
    }

    fn all(meshes: &[Mesh]) -> Solid {
        let mut sum = Mesh::default();
        for mesh in meshes {
            let n = sum.vertices.len() as u32;
            sum.vertices.extend(&mesh.vertices);
            sum.triangles.extend(mesh.triangles.iter().map(|t| t.map(|v| v + n)));
        }
        Solid::new(sum)
    }

    fn cube(side: f64, x: f64, y: f64, z: f64) -> Mesh {
        shapes::cube(side).transformed(&Isometry3::translation(x, y, z))
    }

    fn kinds(meshes: &[Mesh]) -> Vec<(MeetingKind, [u32; 2])> {
        shell_meetings(&all(meshes)).iter().map(|m| (m.kind, m.shells)).collect()
    }

    #[test]
    fn cubes_that_overlap() {
        use MeetingKind::{Crossing, Inside};
        let diagonal = [cube(20.0, 0.0, 0.0, 0.0), cube(20.0, 7.3, 5.1, 3.7)];
        assert_eq!(kinds(&diagonal), [(Crossing, [0, 1])]);
        assert!(!self_intersections(&all(&diagonal), 5).is_empty());
        // Four walls in common planes: no side passes through another's inside.
        let along = [cube(20.0, -5.0, 0.0, 0.0), cube(20.0, 5.0, 0.0, 0.0)];
        assert_eq!(kinds(&along), [(Inside, [0, 1]), (Inside, [1, 0])]);
        let nested = [cube(20.0, 0.0, 0.0, 0.0), cube(10.0, 0.0, 0.0, 5.0)];
        assert_eq!(kinds(&nested), [(Inside, [1, 0])]);
    }

    #[test]
    fn cavities_and_dolls_are_in_order() {
        let hollow = [cube(20.0, 0.0, 0.0, 0.0), inside_out(cube(10.0, 0.0, 0.0, 5.0))];
        assert_eq!(kinds(&hollow), []);
        let dolls = [
            cube(40.0, 0.0, 0.0, 0.0),
            inside_out(cube(30.0, 0.0, 0.0, 5.0)),
            cube(20.0, 0.0, 0.0, 10.0),
            inside_out(cube(10.0, 0.0, 0.0, 15.0)),
        ];
        assert_eq!(kinds(&dolls), []);
    }

    #[test]
    fn cubes_that_touch() {
        use MeetingKind::Touching;
        let beside = [cube(20.0, -10.0, 0.0, 0.0), cube(20.0, 10.0, 0.0, 0.0)];
        assert_eq!(kinds(&beside), [(Touching, [0, 1])]);
        let on_top = [cube(20.0, 0.0, 0.0, 0.0), cube(10.0, 3.0, 0.0, 20.0)];
        assert_eq!(kinds(&on_top), [(Touching, [0, 1])]);
        let apart = [cube(20.0, -11.0, 0.0, 0.0), cube(20.0, 10.0, 0.0, 0.0)];
        assert_eq!(kinds(&apart), []);
        let corner = [cube(20.0, -10.0, -10.0, 0.0), cube(20.0, 10.0, 10.0, 0.0)];
        assert_eq!(kinds(&corner), []);
        // A ring made of a cylinder and a hole whose ends lie in the same planes.
        let outer = shapes::extruded(&circle(40.0), &[], 10.0);
        let inner = inside_out(shapes::extruded(&circle(30.0), &[], 10.0));
        assert_eq!(kinds(&[outer, inner]), []);
    }

    fn circle(radius: f64) -> Vec<[f64; 2]> {
        let at = |i: u32| (f64::from(i) / 90.0 * std::f64::consts::PI).sin_cos();
        (0..180).map(at).map(|(sin, cos)| [radius * cos, radius * sin]).collect()
    }

    #[test]
    fn touching_survives_rounding() {
        // Turned and rounded to f32, walls miss each other by some rounding.
        let turn = Isometry3::rotation(nalgebra::Vector3::new(0.3, -0.2, 0.7));
        let mut meshes = [cube(20.0, -10.0, 0.0, 0.0), cube(17.0, 8.5, 1.0, 0.0)];
        for mesh in &mut meshes {
            *mesh = mesh.transformed(&turn);
            mesh.vertices.iter_mut().for_each(|p| *p = p.map(|c| f64::from(c as f32)));
        }
        assert_eq!(kinds(&meshes), [(MeetingKind::Touching, [0, 1])]);
    }

    #[test]
    fn sound_shapes_do_not_meet_themselves() {
        for name in shapes::NAMES {
            let solid = Solid::new(shapes::by_name(name).unwrap());
            assert_eq!(self_intersections(&solid, 5), [], "{name}");
            assert_eq!(shell_meetings(&solid), [], "{name}");
        }
    }
}

//! What is at the bottom of a part when some direction goes down.

use super::classes::Class;
use super::{BED_SHARE, Candidate, OrientParams, PIECE, SAME_SHARE, STAND_DEPTH_SHARE};
use crate::mesh::Mesh;
use nalgebra::{Point3, Vector3};
use rayon::prelude::*;

/// A candidate, and whether it would stand.
pub(super) struct Lying {
    pub(super) candidate: Candidate,
    /// Area that faces down within [`STAND_DEPTH_SHARE`] of the bed, mm².
    pub(super) stand_mm2: f64,
}

/// A mesh, and what a way to lie is judged by.
pub(super) struct View<'a> {
    pub(super) mesh: &'a Mesh,
    /// Area of the surface, mm².
    pub(super) total_mm2: f64,
    /// Diagonal of the box around the mesh, mm.
    pub(super) diagonal: f64,
    /// Cosine of the angle within which facets belong to a class.
    of_class: f64,
    /// Sine of the angle beyond which facets that face down need support.
    steep: f64,
}

/// Areas at one end of a direction, mm².
#[derive(Clone, Copy, Default)]
struct Areas {
    /// Facing down and on the bed.
    bed: f64,
    /// Facing down and near to the bed.
    stand: f64,
    /// Facing down too steeply and not on the bed.
    overhang: f64,
}

/// How far a mesh reaches along a direction, mm: from and to.
type Extent = [f64; 2];

impl<'a> View<'a> {
    pub(super) fn of(mesh: &'a Mesh, total_mm2: f64, params: &OrientParams) -> Self {
        Self {
            mesh,
            total_mm2,
            diagonal: mesh.bounds().diagonal(),
            of_class: params.class_tolerance_rad.cos(),
            steep: params.overhang_rad.sin() + SAME_SHARE,
        }
    }

    /// Returns the candidates of some classes: the direction of each and its opposite, in one pass
    /// over the mesh.
    pub(super) fn lying(&self, classes: &[Class]) -> Vec<Lying> {
        let extents = self.extents(classes);
        let sides: Vec<_> = classes.iter().map(|class| class.direction).zip(extents).collect();
        let piece = |triangles: &[[u32; 3]]| {
            let mut areas = vec![[Areas::default(); 2]; sides.len()];
            for corners in triangles {
                self.count(corners, &sides, &mut areas);
            }
            areas
        };
        let pieces: Vec<_> = self.mesh.triangles.par_chunks(PIECE).map(piece).collect();
        let mut lying = Vec::with_capacity(2 * classes.len());
        for (k, (class, (direction, [from, to]))) in classes.iter().zip(&sides).enumerate() {
            for (way, down) in [*direction, -direction].into_iter().enumerate() {
                let mut areas = Areas::default();
                pieces.iter().for_each(|piece| areas.add(&piece[k][way]));
                let candidate = Candidate {
                    // Adding zero makes -0 into 0, which reads better in a report.
                    down: down.map(|c| c + 0.0),
                    class_area_mm2: class.area_mm2,
                    bed_area_mm2: areas.bed,
                    height_mm: to - from,
                    overhang_area_mm2: areas.overhang,
                };
                lying.push(Lying { candidate, stand_mm2: areas.stand });
            }
        }
        lying
    }

    /// How far the mesh reaches along the directions of classes.
    fn extents(&self, classes: &[Class]) -> Vec<Extent> {
        const NONE: Extent = [f64::INFINITY, f64::NEG_INFINITY];
        let wider = |a: Extent, b: Extent| [a[0].min(b[0]), a[1].max(b[1])];
        let piece = |points: &[Point3<f64>]| -> Vec<Extent> {
            let along = |class: &Class| {
                let depths = points.iter().map(|p| p.coords.dot(&class.direction));
                depths.fold(NONE, |extent, depth| wider(extent, [depth, depth]))
            };
            classes.iter().map(along).collect()
        };
        let both = |a: Vec<Extent>, b: Vec<Extent>| -> Vec<Extent> {
            a.into_iter().zip(b).map(|(a, b)| wider(a, b)).collect()
        };
        let pieces = self.mesh.vertices.par_chunks(PIECE).map(piece);
        pieces.reduce(|| vec![NONE; classes.len()], both)
    }

    /// Counts a triangle for each direction and its opposite.
    fn count(
        &self,
        corners: &[u32; 3],
        sides: &[(Vector3<f64>, Extent)],
        areas: &mut [[Areas; 2]],
    ) {
        let points = corners.map(|v| self.mesh.vertices[v as usize]);
        let twice = (points[1] - points[0]).cross(&(points[2] - points[0]));
        let length = twice.norm();
        let area = length / 2.0;
        let (flat, steep) = (self.of_class * length, self.steep * length);
        for ((direction, [from, to]), areas) in sides.iter().zip(areas) {
            let facing = twice.dot(direction);
            if facing.abs() < flat.min(steep) {
                continue;
            }
            let way = usize::from(facing < 0.0);
            let areas = &mut areas[way];
            // How far above the bed the highest corner is.
            let above = || {
                let depths = points.map(|p| p.coords.dot(direction));
                let [a, b, c] =
                    if way == 0 { depths.map(|d| to - d) } else { depths.map(|d| d - from) };
                a.max(b).max(c)
            };
            let above = if facing.abs() >= flat { above() } else { f64::INFINITY };
            if above <= STAND_DEPTH_SHARE * self.diagonal {
                areas.stand += area;
            }
            if above <= BED_SHARE * self.diagonal {
                areas.bed += area;
            } else if facing.abs() > steep {
                areas.overhang += area;
            }
        }
    }
}

impl Areas {
    fn add(&mut self, other: &Self) {
        self.bed += other.bed;
        self.stand += other.stand;
        self.overhang += other.overhang;
    }
}

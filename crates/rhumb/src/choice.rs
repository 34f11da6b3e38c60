//! Which surface suits a part: planes, cones or spheres (`layers = auto`).
//!
//! Of the slopes that the nozzle clears, the cone and the sphere that leave the least area
//! unsupported are tried against planes. Each of the three is sliced, for its time, and weighed:
//!
//! * unsupported area, as a share of what planes leave unsupported: it droops, or wants supports;
//! * stair steps, as the mean height of a step on the outside by the thickness of a layer;
//! * time, by that of planes.
//!
//! A face that is a part of one sphere about the axis, as that of a lens, adds two: layers about its centre,
//! which have no steps on it, from the bed up, and on a planar base as high as the part is straight. The
//! best curved surface is tried on such a base, too, where there is one.
//!
//! Planes win where nothing else is clearly better.

use machine::gcode::decimal;
use mesh::mesh::Mesh;
use mesh::topology::Solid;
use nalgebra::{Point3, Vector3};
use slicer::surface::{LayerSurface, Plane};

use crate::failure::Failure;
use crate::overhang::overhangs;
use crate::ranges::{Follows, Span};
use crate::settings::Job;
use crate::stages::{LayerKind, radius, stages};

/// A surface that was weighed.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// The surface.
    pub kind: LayerKind,
    /// Height of the planar layers below it, mm, where more than the usual few are tried.
    pub base: Option<f64>,
    /// Area that hangs over, mm².
    pub unsupported: f64,
    /// Mean height of the steps on the outside, by the thickness of a layer: 0 to 1.
    pub steps: f64,
    /// Estimated time, s.
    pub time: f64,
    /// What all that comes to; the least wins.
    pub cost: f64,
}

impl Candidate {
    /// Says what it is.
    #[must_use]
    pub fn describe(&self) -> String {
        match self.base {
            Some(base) => {
                format!("planar up to {} mm, then {}", decimal(base, 3), self.kind.describe())
            }
            None => self.kind.describe(),
        }
    }

    /// Returns a job with these layers.
    #[must_use]
    pub fn job(&self, job: &Job) -> Job {
        with(job, self.kind, self.base)
    }
}

/// A job with layers of a kind, on a planar base of this height.
fn with(job: &Job, kind: LayerKind, base: Option<f64>) -> Job {
    let mut job = job.with_layers(kind);
    if base.is_some() {
        let planar = Follows::Family(LayerKind::Planar);
        job.spans = vec![
            Span { follows: planar, from: Some(0.0), to: base },
            Span { follows: Follows::Family(kind), from: base, to: None },
        ];
    }
    job
}

/// What was chosen and why.
#[derive(Debug, Clone, PartialEq)]
pub struct Choice {
    /// All that were weighed, planes first.
    pub candidates: Vec<Candidate>,
    /// Index of the one that was chosen.
    pub chosen: usize,
    /// The steepest slope that was tried, radians: what the nozzle clears.
    pub steepest: f64,
}

impl Choice {
    /// Returns the one that was chosen.
    #[must_use]
    pub fn best(&self) -> &Candidate {
        &self.candidates[self.chosen]
    }

    /// Says why, in a sentence.
    #[must_use]
    pub fn why(&self) -> String {
        let planes = &self.candidates[0];
        let best = &self.candidates[self.chosen];
        if self.chosen > 0 && planes.unsupported - best.unsupported < NEGLIGIBLE_MM2 {
            return format!(
                "{} leaves steps of {:.2} of a layer outside, planes of {:.2}",
                best.describe(),
                best.steps,
                planes.steps
            );
        }
        if self.chosen > 0 {
            return format!(
                "{} leaves {:.0} mm² unsupported, planes {:.0} mm²",
                best.describe(),
                best.unsupported,
                planes.unsupported
            );
        }
        let rival = self.candidates[1..].iter().min_by(|a, b| a.cost.total_cmp(&b.cost));
        match rival {
            None => "the nozzle clears no other surface in this part".into(),
            Some(_) if planes.unsupported < NEGLIGIBLE_MM2 => {
                "planes leave nothing unsupported".into()
            }
            Some(rival) => format!(
                "{} would leave {:.0} mm² unsupported, planes leave {:.0} mm²: not worth it",
                rival.describe(),
                rival.unsupported,
                planes.unsupported
            ),
        }
    }
}

/// Slopes that are tried lie this far apart, radians (5°).
const SLOPE_STEP: f64 = std::f64::consts::PI / 36.0;

/// Unsupported area that nobody sees, mm².
const NEGLIGIBLE_MM2: f64 = 1.0;

/// What a share of unsupported area is worth, to a share of time.
const UNSUPPORTED_WEIGHT: f64 = 2.0;

/// What steps as high as a layer everywhere are worth, likewise.
const STEPS_WEIGHT: f64 = 0.5;

/// How much better another surface must be than planes.
const CLEARLY: f64 = 0.15;

/// Weighs the surfaces for a part; `time` slices it and says how long the print takes.
///
/// # Errors
///
/// What slicing with planes fails with; other surfaces that fail are left out.
pub fn choose(
    solid: &Solid,
    job: &Job,
    mut time: impl FnMut(&Job) -> Result<f64, Failure>,
) -> Result<Choice, Failure> {
    let part = solid.mesh();
    let fits = |kind: &LayerKind| stages(solid, &job.with_layers(*kind)).is_ok();
    let slopes = || (1..).map(|k| f64::from(k) * SLOPE_STEP).take_while(|a| *a < STEEPEST);
    let reach = radius(part);
    let cones = slopes().flat_map(|a| [LayerKind::Conical(a), LayerKind::Conical(-a)]);
    let spheres = slopes().map(|a| LayerKind::Spherical(-reach / a.tan()));
    let mut steepest = 0.0_f64;
    let mut finalists = vec![LayerKind::Planar];
    let families: [Vec<LayerKind>; 2] = [cones.collect(), spheres.collect()];
    for family in families {
        let mut best: Option<(f64, LayerKind)> = None;
        for kind in family.into_iter().filter(|kind| fits(kind)) {
            if let LayerKind::Conical(angle) = kind {
                steepest = steepest.max(angle.abs());
            }
            let unsupported = unsupported(part, kind, job)?;
            // Of equals the flattest.
            if best.is_none_or(|(least, _)| unsupported < least - NEGLIGIBLE_MM2) {
                best = Some((unsupported, kind));
            }
        }
        finalists.extend(best.map(|(_, kind)| kind));
    }
    let straight = straight_height(part)
        .filter(|height| *height >= job.schedule.layer_height * LEAST_BASE_LAYERS as f64);
    let mut wanted: Vec<(LayerKind, Option<f64>)> =
        finalists.into_iter().map(|kind| (kind, None)).collect();
    let face = face_centre(part).map(LayerKind::Spherical).filter(fits);
    if let Some(face) = face {
        wanted.push((face, None));
        wanted.extend(straight.map(|base| (face, Some(base))));
    }
    let mut candidates: Vec<Candidate> = Vec::new();
    let mut weigh = |kind: LayerKind, base: Option<f64>, candidates: &mut Vec<Candidate>| {
        let seconds = match time(&with(job, kind, base)) {
            Ok(seconds) => seconds,
            Err(failure) if kind == LayerKind::Planar => return Err(failure),
            Err(_) => return Ok(()),
        };
        let unsupported = unsupported(part, kind, job)?;
        let steps = steps(part, kind, base.unwrap_or(0.0))?;
        let planes = candidates.first();
        let of_planes = planes.map_or(unsupported, |p| p.unsupported).max(NEGLIGIBLE_MM2);
        let share = if unsupported < NEGLIGIBLE_MM2 { 0.0 } else { unsupported / of_planes };
        let slower = planes.map_or(1.0, |p| seconds / p.time);
        // What hangs over by a hundredth of the outside matters as much as a tenth more time.
        let weight = (of_planes / outside(part) * 10.0).min(1.0);
        let cost = UNSUPPORTED_WEIGHT * weight * share + STEPS_WEIGHT * steps + slower;
        candidates.push(Candidate { kind, base, unsupported, steps, time: seconds, cost });
        Ok(())
    };
    for (kind, base) in wanted {
        weigh(kind, base, &mut candidates)?;
    }
    // The best so far, on a base, where that is clearly better than planes.
    let best = least(&candidates).map(|k| (candidates[k].kind, candidates[k].base));
    if let (Some((kind, None)), Some(base)) = (best, straight)
        && Some(kind) != face
    {
        weigh(kind, Some(base), &mut candidates)?;
    }
    let chosen = least(&candidates).unwrap_or(0);
    Ok(Choice { candidates, chosen, steepest })
}

/// The curved surface that costs least, where that is clearly less than planes do.
fn least(candidates: &[Candidate]) -> Option<usize> {
    let planes = candidates.first()?.cost - CLEARLY;
    (1..candidates.len())
        .filter(|&k| candidates[k].cost < planes)
        .min_by(|&a, &b| candidates[a].cost.total_cmp(&candidates[b].cost))
}

/// A planar base of fewer layers is what curved layers stand on anyway.
const LEAST_BASE_LAYERS: usize = 3;

/// How far facets may lean and be upright or level, as a sine: what files round.
const UPRIGHT: f64 = 1e-3;

/// Up to which height a part has nothing but upright sides, and level faces that face down on the bed, mm;
/// `None` where it has nothing else at all.
fn straight_height(part: &Mesh) -> Option<f64> {
    let on_bed = |z: f64| z.abs() < UPRIGHT;
    let lowest = part.triangles.iter().enumerate().filter_map(|(index, triangle)| {
        let n = part.area_vector(index as u32).try_normalize(0.0)?;
        let z = triangle.map(|v| part.vertices[v as usize].z);
        let is_straight = n.z.abs() < UPRIGHT || n.z < 0.0 && z.into_iter().all(on_bed);
        (!is_straight).then(|| z[0].min(z[1]).min(z[2]))
    });
    let lowest = lowest.fold(f64::INFINITY, f64::min);
    lowest.is_finite().then_some(lowest)
}

/// How far the corners of a face may lie off its sphere, mm: what files round, and no more than a tenth of a
/// layer.
const OFF_SPHERE_MM: f64 = 0.02;

/// Least area of a face that is worth a family of its own, as a share of the outside.
const LEAST_FACE_SHARE: f64 = 0.1;

/// Height of the centre of the sphere, about a point of the axis, that all of a part's sloping facets that
/// face up lie on, mm.
fn face_centre(part: &Mesh) -> Option<f64> {
    let (mut area, mut corners) = (0.0, Vec::new());
    for (index, triangle) in part.triangles.iter().enumerate() {
        let vector = part.area_vector(index as u32);
        let Some(n) = vector.try_normalize(0.0) else { continue };
        if n.z > UPRIGHT {
            area += vector.norm();
            corners.extend(triangle.map(|v| part.vertices[v as usize]));
        }
    }
    if corners.is_empty() || area < LEAST_FACE_SHARE * outside(part) {
        return None;
    }
    // x² + y² + z² = 2·centre·z + (radius² − centre²): a line through (z, square).
    let count = corners.len() as f64;
    let mean = |value: &dyn Fn(&Point3<f64>) -> f64| corners.iter().map(value).sum::<f64>() / count;
    let square = |p: &Point3<f64>| p.coords.norm_squared();
    let (z, squares) = (mean(&|p| p.z), mean(&square));
    let spread = mean(&|p| (p.z - z).powi(2));
    let centre = mean(&|p| (p.z - z) * (square(p) - squares)) / spread / 2.0;
    let distance = |p: &Point3<f64>| p.x.hypot(p.y).hypot(p.z - centre);
    let radius = mean(&distance);
    let is_sphere = corners.iter().all(|p| (distance(p) - radius).abs() <= OFF_SPHERE_MM);
    (centre.is_finite() && is_sphere).then_some(centre)
}

/// Nothing steeper is tried, radians (50°): beads would slide.
const STEEPEST: f64 = 50.5 / 180.0 * std::f64::consts::PI;

fn surface(kind: LayerKind) -> Result<Box<dyn LayerSurface>, Failure> {
    kind.surface().map_err(|error| Failure::new("OutOfEnvelope", error.to_string()))
}

fn unsupported(part: &Mesh, kind: LayerKind, job: &Job) -> Result<f64, Failure> {
    Ok(overhangs(part, &*surface(kind)?, job.orient.overhang_rad).chosen)
}

fn outside(part: &Mesh) -> f64 {
    (0..part.triangles.len() as u32).map(|k| part.area_vector(k).norm()).sum()
}

/// The mean of |n·N| over the outside, where the layers do not lie along it; below `base` mm they are planes.
fn steps(part: &Mesh, kind: LayerKind, base: f64) -> Result<f64, Failure> {
    /// Facets as flat as this in their layers have no steps.
    const ALONG: f64 = 0.9999;
    let surface = surface(kind)?;
    let surface: &dyn LayerSurface = if kind == LayerKind::Planar { &Plane } else { &*surface };
    let (mut sum, mut all) = (0.0, 0.0);
    for (index, triangle) in part.triangles.iter().enumerate() {
        let vector = part.area_vector(index as u32);
        let area = vector.norm();
        if area == 0.0 {
            continue;
        }
        let corners = triangle.map(|v| part.vertices[v as usize].coords);
        let centre = Point3::from((corners[0] + corners[1] + corners[2]) / 3.0);
        let normal = if centre.z < base { Vector3::z() } else { surface.normal(&centre) };
        let along = (vector / area).dot(&normal).abs();
        all += area;
        sum += if along < ALONG { along * area } else { 0.0 };
    }
    Ok(if all > 0.0 { sum / all } else { 0.0 })
}

#[cfg(test)]
mod tests {
    use super::*;
    use mesh::shapes;

    #[test]
    fn the_face_of_a_lens_is_found_and_where_it_begins() {
        // A face of 60 mm over a rim of 1 mm.
        let arc = |k: u32| {
            let r = 20.0 * f64::from(k) / 32.0;
            [r, 1.0 + (3600.0 - r * r).sqrt() - 3200.0_f64.sqrt()]
        };
        let mut outline = vec![[0.0, 0.0], [20.0, 0.0]];
        outline.extend((0..=32).rev().map(arc));
        let lens = shapes::revolved(&outline, 96);
        let centre = face_centre(&lens).unwrap();
        assert!((centre - (1.0 - 3200.0_f64.sqrt())).abs() < 1e-3, "{centre}");
        assert!((straight_height(&lens).unwrap() - 1.0).abs() < 1e-9);
    }

    #[test]
    fn other_parts_have_no_such_face() {
        assert_eq!(face_centre(&shapes::cube(10.0)), None);
        assert_eq!(face_centre(&shapes::mushroom(48)), None);
        assert_eq!(straight_height(&shapes::cube(10.0)), Some(10.0));
    }
}

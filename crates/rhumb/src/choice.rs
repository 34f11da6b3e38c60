//! Which surface suits a part: planes, cones or spheres (`layers = auto`).
//!
//! Of the slopes that the nozzle clears, the cone and the sphere that leave the least area
//! unsupported are tried against planes. Each of the three is sliced, for its time, and weighed:
//!
//! * unsupported area, as a share of what planes leave unsupported: it droops, or wants supports;
//! * stair steps, as the mean height of a step on the outside by the thickness of a layer;
//! * time, by that of planes.
//!
//! Planes win where nothing else is clearly better.

use mesh::mesh::Mesh;
use mesh::topology::Solid;
use nalgebra::Point3;
use slicer::surface::{LayerSurface, Plane};

use crate::failure::Failure;
use crate::overhang::overhangs;
use crate::settings::Job;
use crate::stages::{LayerKind, radius, stages};

/// A surface that was weighed.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    /// The surface.
    pub kind: LayerKind,
    /// Area that hangs over, mm².
    pub unsupported: f64,
    /// Mean height of the steps on the outside, by the thickness of a layer: 0 to 1.
    pub steps: f64,
    /// Estimated time, s.
    pub time: f64,
    /// What all that comes to; the least wins.
    pub cost: f64,
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
        if self.chosen > 0 {
            return format!(
                "{} leaves {:.0} mm² unsupported, planes {:.0} mm²",
                best.kind.describe(),
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
                rival.kind.describe(),
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
    let mut candidates: Vec<Candidate> = Vec::new();
    for kind in finalists {
        let seconds = match time(&job.with_layers(kind)) {
            Ok(seconds) => seconds,
            Err(failure) if kind == LayerKind::Planar => return Err(failure),
            Err(_) => continue,
        };
        let (unsupported, steps) = (unsupported(part, kind, job)?, steps(part, kind)?);
        let planes = candidates.first();
        let of_planes = planes.map_or(unsupported, |p| p.unsupported).max(NEGLIGIBLE_MM2);
        let share = if unsupported < NEGLIGIBLE_MM2 { 0.0 } else { unsupported / of_planes };
        let slower = planes.map_or(1.0, |p| seconds / p.time);
        // What hangs over by a hundredth of the outside matters as much as a tenth more time.
        let weight = (of_planes / outside(part) * 10.0).min(1.0);
        let cost = UNSUPPORTED_WEIGHT * weight * share + STEPS_WEIGHT * steps + slower;
        candidates.push(Candidate { kind, unsupported, steps, time: seconds, cost });
    }
    let planes = candidates[0].cost - CLEARLY;
    let chosen = (1..candidates.len())
        .filter(|&k| candidates[k].cost < planes)
        .min_by(|&a, &b| candidates[a].cost.total_cmp(&candidates[b].cost));
    Ok(Choice { candidates, chosen: chosen.unwrap_or(0), steepest })
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

/// The mean of |n·N| over the outside, where the layers do not lie along it.
fn steps(part: &Mesh, kind: LayerKind) -> Result<f64, Failure> {
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
        let along = (vector / area).dot(&surface.normal(&centre)).abs();
        all += area;
        sum += if along < ALONG { along * area } else { 0.0 };
    }
    Ok(if all > 0.0 { sum / all } else { 0.0 })
}

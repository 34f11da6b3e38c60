//! What a print would take, from a few sums over its surface: good enough to tell poses apart,
//! made without slicing.
//!
//! Walls follow the outlines of all levels, whose length times height is the surface seen from the
//! side. Skins cover what is seen from above and below. The rest of the volume is filled at the
//! density asked for. Lines run at their speeds, or as fast as filament melts; each layer takes at
//! least the time that it needs to cool. Travel and acceleration take half as much again, which
//! is what they take on the bundled models within an eighth; fine detail takes more.

use mesh::orient::Rating;
use plan::planner::PlanParams;
use slicer::bead::Bead;

use crate::settings::Job;

/// Planned time by the time of the lines alone: from 1.31 to 1.57 on seven of the bundled models
/// with the usual settings.
const WITH_TRAVEL: f64 = 1.5;

/// An estimate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// Number of layers.
    pub layers: f64,
    /// Mean stair step of what is not flat, mm.
    pub stair: f64,
    /// Time, s.
    pub time: f64,
}

/// Estimates the print of a part of a height (mm) and a volume (mm³) in some pose.
#[must_use]
pub fn estimate(rating: &Rating, height: f64, volume: f64, job: &Job) -> Estimate {
    let thickness = job.schedule.layer_height;
    let above_first = (height - job.schedule.first_layer_height).max(0.0);
    let layers = 1.0 + (above_first / thickness).round();
    let (walls, fill, speeds) = (&job.paths.walls, &job.paths.infill, &job.plan.speeds);
    let mut left = volume;
    let mut time = 0.0;
    // What is inside is left over when what is outside is laid; a thin part is all walls.
    let mut lay = |wanted: f64, width: f64, speed: f64| {
        let laid = wanted.min(left).max(0.0);
        left -= laid;
        time += laid / flow(width, thickness, speed, &job.plan);
    };
    for wall in 0..walls.count {
        let (width, speed) = match wall {
            0 => (walls.external_width, speeds.external_perimeter),
            _ => (walls.width, speeds.perimeter),
        };
        let spacing = Bead { width, thickness }.spacing();
        lay(rating.outline_mm2 * spacing, width, speed);
    }
    let skins = &job.paths.skins;
    let solid =
        rating.top_mm2 * skins.top_layers as f64 + rating.bottom_mm2 * skins.bottom_layers as f64;
    lay(solid * thickness, fill.solid_width, speeds.solid_infill);
    let sparse = left * fill.density;
    time += sparse / flow(fill.width, thickness, speeds.infill, &job.plan);
    let time = (time * WITH_TRAVEL).max(layers * job.plan.cooling.least_layer_time);
    Estimate { layers, stair: rating.stairs * thickness, time }
}

/// Volume laid in a second, mm³.
fn flow(width: f64, thickness: f64, speed: f64, plan: &PlanParams) -> f64 {
    let area = Bead { width, thickness }.spacing() * thickness;
    (area * speed).min(plan.filament.volume_per_second)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::interrupt::Interrupt;
    use crate::pipeline::{Request, Watch, slice};
    use crate::place::{Pose, Wish};
    use crate::progress::Silent;
    use crate::settings::Settings;
    use mesh::orient::{candidates, laid, rate};
    use mesh::{measure, shapes, stl};

    #[test]
    fn estimates_are_near_what_is_planned() {
        let settings = Settings::defaults();
        let job = Job::resolve(&settings).unwrap();
        for name in ["cube", "steps", "mushroom"] {
            let mesh = shapes::by_name(name).unwrap();
            let upright = candidates(&mesh, &job.orient)
                .into_iter()
                .find(|c| (c.down.z + 1.0).abs() < 1e-9)
                .unwrap();
            assert_eq!(laid(&mesh, &upright), nalgebra::Rotation3::identity());
            let rating = rate(&mesh, &upright, &job.orient);
            let volume = measure::volume_mm3(&mesh);
            let found = estimate(&rating, upright.height_mm, volume, &job);
            let model = stl::write(&mesh);
            let request = Request {
                model: &model,
                name,
                wish: Wish { pose: Pose::Keep, ..Wish::default() },
                settings: &settings,
                job: &job,
                made_at: "now",
            };
            let watch = &mut Watch { progress: &mut Silent, interrupt: &Interrupt::default() };
            let outcome = slice(&request, &mut std::io::sink(), watch).unwrap();
            assert_eq!(outcome.layout.levels.len() as f64, found.layers, "{name}");
            let ratio = outcome.totals.time / found.time;
            assert!((0.87..1.15).contains(&ratio), "{name}: {ratio}");
        }
    }
}

//! The layers of a part: its flat faces, the schedule that meets them, and what is said of those
//! that it misses.

use std::fmt::Write as _;

use machine::gcode::decimal;
use mesh::flats::{Facing, Flat, flats};
use mesh::mesh::Mesh;
use slicer::level::{
    Extent, FlatFace, Level, ScheduleParams, Snap, adaptive, cost, misses, schedule,
};
use slicer::surface::LayerSurface;

use crate::failure::Failure;
use crate::ranges::LaidSpan;
use crate::report::{self, Warning};
use crate::settings::Job;

/// More layers than any printer lays: a setting or a unit is wrong.
const MOST_LAYERS: f64 = 100_000.0;

/// More than this is a minute of work for the schedule: a very fine increment on a tall part.
const MOST_STEPS: f64 = 2e8;

/// A flat face and how far the nearest layer misses it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MetFlat {
    /// The face.
    pub flat: Flat,
    /// Distance of the nearest bound of a layer, mm.
    pub miss: f64,
    /// Whether the schedule was asked to meet it.
    pub wanted: bool,
}

/// A flat face that planar layers were to finish and do not.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SteppedFlat {
    /// The face.
    pub flat: Flat,
    /// Why it is left.
    pub why: Why,
}

/// Why curved layers end on a flat face in steps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Why {
    /// No curved layer would fit below the planar ones.
    NoRoom,
    /// It lies within the planar layers that curved ones stand on, or too little above.
    InBase,
    /// It lies where cones grow out of planes, or too little above.
    InBlend,
    /// A flat top at this height is met, mm, and no layer fits between.
    Near(f64),
    /// So much that looks down would hang on the planar layers below it, mm².
    Hangs(f64),
}

impl SteppedFlat {
    /// Why it is left, in words.
    fn why(&self) -> String {
        match self.why {
            Why::NoRoom => "no curved layer would fit below the planar ones".into(),
            Why::InBase => "it lies within the base layers, or less than a layer above them".into(),
            Why::InBlend => "it lies where the layers grow from planes to cones".into(),
            Why::Near(z) => {
                format!("no layer fits between it and the flat top at {} mm", decimal(z, 3))
            }
            Why::Hangs(area) => format!(
                "{} mm² of the part look down there and would hang on planar layers",
                decimal(area, 1)
            ),
        }
    }
}

/// The layers, and what became of the flat faces.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Layout {
    /// The layers.
    pub levels: Vec<Level>,
    /// The flat faces, from the bed up.
    pub flats: Vec<MetFlat>,
    /// Flat faces facing up that planar layers were to finish, and that curved ones end on in steps.
    pub stepped: Vec<SteppedFlat>,
    /// What the ranges of heights came to be, where layers are given by those.
    pub spans: Vec<LaidSpan>,
    /// The words of those that begin above the part, or within a blend that it ends in.
    pub unreached: Vec<&'static str>,
    /// What is still a hit, mm: half an increment, and the rounding of a level.
    pub tolerance: f64,
}

/// Lays out the layers of a part that stands on the bed.
///
/// # Errors
///
/// `LimitExceeded`.
pub fn layout(part: &Mesh, surface: &dyn LayerSurface, job: &Job) -> Result<Layout, Failure> {
    let params = &job.schedule;
    let top = part.bounds().max.z;
    check_cost(top, job)?;
    let flats = flats(part, &job.flats);
    let face = |flat: &Flat| FlatFace { level: flat.z_mm, area: flat.area_mm2 };
    let is_wanted = |flat: &&Flat| flat.area_mm2 >= job.least_flat_mm2;
    let wanted: Vec<FlatFace> = flats.iter().filter(is_wanted).map(face).collect();
    let caps = params
        .adaptive
        .map(|adaptive| adaptive::caps(part, surface, top, params, &adaptive))
        .unwrap_or_default();
    let levels = schedule(&Extent { top, flats: &wanted, caps: &caps }, params);
    let all: Vec<FlatFace> = flats.iter().map(face).collect();
    let flats = flats
        .iter()
        .zip(misses(&levels, &all))
        .map(|(flat, miss)| MetFlat { flat: *flat, miss, wanted: is_wanted(&flat) })
        .collect();
    const ROUNDING_MM: f64 = 1e-6;
    Ok(Layout {
        levels,
        flats,
        stepped: Vec::new(),
        spans: Vec::new(),
        unreached: Vec::new(),
        tolerance: params.increment / 2.0 + ROUNDING_MM,
    })
}

/// Lays out planar layers of the wanted height, from 0 to `height`; the first is `first` thick.
///
/// # Errors
///
/// `LimitExceeded`.
pub(crate) fn planes(
    height: f64,
    flats: &[FlatFace],
    first: f64,
    job: &Job,
) -> Result<Vec<Level>, Failure> {
    check_cost(height, job)?;
    let params = ScheduleParams { first_layer_height: first, adaptive: None, ..job.schedule };
    Ok(schedule(&Extent { top: height, flats, caps: &[] }, &params))
}

/// Refuses a number of layers that no printer lays.
///
/// # Errors
///
/// `LimitExceeded`.
pub(crate) fn check_count(layers: f64) -> Result<(), Failure> {
    if layers > MOST_LAYERS {
        return Err(Failure::new(
            "LimitExceeded",
            format!("{layers:.0} layers are too many; the limit is {MOST_LAYERS}"),
        ));
    }
    Ok(())
}

/// Refuses, before it is begun, work that would take hours: how often layers cut facets is known from
/// the heights of both.
///
/// # Errors
///
/// `LimitExceeded`.
pub(crate) fn check_cuts(part: &Mesh, layers: usize, job: &Job) -> Result<(), Failure> {
    let top = part.bounds().max.z;
    let height = |corners: &[u32; 3]| {
        let z = corners.map(|k| part.vertices[k as usize].z);
        z[0].max(z[1]).max(z[2]) - z[0].min(z[1]).min(z[2])
    };
    let heights: f64 = part.triangles.iter().map(height).sum();
    let cuts = layers as f64 * (heights / top).max(1.0);
    if cuts <= job.most_cuts {
        return Ok(());
    }
    let what = format!(
        "{layers} layers would cut {} facets {:.0} million times; the limit is {} million",
        part.triangles.len(),
        cuts / 1e6,
        job.most_cuts / 1e6
    );
    Err(Failure::new("LimitExceeded", what)
        .hint("make the mesh coarser, choose thicker layers, or raise --most-cuts"))
}

fn check_cost(top: f64, job: &Job) -> Result<(), Failure> {
    let cost = cost(top, &job.schedule);
    check_count(cost.layers)?;
    if cost.steps > MOST_STEPS {
        return Err(Failure::new(
            "LimitExceeded",
            format!(
                "z_increment_mm = {} is too fine for a part of {top:.1} mm: the schedule would \
                 weigh up {:.1e} choices; the limit is {MOST_STEPS:.0e}",
                job.schedule.increment, cost.steps
            ),
        )
        .hint("set a coarser z_increment_mm, or snap = off"));
    }
    Ok(())
}

impl Layout {
    /// The flat faces that were wanted and are missed.
    pub fn missed(&self) -> impl Iterator<Item = &MetFlat> {
        self.flats.iter().filter(|met| met.wanted && met.miss > self.tolerance)
    }

    /// The flat faces that are missed because they are too small to matter.
    pub fn ignored(&self) -> impl Iterator<Item = &MetFlat> {
        self.flats.iter().filter(|met| !met.wanted && met.miss > self.tolerance)
    }

    /// What the user should know. Whoever turned snapping off knows that faces are missed.
    #[must_use]
    pub fn warnings(&self, snap: Snap) -> Vec<Warning> {
        let mut warnings = Vec::new();
        if !self.stepped.is_empty() {
            let faces = match self.stepped.len() {
                1 => "1 flat top is".into(),
                count => format!("{count} flat tops are"),
            };
            let places: Vec<String> = self.stepped.iter().map(left_over).collect();
            let message = format!(
                "{faces} left to the curved layers, which end there in steps: {}",
                places.join("; ")
            );
            warnings.push(Warning { code: "FlatTopsStepped".into(), message });
        }
        if !self.unreached.is_empty() {
            let message = format!(
                "the part ends below the ranges with {} layers: begin them lower, or let the blend \
                 below them end lower",
                self.unreached.join(", ")
            );
            warnings.push(Warning { code: "RangeUnreached".into(), message });
        }
        if snap == Snap::Off {
            return warnings;
        }
        let missed: Vec<&MetFlat> = self.missed().collect();
        if !missed.is_empty() {
            let message =
                format!("{} missed by the layers: {}", faces(missed.len()), list(&missed));
            warnings.push(Warning { code: "FlatMissed".into(), message });
        }
        let ignored: Vec<&MetFlat> = self.ignored().collect();
        if !ignored.is_empty() {
            let message = format!(
                "{} smaller than flat_area_min_mm2 and not met: {}",
                faces(ignored.len()),
                list(&ignored)
            );
            warnings.push(Warning { code: "FlatsIgnored".into(), message });
        }
        warnings
    }

    /// The flat faces as the report shows them.
    #[must_use]
    pub fn report(&self) -> Vec<report::Flat> {
        let facing = |facing| match facing {
            Facing::Up => "up",
            Facing::Down => "down",
        };
        self.flats
            .iter()
            .map(|met| report::Flat {
                z_mm: tidy(met.flat.z_mm),
                area_mm2: tidy(met.flat.area_mm2),
                error_mm: met.miss,
                facing: facing(met.flat.facing),
                ignored: !met.wanted,
            })
            .collect()
    }

    /// The flat tops that stay steps, as the report shows them.
    #[must_use]
    pub fn report_stepped(&self) -> Vec<report::FlatLeft> {
        let shown = |left: &SteppedFlat| report::FlatLeft {
            z_mm: tidy(left.flat.z_mm),
            area_mm2: tidy(left.flat.area_mm2),
            why: left.why(),
        };
        self.stepped.iter().map(shown).collect()
    }

    /// One line for people; `None` when there is nothing to say.
    #[must_use]
    pub fn summary(&self) -> Option<String> {
        let wanted = self.flats.iter().filter(|met| met.wanted).count();
        let missed = self.missed().count();
        (wanted > 0).then(|| format!("{} of {wanted} met", wanted - missed))
    }
}

fn left_over(left: &SteppedFlat) -> String {
    let Flat { z_mm, area_mm2, .. } = left.flat;
    format!("z = {} mm ({} mm²): {}", decimal(z_mm, 3), decimal(area_mm2, 2), left.why())
}

fn faces(count: usize) -> String {
    if count == 1 { "1 flat face is".into() } else { format!("{count} flat faces are") }
}

/// The largest few, in the order of their heights.
fn list(flats: &[&MetFlat]) -> String {
    const MOST: usize = 5;
    let mut largest = flats.to_vec();
    largest.sort_by(|a, b| b.flat.area_mm2.total_cmp(&a.flat.area_mm2));
    largest.truncate(MOST);
    largest.sort_by(|a, b| a.flat.z_mm.total_cmp(&b.flat.z_mm));
    let mut text = String::new();
    for (i, met) in largest.iter().enumerate() {
        // Writing to a string cannot fail.
        let _ = write!(
            text,
            "{}z = {} mm ({} mm²) by {} mm",
            if i == 0 { "" } else { ", " },
            decimal(met.flat.z_mm, 3),
            decimal(met.flat.area_mm2, 2),
            decimal(met.miss, 3)
        );
    }
    if flats.len() > MOST {
        let _ = write!(text, ", and {} smaller ones", flats.len() - MOST);
    }
    text
}

/// A number without the noise of its last bits.
fn tidy(number: f64) -> f64 {
    (number * 1e6).round() / 1e6
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::interrupt::Interrupt;
    use crate::pipeline::{Request, Watch, slice};
    use crate::place::{Pose, Wish};
    use crate::progress::Silent;
    use crate::settings::Settings;
    use mesh::shapes;
    use slicer::surface::Plane;

    fn job(set: &[&str]) -> Job {
        let mut settings = Settings::defaults();
        for pair in set {
            settings.set(pair).unwrap();
        }
        Job::resolve(&settings).unwrap()
    }

    /// Two blocks side by side, of different heights.
    fn two(low: f64, high: f64) -> Mesh {
        let outline = [[0.0, 0.0], [10.0, 0.0], [10.0, high], [5.0, high], [5.0, low], [0.0, low]];
        let mut mesh = shapes::extruded(&outline, &[], 10.0);
        for p in &mut mesh.vertices {
            *p = nalgebra::Point3::new(p.x, -p.z, p.y);
        }
        mesh
    }

    #[test]
    fn flats_are_met_to_half_an_increment() {
        let layout = layout(&shapes::steps(), &Plane, &job(&[])).unwrap();
        assert_eq!(layout.flats.len(), 5);
        assert!(layout.flats.iter().all(|met| met.miss == 0.0), "{layout:?}");
        assert!(layout.warnings(Snap::Optimal).is_empty());
        assert_eq!(layout.summary().unwrap(), "5 of 5 met");
    }

    /// The heights at which a program lays material, as its text says.
    fn printed_heights(text: &str) -> Vec<f64> {
        let mut z = f64::NAN;
        let mut heights: Vec<f64> = Vec::new();
        for line in text.lines().filter(|line| line.starts_with("G1 ")) {
            let word = |letter: char| {
                let value = line.split(' ').find_map(|word| word.strip_prefix(letter))?;
                value.parse::<f64>().ok()
            };
            z = word('Z').unwrap_or(z);
            let moves = word('R').is_some();
            if moves && word('E').is_some_and(|fed| fed > 0.0) && heights.last() != Some(&z) {
                heights.push(z);
            }
        }
        heights
    }

    #[test]
    fn flats_are_exact_in_the_text_of_the_program() {
        let settings = Settings::defaults();
        let model = mesh::stl::write(&shapes::steps());
        let request = Request {
            model: &model,
            name: "steps",
            wish: Wish { pose: Pose::Keep, ..Wish::default() },
            settings: &settings,
            job: &job(&[]),
            made_at: "now",
        };
        let mut text = Vec::new();
        let watch = &mut Watch { progress: &mut Silent, interrupt: &Interrupt::default() };
        let outcome = slice(&request, &mut text, watch).unwrap();
        let heights = printed_heights(std::str::from_utf8(&text).unwrap());
        assert_eq!(heights.len(), outcome.layout.levels.len());
        for flat in [3.07, 7.33, 11.9, 15.0] {
            assert!(heights.contains(&flat), "{flat} in {heights:?}");
        }
        assert_eq!(heights.last(), Some(&15.0));
    }

    #[test]
    fn a_missed_flat_is_told() {
        let job = job(&[]);
        let layout = layout(&two(5.0, 5.02), &Plane, &job).unwrap();
        let warnings = layout.warnings(Snap::Optimal);
        assert_eq!(warnings.len(), 1);
        assert_eq!(warnings[0].code, "FlatMissed");
        assert!(warnings[0].message.contains("(50 mm²) by 0.02 mm"), "{}", warnings[0].message);
        assert_eq!(layout.missed().count(), 1);
        assert!(layout.warnings(Snap::Off).is_empty());
    }

    #[test]
    fn a_small_flat_is_ignored_and_told() {
        let job = job(&["flat_area_min_mm2=60"]);
        let layout = layout(&two(5.07, 8.0), &Plane, &job).unwrap();
        assert_eq!(layout.missed().count(), 0);
        assert_eq!(layout.ignored().count(), 1);
        assert_eq!(layout.warnings(Snap::Optimal)[0].code, "FlatsIgnored");
        assert!(layout.report()[1].ignored);
    }

    #[test]
    fn absurd_schedules_are_refused() {
        let refused = |set: &[&str], height: f64| {
            layout(&shapes::block(1.0, 1.0, height), &Plane, &job(set)).unwrap_err().class()
        };
        let fine = ["z_increment_mm=0.001", "max_layer_height_mm=0.44"];
        assert_eq!(refused(&fine, 2000.0), "LimitExceeded");
        let thin = ["layer_height_mm=0.01", "min_layer_height_mm=0.01", "snap=off"];
        assert_eq!(refused(&thin, 2000.0), "LimitExceeded");
    }

    #[test]
    fn adaptive_layers_meet_flats_too() {
        let job = job(&["adaptive=true", "cusp_mm=0.08"]);
        let mushroom = shapes::mushroom(96);
        let layout = layout(&mushroom, &Plane, &job).unwrap();
        assert_eq!(layout.missed().count(), 0);
        let thickness = layout.levels.iter().map(Level::thickness);
        let (thin, thick) = thickness.fold((f64::MAX, 0.0_f64), |(a, b), h| (a.min(h), b.max(h)));
        assert!(thin < 0.15 && thick > 0.25, "{thin} {thick}");
    }
}

//! How long the stages of a slice take: reading and repair, sections, fill, the whole, the check.
//!
//! Bundled models, and the Benchy where a folder `shared` lies beside the repository. Sections and
//! fill use all processors, like the program. `cargo bench -p rhumb -- gear` runs what has *gear*
//! in its name.

#![allow(clippy::unwrap_used, reason = "a benchmark fails by panicking")]
#![allow(missing_docs, reason = "the macros of the harness write functions without any")]

use std::path::Path;

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use geom::region::Region;
use mesh::health::solid_from_soup;
use mesh::stl;
use mesh::topology::Solid;
use rayon::prelude::*;
use rhumb::check::check;
use rhumb::interrupt::Interrupt;
use rhumb::levels::layout;
use rhumb::pipeline::{Outcome, Request, Watch, part, slice};
use rhumb::place::{Wish, place};
use rhumb::progress::Silent;
use rhumb::settings::{Job, Settings};
use slicer::layer::fill_layer;
use slicer::level::Level;
use slicer::lift::Lift;
use slicer::section::Cutter;
use slicer::skins::{Neighbours, SKIN_TOLERANCE_MM};
use slicer::surface::Plane;

/// A model and all that its stages begin with.
struct Model {
    name: &'static str,
    bytes: Vec<u8>,
    /// Laid down and placed.
    solid: Solid,
    levels: Vec<Level>,
    sections: Vec<Region>,
    program: Vec<u8>,
    outcome: Outcome,
}

fn read(bytes: &[u8]) -> Solid {
    solid_from_soup(&stl::read(bytes).unwrap().0).unwrap().0
}

fn sections(solid: &Solid, levels: &[Level], job: &Job) -> Vec<Region> {
    let cutter = Cutter::new(solid, &Plane, levels);
    let section = |k| cutter.section(k, job.paths.tolerance).region;
    (0..levels.len()).into_par_iter().map(section).collect()
}

/// Fills all layers; returns the number of islands, so that nothing is left out as unused.
fn filled(model: &Model, covers: &[Region], job: &Job) -> usize {
    let skins = &job.paths.skins;
    let layer = |k: usize| {
        let end = (k + 1 + skins.top_layers).min(covers.len());
        let neighbours = Neighbours {
            above: covers[k + 1..end].iter().collect(),
            below: covers[k.saturating_sub(skins.bottom_layers)..k].iter().rev().collect(),
            support: None,
        };
        let material = &model.sections[k];
        let lift = Lift {
            surface: &Plane,
            level: model.levels[k],
            floor: None,
            ceiling: None,
            stair: None,
            below: None,
            bare: None,
        };
        fill_layer(&lift, material, &neighbours, &job.paths).paths.islands.len()
    };
    (0..covers.len()).into_par_iter().map(layer).sum()
}

fn whole(bytes: &[u8], settings: &Settings, job: &Job) -> (Vec<u8>, Outcome) {
    let wish = Wish::default();
    let request = Request { model: bytes, name: "bench", wish, settings, job, made_at: "now" };
    let mut text = Vec::new();
    let watch = &mut Watch { progress: &mut Silent, interrupt: &Interrupt::default() };
    let outcome = slice(&request, &mut text, watch).unwrap();
    (text, outcome)
}

fn model(name: &'static str, path: &Path, settings: &Settings, job: &Job) -> Option<Model> {
    let bytes = std::fs::read(path).ok()?;
    let solid = place(read(&bytes), &Wish::default(), &job.orient).unwrap().solid;
    let levels = layout(solid.mesh(), &Plane, job).unwrap().levels;
    let sections = sections(&solid, &levels, job);
    let (program, outcome) = whole(&bytes, settings, job);
    Some(Model { name, bytes, solid, levels, sections, program, outcome })
}

/// The settings with every optional feature of print quality on.
fn everything_on() -> Settings {
    let mut settings = Settings::defaults();
    for pair in [
        "support_material=true",
        "ironing=true",
        "fuzzy_skin=true",
        "scarf_seam_placement=everywhere",
        "avoid_crossing_perimeters=true",
        "extra_perimeters=true",
        "only_one_perimeter_top=true",
        "seam_position=corner",
        "xy_size_compensation_mm=-0.05",
        "elefant_foot_compensation_mm=0.1",
        "fill_pattern=lightning",
    ] {
        settings.set(pair).unwrap();
    }
    settings
}

fn stages(criterion: &mut Criterion) {
    let settings = Settings::defaults();
    let job = Job::resolve(&settings).unwrap();
    let everything = everything_on();
    let all_on = Job::resolve(&everything).unwrap();
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2).unwrap();
    let models: Vec<Model> = [
        ("cube", root.join("models/cube.stl")),
        ("gear", root.join("models/gear.stl")),
        ("vase", root.join("models/vase.stl")),
        ("benchy", root.join("../shared/models/real/benchy.stl")),
    ]
    .into_iter()
    .filter_map(|(name, path)| model(name, &path, &settings, &job))
    .collect();
    for model in &models {
        let mut group = criterion.benchmark_group(model.name);
        // A Benchy takes seconds: fewer runs are enough to see a change.
        group.sample_size(10);
        group.bench_function(BenchmarkId::from_parameter("read and repair"), |bencher| {
            bencher.iter(|| read(&model.bytes));
        });
        group.bench_function(BenchmarkId::from_parameter("section"), |bencher| {
            bencher.iter(|| sections(&model.solid, &model.levels, &job));
        });
        let covers: Vec<Region> =
            model.sections.iter().map(|section| section.thinned(SKIN_TOLERANCE_MM)).collect();
        group.bench_function(BenchmarkId::from_parameter("fill"), |bencher| {
            bencher.iter(|| filled(model, &covers, &job));
        });
        group.bench_function(BenchmarkId::from_parameter("whole slice"), |bencher| {
            bencher.iter(|| whole(&model.bytes, &settings, &job).0.len());
        });
        group.bench_function(
            BenchmarkId::from_parameter("whole slice, everything on"),
            |bencher| {
                bencher.iter(|| whole(&model.bytes, &everything, &all_on).0.len());
            },
        );
        group.bench_function(BenchmarkId::from_parameter("verify"), |bencher| {
            let part = Some(part(&model.outcome));
            bencher.iter(|| {
                check(model.program.as_slice(), &job, part, false, |_| {}).unwrap().totals
            });
        });
        group.finish();
    }
}

criterion_group!(pipeline, stages);
criterion_main!(pipeline);

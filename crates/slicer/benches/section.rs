//! Time of the section stage by surface, for the same number of layers of the same mesh.
//!
//! `cargo bench -p slicer --bench section` cuts 40 layers of a sphere with 1.3 million facets and of
//! one with 5 thousand, whose facets are large beside the chord tolerance.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use mesh::shapes;
use mesh::topology::Solid;
use nalgebra::Isometry3;
use slicer::section::{Cutter, level_range};
use slicer::surface::{Caps, Cone, LayerSurface, Plane, Spheres};

/// How far outlines may lie from the exact curves, mm: the default of a print.
const TOLERANCE_MM: f64 = 0.002;

const LAYERS: u32 = 40;

fn surfaces() -> Vec<(&'static str, Box<dyn LayerSurface>)> {
    let cone = |angle: f64| Box::new(Cone::new(angle).expect("an angle"));
    vec![
        ("planar", Box::new(Plane)),
        ("cone 30", cone(30_f64.to_radians())),
        ("cone -30", cone(-30_f64.to_radians())),
        ("spheres", Box::new(Spheres::new(-10.0).expect("a height"))),
        ("caps", Box::new(Caps::new(60.0).expect("a radius"))),
    ]
}

fn cut(solid: &Solid, surface: &dyn LayerSurface) -> usize {
    let [low, high] = level_range(solid, surface).expect("facets");
    let step = (high - low) / f64::from(LAYERS);
    let cuts = (0..LAYERS).map(|k| low + step * (f64::from(k) + 0.5)).collect();
    let cutter = Cutter::at_levels(solid, surface, cuts);
    (0..LAYERS as usize).map(|k| cutter.section(k, TOLERANCE_MM).region.point_count()).sum()
}

fn sections(criterion: &mut Criterion) {
    for (name, depth) in [("1.3 M facets", 8), ("5 k facets", 4)] {
        // Off the axis, so that no layer is a circle about it.
        let aside = Isometry3::translation(7.0, 3.0, 0.0);
        let solid = Solid::new(shapes::icosphere(depth, 20.0)).transformed(&aside);
        let mut group = criterion.benchmark_group(name);
        group.sample_size(10);
        for (surface_name, surface) in surfaces() {
            group.bench_function(surface_name, |bencher| {
                bencher.iter(|| black_box(cut(&solid, surface.as_ref())));
            });
        }
        group.finish();
    }
}

criterion_group!(benches, sections);
criterion_main!(benches);

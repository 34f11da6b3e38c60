//! Settings that users of other slicers bring along: lines of the first layer, skins by thickness,
//! slow small holes, programs at layers, brims in holes, how filament is drawn back.

use std::collections::BTreeSet;

use mesh::mesh::Mesh;
use mesh::shapes::{block, extruded};

use crate::program::{Motion, motions};
use crate::run::sliced_mesh as sliced;

const SURFACES: [&[&str]; 3] =
    [&[], &["--layers", "conical", "--cone-angle", "20"], &["--layers", "spherical"]];

fn with(surface: &[&'static str], set: &[&'static str]) -> Vec<&'static str> {
    let set = set.iter().flat_map(|pair| ["--set", pair]);
    surface.iter().copied().chain(set).collect()
}

/// A block with a round hole through it.
fn drilled(size: f64, hole: f64) -> Mesh {
    let half = size / 2.0;
    let corners = [[-half, -half], [half, -half], [half, half], [-half, half]];
    let round = |k: u32| {
        let angle = std::f64::consts::TAU * f64::from(k) / 48.0;
        [-hole * angle.cos(), hole * angle.sin()]
    };
    let hole: Vec<[f64; 2]> = (0..48).map(round).collect();
    extruded(&corners, &[hole], 3.0)
}

fn of_part<'a, 'b>(all: &'b [Motion<'a>]) -> impl Iterator<Item = &'b Motion<'a>> {
    all.iter().filter(|m| m.lays() && m.role != "Skirt/Brim")
}

#[test]
fn lines_of_the_first_layer_are_as_wide_as_told() {
    for surface in SURFACES {
        let set = ["first_layer_extrusion_width_mm=0.6", "only_one_perimeter_first_layer=true"];
        let text = sliced(&block(14.0, 14.0, 3.0), &with(surface, &set));
        let all = motions(&text);
        let mean = |first: bool| {
            let lines = of_part(&all).filter(|m| (m.layer == Some(0)) == first);
            let sums = lines.fold([0.0, 0.0], |[length, area], m| {
                [length + m.path(), area + m.path() * m.width]
            });
            sums[1] / sums[0]
        };
        assert!((mean(true) - 0.6).abs() < 0.03, "{surface:?}: {}", mean(true));
        assert!((mean(false) - 0.45).abs() < 0.05, "{surface:?}: {}", mean(false));
        let inner = |layer| all.iter().any(|m| m.layer == Some(layer) && m.role == "Perimeter");
        assert!(!inner(0) && inner(1), "{surface:?}");
    }
}

#[test]
fn skins_are_as_thick_as_told() {
    for surface in SURFACES {
        let solid = |set: &[&'static str]| -> BTreeSet<usize> {
            let text = sliced(&block(16.0, 16.0, 6.0), &with(surface, set));
            let all = motions(&text);
            let sparse: BTreeSet<usize> = all
                .iter()
                .filter(|m| m.lays() && m.role == "Internal infill")
                .filter_map(|m| m.layer)
                .collect();
            let last = all.iter().filter_map(|m| m.layer).max().unwrap();
            (0..=last).filter(|layer| !sparse.contains(layer)).collect()
        };
        let few = ["top_solid_layers=2", "bottom_solid_layers=2"];
        let thick = ["bottom_solid_min_thickness_mm=1.6", "top_solid_layers=2"];
        let (few, thick) = (solid(&few), solid(&thick));
        // On curved layers bottoms reach through more layers than there are of them.
        assert!((0..8).all(|layer| thick.contains(&layer)), "{surface:?}: {thick:?}");
        let more = thick.difference(&few).count();
        assert!((4..=7).contains(&more), "{surface:?}: {few:?} and {thick:?}");
        let every = solid(&["solid_infill_every_layers=9", "top_solid_layers=2"]);
        assert!(every.contains(&18) && !few.contains(&18), "{surface:?}: {every:?}");
        assert!(!every.contains(&19), "{surface:?}: {every:?}");
    }
}

#[test]
fn small_holes_are_laid_slowly_and_large_ones_are_not() {
    for surface in SURFACES {
        let fastest = |hole: f64| {
            let set = ["small_perimeter_speed_mm_per_s=9", "slowdown_below_layer_time_s=0"];
            let text = sliced(&drilled(34.0, hole), &with(surface, &set));
            let all = motions(&text);
            let near = |m: &&Motion<'_>| {
                let [x, y, _] = m.at(0.5);
                m.role == "External perimeter" && m.layer > Some(4) && x.hypot(y) < hole + 1.0
            };
            all.iter().filter(near).filter(|m| m.lays()).map(|m| m.speed).fold(0.0, f64::max)
        };
        let [small, large] = [4.0, 9.0].map(fastest);
        assert!(small <= 9.001, "{surface:?}: {small}");
        assert!(large > 20.0, "{surface:?}: {large}");
    }
}

#[test]
fn programs_at_layers_stand_at_every_layer() {
    for surface in SURFACES {
        let set =
            ["before_layer_gcode=; before [layer_num]", "layer_gcode=M117 Layer {layer_num + 1}"];
        let text = sliced(&block(9.0, 9.0, 2.0), &with(surface, &set));
        let lines: Vec<&str> = text.lines().collect();
        let layers: Vec<usize> =
            (0..lines.len()).filter(|&k| lines[k] == ";LAYER_CHANGE").collect();
        assert!(layers.len() >= 10, "{surface:?}");
        for (number, &k) in layers.iter().enumerate() {
            assert_eq!(lines[k - 1], format!("; before {number}"), "{surface:?}");
            let after = lines[k..].iter().find(|line| !line.starts_with(';'));
            assert_eq!(after, Some(&format!("M117 Layer {}", number + 1).as_str()), "{surface:?}");
        }
    }
}

#[test]
fn a_brim_lies_where_it_is_wanted() {
    let loops = |kind: &'static str| {
        let text = sliced(
            &drilled(24.0, 8.0),
            &["--set", "brim_width_mm=2", "--set", kind, "--set", "skirts=0"],
        );
        let all = motions(&text);
        let far = |m: &Motion<'_>| {
            let [x, y, _] = m.at(0.5);
            x.abs().max(y.abs())
        };
        let places: Vec<f64> =
            all.iter().filter(|m| m.lays() && m.role == "Skirt/Brim").map(far).collect();
        [places.iter().any(|r| *r < 8.0), places.iter().any(|r| *r > 12.0)]
    };
    assert_eq!(loops("brim_type=outer_only"), [false, true]);
    assert_eq!(loops("brim_type=inner_only"), [true, false]);
    assert_eq!(loops("brim_type=outer_and_inner"), [true, true]);
    assert_eq!(loops("brim_type=no_brim"), [false, false]);
}

#[test]
fn more_or_less_filament_than_was_drawn_back_is_fed_as_told() {
    for (set, wanted) in
        [("retract_restart_extra_mm=0.06", 0.86), ("retract_restart_extra_mm=-0.05", 0.75)]
    {
        let text = sliced(&block(9.0, 9.0, 2.0), &with(SURFACES[0], &[set, "wipe_mm=0"]));
        let all = motions(&text);
        let fed = || all.iter().filter(|m| m.path() == 0.0 && m.e > 0.0).map(|m| m.e);
        assert!(fed().count() > 3 && fed().all(|e| (e - wanted).abs() < 1e-4), "{set}");
    }
}

#[test]
fn filament_is_fed_as_fast_as_told_and_drawn_back_at_layers() {
    for surface in SURFACES {
        let set = [
            "retract_layer_change=true",
            "deretract_speed_mm_per_s=20",
            "retract_before_travel_mm=500",
            "wipe_mm=0",
        ];
        let text = sliced(&block(9.0, 9.0, 2.0), &with(surface, &set));
        let all = motions(&text);
        let still = |m: &&Motion<'_>| m.path() == 0.0 && m.e != 0.0;
        let layers = all.iter().filter_map(|m| m.layer).max().unwrap();
        let back: Vec<&Motion<'_>> = all.iter().filter(still).filter(|m| m.e < 0.0).collect();
        let fed: Vec<&Motion<'_>> = all.iter().filter(still).filter(|m| m.e > 0.0).collect();
        // Once a layer, and at the end.
        assert_eq!((back.len(), fed.len()), (layers + 1, layers), "{surface:?}");
        assert!(back.iter().all(|m| (m.speed - 35.0).abs() < 0.1), "{surface:?}");
        assert!(fed.iter().all(|m| (m.speed - 20.0).abs() < 0.1), "{surface:?}");
    }
}

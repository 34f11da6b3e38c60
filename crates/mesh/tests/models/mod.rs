//! Models that people print, and the generated ones, with the facts of their provenance.

use super::shared;
use mesh::health::{Health, solid_from_soup};
use mesh::stl;
use std::path::Path;

/// What is known of a model: facets, shells, edges with one facet and with more than two, and the
/// volume, mm³, when the file is closed.
struct Facts(&'static str, usize, usize, usize, usize, Option<f64>);

const GENERATED: [Facts; 9] = [
    Facts("cube20", 12, 1, 0, 0, Some(8000.0)),
    Facts("cross7", 60, 1, 0, 0, Some(56_000.0)),
    Facts("stepped_awkward_z", 36, 1, 0, 0, Some(10_742.4)),
    Facts("gear24", 4756, 1, 0, 0, Some(12_262.0)),
    Facts("lens", 24_576, 1, 0, 0, Some(3433.2)),
    Facts("mushroom", 22_016, 1, 0, 0, Some(20_122.9)),
    Facts("umbrella", 3072, 1, 0, 0, Some(9299.7)),
    Facts("canopy_up", 3072, 1, 0, 0, Some(8179.0)),
    Facts("funnel", 4096, 1, 0, 0, Some(7350.9)),
];

const REAL: [Facts; 16] = [
    Facts("benchy", 225_154, 1, 0, 0, Some(15_550.5)),
    Facts("extruder_idler", 3586, 3, 0, 0, Some(5431.5)),
    Facts("mk3_extruder_body", 21_464, 1, 0, 0, Some(28_564.0)),
    Facts("voron_cw2_main_body", 22_710, 1, 0, 0, Some(24_252.3)),
    Facts("npm_gearwheel", 2444, 1, 0, 0, Some(8922.6)),
    Facts("rear_case", 18_808, 1, 0, 0, Some(38_229.9)),
    Facts("temp_tower", 49_400, 21, 0, 1, Some(23_613.5)),
    Facts("nefertiti", 99_938, 1, 0, 0, Some(32_751.2)),
    Facts("spot", 5856, 1, 0, 0, Some(30_600.9)),
    Facts("rocker_arm", 20_088, 1, 0, 0, Some(9182.9)),
    Facts("chess_set", 5596, 16, 0, 0, Some(65_654.0)),
    // The volumes given for the next three are sums over an open surface: they have none.
    Facts("bunny_open", 69_451, 1, 223, 0, None),
    Facts("teapot_open", 6320, 3, 160, 0, None),
    Facts("conveyor_holes", 855, 1, 3, 0, None),
    Facts("einsy_base_nonmanifold", 9142, 1, 0, 6, Some(41_661.8)),
    // The volume given is that of facets half of which face inwards.
    Facts("hourglass_flipped", 2146, 1, 0, 0, None),
];

fn check(folder: &Path, facts: &Facts) -> Health {
    let Facts(name, facets, shells, open, crowded, volume) = *facts;
    let bytes = std::fs::read(folder.join(name).with_extension("stl")).unwrap();
    let (soup, report) = stl::read(&bytes).unwrap();
    let (solid, health) = solid_from_soup(&soup).unwrap();
    solid.check().unwrap();
    let found = [health.facets, health.shells, health.open_edges, health.nonmanifold_edges];
    assert_eq!(found, [facets, shells, open, crowded], "{name}");
    assert_eq!(health.open_edges_left, 0, "{name}");
    if let Some(volume) = volume {
        let error = (health.volume_mm3 / volume - 1.0).abs();
        assert!(error < 1e-3, "{name}: {} mm³, not {volume}", health.volume_mm3);
    }
    assert!(health.volume_mm3 > 0.0, "{name}");
    health.with_read(&report)
}

#[test]
fn generated_models_are_sound() {
    let Some(folder) = shared("models/gen") else { return };
    for facts in &GENERATED {
        assert_eq!(check(&folder, facts).notes, [], "{}", facts.0);
    }
}

#[test]
fn real_models_become_solids() {
    let Some(folder) = shared("models/real") else { return };
    let health = |name: &str| {
        let facts = REAL.iter().find(|facts| facts.0 == name).unwrap();
        check(&folder, facts)
    };
    for facts in &REAL {
        check(&folder, facts);
    }
    assert_eq!(health("benchy").degenerate, 8);
    assert_eq!(health("nefertiti").notes, []);
    // Five holes of a scan, none of them flat.
    assert!(health("bunny_open").guessed);
    assert!(!health("conveyor_holes").guessed);
    // Facets as they stand add up to 4948 mm³; all outwards, to this.
    let hourglass = health("hourglass_flipped");
    assert!(hourglass.has("FacetsReoriented"));
    assert!((hourglass.volume_mm3 - 21_598.1).abs() < 1.0);
    assert!(health("teapot_open").overlaps);
}

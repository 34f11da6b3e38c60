//! How lines are run: accelerations by what is laid, and walls whose ends lie over their begins.

use crate::program::{FILAMENT_AREA, Motion, motions};
use crate::run::{Ran, Scratch, model};

fn sliced(scratch: &Scratch, name: &str, more: &[&str]) -> Ran {
    let file = model(name);
    let mut all = vec!["slice", file.to_str().unwrap(), "-q", "-o", "p.gcode", "--scale", "0.5"];
    all.extend(more);
    scratch.run(&all)
}

fn program(scratch: &Scratch) -> String {
    std::fs::read_to_string(scratch.path("p.gcode")).unwrap()
}

#[test]
fn walls_are_sped_up_as_gently_as_wanted_and_infill_is_not() {
    let scratch = Scratch::new();
    let rates = |more: &[&str]| {
        let common = ["--set", "path_acceleration_mm_per_s2=3000", "--set", "skirts=0"];
        sliced(&scratch, "gear", &[&common, more].concat()).expect(0);
        let text = program(&scratch);
        let moves = motions(&text);
        let rate = |role: &'static str| {
            let pairs =
                moves.windows(2).filter(|pair| pair.iter().all(|m| m.role == role && m.lays()));
            let rate = |pair: &[Motion<'_>]| {
                let speed = |m: &Motion<'_>| m.path() / m.duration();
                let between = f64::midpoint(pair[0].duration(), pair[1].duration());
                (speed(&pair[0]) - speed(&pair[1])).abs() / between
            };
            pairs.map(rate).fold(0.0, f64::max)
        };
        [rate("External perimeter"), rate("Internal infill")]
    };
    let [wall, _] = rates(&[]);
    assert!(wall > 600.0, "as fast as it can: {wall}");
    let gentle = ["--set", "external_perimeter_acceleration_mm_per_s2=300"];
    let [wall, infill] = rates(&gentle);
    assert!(wall < 303.0, "{wall}");
    assert!(infill > 600.0, "{infill}");
    assert!(!program(&scratch).contains("M204"), "no command for it in this dialect");
    let all = [&gentle[..], &["--dialect", "marlin-polar"]].concat();
    sliced(&scratch, "gear", &all).expect(0);
    let marlin = program(&scratch);
    assert!(marlin.contains("\nM204 S300\n") && marlin.contains("\nM204 S1500\n"));
    sliced(&scratch, "gear", &["--dialect", "marlin-polar"]).expect(0);
    assert!(!program(&scratch).contains("M204"));
}

/// Moves of outer walls above the first layer, and those of them that are announced to slope.
fn walls(text: &str) -> (f64, Vec<Vec<Motion<'_>>>) {
    let moves = motions(text);
    let is_wall = |m: &&Motion<'_>| m.role == "External perimeter" && m.lays() && m.layer > Some(0);
    let volume = moves.iter().filter(is_wall).map(Motion::volume).sum();
    let mark = |what: &str| -> Vec<usize> {
        (1..).zip(text.lines()).filter(|(_, line)| *line == what).map(|(k, _)| k).collect()
    };
    let (begins, ends) = (mark("; scarf seam"), mark("; scarf seam done"));
    assert_eq!(begins.len(), ends.len());
    let between = |(begin, end): (&usize, &usize)| -> Vec<Motion<'_>> {
        moves.iter().filter(|m| m.line > *begin && m.line < *end).cloned().collect()
    };
    (volume, begins.iter().zip(&ends).map(between).collect())
}

#[test]
fn walls_rise_over_their_begin_and_lose_no_volume() {
    let scratch = Scratch::new();
    let plain = [&["--set", "skirts=0", "--set", "snap=off", "--scale", "1"][..]].concat();
    let file = scratch.file("b.stl", mesh::stl::write(&mesh::shapes::block(30.0, 20.0, 3.0)));
    let slice = |more: &[&str]| {
        let all = [&["slice", file.to_str().unwrap(), "-q", "-o", "p.gcode"], &plain[..4], more];
        scratch.run(&all.concat()).expect(0);
        program(&scratch)
    };
    let without = slice(&[]);
    let with =
        slice(&["--set", "scarf_seam_placement=contours", "--set", "scarf_seam_length_mm=15"]);
    let (volume, none) = walls(&without);
    let (same, sloping) = walls(&with);
    assert!(none.is_empty() && sloping.len() == 14, "{}", sloping.len());
    assert!((same / volume - 1.0).abs() < 2e-4, "{same} {volume}");
    for wall in &sloping {
        let laid: Vec<&Motion<'_>> = wall.iter().filter(|m| m.lays()).collect();
        let top = laid.iter().map(|m| m.to[2]).fold(0.0, f64::max);
        let first = laid[0].from[2];
        assert!((top - first - 0.2).abs() < 0.001, "it begins on the layer below: {first} {top}");
        // Up evenly over 15 mm, no step higher than a piece of 1 mm makes, and level from there on.
        let (mut along, mut fed) = (0.0, 0.0);
        for m in &laid {
            along += m.path();
            let wanted = top - 0.2 * (1.0 - along / 15.0).max(0.0);
            assert!((m.to[2] - wanted).abs() < 0.002, "{along}: {} {wanted}", m.to[2]);
            assert!(m.to[2] - m.from[2] < 0.2 / 14.0);
            fed += m.volume();
        }
        let round = 2.0 * (30.0 + 20.0 - 0.9);
        assert!((along - round - 15.0).abs() < 0.2, "{along}");
        // The end lies over the begin: together they are one bead.
        let share = |k: usize| laid[k].e / laid[k].path();
        let whole = share(laid.len() / 2);
        assert!(share(0) < 0.06 * whole && share(laid.len() - 1) < 0.06 * whole);
        assert!((fed / (whole * FILAMENT_AREA * round) - 1.0).abs() < 5e-3);
    }
}

#[test]
fn sloping_seams_lie_on_curved_layers_too() {
    let scratch = Scratch::new();
    for layers in [
        &["--layers", "conical", "--cone-angle", "20"][..],
        &["--layers", "conical", "--cone-angle=-15"],
        &["--layers", "spherical", "--sphere-centre=-60"],
    ] {
        let set = ["--set", "scarf_seam_placement=everywhere", "--set", "scarf_seam_length_mm=8"];
        // The twin finds no bead off its layer, none of odd section and no volume amiss.
        sliced(&scratch, "vase", &[layers, &set].concat()).expect(0);
        let text = program(&scratch);
        let (_, sloping) = walls(&text);
        assert!(sloping.len() > 20, "{layers:?}: {}", sloping.len());
    }
}

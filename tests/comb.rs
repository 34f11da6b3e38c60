//! Travel that is asked to stay inside the part does.

use crate::program::{Motion, motions};
use crate::run::Scratch;

/// Half the side of the hole of the frame, mm.
const HOLE: f64 = 6.0;

/// The program of a frame about the axis.
fn frame(arguments: &[&str]) -> String {
    let square = |half: f64| vec![[-half, -half], [half, -half], [half, half], [-half, half]];
    let hole: Vec<[f64; 2]> = square(HOLE).into_iter().rev().collect();
    let scratch = Scratch::new();
    scratch.file("m.stl", mesh::stl::write(&mesh::shapes::extruded(&square(15.0), &[hole], 3.0)));
    let mut all = vec!["slice", "m.stl", "-q", "-o", "-"];
    all.extend(arguments);
    scratch.run(&all).expect(0).out
}

/// How many travels lead over the hole, and how often filament is drawn back.
fn over_the_hole(text: &str) -> (usize, usize) {
    let motions = motions(text);
    // What comes before and after the print is not inside of anything.
    let first = motions.iter().position(|m| m.role == "External perimeter").unwrap();
    let last = motions.iter().rposition(|m| m.e > 0.0 && m.path() > 0.0).unwrap();
    let inside = |motion: &Motion<'_>| {
        motion.e == 0.0
            && (0..=50).any(|k| {
                let [x, y, _] = motion.at(f64::from(k) / 50.0);
                x.abs() < HOLE - 0.01 && y.abs() < HOLE - 0.01
            })
    };
    let all = &motions[first..=last];
    let back = all.iter().filter(|m| m.e < 0.0 && m.path() == 0.0).count();
    (all.iter().filter(|motion| inside(motion)).count(), back)
}

#[test]
fn no_travel_leads_over_a_hole_where_there_is_a_way_round_it() {
    let (straight, drawn_back) = over_the_hole(&frame(&[]));
    assert!(straight > 5, "{straight} travels over the hole without combing");
    let combed = frame(&["--set", "avoid_crossing_perimeters=true"]);
    let (over, back) = over_the_hole(&combed);
    assert_eq!(over, 0);
    assert!(back < drawn_back, "{back} retractions, {drawn_back} without combing");
}

#[test]
fn combing_moves_travel_and_nothing_else() {
    let laid = |text: &str| -> f64 { motions(text).iter().map(|motion| motion.e).sum() };
    let (plain, combed) = (frame(&[]), frame(&["--set", "avoid_crossing_perimeters=true"]));
    assert!((laid(&plain) / laid(&combed) - 1.0).abs() < 1e-6);
}

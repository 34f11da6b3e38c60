//! `rhumb curve`: bare curves on a sphere, to compare and to teach.

use std::f64::consts::{PI, TAU};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use geom::spherical::{self, Archimedean, Loxodrome};
use nalgebra::Point3;
use twin::picture::curve::curve_svg;

use super::{DONE, say, say_json, write_file};
use crate::args::{Archimedes, Curve, LoxodromeCurve, Manner};
use crate::failure::Failure;

/// Step of the listing that the spiral comes from.
const USUAL_STEP: f64 = 0.25;

/// Turns of the same listing.
const USUAL_TURNS: f64 = 17.0;

/// Points of a turn that still look round: a regular polygon of 24 sides misses its circle by 0.9 %.
const POINTS_OF_A_TURN: f64 = 24.0;

/// Latitude where a loxodrome ends unless told otherwise, degrees: its turns there are a tenth as far
/// apart as at the equator.
const USUAL_END: f64 = 85.0;

/// Most points of a curve: some gigabytes as text.
const MOST_POINTS: f64 = 2e7;

/// Share of a step by which the last point may seem to lie beyond the pole: rounding of
/// `2 R / step`, not a choice.
const ROUNDING: f64 = 1e-9;

/// A point of a curve and what a table says of it.
struct Place {
    point: Point3<f64>,
    /// Length from the first point, mm.
    length: f64,
    /// Turns from the first point.
    turn: f64,
    /// Radians.
    latitude: f64,
    /// Distance to the turn above along the meridian, mm.
    spacing: f64,
}

/// A curve, ready to be written.
struct Drawn {
    kind: &'static str,
    radius: f64,
    turns: f64,
    /// What else defines it, for `--json`.
    shape: (&'static str, f64),
    places: Vec<Place>,
    /// Smallest and largest distance of neighbouring turns, mm.
    spacing: [f64; 2],
    /// How far chords between points are off, mm.
    chord_error: f64,
    /// What people should know.
    notes: Vec<String>,
    /// File name unless told otherwise.
    name: String,
}

pub(super) fn run(curve: &Curve, manner: &Manner) -> Result<u8, Failure> {
    let format = match curve.output() {
        Some(path) => Format::of(path)?,
        None => Format::Sldcrv,
    };
    let drawn = match curve {
        Curve::Archimedes(arguments) => archimedes(arguments)?,
        Curve::Loxodrome(arguments) => loxodrome(arguments)?,
    };
    let target = curve.output().clone().unwrap_or_else(|| PathBuf::from(&drawn.name));
    let text = match format {
        Format::Sldcrv => sldcrv(&drawn),
        Format::Csv => csv(&drawn),
        Format::Svg => {
            let points: Vec<Point3<f64>> = drawn.places.iter().map(|place| place.point).collect();
            curve_svg(&points, drawn.radius, &title(&drawn))
        }
    };
    write_file(&target, &[], text.as_bytes())?;
    if target != Path::new("-") {
        tell(&drawn, &target, manner)?;
    }
    Ok(DONE)
}

#[derive(Clone, Copy)]
enum Format {
    Sldcrv,
    Csv,
    Svg,
}

impl Format {
    fn of(path: &Path) -> Result<Self, Failure> {
        if path == Path::new("-") {
            return Ok(Self::Sldcrv);
        }
        let ending = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        match ending.as_str() {
            "sldcrv" => Ok(Self::Sldcrv),
            "csv" => Ok(Self::Csv),
            "svg" => Ok(Self::Svg),
            _ => {
                let what = format!("{} does not end in .sldcrv, .csv or .svg", path.display());
                Err(Failure::new("Usage", what).hint("the end of the name says the format"))
            }
        }
    }
}

/// Refuses numbers that make no curve.
fn positive(wanted: &[(&str, Option<f64>)]) -> Result<(), Failure> {
    for (name, value) in wanted {
        if let Some(value) = value.filter(|value| !(value.is_finite() && *value > 0.0)) {
            return Err(Failure::new("Usage", format!("{name} {value} is not above 0")));
        }
    }
    Ok(())
}

fn archimedes(arguments: &Archimedes) -> Result<Drawn, Failure> {
    let radius = arguments.radius;
    positive(&[
        ("--radius", Some(radius)),
        ("--turns", arguments.turns),
        ("--bead-width", arguments.bead_width),
        ("--step", arguments.step),
    ])?;
    if !arguments.leaning.is_finite() {
        let what = format!("--leaning {} is not an angle", arguments.leaning);
        return Err(Failure::new("Usage", what));
    }
    let turns = match arguments.bead_width {
        Some(width) => spherical::turns_for(radius, width),
        None => arguments.turns.unwrap_or(USUAL_TURNS),
    };
    let curve = Archimedean { radius, turns, leaning: arguments.leaning.to_radians() };
    let step = arguments.step.unwrap_or_else(|| usual_step(radius, turns));
    let n_steps = (2.0 * radius / step + ROUNDING).floor();
    limited(n_steps)?;
    if n_steps < 1.0 {
        let what = format!("--step {step} is beyond the sphere's diameter, {} mm", 2.0 * radius);
        return Err(Failure::new("Usage", what));
    }
    let share = |k: usize| (k as f64 * step / (2.0 * radius)).min(1.0);
    let spacing = curve.spacing();
    let count = n_steps as usize;
    let mut length = 0.0;
    let places = (0..=count).map(|k| {
        let share = share(k);
        length += if k > 0 { between(&curve, share - step / (2.0 * radius), share) } else { 0.0 };
        let latitude = curve.latitude(share);
        Place { point: curve.at(share), length, turn: turns * share, latitude, spacing }
    });
    let places: Vec<Place> = places.collect();
    let middle = |k: usize| curve.at((k as f64 + 0.5) * step / (2.0 * radius));
    let chord_error = chord_error(&places, middle);
    let mut notes = points_of_a_turn(n_steps / turns);
    let short = radius * PI * (1.0 - share(count));
    if short > radius * ROUNDING {
        notes.push(format!(
            "the last point lies {short:.3} mm before the pole: the step does not divide {}",
            2.0 * radius
        ));
    }
    if let Some(width) = arguments.bead_width {
        notes.push(example_note(radius, width, turns));
    }
    let name = format!("line-{}-{}.sldcrv", brief(radius), brief(turns));
    let shape = ("leaning_deg", arguments.leaning);
    let spacing = [spacing; 2];
    Ok(Drawn {
        kind: "archimedes",
        radius,
        turns,
        shape,
        places,
        spacing,
        chord_error,
        notes,
        name,
    })
}

/// Length of a piece, from places that are near to each other.
fn between(curve: &Archimedean, from: f64, to: f64) -> f64 {
    let rate = |share: f64| {
        (PI * curve.radius).hypot(TAU * curve.turns * curve.radius * curve.latitude(share).cos())
    };
    // Simpson's rule: pieces are short against the sphere.
    (to - from) / 6.0 * (rate(from) + 4.0 * rate(f64::midpoint(from, to)) + rate(to))
}

/// The source's equation and its example, which disagree.
fn example_note(radius: f64, width: f64, turns: f64) -> String {
    format!(
        "n = πR/h = {turns:.2} turns (eq. 2.5). The example beside that equation in its source, 100 turns \
         for R = 20 and h = 0.2, is R/h and leaves gaps: {:.2} turns would be {:.3} mm apart here",
        radius / width,
        PI * width
    )
}

/// The listing's step, halved until a turn has points enough.
fn usual_step(radius: f64, turns: f64) -> f64 {
    let enough = |step: &f64| 2.0 * radius / step >= POINTS_OF_A_TURN * turns;
    let halves = std::iter::successors(Some(USUAL_STEP), |step| Some(step / 2.0));
    // 64 halvings make more points than any limit lets through.
    let mut halves = halves.take(64);
    halves.find(enough).unwrap_or(f64::MIN_POSITIVE)
}

fn loxodrome(arguments: &LoxodromeCurve) -> Result<Drawn, Failure> {
    let radius = arguments.radius;
    positive(&[
        ("--radius", Some(radius)),
        ("--turns", arguments.turns),
        ("--bead-width", arguments.bead_width),
        ("--step", Some(arguments.step)),
    ])?;
    let slope = arguments.slope.filter(|slope| !(slope.is_finite() && *slope != 0.0));
    if slope.is_some() || !arguments.meridian.is_finite() {
        let what = "--slope must be a number other than 0, and --meridian an angle".to_owned();
        return Err(Failure::new("Usage", what));
    }
    let end = USUAL_END.to_radians();
    let (slope, turns) = match (arguments.bead_width, arguments.slope) {
        (Some(width), _) => {
            let most = PI * radius;
            if width >= most {
                let what =
                    format!("--bead-width {width} is not below half the sphere, {most:.3} mm");
                return Err(Failure::new("Usage", what));
            }
            // The widest turn lies half a turn to either side of the equator.
            let slope = spherical::loxodrome_slope(width / (2.0 * radius), 1.0);
            (slope, arguments.turns.unwrap_or_else(|| end.tan().asinh() / (PI * slope)))
        }
        (None, Some(slope)) => (slope, arguments.turns.unwrap_or(USUAL_TURNS)),
        (None, None) => {
            let turns = arguments.turns.unwrap_or(USUAL_TURNS);
            (spherical::loxodrome_slope(end, turns), turns)
        }
    };
    let meridian = arguments.meridian.to_radians();
    drawn_loxodrome(&Loxodrome { radius, slope, meridian }, turns, arguments.step)
}

fn drawn_loxodrome(curve: &Loxodrome, turns: f64, step_deg: f64) -> Result<Drawn, Failure> {
    let n_steps = (turns * 360.0 / step_deg + ROUNDING).floor();
    limited(n_steps)?;
    if n_steps < 1.0 {
        let what =
            format!("--step {step_deg} is beyond the whole curve, {} degrees", 360.0 * turns);
        return Err(Failure::new("Usage", what));
    }
    let step = step_deg.to_radians();
    let start = curve.meridian - PI * turns;
    let azimuth = |k: f64| start + k * step;
    let at_start = curve.latitude(start);
    let count = n_steps as usize;
    let places = (0..=count).map(|k| {
        let azimuth = azimuth(k as f64);
        let latitude = curve.latitude(azimuth);
        // Climb over the sine of the slope.
        let climb = curve.radius * (latitude - at_start).abs();
        Place {
            point: curve.at(azimuth),
            length: climb * curve.slope.hypot(1.0) / curve.slope.abs(),
            turn: (azimuth - start) / TAU,
            latitude,
            spacing: curve.spacing(azimuth),
        }
    });
    let places: Vec<Place> = places.collect();
    let chord_error = chord_error(&places, |k| curve.at(azimuth(k as f64 + 0.5)));
    // Pairs of turns lie between the first turn, or the last, and the middle.
    let least = curve.spacing(start);
    let most = if turns < 2.0 { least } else { curve.spacing(curve.meridian - PI) };
    let end = spherical::loxodrome_end(curve.slope.abs(), turns);
    let mut notes = points_of_a_turn(360.0 / step_deg);
    notes.push(format!(
        "ends at {:.3}° latitude; the caps above and below stay empty",
        end.to_degrees()
    ));
    Ok(Drawn {
        kind: "loxodrome",
        radius: curve.radius,
        turns,
        shape: ("slope", curve.slope),
        places,
        spacing: [least, most.max(least)],
        chord_error,
        notes,
        name: format!("loxodrome-{}-{}.sldcrv", brief(curve.radius), brief(turns)),
    })
}

fn limited(n_steps: f64) -> Result<(), Failure> {
    // Also when it is not finite.
    if n_steps < MOST_POINTS {
        return Ok(());
    }
    let what = format!("the curve has {n_steps:.0} points, at most {MOST_POINTS:.0}");
    Err(Failure::new("LimitExceeded", what).hint("a larger --step has less"))
}

fn points_of_a_turn(points: f64) -> Vec<String> {
    let few = points < POINTS_OF_A_TURN / 2.0;
    let note =
        || format!("a turn has {points:.1} points only; a smaller --step follows the curve closer");
    few.then(note).into_iter().collect()
}

/// Largest distance of the curve, half-way between points, from their chord.
fn chord_error(places: &[Place], middle: impl Fn(usize) -> Point3<f64>) -> f64 {
    let off = |(k, pair): (usize, &[Place])| {
        let along = pair[1].point - pair[0].point;
        let to = middle(k) - pair[0].point;
        let share = if along.norm() > 0.0 { to.dot(&along) / along.norm_squared() } else { 0.0 };
        (to - along * share.clamp(0.0, 1.0)).norm()
    };
    places.windows(2).enumerate().map(off).fold(0.0, f64::max)
}

/// The listing's lines: its third, second and first coordinate, rounded to three decimals and printed
/// as Python prints floats, that is with at least one of them.
fn sldcrv(drawn: &Drawn) -> String {
    let mut out = String::new();
    for Place { point, .. } in &drawn.places {
        let [a, b, c] = [point.y, point.z, point.x].map(rounded);
        // Writing to a string cannot fail, here and below.
        let _ = writeln!(out, "{a} {b} {c}");
    }
    out
}

fn rounded(value: f64) -> String {
    let mut text = format!("{value:.3}");
    while text.ends_with('0') && !text.ends_with(".0") {
        text.pop();
    }
    text
}

fn csv(drawn: &Drawn) -> String {
    let mut out = String::from("x_mm,y_mm,z_mm,length_mm,turn,latitude_deg,spacing_mm\n");
    let six = |value: f64| machine::gcode::decimal(value, 6);
    for place in &drawn.places {
        let Point3 { coords, .. } = place.point;
        let _ = writeln!(
            out,
            "{},{},{},{},{},{},{}",
            six(coords.x),
            six(coords.y),
            six(coords.z),
            six(place.length),
            six(place.turn),
            six(place.latitude.to_degrees()),
            six(place.spacing)
        );
    }
    out
}

/// A number as short as three decimals allow.
fn brief(value: f64) -> String {
    machine::gcode::decimal(value, 3)
}

fn title(drawn: &Drawn) -> String {
    let (radius, turns) = (brief(drawn.radius), brief(drawn.turns));
    format!("{}, R = {radius} mm, {turns} turns, {}", drawn.kind, apart(drawn))
}

fn apart(drawn: &Drawn) -> String {
    let [least, most] = drawn.spacing;
    if least == most {
        format!("{least:.3} mm apart")
    } else {
        format!("{most:.3} mm apart at the equator, {least:.3} mm at the ends")
    }
}

fn length(drawn: &Drawn) -> f64 {
    drawn.places.last().map_or(0.0, |place| place.length)
}

fn tell(drawn: &Drawn, target: &Path, manner: &Manner) -> Result<(), Failure> {
    if manner.json {
        return say_json(&serde_json::json!({
            "curve": drawn.kind,
            "radius_mm": drawn.radius,
            "turns": drawn.turns,
            (drawn.shape.0): drawn.shape.1,
            "points": drawn.places.len(),
            "length_mm": length(drawn),
            "spacing_mm": { "least": drawn.spacing[0], "most": drawn.spacing[1] },
            "chord_error_mm": drawn.chord_error,
            "notes": drawn.notes,
            "file": target.display().to_string(),
        }));
    }
    if manner.quiet {
        return Ok(());
    }
    let (radius, turns) = (brief(drawn.radius), brief(drawn.turns));
    let mut out = format!("  curve  {}, R = {radius} mm, {turns} turns\n", drawn.kind);
    let _ = writeln!(out, "  turns  {}", apart(drawn));
    let _ = writeln!(out, " length  {:.3} mm", length(drawn));
    let error = drawn.chord_error;
    let _ = writeln!(out, " points  {}, chords within {error:.4} mm", drawn.places.len());
    for note in &drawn.notes {
        let _ = writeln!(out, "   note  {note}");
    }
    let _ = writeln!(out, "written  {}", target.display());
    say(&out)
}

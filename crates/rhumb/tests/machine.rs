//! What comes out of real machines: misaligned ones, and those of every dialect.

use machine::kinematics::Alignment;
use machine::profile::Printer;
use machine::program::Role;
use mesh::mesh::Mesh;
use mesh::shapes;
use nalgebra::{Point2, Vector2};
use plan::planner::Totals;
use rhumb::check::check;
use rhumb::interrupt::Interrupt;
use rhumb::pipeline::{Request, Watch, part, slice};
use rhumb::place::{Pose, Wish};
use rhumb::progress::Silent;
use rhumb::settings::{Job, Settings, Sources};
use twin::finding::Severity;
use twin::segment::Segment;

fn job(printer: &str, set: &[&str]) -> (Settings, Job) {
    let sources = Sources {
        printer: Some(printer.into()),
        set: set.iter().map(|&pair| pair.to_owned()).collect(),
        ..Sources::default()
    };
    let no_files = |_: &std::path::Path| unreachable!("built-in profiles need no files");
    let settings = Settings::load(&sources, &no_files).expect("built-in profiles are sound");
    let job = Job::resolve(&settings).expect("they fit together");
    (settings, job)
}

/// Slices a mesh, and has the program judged by the machine that it was made for.
fn program(mesh: &Mesh, settings: &Settings, job: &Job) -> Vec<u8> {
    sliced(mesh, settings, job).0
}

/// The same with what the slice amounts to.
fn sliced(mesh: &Mesh, settings: &Settings, job: &Job) -> (Vec<u8>, Totals) {
    let model = mesh::stl::write(mesh);
    let request = Request {
        model: &model,
        name: "test",
        wish: Wish::default(),
        settings,
        job,
        made_at: "2026-01-31 at 12:00:00",
    };
    let mut text = Vec::new();
    let watch = &mut Watch { progress: &mut Silent, interrupt: &Interrupt::default() };
    let outcome = slice(&request, &mut text, watch).expect("it can be sliced");
    let verdict = check(text.as_slice(), job, Some(part(&outcome)), false, |_| {}).expect("memory");
    let errors: Vec<_> =
        verdict.findings.iter().filter(|f| f.severity == Severity::Error).take(3).collect();
    assert!(errors.is_empty(), "{}: {errors:?}", job.dialect.name);
    (text, outcome.totals)
}

/// Places of the nozzle in the part, a few on each extruding move of the outer wall, as a machine
/// prints them.
fn outer_wall(text: &[u8], job: &Job, machine: &Printer) -> Vec<Point2<f64>> {
    let job = Job { printer: machine.clone(), ..job.clone() };
    let mut places = Vec::new();
    let each = |segment: &Segment| {
        if segment.extrudes() && segment.role == Role::ExternalPerimeter {
            for k in 0..=4 {
                let over_bed = segment.curve.over_bed(f64::from(k) / 4.0);
                places.push(machine.alignment.part_from_bed(&over_bed));
            }
        }
    };
    check(text, &job, None, false, each).expect("memory");
    assert!(places.len() > 100);
    places
}

const MISSED: Alignment = Alignment { b: 0.5, ..Alignment::IDEAL };

/// The chord tolerance and the last place of a length.
const WITHIN: f64 = 0.005 + 0.001;

fn square_tube() -> Mesh {
    shapes::block(40.0, 40.0, 1.0)
}

fn boss() -> Mesh {
    let ring: Vec<[f64; 2]> = (0..360)
        .map(|k| f64::from(k).to_radians())
        .map(|angle| [2.5 * angle.cos(), 2.5 * angle.sin()])
        .collect();
    shapes::extruded(&ring, &[], 1.0)
}

/// Distance from the square on which the outer wall's middle runs.
fn off_square(p: &Point2<f64>, half: f64) -> f64 {
    (p.x.abs().max(p.y.abs()) - half).abs()
}

#[test]
fn a_calibrated_square_is_true_on_a_machine_that_misses_its_axis() {
    for name in ["generic-polar", "klipper-polar", "core-r-theta"] {
        let set = ["fill_density=0", "top_solid_layers=0", "bottom_solid_layers=0", "skirts=0"];
        let (settings, mut job) = job(name, &set);
        let half = 20.0 - 0.45 / 2.0;
        let naive = program(&square_tube(), &settings, &job);
        let mut real = job.printer.clone();
        real.alignment = MISSED;
        // What the theory predicts without correction: half a millimetre everywhere.
        let (meant, printed) =
            (outer_wall(&naive, &job, &job.printer), outer_wall(&naive, &job, &real));
        for (a, b) in meant.iter().zip(&printed) {
            assert!(((a - b).norm() - 0.5).abs() < 1e-9);
        }
        let worst =
            |places: &[Point2<f64>]| places.iter().map(|p| off_square(p, half)).fold(0.0, f64::max);
        assert!(worst(&printed) > 0.3, "{name}");
        job.printer.alignment = MISSED;
        let corrected = program(&square_tube(), &settings, &job);
        let off = worst(&outer_wall(&corrected, &job, &real));
        assert!(off <= WITHIN, "{name}: {off}");
    }
}

#[test]
fn a_calibrated_boss_has_its_radius() {
    let set = ["fill_density=0", "top_solid_layers=0", "bottom_solid_layers=0", "perimeters=1"];
    let (settings, mut job) = job("generic-polar", &set);
    let mut real = job.printer.clone();
    real.alignment = MISSED;
    let radii = |text: &[u8], job: &Job| -> (f64, f64) {
        let places = outer_wall(text, job, &real);
        let radii = places.iter().map(|p| p.coords.norm());
        radii.fold((f64::MAX, 0.0), |(low, high), r| (low.min(r), high.max(r)))
    };
    let radius: f64 = 2.5 - 0.45 / 2.0;
    // A polygon of 360 corners, and the slicer's own thinning of outlines.
    let slack = WITHIN + 0.005;
    let naive = program(&boss(), &settings, &job);
    let (low, high) = radii(&naive, &job);
    let wrong = radius.hypot(0.5);
    assert!((low - wrong).abs() < slack && (high - wrong).abs() < slack, "{low} {high}");
    job.printer.alignment = MISSED;
    let corrected = program(&boss(), &settings, &job);
    let (low, high) = radii(&corrected, &job);
    assert!((low - radius).abs() < slack && (high - radius).abs() < slack, "{low} {high}");
}

fn round(diameter: f64) -> Mesh {
    let ring: Vec<[f64; 2]> = (0..72)
        .map(|k| f64::from(k * 5).to_radians())
        .map(|angle| [angle.cos(), angle.sin()])
        .map(|[x, y]| [diameter / 2.0 * x, diameter / 2.0 * y])
        .collect();
    shapes::extruded(&ring, &[], 0.6)
}

fn bar(length: f64, width: f64) -> Mesh {
    let ring = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]
        .map(|[x, y]| [length / 2.0 * x, width / 2.0 * y]);
    shapes::extruded(&ring, &[], 0.6)
}

fn arms(length: f64, width: f64) -> Mesh {
    let (far, near) = (length / 2.0, width / 2.0);
    let ring = [
        [near, near],
        [near, far],
        [-near, far],
        [-near, near],
        [-far, near],
        [-far, -near],
        [-near, -near],
        [-near, -far],
        [near, -far],
        [near, -near],
        [far, -near],
        [far, near],
    ];
    shapes::extruded(&ring, &[], 0.6)
}

/// Slices a mesh where it stands, and expects a judge who has nothing to say.
fn flawless(mesh: &Mesh, centre: [f64; 2], settings: &Settings, job: &Job) {
    let model = mesh::stl::write(mesh);
    let wish = Wish { pose: Pose::Keep, centre: centre.into(), ..Wish::default() };
    let request = Request { model: &model, name: "test", wish, settings, job, made_at: "now" };
    let mut text = Vec::new();
    let watch = &mut Watch { progress: &mut Silent, interrupt: &Interrupt::default() };
    let outcome = slice(&request, &mut text, watch).expect("it can be sliced");
    let must_go_round = job.printer.rail.min >= 0.0;
    let mut nearest = f64::INFINITY;
    let each = |segment: &Segment| {
        if let Some(ends) = segment.joints.filter(|_| segment.path > 0.0) {
            // What the firmware is told, straight from end to end.
            let [a, b] = ends.map(|to| {
                let (sin, cos) = to.turn.radians().sin_cos();
                Point2::new(to.s * cos, to.s * sin)
            });
            let distance = geom::polyline::distance_to_segment(&a, &b, &Point2::origin());
            nearest = f64::min(nearest, distance);
        }
    };
    let verdict = check(text.as_slice(), job, Some(part(&outcome)), false, each).expect("memory");
    assert!(verdict.findings.is_empty(), "{}: {:?}", job.dialect.name, verdict.findings);
    if must_go_round {
        let clearance = job.printer.axis_clearance;
        assert!(nearest >= clearance, "{}: {nearest} mm from the axis", job.dialect.name);
    }
}

#[test]
fn what_lies_over_the_axis_is_printed_in_every_dialect() {
    let models = [
        (round(8.0), [0.0; 2]),
        (round(8.0), [0.1, 0.0]),
        (round(1.0), [0.0; 2]),
        (arms(20.0, 4.0), [0.0; 2]),
        (arms(30.0, 1.2), [0.0; 2]),
        (bar(24.0, 0.6), [0.0; 2]),
        (bar(24.0, 0.45), [0.05, 0.1]),
    ];
    let printers = [
        "generic-polar",
        "klipper-polar",
        "rrf-polar",
        "marlin-polar",
        "grblhal-polar",
        "core-r-theta",
        "linuxcnc-rotary",
    ];
    let mut missed = Alignment {
        a: 0.213,
        b: 0.347,
        a1: 0.001,
        b1: -0.0015,
        plate_offset: Vector2::new(0.12, -0.05),
        plate_angle: 0.026,
        ..Alignment::IDEAL
    };
    missed.bed.zero = 0.05;
    missed.bed.backlash = 0.05_f64.to_radians();
    for printer in printers {
        let (settings, mut job) = job(printer, &["skirts=0"]);
        for alignment in [Alignment::IDEAL, missed] {
            job.printer.alignment = alignment;
            for (model, centre) in &models {
                flawless(model, *centre, &settings, &job);
            }
        }
        let (settings, job) = self::job(printer, &["fill_density=1"]);
        flawless(&round(8.0), [0.0; 2], &settings, &job);
        flawless(&arms(20.0, 4.0), [0.0; 2], &settings, &job);
    }
}

#[test]
fn wires_to_the_bed_bound_its_turn() {
    let (settings, job) = job("generic-polar", &["turns_max=4", "fill_density=0"]);
    let text = program(&shapes::block(30.0, 30.0, 4.0), &settings, &job);
    let (mut most, mut turned): (f64, f64) = (0.0, 0.0);
    check(text.as_slice(), &job, None, false, |segment| {
        if let Some([from, to]) = segment.joints {
            most = most.max(to.turn.radians().abs() / std::f64::consts::TAU);
            turned += (to.turn.radians() - from.turn.radians()).abs() / std::f64::consts::TAU;
        }
    })
    .expect("memory");
    assert!(most <= 4.0, "{most}");
    assert!(turned > 20.0, "there was something to unwind: {turned}");
}

#[test]
fn a_probed_bed_and_a_loose_drive_print_the_same_part() {
    let (settings, mut job) = job("generic-polar", &["fill_density=0", "skirts=0"]);
    let probes: Vec<[f64; 3]> = (0..9)
        .map(|k| {
            let (x, y) = (f64::from(k % 3) * 40.0 - 40.0, f64::from(k / 3) * 40.0 - 40.0);
            [x, y, 0.002 * x - 0.001 * y + 0.0001 * x * x]
        })
        .collect();
    let level = program(&square_tube(), &settings, &job);
    let meant = outer_wall(&level, &job, &job.printer.clone());
    job.printer.bed_map =
        machine::height_map::HeightMap::new(&probes, 10.0).expect("a map of a bed");
    job.printer.alignment.bed.backlash = 0.2_f64.to_radians();
    // The twin knows the bed and the play of its drive, and finds the part true.
    let told = program(&square_tube(), &settings, &job);
    let half = meant.iter().map(|p| p.x.abs()).fold(0.0, f64::max);
    for place in outer_wall(&told, &job, &job.printer.clone()) {
        assert!(off_square(&place, half) <= WITHIN, "{place}");
    }
    let raised = job.printer.bed_map.height(&Vector2::new(19.0, -19.0));
    let text = String::from_utf8(told).expect("ASCII");
    let heights: Vec<f64> = text
        .lines()
        .filter(|line| line.starts_with("G1 R"))
        .filter_map(|line| line.split(" Z").nth(1)?.split(' ').next()?.parse().ok())
        .collect();
    assert!(raised > 0.05 && heights.len() > 100, "the lift follows the bed: {}", heights.len());
}

#[test]
fn no_firmware_gets_more_moves_in_a_second_than_it_takes() {
    // 7200 facets round the axis and as many round a hole beside it: sides of 14 and 3 µm.
    let ring = |x: f64, radius: f64| -> Vec<[f64; 2]> {
        (0..7200)
            .map(|k| (f64::from(k) * 0.05).to_radians())
            .map(|angle| [x + radius * angle.cos(), radius * angle.sin()])
            .collect()
    };
    let model = shapes::extruded(&ring(0.0, 16.0), &[ring(8.0, 4.0)], 0.6);
    for printer in ["marlin-polar", "klipper-polar", "core-r-theta"] {
        let fast = ["external_perimeter_speed_mm_per_s=200", "perimeter_speed_mm_per_s=200"];
        let (settings, job) = job(printer, &fast);
        let text = program(&model, &settings, &job);
        let limit = job.printer.moves_per_second;
        // Ends of all moves, s.
        let (mut ends, mut shortest) = (vec![0.0], f64::INFINITY);
        check(text.as_slice(), &job, None, false, |segment| {
            if segment.duration > 0.0 {
                // Marlin stretches what it runs at its own pace itself, should its queue run dry.
                let least = if segment.is_paced { 1.0 / limit } else { 0.0 };
                let duration = segment.duration.max(least);
                shortest = duration.min(shortest);
                ends.push(ends.last().expect("one at least") + duration);
            }
        })
        .expect("memory");
        assert!(ends.len() > 1000, "{printer}: {}", ends.len());
        // Rounding of `F` and of the ends of a move is a hundredth at the most.
        assert!(shortest * limit > 0.99, "{printer}: {} a second", 1.0 / shortest);
        let most = (limit / 10.0).ceil() as usize;
        for window in ends.windows(most + 1) {
            let moves = most as f64 / (window[most] - window[0]);
            assert!(moves <= 1.005 * limit, "{printer}: {moves} a second");
        }
    }
}

#[test]
fn slow_flow_beside_the_axis_is_told_and_there_is_none_elsewhere() {
    let disc: Vec<[f64; 2]> = (0..90)
        .map(|k| (f64::from(k) * 4.0).to_radians())
        .map(|angle| [8.0 * angle.cos(), 8.0 * angle.sin()])
        .collect();
    let hole: Vec<[f64; 2]> = disc.iter().map(|[x, y]| [x / 2.0, y / 2.0]).collect();
    let (solid, ring) = (shapes::extruded(&disc, &[], 0.8), shapes::extruded(&disc, &[hole], 0.8));
    let set = ["fill_density=1", "skirts=0"];
    let (settings, mut job) = job("linuxcnc-rotary", &set);
    let (text, totals) = sliced(&solid, &settings, &job);
    let found = totals.slow_flow;
    let limit = job.plan.filament.least_flow;
    // At a quarter turn a second even a thick bead needs a millimetre's distance.
    assert!(found.places > 0 && found.least < limit / 2.0, "{found:?}");
    assert!(found.at.xy().coords.norm() < 1.0, "{found:?}");
    // The program says the same: time and length of what is laid below the limit.
    let (mut time, mut length, mut least) = (0.0, 0.0, f64::INFINITY);
    check(text.as_slice(), &job, None, false, |segment| {
        let flow = segment.filament * job.plan.filament.area / segment.duration;
        if segment.extrudes() && flow < limit {
            time += segment.duration;
            length += segment.path;
            least = flow.min(least);
        }
    })
    .expect("memory");
    assert!((found.time / time - 1.0).abs() < 0.02, "{} {time}", found.time);
    assert!((found.length / length - 1.0).abs() < 0.02, "{} {length}", found.length);
    assert!((found.least / least - 1.0).abs() < 0.02, "{} {least}", found.least);
    let (_, totals) = sliced(&ring, &settings, &job);
    assert_eq!(totals.slow_flow.places, 0, "{:?}", totals.slow_flow);
    job.plan.filament.least_flow = 0.0;
    let (_, totals) = sliced(&solid, &settings, &job);
    assert_eq!(totals.slow_flow.places, 0);
}

#[test]
fn filament_ahead_of_its_flow_is_told_in_the_words_of_each_firmware() {
    for (printer, wanted) in [
        ("klipper-polar", "SET_PRESSURE_ADVANCE ADVANCE=0.045"),
        ("rrf-polar", "M572 D0 S0.045"),
        ("core-r-theta", "M572 D0 S0.045"),
        ("marlin-polar", "M900 K0.045"),
    ] {
        let (settings, job) = job(printer, &["pressure_advance_s=0.045"]);
        flawless(&bar(20.0, 0.6), [0.0; 2], &settings, &job);
        let text = String::from_utf8(program(&bar(20.0, 0.6), &settings, &job)).expect("ASCII");
        let line = text.lines().position(|line| line == wanted).expect("it is told");
        let laid = text.lines().position(|line| line.starts_with(";TYPE:")).expect("a bead");
        assert!(line < laid, "{printer}: before the print");
    }
    let sources = Sources {
        printer: Some("grblhal-polar".into()),
        set: vec!["pressure_advance_s=0.045".into()],
        ..Sources::default()
    };
    let no_files = |_: &std::path::Path| unreachable!("built-in profiles need no files");
    let settings = Settings::load(&sources, &no_files).expect("the value is in its range");
    let refused = Job::resolve(&settings).expect_err("grblHAL has no such command");
    assert!(refused.to_string().contains("pressure_advance_s"), "{refused}");
}

//! `rhumb calibrate` from what a sensor logs to what a machine prints.

use machine::kinematics::{Alignment, Branch};
use machine::program::{BedTurn, Role};
use nalgebra::{Point2, Point3, Vector2};
use rhumb::calibration::Calibration;
use rhumb::check::check;
use rhumb::interrupt::Interrupt;
use rhumb::pipeline::{Request, Watch, slice};
use rhumb::place::Wish;
use rhumb::progress::Silent;
use rhumb::settings::{Job, Settings, Sources};
use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// A folder of its own for each test, empty at first.
fn folder(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("calibrate-{name}"));
    let _ = std::fs::remove_dir_all(&path);
    std::fs::create_dir_all(&path).expect("a folder for the test");
    path
}

fn rhumb(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_rhumb"))
        .args(arguments)
        .current_dir(folder)
        .env("SOURCE_DATE_EPOCH", "0")
        .output()
        .expect("the binary runs")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

const TRUE_MACHINE: Alignment = Alignment {
    a: 0.31,
    b: -0.44,
    plate_offset: Vector2::new(0.2, 0.5),
    plate_angle: 0.03,
    ..Alignment::IDEAL
};

/// What a sensor without noise logs of a ring of 16 on the machine.
fn log(sides: &[Branch]) -> String {
    let mut text = "# magnets = 16\n# ring_radius_mm = 100\n# index_theta_deg = 1\n\
        s_mm,theta_deg\n"
        .to_owned();
    for k in 0..16 {
        let azimuth = TAU * f64::from(k) / 16.0;
        let at = Point3::new(99.6 * azimuth.cos(), 99.6 * azimuth.sin(), 0.0);
        for &side in sides {
            let joints = TRUE_MACHINE
                .joints_from_part(&at, side, BedTurn::default())
                .expect("the ring is within reach");
            let theta_deg = joints.turn.radians().to_degrees();
            writeln!(text, "{:.5},{theta_deg:.5}", joints.s).expect("strings take all");
        }
    }
    text
}

#[test]
fn a_log_becomes_a_calibration_with_errors() {
    let folder = folder("fit");
    std::fs::write(folder.join("log.csv"), log(&[Branch::Near, Branch::Far])).expect("written");
    let done = rhumb(&folder, &["calibrate", "fit", "log.csv", "--picture", "fit.svg"]);
    assert_eq!(done.status.code(), Some(0), "{}", text(&done.stderr));
    let said = text(&done.stdout);
    assert!(said.contains("two-sided ring") && said.contains("rank 6"), "{said}");
    let bytes = std::fs::read(folder.join("log.toml")).expect("the calibration is written");
    let found = Calibration::read(&bytes, "log.toml").expect("it can be read");
    assert!((found.rail.a_mm - 0.31).abs() < 1e-4 && (found.rail.b_mm + 0.44).abs() < 1e-4);
    assert!((found.plate.ex_mm - 0.2).abs() < 1e-4 && (found.plate.ey_mm - 0.5).abs() < 1e-4);
    assert!((found.plate.psi_deg.to_radians() - 0.03).abs() < 1e-6);
    let sd = found.quality["b_sd_mm"].as_float().expect("a standard error");
    assert!((sd - 0.0035).abs() < 0.0003, "{sd}");
    let picture = std::fs::read_to_string(folder.join("fit.svg")).expect("the picture");
    assert!(picture.contains("32 of 32 sightings used"));
}

#[test]
fn what_a_log_does_not_say_is_not_written() {
    let folder = folder("one-side");
    std::fs::write(folder.join("log.csv"), log(&[Branch::Near])).expect("written");
    let done = rhumb(&folder, &["calibrate", "fit", "log.csv", "-o", "cal.toml"]);
    assert_eq!(done.status.code(), Some(1));
    let said = text(&done.stdout);
    assert!(said.contains("not determined: b, by how much the rail misses the axis"), "{said}");
    let written = std::fs::read_to_string(folder.join("cal.toml")).expect("the calibration");
    assert!(!written.contains("b_mm") && !written.contains("a_mm"), "{written}");
    assert!(!written.contains("psi_deg"), "{written}");
    assert!(written.contains("ex_mm = 0.19"), "{written}");
}

#[test]
fn failures_leave_nothing_behind() {
    let folder = folder("failures");
    let cases = [
        ("empty.csv", "", 4, "LogSyntax"),
        ("header.csv", "a,b\n1,2\n", 4, "LogSyntax"),
        ("row.csv", "s_mm,theta_deg\n1,inf\n", 4, "LogSyntax"),
        ("few.csv", "s_mm,theta_deg\n100,2\n", 4, "NoCalibration"),
        ("none.csv", "# magnets = 16\ns_mm,theta_deg\n100,2\n10,70\n55,190\n", 4, "NoCalibration"),
        // The rail is 2 mm off: that is for a spanner.
        ("bent.csv", "s_mm,theta_deg\n100,-1.146\n-100,-178.854\n", 6, "ConfigRange"),
    ];
    for (name, log, status, class) in cases {
        std::fs::write(folder.join(name), log).expect("written");
        let done = rhumb(&folder, &["calibrate", "fit", name, "-o", "cal.toml"]);
        let said = text(&done.stderr);
        assert_eq!(done.status.code(), Some(status), "{name}: {said}");
        assert!(said.starts_with(&format!("error[{class}]: ")), "{name}: {said}");
        assert!(!folder.join("cal.toml").exists(), "{name}");
    }
}

#[test]
fn a_calibration_is_explained() {
    let folder = folder("show");
    let file = "[rail]\na_mm = -0.2\nb_mm = 0.5\n[plate]\nex_mm = 3\n[quality]\nb_sd_mm = 0.004\n";
    std::fs::write(folder.join("cal.toml"), file).expect("written");
    let done = rhumb(&folder, &["calibrate", "show", "cal.toml", "--picture", "map.svg"]);
    assert_eq!(done.status.code(), Some(0), "{}", text(&done.stderr));
    let said = text(&done.stdout);
    assert!(said.contains("would break by 1.000 mm") && said.contains("0.5 ± 0.0040"), "{said}");
    // √(0.2² + 0.5²) everywhere.
    assert!(said.contains("miss by up to 0.539 mm (0.539 mm rms)"), "{said}");
    assert!(folder.join("map.svg").exists());
    let done = rhumb(&folder, &["--json", "calibrate", "show", "cal.toml"]);
    let json: serde_json::Value = serde_json::from_slice(&done.stdout).expect("JSON");
    assert!(
        (json["missed_by_the_rail_mm"]["most"].as_f64().expect("a number") - 0.5385).abs() < 1e-3
    );
}

#[test]
fn printed_pins_correct_a_calibration_and_tell_where_the_sensor_sits() {
    let folder = folder("pins");
    let done = rhumb(&folder, &["calibrate", "pins"]);
    assert_eq!(done.status.code(), Some(0), "{}", text(&done.stderr));
    let mesh = std::fs::read(folder.join("pins.stl")).expect("the model");
    assert!(mesh.len() > 84);
    // The nozzle of the true machine, printed with what a sensor beside it found.
    let (a, b) = (0.05, -0.12);
    let at = |radius: f64, quarter: f64| {
        let (sin, cos) = (quarter * TAU / 4.0).sin_cos();
        Point2::new(cos * (radius + a) - sin * b, sin * (radius + a) + cos * b)
    };
    let pair = |p: Point2<f64>, q: Point2<f64>| (p - q).norm() + 6.0;
    let readings = format!(
        "from,to,over_mm,between_mm\nA0,C90,{},\nA0,C270,{},\nA0,A180,{},\nC0,C180,{},\n",
        pair(at(60.0, 0.0), at(15.0, 1.0)),
        pair(at(60.0, 0.0), at(15.0, 3.0)),
        pair(at(60.0, 0.0), at(60.0, 2.0)),
        pair(at(15.0, 0.0), at(15.0, 2.0)),
    );
    std::fs::write(folder.join("readings.csv"), readings).expect("written");
    std::fs::write(folder.join("log.csv"), log(&[Branch::Near, Branch::Far])).expect("written");
    rhumb(&folder, &["calibrate", "fit", "log.csv", "-o", "sensor.toml"]);
    let arguments =
        ["calibrate", "pins", "readings.csv", "--calibration", "sensor.toml", "-o", "nozzle.toml"];
    let done = rhumb(&folder, &arguments);
    assert_eq!(done.status.code(), Some(0), "{}", text(&done.stderr));
    let read = |name: &str| {
        let bytes = std::fs::read(folder.join(name)).expect("a calibration");
        Calibration::read(&bytes, name).expect("it can be read")
    };
    let nozzle = read("nozzle.toml");
    assert!((nozzle.rail.a_mm - 0.36).abs() < 2e-4, "{nozzle:?}");
    assert!((nozzle.rail.b_mm + 0.56).abs() < 2e-4, "{nozzle:?}");
    assert!((nozzle.plate.ex_mm - 0.2).abs() < 1e-4);
    // From then on magnets alone give the nozzle.
    let arguments = ["calibrate", "fit", "log.csv", "--pins", "nozzle.toml", "-o", "again.toml"];
    let done = rhumb(&folder, &arguments);
    assert_eq!(done.status.code(), Some(0), "{}", text(&done.stderr));
    let again = read("again.toml");
    assert!((again.rail.a_mm - nozzle.rail.a_mm).abs() < 1e-4, "{again:?}");
    assert!((again.rail.b_mm - nozzle.rail.b_mm).abs() < 1e-4, "{again:?}");
}

#[test]
fn a_calibrated_print_is_right_on_the_true_machine() {
    let folder = folder("print");
    std::fs::write(folder.join("log.csv"), log(&[Branch::Near, Branch::Far])).expect("written");
    rhumb(&folder, &["calibrate", "fit", "log.csv", "-o", "cal.toml"]);
    let bytes = std::fs::read(folder.join("cal.toml")).expect("the calibration");
    let found = Calibration::read(&bytes, "cal.toml").expect("it can be read");
    let set = ["fill_density=0", "top_solid_layers=0", "bottom_solid_layers=0", "skirts=0"];
    let sources = Sources { set: set.map(str::to_owned).to_vec(), ..Sources::default() };
    let no_files = |_: &Path| unreachable!("built-in profiles need no files");
    let settings = Settings::load(&sources, &no_files).expect("built-in profiles are sound");
    let mut job = Job::resolve(&settings).expect("defaults fit together");
    let uncalibrated = job.clone();
    found.apply(&mut job.printer, job.bed_map_fade).expect("a sound calibration");
    let mut machine = job.clone();
    machine.printer.alignment = TRUE_MACHINE;
    let off = worst_off_square(&settings, &job, &machine);
    assert!(off < 0.020, "{off}");
    let off = worst_off_square(&settings, &uncalibrated, &machine);
    assert!(off > 0.3, "{off}");
}

/// By how much the middle of the outer wall of a square misses its place on a machine, mm.
fn worst_off_square(settings: &Settings, job: &Job, machine: &Job) -> f64 {
    let model = mesh::stl::write(&mesh::shapes::block(40.0, 40.0, 1.0));
    let request = Request {
        model: &model,
        name: "square",
        wish: Wish::default(),
        settings,
        job,
        made_at: "2026-01-31 at 12:00:00",
    };
    let mut program = Vec::new();
    let watch = &mut Watch { progress: &mut Silent, interrupt: &Interrupt::default() };
    slice(&request, &mut program, watch).expect("it can be sliced");
    let mut places = Vec::new();
    check(program.as_slice(), machine, None, false, |segment| {
        if segment.extrudes() && segment.role == Role::ExternalPerimeter {
            for k in 0..=4 {
                let over_bed = segment.curve.over_bed(f64::from(k) / 4.0);
                places.push(TRUE_MACHINE.part_from_bed(&over_bed));
            }
        }
    })
    .expect("memory");
    assert!(places.len() > 100);
    // Half a bead inside of the square.
    let half = 20.0 - 0.45 / 2.0;
    places.iter().map(|p| (p.x.abs().max(p.y.abs()) - half).abs()).fold(0.0, f64::max)
}

/// What a calibration says of the pivot.
fn pivot_of(file: &Path) -> (f64, Option<[f64; 2]>, f64) {
    let found = Calibration::read(&std::fs::read(file).expect("written"), "c").expect("readable");
    let sd = found.quality["pivot_length_sd_mm"].as_float().expect("a number");
    (found.head.pivot_length_mm.expect("a length"), found.head.offset_mm, sd)
}

#[test]
fn a_pivot_is_found_from_touches_within_three_standard_errors() {
    let folder = folder("pivot");
    for (printer, truth, seed) in [
        ("polar-two-axis", "47.31,0.42,-0.63", "1"),
        ("polar-two-axis", "44.2", "2"),
        ("tilt-core-r-theta", "41.77", "3"),
    ] {
        let simulate = ["calibrate", "pivot", "--printer", printer, "-o", "log.csv"];
        let written =
            rhumb(&folder, &[&simulate[..], &["--simulate", truth, "--seed", seed]].concat());
        assert_eq!(written.status.code(), Some(0), "{}", text(&written.stderr));
        let fitted = ["calibrate", "pivot", "log.csv", "--printer", printer, "-o", "cal.toml"];
        let fitted = rhumb(&folder, &fitted);
        assert_eq!(fitted.status.code(), Some(0), "{}", text(&fitted.stderr));
        assert!(text(&fitted.stdout).contains("from pivot to tip"), "{}", text(&fitted.stdout));
        let truth: Vec<f64> = truth.split(',').map(|n| n.parse().expect("a number")).collect();
        let (length, offset, sd) = pivot_of(&folder.join("cal.toml"));
        assert!((length - truth[0]).abs() <= 3.0 * sd && sd < 0.02, "{printer}: {length} ± {sd}");
        assert_eq!(offset.is_some(), printer == "polar-two-axis");
        for (k, found) in offset.into_iter().flatten().enumerate() {
            let off = (found - truth.get(k + 1).unwrap_or(&0.0)).abs();
            assert!(off < 0.06, "{printer}: {found}");
        }
    }
}

#[test]
fn a_program_for_a_calibrated_pivot_proves_sound_on_that_machine_and_not_on_another() {
    let folder = folder("pivot-print");
    let head = "[head]\npivot_length_mm = 47.3\noffset_mm = [0.41, -0.6]\n";
    std::fs::write(folder.join("cal.toml"), head).expect("written");
    let model = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models/dome.stl");
    let machine = ["--printer", "polar-two-axis"];
    let spheres = ["--layers=spherical", "--sphere-centre=-12", "--set", "tilt=normal"];
    let slice = ["slice", model.to_str().expect("a path"), "-q", "--scale=0.4", "-o", "o.gcode"];
    let calibrated = ["--calibration", "cal.toml"];
    let sliced = rhumb(&folder, &[&slice[..], &machine, &spheres, &calibrated].concat());
    assert_eq!(sliced.status.code(), Some(0), "{}", text(&sliced.stderr));
    let verify = ["verify", "o.gcode", "-q"];
    // What hangs inside of it hangs on any machine.
    let is_off = |said: &str| {
        said.lines().any(|line| ["surface: ", "head: "].iter().any(|check| line.starts_with(check)))
    };
    let there = text(&rhumb(&folder, &[&verify[..], &machine, &calibrated].concat()).stdout);
    assert!(!is_off(&there), "{there}");
    let elsewhere = text(&rhumb(&folder, &[&verify[..], &machine].concat()).stdout);
    assert!(is_off(&elsewhere), "{elsewhere}");
}

#[test]
fn what_tells_no_pivot_is_refused() {
    let folder = folder("no-pivot");
    let run = |arguments: &[&str]| {
        let ran = rhumb(&folder, &[&["calibrate", "pivot"], arguments].concat());
        (ran.status.code(), text(&ran.stderr))
    };
    let printer = ["--printer", "polar-two-axis"];
    let (code, _) =
        run(&[&["--simulate", "45", "--tilt", "2", "-o", "flat.csv"], &printer[..]].concat());
    assert_eq!(code, Some(0));
    let (code, said) = run(&[&["flat.csv"], &printer[..]].concat());
    assert!(code == Some(4) && said.contains("add touches"), "{said}");
    assert!(said.contains("B = -30° and B = 30°"), "{said}");
    let (code, said) = run(&["flat.csv"]);
    assert!(code == Some(6) && said.contains("no head"), "{said}");
    std::fs::write(folder.join("bad.csv"), "s_mm,theta_deg,z_mm,b_deg\n1,2,x,4\n")
        .expect("written");
    let (code, said) = run(&[&["bad.csv"], &printer[..]].concat());
    assert!(code == Some(4) && said.contains("line 2"), "{said}");
}

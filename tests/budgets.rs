//! How much memory and time a file may cost: never more than in proportion to its bytes, whatever
//! numbers stand in it.

use std::process::{Command, Output, Stdio};
use std::time::Duration;

use crate::run::{Ran, Scratch, model, say};

#[test]
fn work_for_hours_is_refused_before_it_begins() {
    let scratch = Scratch::new();
    let cube = model("cube");
    let few = ["slice", cube.to_str().unwrap(), "-o", "x.gcode", "--most-cuts", "0.0005"];
    let ran = scratch.run(&few).refused("LimitExceeded", 8);
    assert!(ran.err.contains("--most-cuts") && ran.err.contains("12 facets"), "{}", ran.err);
    assert!(scratch.names().is_empty());
    let enough = ["slice", cube.to_str().unwrap(), "-q", "-o", "x.gcode", "--most-cuts", "1"];
    scratch.run(&enough).expect(0);
}

/// A header that promises four thousand million facets, and what must not cost more than a moment.
#[test]
fn numbers_in_headers_cost_nothing() {
    let scratch = Scratch::new();
    let mut bytes = std::fs::read(model("cube")).unwrap();
    bytes[80..84].copy_from_slice(&(u32::MAX - 1).to_le_bytes());
    scratch.file("promise.stl", &bytes);
    limited(&scratch, 64, "inspect promise.stl", &[4]);
    let needle = mesh::stl::write(&mesh::shapes::block(1e6, 0.5, 0.5));
    scratch.file("needle.stl", needle);
    limited(&scratch, 64, "slice needle.stl -o x.gcode", &[5]);
    let deep = format!("a = {}1{}\n", "[".repeat(50_000), "]".repeat(50_000));
    scratch.file("deep.toml", deep);
    limited(&scratch, 64, "slice needle.stl -o x.gcode --print deep.toml", &[6]);
}

/// What `slice` and `inspect` take beside 64 MB, as a multiple of the size of the file.
const TIMES: usize = 4;

/// A ball of so many MB, and the same without every second facet: the worst for what mends holes.
fn balls(level: u32) -> [(&'static str, Vec<u8>); 2] {
    let ball = mesh::stl::write(&mesh::shapes::icosphere(level, 40.0));
    let mut holes = ball[..84].to_vec();
    holes.extend(ball[84..].chunks_exact(100).flat_map(|pair| &pair[..50]));
    let count = u32::try_from((holes.len() - 84) / 50).unwrap();
    holes[80..84].copy_from_slice(&count.to_le_bytes());
    [("ball.stl", ball), ("holes.stl", holes)]
}

#[test]
fn memory_is_in_proportion_to_the_file() {
    let scratch = Scratch::new();
    for (name, bytes) in balls(7) {
        let mb = bytes.len().div_ceil(1 << 20);
        assert!(mb >= 7, "{mb} MB");
        scratch.file(name, bytes);
        let inspect = format!("inspect {name}");
        let slice = format!("slice {name} -o x.gcode --no-verify --set layer_height_mm=0.3");
        // What is half holes cannot be printed.
        let lines = if name == "holes.stl" { vec![inspect] } else { vec![inspect, slice] };
        for line in lines {
            let Some(peak) = peak_mb(&scratch, &line) else { continue };
            say(&format!("{line}: {peak} MB for a file of {mb} MB"));
            assert!(peak <= 64 + TIMES * mb, "{line}: {peak} MB for a file of {mb} MB");
        }
    }
}

/// What other slicers die of is printed: a file of a third of a million facets (a whole million with
/// `RHUMB_CORPUS=all`) with 300 MB of addresses.
#[test]
fn few_addresses_are_enough() {
    let scratch = Scratch::new();
    let is_all = std::env::var("RHUMB_CORPUS").is_ok_and(|value| value == "all");
    let [(_, ball), _] = balls(if is_all { 8 } else { 7 });
    scratch.file("ball.stl", ball);
    let line = "slice ball.stl -o x.gcode --no-verify --set layer_height_mm=0.3";
    // A ball stands on a point, which wants a look.
    limited(&scratch, 150, line, &[0, 1]);
}

/// With fewer the user is told so, before anything is written.
#[cfg(target_os = "linux")]
#[test]
fn too_few_addresses_are_told() {
    let scratch = Scratch::new();
    let [(name, ball), _] = balls(7);
    let mb = ball.len() as f64 / f64::from(1 << 20);
    scratch.file(name, ball);
    scratch.cube("cube.stl", 5.0);
    let works = |mb: &usize| with_addresses(&scratch, *mb, "slice cube.stl -o -").status.success();
    let program = (16..1024).step_by(2).find(works).expect("a gigabyte is enough for a cube");
    // Enough for half of the file, for the file, and for its facets beside it.
    for share in [0.5, 1.4, 1.9] {
        let addresses = program + (share * mb) as usize;
        let line = format!("slice {name} -o x.gcode");
        let ran = Ran::from(with_addresses(&scratch, addresses, &line));
        ran.refused("LimitExceeded", 8);
        assert_eq!(scratch.names(), [name, "cube.stl"], "{share}");
    }
}

/// The greatest memory that a run takes, MB; `None` where the system does not tell.
fn peak_mb(scratch: &Scratch, line: &str) -> Option<usize> {
    let arguments: Vec<&str> = line.split(' ').chain(["-q", "--threads", "2"]).collect();
    let mut child =
        scratch.rhumb(&arguments).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    let status = format!("/proc/{}/status", child.id());
    let mut peak = None;
    loop {
        // It only grows, so that the last look before the end is near the truth.
        let told = std::fs::read_to_string(&status).unwrap_or_default();
        let kb =
            told.lines().find_map(|line| line.strip_prefix("VmHWM:")?.split_whitespace().next());
        peak = kb.and_then(|kb| kb.parse::<usize>().ok()).map(|kb| kb.div_ceil(1024)).or(peak);
        if let Some(status) = child.try_wait().unwrap() {
            assert!(matches!(status.code(), Some(0 | 1)), "{line}: {status}");
            return peak;
        }
        std::thread::sleep(Duration::from_millis(2));
    }
}

/// Runs rhumb on one thread with a limit of twice `mb` on its address space; expects one of some statuses.
fn limited(scratch: &Scratch, mb: usize, line: &str, statuses: &[i32]) {
    if !cfg!(target_os = "linux") {
        return;
    }
    let output = with_addresses(scratch, 2 * mb, line);
    let said = String::from_utf8_lossy(&output.stderr);
    let is_expected = output.status.code().is_some_and(|code| statuses.contains(&code));
    assert!(is_expected, "{line}: {} {said}", output.status);
}

/// Runs rhumb on one thread with an address space of so many MB.
fn with_addresses(scratch: &Scratch, mb: usize, line: &str) -> Output {
    let kb = mb * 1024;
    let binary = env!("CARGO_BIN_EXE_rhumb");
    let line = format!("ulimit -v {kb}; exec \"{binary}\" {line} -q --threads 1");
    Command::new("sh").current_dir(scratch.path("")).args(["-c", &line]).output().unwrap()
}

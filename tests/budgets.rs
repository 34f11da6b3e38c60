//! How much memory and time a file may cost: never more than in proportion to its bytes, whatever
//! numbers stand in it.

use crate::run::{Scratch, model};

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
    limited(&scratch, 64, "inspect promise.stl", 4);
    let needle = mesh::stl::write(&mesh::shapes::block(1e6, 0.5, 0.5));
    scratch.file("needle.stl", needle);
    limited(&scratch, 64, "slice needle.stl -o x.gcode", 5);
    let deep = format!("a = {}1{}\n", "[".repeat(50_000), "]".repeat(50_000));
    scratch.file("deep.toml", deep);
    limited(&scratch, 64, "slice needle.stl -o x.gcode --print deep.toml", 6);
}

/// Reading and mending takes at most 64 MB and twelve times the size of the file: measured by a limit of
/// twice that on all addresses, most of which is never memory.
#[test]
fn reading_and_mending_takes_memory_in_proportion_to_the_file() {
    let scratch = Scratch::new();
    let ball = mesh::stl::write(&mesh::shapes::icosphere(7, 40.0));
    scratch.file("ball.stl", &ball);
    let mb = ball.len().div_ceil(1 << 20);
    assert!(mb >= 15, "{mb} MB");
    limited(&scratch, 64 + 12 * mb, "inspect ball.stl", 0);
    // Every second facet is missing: the worst for what mends holes.
    let mut holes = ball[..84].to_vec();
    holes.extend(ball[84..].chunks_exact(100).flat_map(|pair| &pair[..50]));
    let count = u32::try_from((holes.len() - 84) / 50).unwrap();
    holes[80..84].copy_from_slice(&count.to_le_bytes());
    scratch.file("holes.stl", &holes);
    limited(&scratch, 64 + 12 * mb / 2, "inspect holes.stl", 0);
}

/// Runs rhumb on one thread with a limit of twice `mb` on its address space; expects a status.
fn limited(scratch: &Scratch, mb: usize, line: &str, status: i32) {
    if !cfg!(target_os = "linux") {
        return;
    }
    let kb = 2 * mb * 1024;
    let binary = env!("CARGO_BIN_EXE_rhumb");
    let line = format!("ulimit -v {kb}; exec \"{binary}\" {line} -q --threads 1");
    let output = std::process::Command::new("sh")
        .current_dir(scratch.path(""))
        .args(["-c", &line])
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(status), "{line}: {} {said}", output.status);
}

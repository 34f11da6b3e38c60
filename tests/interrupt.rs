//! Ctrl-C: the run ends soon, the old program stays, nothing is left behind.

#![cfg(unix)]

use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use crate::run::{Ran, Scratch, wait_until};

/// Longest time until a run that is asked to stop has ended. Far more than it takes, for slow machines.
const PATIENCE: Duration = Duration::from_secs(30);

/// A run that would take minutes, in a folder with an old program; it has begun to write.
fn long_run(scratch: &Scratch) -> Child {
    scratch.cube("cube.stl", 100.0);
    scratch.file("cube.gcode", "G28\n");
    let fine = ["layer_height_mm=0.02", "min_layer_height_mm=0.01", "fill_density=60%"];
    let mut arguments = vec!["slice", "cube.stl", "--report", "r.json"];
    arguments.extend(fine.iter().flat_map(|pair| ["--set", pair]));
    let child =
        scratch.rhumb(&arguments).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    wait_until("the run writes", || is_writing(scratch, &child));
    child
}

/// Whether a run has written some of a program: into a file with a name of its own, or, on Linux, without.
fn is_writing(scratch: &Scratch, run: &Child) -> bool {
    let folder = scratch.path("").canonicalize().unwrap();
    let has_begun = |path: PathBuf| path.metadata().is_ok_and(|file| file.len() > 0);
    let is_draft = |open: &PathBuf| {
        let target = std::fs::read_link(open).unwrap_or_default();
        target.starts_with(&folder) && target.to_string_lossy().ends_with(" (deleted)")
    };
    let open = std::fs::read_dir(format!("/proc/{}/fd", run.id())).into_iter().flatten();
    let mut drafts = open.flatten().map(|file| file.path()).filter(is_draft);
    let is_named = |name: &String| name.ends_with(".tmp") && name.contains("cube.gcode");
    drafts.any(has_begun)
        || scratch
            .names()
            .iter()
            .filter(|name| is_named(name))
            .map(|n| scratch.path(n))
            .any(has_begun)
}

fn stops_on(signal: &str) {
    let scratch = Scratch::new();
    let child = long_run(&scratch);
    let asked = Instant::now();
    let sent = Command::new("kill").args(["-s", signal, &child.id().to_string()]).status().unwrap();
    assert!(sent.success());
    let ran = Ran::from(child.wait_with_output().unwrap()).refused("Interrupted", 130);
    assert!(asked.elapsed() < PATIENCE, "{:?}", asked.elapsed());
    assert!(ran.err.contains("nothing was written"), "{}", ran.err);
    assert_eq!(scratch.names(), ["cube.gcode", "cube.stl"]);
    assert_eq!(std::fs::read(scratch.path("cube.gcode")).unwrap(), b"G28\n");
}

#[test]
fn an_interrupted_run_leaves_nothing_behind() {
    stops_on("INT");
}

#[test]
fn a_terminated_run_leaves_nothing_behind() {
    stops_on("TERM");
}

/// Whoever forgot to pipe a model in presses Ctrl-C. Here the signal is TERM: a shell that runs these tests in
/// its background has told them to ignore INT, and what they start with them.
#[test]
fn a_run_that_waits_for_a_pipe_can_be_stopped() {
    for command in ["slice", "convert"] {
        let scratch = Scratch::new();
        let mut waiting = scratch.rhumb(&[command, "-", "-o", "x.gcode"]);
        let mut child = waiting.stdin(Stdio::piped()).spawn().unwrap();
        // Time to begin with reading.
        std::thread::sleep(Duration::from_millis(500));
        let sent =
            Command::new("kill").args(["-s", "TERM", &child.id().to_string()]).status().unwrap();
        assert!(sent.success());
        let asked = Instant::now();
        while child.try_wait().unwrap().is_none() {
            if asked.elapsed() > PATIENCE {
                child.kill().unwrap();
                panic!("{command} goes on waiting");
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        assert!(scratch.names().is_empty(), "{:?}", scratch.names());
    }
}

#[test]
fn a_batch_that_is_asked_to_stop_keeps_what_is_finished() {
    let scratch = Scratch::new();
    scratch.cube("a.stl", 3.0);
    scratch.cube("b.stl", 100.0);
    let fine = ["batch", "a.stl", "b.stl", "--out-dir", "out", "--set", "layer_height_mm=0.05"];
    let mut batch = scratch.rhumb(&fine);
    let child = batch.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    // The journal is written after the program, and before the line that tells of it.
    let journal = scratch.path("out/batch.jsonl");
    wait_until("the first model is done", || journal.metadata().is_ok_and(|file| file.len() > 0));
    let sent = Command::new("kill").args(["-s", "TERM", &child.id().to_string()]).status().unwrap();
    assert!(sent.success());
    let ran = Ran::from(child.wait_with_output().unwrap());
    assert_eq!(ran.code, Some(130), "{}", ran.err);
    // Whether the first model's line is said before the stop is a matter of milliseconds.
    let told = ran.err.find("error[Interrupted]: ").map(|at| &ran.err[at..]);
    let told = told.expect("the stop is told");
    assert!(told.contains("what was finished is kept"), "{told}");
    assert!(told.contains("goes on where"), "{told}");
    assert!(scratch.path("out/a.gcode").exists() && !scratch.path("out/b.gcode").exists());
}

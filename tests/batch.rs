//! Many models in one command: each gets its own outcome, and what was done is not done again.

use std::path::PathBuf;

use serde_json::Value;

use crate::run::{Ran, Scratch, wait_until};

/// A folder with three sound models, a broken one and one that is too large.
fn with_models() -> Scratch {
    let scratch = Scratch::new();
    std::fs::create_dir(scratch.path("models")).unwrap();
    for (name, side) in [("a", 3.0), ("b", 4.0), ("e ü", 2.0), ("huge", 4000.0)] {
        scratch.cube(format!("models/{name}.stl"), side);
    }
    scratch.file("models/c.stl", "solid c\nthis is no facet\n");
    scratch.file("models/notes.txt", "not a model");
    scratch
}

fn batch(scratch: &Scratch, more: &[&str]) -> Ran {
    let mut arguments = vec!["batch", "models", "--out-dir", "out"];
    arguments.extend(more);
    scratch.run(&arguments)
}

fn report(scratch: &Scratch, name: &str) -> Value {
    serde_json::from_slice(&std::fs::read(scratch.path("out").join(name)).unwrap()).unwrap()
}

fn programs(scratch: &Scratch) -> Vec<String> {
    let mut names: Vec<String> = std::fs::read_dir(scratch.path("out"))
        .unwrap()
        .map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned())
        .filter(|name| name.ends_with(".gcode"))
        .collect();
    names.sort();
    names
}

/// When each program was written.
fn times(scratch: &Scratch) -> Vec<std::time::SystemTime> {
    let path = |name: &String| -> PathBuf { scratch.path("out").join(name) };
    let time = |name: &String| path(name).metadata().unwrap().modified().unwrap();
    programs(scratch).iter().map(time).collect()
}

#[test]
fn a_failing_model_does_not_stop_the_rest_and_nothing_is_done_twice() {
    let scratch = with_models();
    // The highest status of any model.
    let ran = batch(&scratch, &[]).expect(5);
    assert!(ran.out.starts_with("3 done, 2 failed"), "{}", ran.out);
    assert!(ran.out.contains("c.stl: error[") && ran.out.contains("huge.stl: error["));
    for line in ran.out.lines().filter(|line| line.contains("error[")) {
        assert_eq!(line.matches(".stl").count(), 1, "a model is named once: {line}");
    }
    assert_eq!(programs(&scratch), ["a.gcode", "b.gcode", "e ü.gcode"]);
    let first = report(&scratch, "batch.json");
    let status: Vec<u64> =
        first["models"].as_array().unwrap().iter().map(|m| m["status"].as_u64().unwrap()).collect();
    assert_eq!(status, [0, 0, 4, 0, 5]);
    assert_eq!(first["models"][4]["error"]["class"], "OutOfEnvelope");
    assert!(first["models"][0]["time_s"].as_f64().unwrap() > 1.0);

    let before = times(&scratch);
    batch(&scratch, &["-q"]).expect(5);
    assert_eq!(times(&scratch), before, "sliced again");
    assert_eq!(report(&scratch, "batch.json")["models"][0], first["models"][0]);

    // A model that is mended or changed, and a program that is gone, are work again.
    scratch.cube("models/c.stl", 3.0);
    scratch.cube("models/b.stl", 5.0);
    std::fs::remove_file(scratch.path("models/huge.stl")).unwrap();
    std::fs::remove_file(scratch.path("out/e ü.gcode")).unwrap();
    let ran = batch(&scratch, &[]).expect(0);
    assert_eq!(ran.err.lines().count(), 3, "{}", ran.err);
    // Other settings are other programs.
    let ran = batch(&scratch, &["--set", "perimeters=1"]).expect(0);
    assert_eq!(ran.err.lines().count(), 4, "{}", ran.err);
}

#[test]
fn programs_are_those_of_single_slices() {
    let scratch = with_models();
    let options = ["--layers", "conical", "--cone-angle", "-15", "--set", "fill_density=40%"];
    let arguments: Vec<&str> =
        ["batch", "models/a.stl", "models/b.stl", "--out-dir", "out", "--jobs", "2"]
            .into_iter()
            .chain(options)
            .collect();
    scratch.run(&arguments).expect(0);
    let mut single = vec!["slice", "models/b.stl", "-q"];
    single.extend(options);
    scratch.run(&single).expect(0);
    let ours = std::fs::read_to_string(scratch.path("out/b.gcode")).unwrap();
    assert_eq!(ours, std::fs::read_to_string(scratch.path("b.gcode")).unwrap());
}

#[test]
fn what_is_wrong_for_all_is_said_before_any_work() {
    let scratch = with_models();
    batch(&scratch, &["--set", "perimeters=-1"]).refused("ConfigRange", 6);
    batch(&scratch, &["--shard", "3/2"]).refused("Usage", 2);
    scratch.run(&["batch", "nowhere", "--out-dir", "out"]).expect(3);
    scratch.cube("a.stl", 2.0);
    let ran = scratch.run(&["batch", "models", "a.stl", "--out-dir", "other"]);
    ran.refused("OutputTwice", 7);
    // A pipe is empty once it was read to see whether the model has changed.
    #[cfg(unix)]
    {
        let made = std::process::Command::new("mkfifo").arg(scratch.path("pipe.stl")).status();
        assert!(made.unwrap().success());
        let ran = scratch.run(&["batch", "models", "pipe.stl", "--out-dir", "other"]);
        ran.refused("NotRegularFile", 3);
    }
    assert!(!scratch.path("other").exists());
}

#[test]
fn shares_together_are_the_whole() {
    let scratch = with_models();
    for (share, status) in [("1/2", 5), ("2/2", 0)] {
        batch(&scratch, &["-q", "--shard", share]).expect(status);
    }
    assert_eq!(programs(&scratch), ["a.gcode", "b.gcode", "e ü.gcode"]);
    let models = |name: &str| report(&scratch, name)["models"].as_array().unwrap().len();
    assert_eq!(models("batch-1-of-2.json") + models("batch-2-of-2.json"), 5);
}

#[test]
fn a_model_that_takes_too_long_is_given_up() {
    let scratch = with_models();
    scratch.cube("models/a.stl", 100.0);
    let fine = ["--set", "layer_height_mm=0.05", "--time-limit", "0.3"];
    batch(&scratch, &fine).expect(8);
    let first = &report(&scratch, "batch.json")["models"][0];
    assert_eq!(first["error"]["class"], "LimitExceeded");
    let left = |name: &String| name.starts_with('.');
    let folder = std::fs::read_dir(scratch.path("out")).unwrap();
    let names = folder.map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned());
    assert!(!names.collect::<Vec<_>>().iter().any(left), "something is left behind");
}

/// Whatever happens to the batch itself, the next one takes it up.
#[test]
#[cfg(unix)]
fn a_batch_that_was_killed_goes_on_where_it_stopped() {
    let scratch = with_models();
    scratch.cube("models/b.stl", 100.0);
    let fine = ["batch", "models", "--out-dir", "out", "--set", "layer_height_mm=0.05"];
    let mut child = scratch.rhumb(&fine).spawn().unwrap();
    let journal = scratch.path("out/batch.jsonl");
    let is_noted = || std::fs::read_to_string(&journal).is_ok_and(|j| j.contains("a.stl"));
    wait_until("the first model is done", is_noted);
    child.kill().unwrap();
    child.wait().unwrap();
    // A line that was cut off.
    let mut lines = std::fs::read(&journal).unwrap();
    lines.extend_from_slice(b"{\"model\":\"models/b.s");
    std::fs::write(&journal, lines).unwrap();
    scratch.cube("models/b.stl", 3.0);
    let ran = scratch.run(&fine).expect(5);
    assert!(!ran.err.contains("a.stl"), "sliced again: {}", ran.err);
    assert_eq!(programs(&scratch), ["a.gcode", "b.gcode", "e ü.gcode"]);
}

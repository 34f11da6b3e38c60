//! Where a run happens must not matter, and what cannot be is told: permissions, links that lead
//! nowhere, one thread, another clock and language, a disk that is full at any byte.

#![cfg(unix)]

use std::os::unix::fs::{PermissionsExt, symlink};
use std::process::{Command, Stdio};

use crate::run::{Ran, Scratch, say};

/// Runs a line of the shell in a folder; `$rhumb` is the binary.
fn shell(scratch: &Scratch, line: &str) -> Ran {
    let output = Command::new("sh")
        .current_dir(scratch.path(""))
        .args(["-c", line])
        .env("rhumb", env!("CARGO_BIN_EXE_rhumb"))
        .env("SOURCE_DATE_EPOCH", "1700000000")
        .stdin(Stdio::null())
        .output()
        .unwrap();
    Ran::from(output)
}

#[test]
fn what_leads_nowhere_is_told() {
    let scratch = Scratch::new();
    scratch.cube("cube.stl", 5.0);
    symlink("loop.stl", scratch.path("loop.stl")).unwrap();
    symlink("nowhere/x", scratch.path("far.gcode")).unwrap();
    scratch.run(&["slice", "loop.stl", "-o", "x.gcode"]).refused("NotFound", 3);
    scratch.run(&["slice", "cube.stl", "-o", "far.gcode"]).refused("OutputDenied", 7);
    // A file whose size is told as zero, though it has bytes.
    #[cfg(target_os = "linux")]
    scratch.run(&["slice", "/proc/self/maps", "-o", "x.gcode"]).refused("WrongFormat", 4);
    assert_eq!(scratch.names(), ["cube.stl", "far.gcode", "loop.stl"]);
}

#[test]
fn a_model_comes_from_standard_input() {
    let scratch = Scratch::new();
    scratch.cube("cube.stl", 5.0);
    let file = shell(&scratch, "\"$rhumb\" slice - -q -o x.gcode < cube.stl").expect(0);
    assert!(file.out.is_empty());
    let piped = shell(&scratch, "cat cube.stl | \"$rhumb\" slice - -q -o - | cat").expect(0);
    let device = shell(&scratch, "\"$rhumb\" slice - -q -o /dev/stdout < cube.stl | cat").expect(0);
    let whole = std::fs::read_to_string(scratch.path("x.gcode")).unwrap();
    assert!(piped.out == whole && device.out == whole);
}

/// As somebody who is not root, who may do everything.
#[test]
fn permissions_are_kept() {
    let scratch = Scratch::new();
    scratch.cube("cube.stl", 5.0);
    scratch.cube("secret.stl", 5.0);
    scratch.file("old.gcode", "G28\n");
    std::fs::create_dir(scratch.path("ro")).unwrap();
    for (name, mode) in [("secret.stl", 0o000), ("old.gcode", 0o444), ("ro", 0o555)] {
        std::fs::set_permissions(scratch.path(name), PermissionsExt::from_mode(mode)).unwrap();
    }
    let is_root = std::fs::read(scratch.path("secret.stl")).is_ok();
    let run = |arguments: &str| {
        let line = format!("exec \"$rhumb\" {arguments}");
        if is_root {
            // Read and search of others' files is a power that root can give away.
            let none = "setpriv --bounding-set=-all --inh-caps=-all --reuid=65534 --clear-groups";
            std::fs::set_permissions(scratch.path(""), PermissionsExt::from_mode(0o777)).unwrap();
            shell(&scratch, &line.replacen("exec", &format!("exec {none}"), 1))
        } else {
            shell(&scratch, &line)
        }
    };
    let cube = scratch.path("cube.stl");
    std::fs::set_permissions(&cube, PermissionsExt::from_mode(0o644)).unwrap();
    if !run("inspect cube.stl -q").err.is_empty() {
        return say("skipped: nobody else can run the program here");
    }
    run("slice secret.stl -q -o x.gcode").refused("PermissionDenied", 3);
    run("slice cube.stl -q -o ro/x.gcode").refused("OutputDenied", 7);
    run("slice cube.stl -q -o old.gcode").refused("OutputDenied", 7);
    assert_eq!(std::fs::read(scratch.path("old.gcode")).unwrap(), b"G28\n");
    std::fs::set_permissions(scratch.path("ro"), PermissionsExt::from_mode(0o755)).unwrap();
}

#[test]
fn place_time_and_language_change_no_byte() {
    let scratch = Scratch::new();
    scratch.cube("cube.stl", 6.0);
    std::fs::create_dir(scratch.path("else")).unwrap();
    let model = "slice \"$here/cube.stl\" -q -o \"$here/x.gcode\"";
    let mut seen: Vec<Vec<u8>> = Vec::new();
    for before in [
        "",
        "cd else;",
        "export TZ=Pacific/Auckland LC_ALL=de_DE.UTF-8 LANG=de_DE.UTF-8;",
        "export HOME=/nonexistent TMPDIR=/nonexistent;",
        "export RAYON_NUM_THREADS=1;",
        "export RAYON_NUM_THREADS=8;",
    ] {
        shell(&scratch, &format!("here=$PWD; {before} exec \"$rhumb\" {model}")).expect(0);
        seen.push(std::fs::read(scratch.path("x.gcode")).unwrap());
    }
    assert!(seen.iter().all(|program| *program == seen[0]));
    // Times that clocks show when their battery is empty.
    for second in ["0", "2147483648", "-1", "99999999999999999999", "now"] {
        let line =
            format!("SOURCE_DATE_EPOCH={second} exec \"$rhumb\" slice cube.stl -q -o t.gcode");
        let ran = shell(&scratch, &line);
        assert_eq!(ran.code, Some(0), "{second}: {}", ran.err);
    }
}

#[cfg(target_os = "linux")]
#[test]
fn one_thread_is_enough() {
    let scratch = Scratch::new();
    scratch.cube("cube.stl", 6.0);
    // Nobody else runs under this number, so that one process is all there may be.
    let nobody = "setpriv --reuid=64213 --clear-groups";
    std::fs::set_permissions(scratch.path(""), PermissionsExt::from_mode(0o777)).unwrap();
    let line =
        format!("exec {nobody} sh -c 'ulimit -u 1; exec \"$rhumb\" slice cube.stl -q -o x.gcode'");
    let ran = shell(&scratch, &line);
    if ran.err.contains("setpriv") || ran.err.contains("not found") || ran.err.contains("denied") {
        return say("skipped: nobody else can run the program here");
    }
    assert_eq!(ran.code, Some(0), "{}", ran.err);
}

/// Limits on the size of files, from nothing to the last byte: the old program stays, or the new one is
/// whole.
#[cfg(target_os = "linux")]
#[test]
fn a_disk_may_be_full_at_any_byte() {
    let scratch = Scratch::new();
    scratch.cube("cube.stl", 4.0);
    shell(&scratch, "exec \"$rhumb\" slice cube.stl -q -o whole.gcode").expect(0);
    let whole = std::fs::read(scratch.path("whole.gcode")).unwrap();
    // Limits are told in blocks of 512 bytes.
    let blocks = whole.len().div_ceil(512);
    let mut seen = [0, 0];
    for limit in [0, 1, blocks / 3, blocks / 2, blocks - 2, blocks - 1, blocks, blocks + 1] {
        scratch.file("x.gcode", "G28\n");
        let line = format!("ulimit -f {limit}; exec \"$rhumb\" slice cube.stl -q -o x.gcode");
        let ran = shell(&scratch, &line);
        let left = std::fs::read(scratch.path("x.gcode")).unwrap();
        match ran.code {
            Some(0) => assert!(left == whole, "{limit}"),
            _ => {
                ran.refused("OutputFull", 7);
                assert_eq!(left, b"G28\n", "{limit} of {blocks}");
            }
        }
        seen[usize::from(limit >= blocks)] += 1;
        assert_eq!(scratch.names(), ["cube.stl", "whole.gcode", "x.gcode"], "{limit}");
    }
    assert_eq!(seen, [6, 2]);
}

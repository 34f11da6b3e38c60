//! What goes wrong, and how the program says so: a class and an exit status for scripts, one line
//! and a hint for people, and nothing left behind.

use crate::run::{Ran, Scratch, model};

/// Runs `slice` on a file in a folder where an old program lies, and expects a failure that leaves
/// everything as it was.
#[track_caller]
fn refused(file: &str, bytes: &[u8], arguments: &[&str], class: &str, code: i32) -> Ran {
    let scratch = Scratch::new();
    scratch.file(file, bytes);
    scratch.file("old.gcode", "G28\n");
    let before = scratch.names();
    let mut all = vec!["slice", file, "-o", "old.gcode"];
    all.extend(arguments);
    let ran = scratch.run(&all).refused(class, code);
    assert_eq!(scratch.names(), before, "nothing is left behind");
    assert_eq!(std::fs::read(scratch.path("old.gcode")).unwrap(), b"G28\n");
    assert_eq!(std::fs::read(scratch.path(file)).unwrap(), bytes);
    ran
}

fn cube() -> Vec<u8> {
    std::fs::read(model("cube")).unwrap()
}

/// The cube with a coordinate of its first facet replaced.
fn cube_with(coordinate: f32) -> Vec<u8> {
    let mut bytes = cube();
    // 80 bytes of header, 4 of count, 12 of normal: the first corner.
    bytes[96..100].copy_from_slice(&coordinate.to_le_bytes());
    bytes
}

#[test]
fn wrong_usage_is_status_2() {
    let scratch = Scratch::new();
    let wrong: [&[&str]; 6] = [
        &[],
        &["slice"],
        &["slize", "cube.stl"],
        &["slice", "cube.stl", "--nonsense"],
        &["slice", "cube.stl", "--threads", "0"],
        &["slice", "cube.stl", "--units", "furlong"],
    ];
    for arguments in wrong {
        let ran = scratch.run(arguments).expect(2);
        assert!(ran.out.is_empty() && !ran.err.is_empty(), "{arguments:?}: {ran:?}");
    }
    for arguments in [["--orient", "up"], ["--place", "1"], ["--scale", "0"], ["--scale", "nan"]] {
        let ran = refused("cube.stl", &cube(), &arguments, "Usage", 2);
        assert!(ran.err.contains(arguments[0]), "{}", ran.err);
    }
    assert!(scratch.names().is_empty());
}

#[test]
fn help_and_version_are_no_failures() {
    let scratch = Scratch::new();
    let help = scratch.run(&["--help"]).expect(0);
    for command in ["slice", "inspect", "orient", "verify", "preview", "profile"] {
        assert!(help.out.contains(command), "{command}");
    }
    assert!(scratch.run(&["--version"]).expect(0).out.starts_with("rhumb "));
}

#[test]
fn what_cannot_be_read_is_status_3() {
    let scratch = Scratch::new();
    let missing = scratch.run(&["slice", "absent.stl"]).refused("NotFound", 3);
    assert!(missing.err.contains("absent.stl"), "{}", missing.err);
    std::fs::create_dir(scratch.path("folder.stl")).unwrap();
    scratch.run(&["slice", "folder.stl"]).refused("IsDirectory", 3);
    scratch.run(&["inspect", "absent.stl"]).refused("NotFound", 3);
    scratch.run(&["orient", "absent.stl"]).refused("NotFound", 3);
    scratch.run(&["verify", "absent.gcode"]).refused("NotFound", 3);
    scratch.run(&["preview", "absent.gcode", "-o", "p.svg"]).refused("NotFound", 3);
    assert_eq!(scratch.names(), ["folder.stl"]);
}

#[cfg(unix)]
#[test]
fn an_endless_device_is_refused_and_not_read() {
    let scratch = Scratch::new();
    scratch.run(&["slice", "/dev/zero", "-o", "x.gcode"]).refused("NotRegularFile", 3);
    assert!(scratch.names().is_empty());
}

#[test]
fn what_is_malformed_is_status_4() {
    let no_facets: Vec<u8> = [[0_u8; 80].as_slice(), &0_u32.to_le_bytes()].concat();
    let cases: [(&[u8], &str); 8] = [
        (b"", "EmptyFile"),
        (b"hello, this is a letter\n", "WrongFormat"),
        (&cube()[..400], "TruncatedBinary"),
        (&cube_with(f32::NAN), "NotFinite"),
        (&cube_with(f32::NEG_INFINITY), "NotFinite"),
        (&no_facets, "NoTriangles"),
        (b"solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 zero\n", "AsciiSyntax"),
        (b"PK\x03\x04 and what else a 3MF holds, which is a ZIP archive ......", "WrongFormat"),
    ];
    for (bytes, class) in cases {
        let ran = refused("model.stl", bytes, &[], class, 4);
        assert!(ran.err.contains("]: model.stl: "), "{}", ran.err);
    }
}

#[test]
fn what_cannot_be_printed_is_status_5() {
    let inches = refused("cube.stl", &cube(), &["--scale", "10"], "OutOfEnvelope", 5);
    assert!(inches.err.contains("141.4 mm") && inches.err.contains("120 mm"), "{}", inches.err);
    let tall = refused(
        "cube.stl",
        &cube(),
        &["--set", "z_max_mm=15", "--set", "home_z_mm=5"],
        "OutOfEnvelope",
        5,
    );
    assert!(tall.err.contains("20.0 mm tall") && tall.err.contains("15 mm"), "{}", tall.err);
    refused("cube.stl", &cube(), &["--place", "115,0"], "OutOfEnvelope", 5);
    let metres = refused("cube.stl", &cube(), &["--scale", "0.001"], "NothingToPrint", 5);
    assert!(metres.err.contains("--units m"), "{}", metres.err);
    let mut flat = cube();
    for facet in flat[84..].chunks_exact_mut(50) {
        for corner in facet[12..48].chunks_exact_mut(12) {
            corner[8..].fill(0);
        }
    }
    refused("flat.stl", &flat, &[], "NoVolume", 5);
}

#[test]
fn a_skirt_alone_is_no_print() {
    let paper = mesh::stl::write(&mesh::shapes::block(20.0, 0.01, 20.0));
    refused("paper.stl", &paper, &["--orient", "keep"], "NothingToPrint", 5);
}

#[test]
fn a_part_of_exactly_the_size_of_the_machine_is_printed() {
    let scratch = Scratch::new();
    let disc = mesh::shapes::revolved(&[[0.0, 0.0], [120.0, 0.0], [120.0, 0.4], [0.0, 0.4]], 90);
    scratch.file("disc.stl", mesh::stl::write(&disc));
    let ran = scratch.run(&["slice", "disc.stl", "--json", "--set", "skirts=0"]).expect(0);
    assert!(ran.out.contains("AtEnvelope"), "{}", ran.out);
    let tall = mesh::stl::write(&mesh::shapes::block(8.0, 8.0, 200.0));
    scratch.file("tall.stl", tall);
    scratch.run(&["slice", "tall.stl", "--orient", "keep"]).expect(0);
}

#[test]
fn outputs_that_cannot_be_written_are_status_7() {
    let scratch = Scratch::new();
    scratch.cube("cube.stl", 5.0);
    std::fs::create_dir(scratch.path("folder")).unwrap();
    let before = std::fs::read(scratch.path("cube.stl")).unwrap();
    let slice = |output: &str| scratch.run(&["slice", "cube.stl", "-o", output]);
    slice("cube.stl").refused("OutputIsInput", 7);
    slice("./folder/../cube.stl").refused("OutputIsInput", 7);
    slice("folder").refused("OutputIsDirectory", 7);
    slice("no/such/x.gcode").refused("OutputDenied", 7);
    for option in ["--report", "--export-placed"] {
        let run = ["slice", "cube.stl", "-o", "x.gcode", option, "cube.stl"];
        scratch.run(&run).refused("OutputIsInput", 7);
    }
    scratch.run(&["orient", "cube.stl", "-o", "cube.stl"]).refused("OutputIsInput", 7);
    assert_eq!(std::fs::read(scratch.path("cube.stl")).unwrap(), before);
    assert_eq!(scratch.names(), ["cube.stl", "folder"]);
}

#[cfg(unix)]
#[test]
fn links_to_the_input_are_seen_through_and_others_are_followed() {
    use std::os::unix::fs::symlink;
    let scratch = Scratch::new();
    scratch.cube("cube.stl", 5.0);
    symlink("cube.stl", scratch.path("soft.gcode")).unwrap();
    std::fs::hard_link(scratch.path("cube.stl"), scratch.path("hard.gcode")).unwrap();
    for output in ["soft.gcode", "hard.gcode"] {
        scratch.run(&["slice", "cube.stl", "-o", output]).refused("OutputIsInput", 7);
    }
    scratch.file("real.gcode", "G28\n");
    symlink("real.gcode", scratch.path("link.gcode")).unwrap();
    scratch.run(&["slice", "cube.stl", "-o", "link.gcode"]).expect(0);
    assert!(scratch.path("link.gcode").is_symlink());
    let real = std::fs::read_to_string(scratch.path("real.gcode")).unwrap();
    assert!(real.starts_with("; generated by rhumb"));
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_and_a_closed_pipe_are_told_apart() {
    use std::process::Stdio;
    let scratch = Scratch::new();
    scratch.cube("cube.stl", 5.0);
    scratch.run(&["slice", "cube.stl", "-o", "/dev/full"]).refused("OutputFull", 7);
    let full = std::fs::File::options().write(true).open("/dev/full").unwrap();
    let ran = scratch.rhumb(&["slice", "cube.stl", "-o", "-", "-q"]).stdout(full).output().unwrap();
    Ran::from(ran).refused("OutputFull", 7);
    let mut child = scratch
        .rhumb(&["slice", "cube.stl", "-o", "-", "-q"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    Ran::from(child.wait_with_output().unwrap()).refused("BrokenPipe", 141);
    assert_eq!(scratch.names(), ["cube.stl"]);
}

#[test]
fn too_many_layers_are_a_limit() {
    let fine = [
        "--scale",
        "5",
        "--set",
        "min_layer_height_mm=0.01",
        "--set",
        "layer_height_mm=0.01",
        "--set",
        "z_max_mm=2000",
        "--orient",
        "keep",
    ];
    let tower = mesh::stl::write(&mesh::shapes::block(4.0, 4.0, 399.0));
    let ran = refused("tower.stl", &tower, &fine, "LimitExceeded", 8);
    assert!(ran.err.contains("100000"), "{}", ran.err);
}

#[test]
fn a_program_that_fails_its_check_is_not_written() {
    // Nothing heats the nozzle.
    let cold = ["--set", "start_gcode=G28"];
    let ran = refused("cube.stl", &cube(), &cold, "SelfCheckFailed", 9);
    assert!(ran.err.contains("heat") && ran.err.contains("170 °C"), "{}", ran.err);
    let scratch = Scratch::new();
    scratch.cube("cube.stl", 5.0);
    let mut unchecked = vec!["slice", "cube.stl", "--no-verify"];
    unchecked.extend(cold);
    scratch.run(&unchecked).expect(0);
    scratch.run(&["verify", "cube.gcode"]).expect(1);
}

#[test]
fn errors_can_be_read_by_programs() {
    let scratch = Scratch::new();
    let ran = scratch.run(&["slice", "absent.stl", "--error-format", "json"]).expect(3);
    let error: serde_json::Value = serde_json::from_str(&ran.err).unwrap();
    assert_eq!(error["error"]["class"], "NotFound");
    assert_eq!(error["error"]["exit"], 3);
    assert!(error["error"]["message"].as_str().unwrap().contains("absent.stl"));
    assert!(ran.out.is_empty());
    for wrong in [["slize", "--error-format", "json"], ["slice", "--error-format=json", "--none"]] {
        let ran = scratch.run(&wrong).expect(2);
        let error: serde_json::Value = serde_json::from_str(&ran.err).unwrap();
        assert_eq!(
            (&error["error"]["class"], &error["error"]["exit"]),
            (&"Usage".into(), &2.into())
        );
    }
    let said = scratch.run(&["slize"]).expect(2).err;
    assert!(said.starts_with("error[Usage]: unrecognized subcommand 'slize'"), "{said}");
}

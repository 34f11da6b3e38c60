//! Names that files really have: no character of them may be lost, or read as an option or as a
//! command of the program.

use std::ffi::{OsStr, OsString};

use crate::run::Scratch;

const NAMES: [&str; 8] = [
    "my cube.stl",
    "W\u{fc}rfel-\u{7acb}\u{65b9}\u{4f53}-\u{1f9ca}.stl",
    "-o.stl",
    "--help.stl",
    "...stl",
    "CUBE.STL",
    "cube",
    "cube.stl ",
];

/// Names that only some systems allow.
#[cfg(unix)]
const WILD_NAMES: [&str; 5] = [
    "a'b\"c`d$(e).stl",
    "cube\nM104 S999\n.stl",
    "cube\rM104 S999\r.stl",
    "cube;G1 X999.stl",
    "%s%n{}.stl",
];

fn slice(name: &OsStr) -> String {
    let scratch = Scratch::new();
    scratch.cube(name, 3.0);
    let [slice, output, out, dashes] = ["slice", "-o", "out.gcode", "--"].map(OsStr::new);
    scratch.run(&[slice, output, out, dashes, name]).expect(0);
    let program = std::fs::read_to_string(scratch.path("out.gcode")).unwrap();
    assert_eq!(scratch.names().len(), 2, "{:?}", scratch.names());
    program
}

#[test]
fn a_model_may_be_called_anything() {
    for name in NAMES {
        slice(OsStr::new(name));
    }
}

#[cfg(unix)]
#[test]
fn no_name_can_give_the_printer_orders() {
    use std::os::unix::ffi::OsStringExt;
    let invalid = OsString::from_vec(b"c\xffu\xfebe.stl".to_vec());
    let long = OsString::from(format!("{}.stl", "x".repeat(251)));
    let names = WILD_NAMES.iter().map(OsString::from).chain([invalid, long]);
    for name in names {
        let program = slice(&name);
        for line in program.lines() {
            assert!(line.len() <= 90 && line.is_ascii(), "{line}");
            assert!(!line.starts_with("M104 S999") && !line.starts_with("G1 X"), "{line}");
        }
    }
}

#[test]
fn the_default_output_is_named_after_the_model_and_lies_in_the_working_folder() {
    let scratch = Scratch::new();
    std::fs::create_dir(scratch.path("models")).unwrap();
    scratch.cube("models/my cube.stl", 3.0);
    scratch.run(&["slice", "models/my cube.stl"]).expect(0);
    assert_eq!(scratch.names(), ["models", "my cube.gcode"]);
}

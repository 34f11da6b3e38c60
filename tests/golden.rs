//! Three small prints, byte for byte.
//!
//! Every change of a program is a change for somebody's printer: it must be wanted. These files
//! show it in a review. The numbers depend in their last place on the sine of the system's
//! mathematics library; should another system differ there, its line says where.

use crate::run::{Scratch, root};

/// What is printed: the name of the golden file, the model, the arguments.
const PRINTS: [(&str, &str, &[&str]); 3] = [
    ("cube-on-axis", "cube", &["--scale", "0.1", "--set", "chord_mm=0.05", "--set", "skirts=0"]),
    ("steps-beside-axis", "steps", &["--scale", "0.1", "--place", "20,5"]),
    ("tetrahedron-cartesian", "tetrahedron", &["--scale", "0.15", "--dialect", "cartesian"]),
];

fn program(model: &str, arguments: &[&str]) -> String {
    let scratch = Scratch::new();
    scratch.run(&["model", model]).expect(0);
    let file = format!("{model}.stl");
    let mut all = vec!["slice", &file, "-q", "-o", "-"];
    all.extend(arguments);
    without_pictures(&scratch.run(&all).expect(0).out)
}

/// A program without the lines of its thumbnails, which nobody can review as text.
fn without_pictures(program: &str) -> String {
    let mut is_picture = false;
    let mut kept = String::with_capacity(program.len());
    for line in program.split_inclusive('\n') {
        is_picture |= line.starts_with("; thumbnail begin ");
        if !is_picture {
            kept.push_str(line);
        }
        is_picture &= line != "; thumbnail end\n";
    }
    kept
}

#[test]
fn three_prints_come_out_as_before() {
    let wants_new = std::env::var_os("UPDATE_GOLDEN").is_some_and(|value| value == "1");
    for (name, model, arguments) in PRINTS {
        let path = root().join("golden").join(format!("{name}.gcode"));
        let now = program(model, arguments);
        assert!(now.len() <= 20 * 1024, "{name} has {} bytes; a review cannot show it", now.len());
        if wants_new {
            std::fs::write(&path, &now).unwrap();
        }
        let before = std::fs::read_to_string(&path).unwrap();
        if now == before {
            continue;
        }
        let (line, old, new) = (1..)
            .zip(before.lines().map(Some).chain(std::iter::repeat(None)))
            .zip(now.lines().map(Some).chain(std::iter::repeat(None)))
            .map(|((line, old), new)| (line, old, new))
            .find(|(_, old, new)| old != new)
            .unwrap();
        panic!(
            "golden/{name}.gcode, line {line}: {old:?} has become {new:?}. If that is wanted, run \
             the tests with UPDATE_GOLDEN=1, look at the difference, and write a line in the \
             CHANGELOG under Output"
        );
    }
}

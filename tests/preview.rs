//! Pictures of programs, from outside.

use std::io::Cursor;

use crate::run::{Scratch, model};

/// A tower in the corner of a Cartesian bed.
fn foreign() -> String {
    let mut text = String::from("G28\nG90\nM82\nG92 E0\n");
    let mut e = 0.0;
    for layer in 0..10 {
        text.push_str(&format!(
            ";LAYER:{layer}\n;TYPE:WALL-OUTER\nG0 F9000 X180 Y20 Z{}\n",
            0.2 * f64::from(layer + 1)
        ));
        for [x, y] in [[190, 20], [190, 30], [180, 30], [180, 20]] {
            e += 0.4;
            text.push_str(&format!("G1 F1800 X{x} Y{y} E{e:.4}\n"));
        }
    }
    text
}

/// Width, height, and what share of the pixels is opaque and not grey.
fn seen(png: &[u8]) -> (u32, u32, f64) {
    let mut reader = png::Decoder::new(Cursor::new(png)).read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut pixels).unwrap();
    let coloured = pixels
        .chunks_exact(4)
        .filter(|p| p[3] > 200 && p[..3].iter().max().unwrap() - p[..3].iter().min().unwrap() > 40)
        .count();
    (info.width, info.height, coloured as f64 / f64::from(info.width * info.height))
}

#[test]
fn the_deposit_from_any_side_in_any_size() {
    let scratch = Scratch::new();
    let cube = scratch.cube("cube.stl", 10.0);
    scratch.run(&["slice", cube.to_str().unwrap(), "-q", "-o", "cube.gcode"]).expect(0);
    let draw = |name: &str, more: &[&str]| {
        scratch.run(&[&["preview", "cube.gcode", "-o", name][..], more].concat()).expect(0);
        std::fs::read(scratch.path(name)).unwrap()
    };
    let usual = draw("a.png", &[]);
    let (width, height, share) = seen(&usual);
    assert_eq!((width, height), (1200, 900));
    assert!((0.05..0.6).contains(&share), "{share}");
    assert!(usual == draw("b.png", &[]), "the same bytes every time");
    let above = draw("c.png", &["--size", "200x150", "--elevation", "90", "--azimuth", "-90"]);
    assert_eq!((seen(&above).0, seen(&above).1), (200, 150));
    assert!(usual != draw("d.png", &["--azimuth", "30"]));
    scratch.run(&["preview", "cube.gcode", "-o", "e.png", "--size", "0x9"]).refused("Usage", 2);
    scratch.run(&["preview", "cube.gcode", "-o", "e.png", "--layer", "1"]).refused("Usage", 2);
    scratch.run(&["preview", "cube.gcode", "-o", "e.jpg"]).refused("Usage", 2);
}

#[test]
fn plots_of_motion_and_of_the_schedule() {
    let scratch = Scratch::new();
    let file = model("steps");
    let arguments =
        ["slice", file.to_str().unwrap(), "-q", "-o", "a.gcode", "--export-placed", "a.stl"];
    scratch.run(&arguments).expect(0);
    scratch.run(&["preview", "a.gcode", "-o", "m.svg", "--plot", "motion"]).expect(0);
    let motion = std::fs::read_to_string(scratch.path("m.svg")).unwrap();
    for word in ["bed speed", "carriage speed", "flow, mm³/s", "the machine's limit is"] {
        assert!(motion.contains(word), "{word}");
    }
    scratch
        .run(&["preview", "a.gcode", "-o", "s.svg", "--plot", "schedule", "--model", "a.stl"])
        .expect(0);
    let schedule = std::fs::read_to_string(scratch.path("s.svg")).unwrap();
    let met = schedule.split("layers, ").nth(1).unwrap().split(" flat faces met").next().unwrap();
    let (met, all) = met.split_once(" of ").unwrap();
    assert!(met == all && all.parse::<usize>().unwrap() > 2, "{met} of {all}");
}

#[test]
fn a_page_that_needs_nothing_else_for_every_dialect_and_for_other_slicers() {
    let scratch = Scratch::new();
    let cube = scratch.cube("cube.stl", 8.0);
    for dialect in ["polar", "rrf-direct", "klipper-polar", "cartesian"] {
        let words = ["slice", cube.to_str().unwrap(), "-q", "-o", "a.gcode", "--dialect", dialect];
        scratch.run(&words).expect(0);
        scratch.run(&["preview", "a.gcode", "-o", "a.html"]).expect(0);
        let page = std::fs::read_to_string(scratch.path("a.html")).unwrap();
        assert!(page.starts_with("<!doctype html>") && page.ends_with("</html>\n"), "{dialect}");
        assert!(page.contains(&format!("\"dialect\":\"{dialect}\"")), "{dialect}");
        assert!(page.contains("\"findings\":[]"), "{dialect}");
    }
    scratch.file("other.gcode", foreign());
    scratch.run(&["preview", "other.gcode", "-o", "other.html"]).expect(0);
    let page = std::fs::read_to_string(scratch.path("other.html")).unwrap();
    // Ten layers of a way there and four sides.
    assert!(page.contains("\"moves\":50") && page.contains("\"judged\":false"));
    scratch.run(&["preview", "other.gcode", "-o", "other.png", "--size", "300x200"]).expect(0);
    let (_, _, share) = seen(&std::fs::read(scratch.path("other.png")).unwrap());
    assert!(share > 0.05, "it stands in the middle of the picture: {share}");
    scratch.file("none.gcode", "M104 S200\n");
    scratch.run(&["preview", "none.gcode", "-o", "none.html"]).refused("GcodeSyntax", 4);
}

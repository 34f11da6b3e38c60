//! `rhumb preview --view`: height map and section of what was laid.

use crate::run::{Scratch, model};

#[test]
fn the_deposit_from_above_and_cut() {
    let scratch = Scratch::new();
    let file = model("dome");
    let slice = ["slice", file.to_str().unwrap(), "-q", "--scale=0.4", "-o", "a.gcode"];
    scratch.run(&[&slice[..], &["--layers=conical", "--cone-angle=30"]].concat()).expect(0);
    let mut pictures = Vec::new();
    for view in ["solid", "height", "section"] {
        let name = format!("{view}.png");
        let draw = ["preview", "a.gcode", "--view", view, "--size", "300x200", "-o", &name];
        scratch.run(&draw).expect(0);
        pictures.push(std::fs::read(scratch.path(&name)).unwrap());
    }
    for picture in &pictures {
        assert!(picture.starts_with(b"\x89PNG"));
        // Width and height stand in the first chunk.
        assert_eq!(picture[16..24], [0, 0, 1, 44, 0, 0, 0, 200]);
    }
    assert!(pictures[0] != pictures[1] && pictures[1] != pictures[2]);
    let wrong = ["preview", "a.gcode", "--view", "height", "-o", "a.svg"];
    scratch.run(&wrong).refused("Usage", 2);
}

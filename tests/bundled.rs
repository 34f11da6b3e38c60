//! The models that come with the program are the ones that it writes itself.

use crate::run::{Scratch, root};

fn bundled() -> Vec<String> {
    let mut names: Vec<String> = std::fs::read_dir(root().join("models"))
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "stl"))
        .map(|path| path.file_stem().unwrap().to_str().unwrap().to_owned())
        .collect();
    names.sort();
    names
}

#[test]
fn bundled_models_are_what_the_program_writes() {
    let names = bundled();
    assert!(names.len() >= 10, "{names:?}");
    let scratch = Scratch::new();
    for name in names {
        scratch.run(&["model", &name]).expect(0);
        let file = format!("{name}.stl");
        let written = std::fs::read(scratch.path(&file)).unwrap();
        let kept = std::fs::read(root().join("models").join(&file)).unwrap();
        assert!(written == kept, "models/{file} is not what `rhumb model {name}` writes");
    }
}

#[test]
fn the_list_of_models_names_each() {
    let list = std::fs::read_to_string(root().join("models/README.md")).unwrap();
    for name in bundled() {
        assert!(list.contains(&format!("| `{name}.stl` |")), "{name} is not in models/README.md");
    }
}

#[test]
fn every_model_that_the_program_knows_can_be_written() {
    let scratch = Scratch::new();
    let listed = scratch.run(&["model"]).expect(0).out;
    assert_eq!(listed.lines().collect::<Vec<_>>(), mesh::shapes::NAMES);
    for name in mesh::shapes::NAMES {
        scratch.run(&["model", name, "-o", "any.stl"]).expect(0);
        assert!(scratch.path("any.stl").metadata().unwrap().len() <= 200_000, "{name} is large");
    }
    scratch.run(&["model", "teapot"]).refused("Usage", 2);
}

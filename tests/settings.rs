//! Settings: a mistake is found before any work is done, and the message says what to write.

use crate::run::{Scratch, root};

#[test]
fn an_unknown_key_names_the_nearest_valid_one() {
    let scratch = Scratch::new();
    scratch.cube("cube.stl", 5.0);
    for (wrong, right) in [
        ("layer_heigth_mm=0.2", "layer_height_mm"),
        ("layer_height=0.2", "layer_height_mm"),
        ("perimeter=3", "perimeters"),
        ("fil_density=20%", "fill_density"),
        ("bed_speed=360", "bed_speed_deg_per_s"),
    ] {
        let ran =
            scratch.run(&["slice", "cube.stl", "--set", wrong]).refused("ConfigUnknownKey", 6);
        assert!(ran.err.contains(&format!("did you mean {right}?")), "{wrong}: {}", ran.err);
    }
    scratch.file("my.toml", "\nlayer_heigth_mm = 0.2\n");
    for arguments in
        [&["slice", "cube.stl", "--print", "my.toml"][..], &["profile", "check", "my.toml"]]
    {
        let ran = scratch.run(arguments).refused("ConfigUnknownKey", 6);
        assert!(ran.err.contains("my.toml, line 2"), "{}", ran.err);
        assert!(ran.err.contains("did you mean layer_height_mm?"), "{}", ran.err);
    }
    assert_eq!(scratch.names(), ["cube.stl", "my.toml"]);
}

#[test]
fn values_that_make_no_sense_are_refused_by_class() {
    let scratch = Scratch::new();
    scratch.cube("cube.stl", 5.0);
    for (set, class) in [
        ("perimeters=two", "ConfigType"),
        ("layer_height_mm=nan", "ConfigType"),
        ("perimeters=1000", "ConfigRange"),
        ("layer_height_mm=0.5", "ConfigRange"),
        ("fill_density=150%", "ConfigRange"),
        ("dialect=klingon", "ConfigRange"),
        ("rail_min_mm=200", "ConfigConflict"),
        ("start_gcode=M109 S{no_such_name}", "ConfigUnknownKey"),
    ] {
        let ran = scratch.run(&["slice", "cube.stl", "--set", set]).refused(class, 6);
        let key = set.split('=').next().unwrap();
        assert!(ran.err.contains(key), "{key} is not named: {}", ran.err);
    }
    scratch.run(&["slice", "cube.stl", "--printer", "no-such"]).refused("ConfigConflict", 6);
    scratch.run(&["slice", "cube.stl", "--print", "absent.toml"]).refused("NotFound", 3);
    assert_eq!(scratch.names(), ["cube.stl"]);
}

#[test]
fn the_command_line_wins_over_the_file_and_the_file_over_what_is_built_in() {
    let scratch = Scratch::new();
    scratch.file("my.toml", "inherits = \"0.12\"\nperimeters = 4\nfill_density = \"30%\"\n");
    let show = |more: &[&str]| {
        let mut all = vec!["profile", "show", "my.toml", "--json"];
        all.extend(more);
        let shown = scratch.run(&all).expect(0).out;
        let shown: serde_json::Value = serde_json::from_str(&shown).unwrap();
        ["layer_height_mm", "perimeters", "fill_density"]
            .map(|key| shown[key]["value"].as_str().unwrap().to_owned())
    };
    assert_eq!(show(&[]), ["0.12", "4", "0.3"]);
    assert_eq!(show(&["--set", "perimeters=1"]), ["0.12", "1", "0.3"]);
    scratch.run(&["profile", "check", "my.toml"]).expect(0);
}

#[test]
fn every_built_in_profile_resolves() {
    let scratch = Scratch::new();
    let list = scratch.run(&["profile", "list"]).expect(0).out;
    let profiles: Vec<(&str, &str)> =
        list.lines().map(|line| line.split_once(' ').unwrap()).collect();
    assert!(profiles.len() >= 5, "{list}");
    for (_, name) in profiles {
        scratch.run(&["profile", "show", name.trim()]).expect(0);
    }
}

#[test]
fn the_settings_page_lists_what_there_is() {
    let path = root().join("docs/settings.md");
    let now = rhumb::settings::page::markdown();
    if std::env::var_os("UPDATE_GOLDEN").is_some_and(|value| value == "1") {
        std::fs::write(&path, &now).unwrap();
    }
    let written = std::fs::read_to_string(&path).unwrap();
    for (written, now) in written.lines().zip(now.lines()) {
        assert_eq!(written, now, "docs/settings.md is older than the settings");
    }
    assert_eq!(written.lines().count(), now.lines().count());
}

//! What people print: models of several formats, turned, mirrored and cut, and several of them on one
//! bed.

use serde_json::Value;

use crate::program::{Motion, motions, stl_volume};
use crate::run::{Ran, Scratch};

/// Slices quietly and returns the report.
fn report(scratch: &Scratch, arguments: &[&str]) -> Value {
    let mut all = vec!["slice"];
    all.extend(arguments);
    all.extend(["--json", "-o", "out.gcode", "--export-placed", "out.stl"]);
    serde_json::from_str(&scratch.run(&all).expect(0).out).unwrap()
}

/// The box around the mesh that was sliced: least and largest coordinates, mm.
fn placed(scratch: &Scratch) -> [[f64; 3]; 2] {
    let bytes = std::fs::read(scratch.path("out.stl")).unwrap();
    let bounds = mesh::stl::read(&bytes).unwrap().0.bounds();
    [bounds.min.into(), bounds.max.into()].map(|p: [f64; 3]| p.map(|c| (c * 1e3).round() / 1e3))
}

fn size(scratch: &Scratch) -> [f64; 3] {
    let [least, most] = placed(scratch);
    [0, 1, 2].map(|k| ((most[k] - least[k]) * 1e3).round() / 1e3)
}

fn block(scratch: &Scratch, name: &str, [x, y, z]: [f64; 3]) {
    scratch.file(name, mesh::stl::write(&mesh::shapes::block(x, y, z)));
}

/// An OBJ of a block with quadrangles.
fn obj([x, y, z]: [f64; 3]) -> String {
    let mut text = String::from("# a block\no block\n");
    for k in 0..8 {
        let pick = |bit: usize, c: f64| if k >> bit & 1 == 1 { c } else { 0.0 };
        text += &format!("v {} {} {}\n", pick(0, x), pick(1, y), pick(2, z));
    }
    text + "f 1 3 4 2\nf 5/1 6/1 8/1 7/1\nf 1 2 6 5\nf 3//1 7//1 8//1 4//1\nf -8 -4 -2 -6\nf 2 4 8 6\n"
}

/// The XML of a 3MF with a block of this size at some places, in some unit.
fn xml(unit: &str, [x, y, z]: [f64; 3], places: &[[f64; 3]]) -> String {
    let mut vertices = String::new();
    for k in 0..8 {
        let pick = |bit: usize, c: f64| if k >> bit & 1 == 1 { c } else { 0.0 };
        vertices +=
            &format!("<vertex x=\"{}\" y=\"{}\" z=\"{}\"/>", pick(0, x), pick(1, y), pick(2, z));
    }
    let sides =
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let mut triangles = String::new();
    for [a, b, c, d] in sides {
        for [a, b, c] in [[a, b, c], [a, c, d]] {
            triangles += &format!("<triangle v1=\"{a}\" v2=\"{b}\" v3=\"{c}\"/>");
        }
    }
    let item = |[x, y, z]: &[f64; 3]| {
        format!("<item objectid=\"1\" transform=\"1 0 0 0 1 0 0 0 1 {x} {y} {z}\"/>")
    };
    let items: String = places.iter().map(item).collect();
    format!(
        "<?xml version=\"1.0\"?><model unit=\"{unit}\"><resources><object id=\"1\"><mesh><vertices>\
         {vertices}</vertices><triangles>{triangles}</triangles></mesh></object></resources>\
         <build>{items}</build></model>"
    )
}

/// A ZIP archive of members that are stored as they are.
fn zip(members: &[(&str, &[u8])]) -> Vec<u8> {
    let (mut bytes, mut directory) = (Vec::new(), Vec::new());
    for (name, content) in members {
        let mut crc = flate2::Crc::new();
        crc.update(content);
        let mut fields = vec![20, 0, 0, 0, 0, 0, 0, 0, 0, 0];
        fields.extend(crc.sum().to_le_bytes());
        fields.extend([(content.len() as u32).to_le_bytes(); 2].as_flattened());
        fields.extend((name.len() as u16).to_le_bytes());
        fields.extend([0, 0]);
        directory.extend([b"PK\x01\x02\x14\x00", fields.as_slice(), &[0; 10]].concat());
        directory.extend((bytes.len() as u32).to_le_bytes());
        directory.extend(name.as_bytes());
        bytes.extend([b"PK\x03\x04", fields.as_slice(), name.as_bytes(), content].concat());
    }
    let begin = bytes.len() as u32;
    let count = (members.len() as u16).to_le_bytes();
    bytes.extend(&directory);
    bytes.extend([b"PK\x05\x06\0\0\0\0", count.as_slice(), &count].concat());
    bytes.extend((directory.len() as u32).to_le_bytes());
    bytes.extend(begin.to_le_bytes());
    bytes.extend([0, 0]);
    bytes
}

fn threemf(unit: &str, size: [f64; 3], places: &[[f64; 3]]) -> Vec<u8> {
    zip(&[("3D/3dmodel.model", xml(unit, size, places).as_bytes())])
}

#[test]
fn one_shape_prints_the_same_from_every_format() {
    let scratch = Scratch::new();
    let size = [12.0, 8.0, 4.0];
    block(&scratch, "part.stl", size);
    scratch.file("part.obj", obj(size));
    scratch.file("part.3mf", threemf("millimeter", size, &[[0.0; 3]]));
    scratch.file("inches.3MF", threemf("inch", size.map(|c| c / 25.4), &[[1.0, 2.0, 0.0]]));
    let moves = |name: &str| {
        let ran = scratch.run(&["slice", name, "-q", "-o", "-"]).expect(0);
        motions(&ran.out).iter().filter(|m| matches!(m, Motion { e, .. } if *e > 0.0)).count()
    };
    let wanted = moves("part.stl");
    assert!(wanted > 100);
    for name in ["part.obj", "part.3mf", "inches.3MF"] {
        assert_eq!(moves(name), wanted, "{name}");
        report(&scratch, &[name]);
        assert_eq!(self::size(&scratch), size, "{name}");
    }
    // Names say the format; a wrong one is told.
    scratch.file("wrong.stl", obj(size));
    let wrong = scratch.run(&["slice", "wrong.stl"]).expect(4);
    assert!(wrong.err.contains("OBJ") && wrong.err.contains(".obj"), "{}", wrong.err);
}

#[test]
fn objects_of_a_3mf_keep_their_places() {
    let scratch = Scratch::new();
    let places = [[100.0, 100.0, 0.0], [130.0, 100.0, 0.0]];
    scratch.file("plate.3mf", threemf("millimeter", [4.0, 5.0, 8.0], &places));
    let report = report(&scratch, &["plate.3mf"]);
    assert_eq!(report["mesh"]["shells"], 2);
    // As they stand, not on their largest faces, and the whole about the axis.
    assert_eq!(placed(&scratch), [[-17.0, -2.5, 0.0], [17.0, 2.5, 8.0]]);
    // One object alone is laid down.
    scratch.file("one.3mf", threemf("millimeter", [4.0, 5.0, 8.0], &places[..1]));
    self::report(&scratch, &["one.3mf"]);
    assert_eq!(size(&scratch)[2], 4.0);
}

#[test]
fn objects_of_a_3mf_are_models_each() {
    let scratch = Scratch::new();
    let places = [[100.0, 100.0, 0.0], [130.0, 100.0, 0.0]];
    let text = xml("millimeter", [8.0, 8.0, 6.0], &places);
    // Two objects that are alike, the second with settings of its own.
    let (first, rest) = (text.find("<object id").unwrap(), text.find("</resources>").unwrap());
    let object = text[first..rest].to_owned();
    let other = object.replacen("id=\"1\"", "id=\"2\" name=\"wheel\"", 1);
    let text = text.replacen(&object, &(object.clone() + &other), 1);
    let last = text.rfind("objectid=\"1\"").unwrap();
    let text = format!("{}objectid=\"2\"{}", &text[..last], &text[last + 12..]);
    let config = "<config><object id=\"2\"><metadata type=\"object\" key=\"perimeters\" value=\"4\"/>\
                  <metadata type=\"object\" key=\"extruder\" value=\"2\"/></object></config>";
    let members = [
        ("3D/3dmodel.model", text.as_bytes()),
        ("Metadata/Slic3r_PE_model.config", config.as_bytes()),
    ];
    scratch.file("plate.3mf", zip(&members));
    let report_of = |own: &[&str]| {
        let all = [&["plate.3mf", "--dialect", "klipper-polar"], own].concat();
        let report = report(&scratch, &all);
        (report, std::fs::read_to_string(scratch.path("out.gcode")).unwrap())
    };
    // They have their names, places and numbers; their settings only when that is asked for.
    let (plain, program) = report_of(&[]);
    assert_eq!(placed(&scratch), [[-19.0, -4.0, 0.0], [19.0, 4.0, 6.0]]);
    assert!(program.contains("EXCLUDE_OBJECT_START NAME=plate_1\n"));
    assert!(program.contains("EXCLUDE_OBJECT_START NAME=wheel_2\n"));
    assert!(
        !program.contains("perimeters=4")
            && plain["warnings"].to_string().contains("--file-settings")
    );
    let (told, program) = report_of(&["--file-settings"]);
    assert!(program.contains("\n; model 2: perimeters=4\n"));
    assert!(told["warnings"].to_string().contains("object 2 (wheel)"), "{}", told["warnings"]);
    assert!(told["warnings"].to_string().contains("extruder"));
    // How many lines of an object lay its inner walls.
    let inner = |program: &str, name: &str| {
        let begin = format!("EXCLUDE_OBJECT_START NAME={name}\n");
        let parts = program.split(&begin).skip(1);
        let of = parts.map(|part| part.split("EXCLUDE_OBJECT_END").next().unwrap_or(""));
        let roles = of.flat_map(|part| part.split(";TYPE:").skip(1));
        let walls = roles.filter(|role| role.starts_with("Perimeter\n"));
        walls.map(|wall| wall.lines().count()).sum::<usize>()
    };
    assert!(inner(&program, "wheel_2") > 2 * inner(&program, "plate_1"));
    // The user has the last word, by the number of the object.
    let (_, program) = report_of(&["--file-settings", "--object", "2:perimeters=2"]);
    assert!(program.contains("\n; model 2: perimeters=2\n"));
    let (wheel, plate) = (inner(&program, "wheel_2"), inner(&program, "plate_1"));
    assert!(wheel.abs_diff(plate) < plate / 20, "{wheel} {plate}");
    let refused = scratch.run(&["slice", "plate.3mf", "--object", "3:perimeters=2"]).expect(2);
    assert!(refused.err.contains("there are models 1 to 2"), "{}", refused.err);
    // A cut goes through both, and copies are of the whole plate.
    report(&scratch, &["plate.3mf", "--cut", "2"]);
    assert_eq!(placed(&scratch), [[-19.0, -4.0, 0.0], [19.0, 4.0, 2.0]]);
    let twice = report(&scratch, &["plate.3mf", "--copies", "2"]);
    assert_eq!(twice["mesh"]["shells"], 4);
}

#[test]
fn bodies_of_a_model_may_be_models_each() {
    let scratch = Scratch::new();
    let mut soup = Vec::new();
    for x in [0.0, 20.0, 40.0] {
        let block = mesh::shapes::block(8.0, 8.0, 4.0);
        let moved = block.transformed(&nalgebra::Isometry3::translation(x, 0.0, 0.0));
        soup.extend((0..moved.triangles.len() as u32).map(|t| moved.corners(t)));
    }
    let corners = soup.iter().flatten().copied().collect::<Vec<_>>();
    let triangles = (0..soup.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect();
    scratch.file("three.stl", mesh::stl::write(&mesh::mesh::Mesh { vertices: corners, triangles }));
    let program = |arguments: &[&str]| {
        let all = [&["three.stl", "--dialect", "klipper-polar"], arguments].concat();
        report(&scratch, &all);
        std::fs::read_to_string(scratch.path("out.gcode")).unwrap()
    };
    assert!(!program(&[]).contains("EXCLUDE_OBJECT"));
    let whole = placed(&scratch);
    let split = program(&["--split", "--object", "2:perimeters=4"]);
    assert_eq!(placed(&scratch), whole, "bodies keep their places");
    for k in 1..=3 {
        assert!(split.contains(&format!("EXCLUDE_OBJECT_START NAME=three_{k}\n")));
    }
    assert!(split.contains("\n; model 2: perimeters=4\n"));
}

#[test]
fn several_models_are_printed_together() {
    let scratch = Scratch::new();
    block(&scratch, "a.stl", [10.0, 10.0, 6.0]);
    scratch.file("b.obj", obj([8.0, 8.0, 4.0]));
    let report = report(&scratch, &["a.stl", "b.obj", "--orient", "keep"]);
    assert_eq!((&report["mesh"]["shells"], &report["model"]["triangles"]), (&2.into(), &24.into()));
    let bytes = std::fs::read(scratch.path("out.stl")).unwrap();
    assert!((stl_volume(&bytes) - 600.0 - 256.0).abs() < 0.01);
    // The circles of the footprints are 6 mm apart, and the middle of both is the axis.
    let reach = 10_f64.hypot(10.0) / 2.0 + 8_f64.hypot(8.0) / 2.0 + 3.0;
    let [least, most] = placed(&scratch);
    let wanted = 2.0 * reach - (10_f64.hypot(10.0) - 10.0) / 2.0 - (8_f64.hypot(8.0) - 8.0) / 2.0;
    assert!((most[0] - least[0] - wanted).abs() < 0.02, "{least:?} {most:?}");
    // Layer by layer: the nozzle never goes down again by more than a lift.
    let text = std::fs::read_to_string(scratch.path("out.gcode")).unwrap();
    let heights: Vec<f64> = motions(&text).iter().filter(|m| m.e > 0.0).map(|m| m.to[2]).collect();
    assert!(heights.is_sorted(), "layer by layer");
}

#[test]
fn models_stand_where_they_are_wanted() {
    let scratch = Scratch::new();
    block(&scratch, "a.stl", [10.0, 10.0, 6.0]);
    report(&scratch, &["a.stl", "a.stl", "--at=-30,0", "--at", "20,10", "--orient", "keep"]);
    assert_eq!(placed(&scratch), [[-35.0, -5.0, 0.0], [25.0, 15.0, 6.0]]);
    let refused = scratch.run(&["slice", "a.stl", "a.stl", "--at", "0,0"]).expect(2);
    assert!(refused.err.contains("1 times for 2 parts"), "{}", refused.err);
    // Parts in one place are told, those that touch are not.
    let told = |places: [&str; 2]| {
        let at = ["a.stl", "a.stl", "--orient", "keep", "--at", places[0], "--at", places[1]];
        report(&scratch, &at)["warnings"].to_string().contains("ModelsOverlap")
    };
    assert!(told(["0,0", "4,5"]) && !told(["0,0", "10,0"]));
    let many = report(&scratch, &["a.stl", "--copies", "7", "--gap", "1"]);
    assert_eq!(many["mesh"]["shells"], 7);
    let far: Ran = scratch.run(&["slice", "a.stl", "a.stl", "--at", "0,0", "--at", "200,0"]);
    assert!(far.expect(5).err.contains("OutOfEnvelope"));
}

#[test]
fn models_are_turned_mirrored_and_cut() {
    let scratch = Scratch::new();
    block(&scratch, "part.stl", [10.0, 20.0, 30.0]);
    let sized = |arguments: &[&str]| {
        let all: Vec<&str> = std::iter::once(&"part.stl").chain(arguments).copied().collect();
        report(&scratch, &all);
        size(&scratch)
    };
    assert_eq!(sized(&["--rotate-x", "90"]), [10.0, 30.0, 20.0]);
    assert_eq!(sized(&["--rotate-y=-90"]), [30.0, 20.0, 10.0]);
    assert_eq!(sized(&["--orient", "keep", "--rotate-z", "90"]), [20.0, 10.0, 30.0]);
    assert_eq!(sized(&["--orient", "keep", "--scale", "0.5"]), [5.0, 10.0, 15.0]);
    assert_eq!(sized(&["--orient", "keep", "--cut", "12"]), [10.0, 20.0, 12.0]);
    let upper = ["--orient", "keep", "--cut", "12", "--keep", "upper"];
    assert_eq!(sized(&upper), [10.0, 20.0, 18.0]);
    assert_eq!(placed(&scratch)[0][2], 0.0);
    scratch.run(&["slice", "part.stl", "--cut", "-3"]).expect(5);
    scratch.run(&["slice", "part.stl", "--rotate-x", "nan"]).expect(2);
    scratch.run(&["slice", "part.stl", "--rotate-x", "9", "--orient", "flat"]).expect(2);
    // A mirror image is another part: the small step is on the other side.
    let left = mesh::shapes::steps();
    scratch.file("steps.stl", mesh::stl::write(&left));
    let heavy_side = |arguments: &[&str]| {
        let all: Vec<&str> =
            ["steps.stl", "--orient", "keep"].iter().chain(arguments).copied().collect();
        report(&scratch, &all);
        let bytes = std::fs::read(scratch.path("out.stl")).unwrap();
        let (mesh, _) = mesh::weld::weld(&mesh::stl::read(&bytes).unwrap().0);
        mesh::measure::centroid(&mesh).unwrap().coords
    };
    let (as_is, image) = (heavy_side(&[]), heavy_side(&["--mirror", "x"]));
    assert!(as_is.x.abs() > 1.0 && (as_is.x + image.x).abs() < 1e-3, "{as_is} {image}");
    assert!((as_is.y - image.y).abs() < 1e-3 && (as_is.z - image.z).abs() < 1e-3);
}

#[test]
fn hostile_packages_are_refused() {
    let scratch = Scratch::new();
    let size = [12.0, 8.0, 4.0];
    let sound = xml("millimeter", size, &[[0.0; 3]]);
    let cases = [
        (sound.replacen("v3=\"3\"", "v3=\"4294967295\"", 1), "WrongFormat", 4),
        (
            sound.replacen("<model", "<!DOCTYPE m SYSTEM \"/etc/passwd\"><model", 1),
            "WrongFormat",
            4,
        ),
        (sound.replacen("x=\"12\"", "x=\"1e39\"", 1), "NumberRange", 4),
        (sound.replacen("x=\"12\"", "x=\"inf\"", 1), "NotFinite", 4),
        (sound.replacen("<item objectid=\"1\"", "<item objectid=\"2\"", 1), "WrongFormat", 4),
        (sound[..sound.len() / 2].to_owned(), "WrongFormat", 4),
    ];
    for (text, class, status) in cases {
        assert_ne!(text, sound);
        scratch.file("m.3mf", zip(&[("3D/3dmodel.model", text.as_bytes())]));
        let ran = scratch.run(&["slice", "m.3mf"]).expect(status);
        assert!(ran.err.contains(&format!("error[{class}]: m.3mf: ")), "{}", ran.err);
    }
    let whole = zip(&[("3D/3dmodel.model", sound.as_bytes())]);
    for length in [0, 1, 30, whole.len() / 2, whole.len() - 1] {
        scratch.file("m.3mf", &whole[..length]);
        scratch.run(&["slice", "m.3mf"]).expect(4);
    }
    assert_eq!(scratch.names(), ["m.3mf"]);
}

#[test]
fn settings_in_a_3mf_become_profiles() {
    let scratch = Scratch::new();
    let prusa =
        "; generated by PrusaSlicer\n\n; perimeters = 4\n; layer_height = 0.25\n; wipe_tower = 1\n";
    scratch.file("prusa.3mf", zip(&[("Metadata/Slic3r_PE.config", prusa.as_bytes())]));
    let orca =
        r#"{"wall_loops": "5", "sparse_infill_pattern": "gyroid", "prime_tower_width": "35"}"#;
    scratch.file("orca.3mf", zip(&[("Metadata/project_settings.config", orca.as_bytes())]));
    for (name, taken, unknown) in [
        ("prusa", ["perimeters = 4", "layer_height_mm = 0.25"], "wipe_tower"),
        ("orca", ["perimeters = 5", "fill_pattern = gyroid"], "prime_tower_width"),
    ] {
        let ran = scratch.run(&["profile", "import", &format!("{name}.3mf")]).expect(0);
        for told in taken.iter().chain([&unknown]) {
            assert!(ran.out.contains(told), "{name}: {told}: {}", ran.out);
        }
        let shown = ["profile", "show", "--print", &format!("{name}.print.toml")];
        let shown = scratch.run(&shown).expect(0).out;
        assert!(taken.iter().all(|line| shown.contains(&format!("{line} "))), "{name}: {shown}");
    }
    scratch.file("none.3mf", threemf("millimeter", [4.0, 5.0, 8.0], &[[0.0; 3]]));
    scratch.run(&["profile", "import", "none.3mf"]).expect(6);
}

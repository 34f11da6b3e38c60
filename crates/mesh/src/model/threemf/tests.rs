use super::*;
use crate::measure;
use crate::model::archive::tests::zip;
use crate::model::{OwnSettings, Slicer};
use crate::weld::weld;

/// A cube of one unit.
const CUBE: &str = "<mesh><vertices>\
    <vertex x=\"0\" y=\"0\" z=\"0\"/><vertex x=\"1\" y=\"0\" z=\"0\"/><vertex x=\"1\" y=\"1\" z=\"0\"/>\
    <vertex x=\"0\" y=\"1\" z=\"0\"/><vertex x=\"0\" y=\"0\" z=\"1\"/><vertex x=\"1\" y=\"0\" z=\"1\"/>\
    <vertex x=\"1\" y=\"1\" z=\"1\"/><vertex x=\"0\" y=\"1\" z=\"1\"/></vertices><triangles>\
    <triangle v1=\"0\" v2=\"2\" v3=\"1\"/><triangle v1=\"0\" v2=\"3\" v3=\"2\"/>\
    <triangle v1=\"4\" v2=\"5\" v3=\"6\"/><triangle v1=\"4\" v2=\"6\" v3=\"7\"/>\
    <triangle v1=\"0\" v2=\"1\" v3=\"5\"/><triangle v1=\"0\" v2=\"5\" v3=\"4\"/>\
    <triangle v1=\"1\" v2=\"2\" v3=\"6\"/><triangle v1=\"1\" v2=\"6\" v3=\"5\"/>\
    <triangle v1=\"2\" v2=\"3\" v3=\"7\"/><triangle v1=\"2\" v2=\"7\" v3=\"6\"/>\
    <triangle v1=\"3\" v2=\"0\" v3=\"4\"/><triangle v1=\"3\" v2=\"4\" v3=\"7\"/>\
    </triangles></mesh>";

/// A model with these attributes, resources and places.
fn model(attributes: &str, resources: &str, build: &str) -> String {
    format!(
        "<?xml version=\"1.0\"?>\n<model {attributes} xmlns=\"http://schemas.microsoft.com/\
         3dmanufacturing/core/2015/02\"><resources>{resources}</resources><build>{build}</build>\
         </model>"
    )
}

fn cube(id: u32, attributes: &str) -> String {
    format!("<object id=\"{id}\" {attributes}>{CUBE}</object>")
}

fn packed(model: &str) -> Vec<u8> {
    zip(&[(USUAL, model.as_bytes())])
}

/// Volume and box of what a model builds.
fn built(model: &str) -> (f64, [f64; 3], [f64; 3]) {
    measured(&read(&packed(model)).unwrap())
}

fn measured(given: &Given) -> (f64, [f64; 3], [f64; 3]) {
    let (mesh, _) = weld(&given.soup);
    let bounds = mesh.bounds();
    let volume = (measure::volume_mm3(&mesh) * 1e3).round() / 1e3;
    (volume, bounds.min.into(), bounds.max.into())
}

fn class(bytes: &[u8]) -> &'static str {
    read(bytes).unwrap_err().class()
}

#[test]
fn units_are_millimetres() {
    let item = "<item objectid=\"1\" transform=\"1 0 0 0 1 0 0 0 1 1 0 0\"/>";
    for (unit, mm) in [
        ("", 1.0),
        ("unit=\"millimeter\"", 1.0),
        ("unit=\"inch\"", f64::from(25.4_f32)),
        ("unit=\"centimeter\"", 10.0),
        ("unit=\"meter\"", 1000.0),
    ] {
        let (_, min, max) = built(&model(unit, &cube(1, ""), item));
        assert!((min[0] - mm).abs() < 1e-4 * mm && (max[0] - 2.0 * mm).abs() < 1e-4 * mm, "{unit}");
        assert!((max[2] - mm).abs() < 1e-6 * mm, "{unit}");
    }
    assert_eq!(class(&packed(&model("unit=\"ell\"", &cube(1, ""), item))), "WrongFormat");
}

#[test]
fn places_and_components_are_followed() {
    // Twice as long, a quarter turn about z, and up.
    let turn = "transform=\"0 2 0 -1 0 0 0 0 1 0 0 5\"";
    let (volume, min, max) =
        built(&model("", &cube(1, ""), &format!("<item objectid=\"1\" {turn}/>")));
    assert_eq!((volume, min, max), (2.0, [-1.0, 0.0, 5.0], [0.0, 2.0, 6.0]));
    // Two in one object, of which one is a mirror image, and that twice.
    let pair = "<object id=\"2\"><components><component objectid=\"1\"/><component objectid=\"1\" \
                transform=\"-1 0 0 0 1 0 0 0 1 -3 0 0\"/></components></object>";
    let build =
        "<item objectid=\"2\"/><item objectid=\"2\" transform=\"1 0 0 0 1 0 0 0 1 0 10 0\"/>";
    let text = model("", &(cube(1, "") + pair), build);
    assert_eq!(built(&text), (4.0, [-4.0, 0.0, 0.0], [1.0, 11.0, 1.0]));
    assert_eq!(read(&packed(&text)).unwrap().objects.len(), 2);
}

#[test]
fn what_is_not_to_be_printed_is_left_out() {
    let objects = cube(1, "") + &cube(2, "type=\"support\"") + &cube(3, "type=\"other\"");
    let far = "transform=\"1 0 0 0 1 0 0 0 1 50 0 0\"";
    let build = format!(
        "<item objectid=\"1\"/><item objectid=\"2\" {far}/><item objectid=\"3\" {far}/>\
         <item objectid=\"1\" printable=\"0\" {far}/>"
    );
    let given = read(&packed(&model("", &objects, &build))).unwrap();
    assert_eq!((given.soup.facets.len(), given.objects.len()), (12, 1));
    assert!(given.notes.is_empty());
}

#[test]
fn objects_may_lie_in_files_of_their_own() {
    let outer = "<object id=\"7\"><components><component objectid=\"1\" \
                 p:path=\"/3D/Objects/a.model\" transform=\"1 0 0 0 1 0 0 0 1 3 0 0\"/></components>\
                 </object>";
    let outer = model("", outer, "<item objectid=\"7\"/>");
    let inner = model("", &cube(1, ""), "");
    let rels = "<Relationships><Relationship Target=\"/odd/main.model\" Id=\"r\" \
                Type=\"http://schemas.microsoft.com/3dmanufacturing/2013/01/3dmodel\"/>\
                </Relationships>";
    let members: [(&str, &[u8]); 4] = [
        ("_rels/.rels", rels.as_bytes()),
        ("odd/main.model", outer.as_bytes()),
        ("3D/Objects/a.model", inner.as_bytes()),
        ("Metadata/project_settings.config", b"{\"machine_start_gcode\": \"M109 S777\"}"),
    ];
    let given = read(&zip(&members)).unwrap();
    assert_eq!(measured(&given), (1.0, [3.0, 0.0, 0.0], [4.0, 1.0, 1.0]));
    assert_eq!(given.notes[0].code, note::EMBEDDED_SETTINGS_IGNORED);
    assert_eq!(class(&zip(&members[..2])), "WrongFormat");
}

#[test]
fn odd_names_are_told() {
    let named = cube(1, "name=\"part&#10;M104 S999\"");
    let given = read(&packed(&model("", &named, "<item objectid=\"1\"/>"))).unwrap();
    assert_eq!(given.notes[0].code, note::NAME_SANITIZED);
    assert!(!given.notes[0].message.contains("M104"));
}

#[test]
fn what_is_wrong_is_refused() {
    let item = "<item objectid=\"1\"/>";
    let sound = model("", &cube(1, ""), item);
    assert_eq!(read(&packed(&sound)).unwrap().soup.facets.len(), 12);
    let changes = [
        ("v3=\"2\"", "v3=\"8\"", "WrongFormat"),
        ("v3=\"2\"", "v3=\"4294967296\"", "WrongFormat"),
        ("v3=\"2\"", "v3=\"-1\"", "WrongFormat"),
        ("v3=\"2\"", "", "WrongFormat"),
        ("x=\"1\"", "x=\"1,5\"", "WrongFormat"),
        ("x=\"1\"", "", "WrongFormat"),
        ("x=\"1\"", "x=\"nan\"", "NotFinite"),
        ("x=\"1\"", "x=\"1e999\"", "NotFinite"),
        ("x=\"1\"", "x=\"1e39\"", "NumberRange"),
        ("<item objectid=\"1\"", "<item objectid=\"3\"", "WrongFormat"),
        ("<item objectid=\"1\"", "<item objectid=\"1\" transform=\"1 0 0\"", "WrongFormat"),
        ("<item objectid=\"1\"", "<item objectid=\"&x;\"", "WrongFormat"),
        ("</build></model>", "", "WrongFormat"),
        ("</mesh>", "</nest>", "WrongFormat"),
        ("<model", "<!DOCTYPE m [<!ENTITY x SYSTEM \"file:///etc/passwd\">]><model", "WrongFormat"),
        ("<model", "<modell", "WrongFormat"),
    ];
    for (from, to, wanted) in changes {
        let broken = sound.replacen(from, to, 1);
        assert_ne!(broken, sound);
        assert_eq!(class(&packed(&broken)), wanted, "{from} -> {to}");
    }
    assert_eq!(class(&zip(&[("other", b"x")])), "WrongFormat");
    assert_eq!(class(b"PK\x03\x04 and what else"), "WrongFormat");
}

#[test]
fn small_files_do_not_become_large_models() {
    let double = |id: u32| {
        let twice = format!("<component objectid=\"{}\"/>", id - 1).repeat(2);
        format!("<object id=\"{id}\"><components>{twice}</components></object>")
    };
    let objects = |last: u32| cube(1, "") + &(2..=last).map(double).collect::<String>();
    let build = |last: u32| format!("<item objectid=\"{last}\"/>");
    let given = read(&packed(&model("", &objects(6), &build(6)))).unwrap();
    assert_eq!(given.soup.facets.len(), 12 << 5);
    assert_eq!(class(&packed(&model("", &objects(30), &build(30)))), "LimitExceeded");
    let own = "<object id=\"1\"><components><component objectid=\"1\"/></components></object>";
    assert_eq!(class(&packed(&model("", own, &build(1)))), "WrongFormat");
    let blanks = " ".repeat(40 << 20);
    assert_eq!(class(&packed(&model("", &(blanks + &cube(1, "")), &build(1)))), "LimitExceeded");
}

#[test]
fn modifiers_are_no_part_of_the_shape() {
    let text = model("", &cube(1, ""), "<item objectid=\"1\"/>");
    let volumes = |kind: &str| {
        format!(
            "<config><object id=\"1\"><metadata type=\"object\" key=\"name\" value=\"a\"/>\
             <volume firstid=\"0\" lastid=\"3\"><metadata type=\"volume\" key=\"volume_type\" \
             value=\"ModelPart\"/></volume><volume firstid=\"4\" lastid=\"11\"><metadata \
             type=\"volume\" key=\"volume_type\" value=\"{kind}\"/></volume></object></config>"
        )
    };
    let facets = |config: &str| {
        let members: [(&str, &[u8]); 2] =
            [(USUAL, text.as_bytes()), ("Metadata/Slic3r_PE_model.config", config.as_bytes())];
        let given = read(&zip(&members)).unwrap();
        let is_told = given.notes.iter().any(|n| n.code == note::VOLUMES_LEFT_OUT);
        (given.soup.facets.len(), is_told)
    };
    assert_eq!(facets(&volumes("ModelPart")), (12, false));
    assert_eq!(facets(&volumes("ParameterModifier")), (4, true));
    assert_eq!(facets(&volumes("NegativeVolume")), (4, true));
    assert_eq!(facets("<config><object"), (12, false), "what cannot be read leaves nothing out");
    // The same in the manner of slices with a file for each object.
    let both = "<object id=\"5\"><components><component objectid=\"1\"/><component objectid=\"2\"/>\
                </components></object>";
    let text = model("", &(cube(1, "") + &cube(2, "") + both), "<item objectid=\"5\"/>");
    let config = "<config><object id=\"5\"><part id=\"1\" subtype=\"normal_part\"/><part id=\"2\" \
                  subtype=\"modifier_part\"/></object></config>";
    let members: [(&str, &[u8]); 2] =
        [(USUAL, text.as_bytes()), ("Metadata/model_settings.config", config.as_bytes())];
    assert_eq!(read(&zip(&members)).unwrap().soup.facets.len(), 12);
}

#[test]
fn objects_have_their_names_facets_and_settings() {
    let objects = cube(1, "name=\"left&#9;wheel\"") + &cube(2, "");
    let build = "<item objectid=\"1\"/><item objectid=\"2\" transform=\"1 0 0 0 1 0 0 0 1 9 0 0\"/>\
                 <item objectid=\"1\" transform=\"1 0 0 0 1 0 0 0 1 20 0 0\"/>";
    let text = model("", &objects, build);
    let given = |name: &str, config: &str| {
        read(&zip(&[(USUAL, text.as_bytes()), (name, config.as_bytes())])).unwrap().objects
    };
    let prusa = "<config><object id=\"1\"><metadata type=\"object\" key=\"name\" value=\"x\"/><metadata \
                 type=\"object\" key=\"perimeters\" value=\"4\"/><volume firstid=\"0\" lastid=\"11\">\
                 <metadata type=\"volume\" key=\"matrix\" value=\"1\"/></volume></object></config>";
    let built = given("Metadata/Slic3r_PE_model.config", prusa);
    let names: Vec<&str> = built.iter().map(|built| built.name.as_str()).collect();
    assert_eq!(names, ["left?wheel", "", "left?wheel"]);
    let facets: Vec<_> = built.iter().map(|built| built.facets.clone()).collect();
    assert_eq!(facets, [0..12, 12..24, 24..36]);
    let pairs = vec![("perimeters".to_owned(), "4".to_owned())];
    let own = Some(OwnSettings { slicer: Slicer::Prusa, pairs });
    assert_eq!((&built[0].settings, &built[1].settings, &built[2].settings), (&own, &None, &own));
    let orca = "<config><object id=\"2\"><metadata key=\"wall_loops\" value=\"5\"/><part id=\"1\" \
                subtype=\"normal_part\"><metadata key=\"name\" value=\"y\"/></part></object></config>";
    let built = given("Metadata/model_settings.config", orca);
    let pairs = vec![("wall_loops".to_owned(), "5".to_owned())];
    assert_eq!(built[1].settings, Some(OwnSettings { slicer: Slicer::Orca, pairs }));
    assert_eq!(built[0].settings, None);
}

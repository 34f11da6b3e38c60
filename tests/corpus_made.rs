//! Broken files, made here byte by byte, so that every clone tests them: what people really have on
//! their disks, with the class that each is refused by or the print that is made of it.

use crate::run::{Ran, Scratch};

/// What is expected of a file.
enum Ends {
    /// A print of this volume, mm³, with status 0, or 1 where a repair is a guess.
    Printed(f64),
    /// Refused, with this class and status.
    Refused(&'static str, i32),
}

use Ends::{Printed, Refused};

type Facet = [[f32; 3]; 3];

/// The facets of a block between two corners, seen from outside.
fn block(a: [f32; 3], b: [f32; 3]) -> Vec<Facet> {
    let corner = |k: usize| {
        let pick = |axis: usize| if k >> axis & 1 == 0 { a[axis] } else { b[axis] };
        [pick(0), pick(1), pick(2)]
    };
    // Each side as a quadrangle, counter-clockwise from outside.
    let sides =
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let halves = |[p, q, r, s]: [usize; 4]| {
        [[p, q, r], [p, r, s]].map(|corners: [usize; 3]| corners.map(corner))
    };
    sides.into_iter().flat_map(halves).collect()
}

fn cube() -> Vec<Facet> {
    block([0.0; 3], [10.0; 3])
}

fn turned(facets: &[Facet]) -> Vec<Facet> {
    facets.iter().map(|&[a, b, c]| [a, c, b]).collect()
}

fn binary(facets: &[Facet]) -> Vec<u8> {
    let mut bytes = vec![b'x'; 80];
    bytes.extend(u32::try_from(facets.len()).unwrap().to_le_bytes());
    for facet in facets {
        bytes.extend([0; 12]);
        facet.iter().flatten().for_each(|c| bytes.extend(c.to_le_bytes()));
        bytes.extend([0; 2]);
    }
    bytes
}

fn ascii(facets: &[Facet]) -> String {
    let mut text = String::from("solid x\n");
    for facet in facets {
        text += "facet normal 0 0 0\n outer loop\n";
        for [x, y, z] in facet {
            text += &format!("  vertex {x} {y} {z}\n");
        }
        text += " endloop\nendfacet\n";
    }
    text + "endsolid x\n"
}

/// The cube with the first coordinate of its first facet replaced.
fn with(coordinate: f32) -> Vec<u8> {
    let mut facets = cube();
    facets[0][0][0] = coordinate;
    binary(&facets)
}

/// Bytes with some of them replaced.
fn patched(mut bytes: Vec<u8>, at: usize, with: &[u8]) -> Vec<u8> {
    bytes[at..at + with.len()].copy_from_slice(with);
    bytes
}

type Case = (&'static str, Vec<u8>, Ends);

fn what_is_in_the_bytes() -> Vec<Case> {
    let (sound, text) = (binary(&cube()), ascii(&cube()));
    let n = sound.len();
    let count = |n: u32| patched(sound.clone(), 80, &n.to_le_bytes());
    vec![
        ("binary", sound.clone(), Printed(1000.0)),
        ("binary that begins with solid", patched(sound.clone(), 0, b"solid x "), Printed(1000.0)),
        ("empty", Vec::new(), Refused("EmptyFile", 4)),
        ("one byte", vec![b's'], Refused("WrongFormat", 4)),
        ("header only", sound[..84].to_vec(), Refused("TruncatedBinary", 4)),
        ("no facets", patched(sound[..84].to_vec(), 80, &[0; 4]), Refused("NoTriangles", 4)),
        ("cut in a facet", sound[..n - 20].to_vec(), Refused("TruncatedBinary", 4)),
        ("cut between facets", sound[..n - 50].to_vec(), Refused("TruncatedBinary", 4)),
        ("count too high", count(13), Refused("TruncatedBinary", 4)),
        ("count of 4 thousand million", count(u32::MAX - 1), Refused("WrongFormat", 4)),
        ("count too low", count(3), Printed(1000.0)),
        ("count left at zero", count(0), Printed(1000.0)),
        ("tail of 7 bytes", [sound.clone(), vec![1; 7]].concat(), Printed(1000.0)),
        ("quiet NaN", with(f32::NAN), Refused("NotFinite", 4)),
        ("signalling NaN", with(f32::from_bits(0x7f80_0001)), Refused("NotFinite", 4)),
        ("infinity", with(f32::INFINITY), Refused("NotFinite", 4)),
        ("minus infinity", with(f32::NEG_INFINITY), Refused("NotFinite", 4)),
        ("negative zero", with(-0.0), Printed(1000.0)),
        ("all bytes 255", vec![255; 684], Refused("NotFinite", 4)),
        ("zeros", vec![0; 1 << 16], Refused("TruncatedBinary", 4)),
        (
            "UTF-16",
            std::iter::once(0xfeff).chain(text.encode_utf16()).flat_map(u16::to_le_bytes).collect(),
            Refused("Encoding", 4),
        ),
        ("gzip", [b"\x1f\x8b\x08\0".to_vec(), sound.clone()].concat(), Refused("WrongFormat", 4)),
        ("ZIP", [b"PK\x03\x04".to_vec(), sound].concat(), Refused("WrongFormat", 4)),
        ("a web page", b"<!DOCTYPE html><html>404</html>".to_vec(), Refused("WrongFormat", 4)),
        ("G-code", b"; generated\nG28\nG1 X10 Y10 E1\n".to_vec(), Refused("WrongFormat", 4)),
    ]
}

fn what_is_in_the_text() -> Vec<Case> {
    let text = ascii(&cube());
    let like = |from: &str, to: &str| text.replacen(from, to, 1).into_bytes();
    let number = |number: &str| like("vertex 0 0 0", &format!("vertex {number} 0 0"));
    let syntax = || Refused("AsciiSyntax", 4);
    let name = format!("solid {}", "x".repeat(1 << 20));
    vec![
        ("ASCII", text.clone().into_bytes(), Printed(1000.0)),
        ("CR LF", text.replace('\n', "\r\n").into_bytes(), Printed(1000.0)),
        ("CR alone", text.replace('\n', "\r").into_bytes(), Printed(1000.0)),
        ("one line", text.replace('\n', " ").into_bytes(), Printed(1000.0)),
        ("capitals", text.to_uppercase().into_bytes(), Printed(1000.0)),
        ("a byte order mark", format!("\u{feff}{text}").into_bytes(), Printed(1000.0)),
        ("blank lines first", format!("\n \n\t{text}").into_bytes(), Printed(1000.0)),
        ("no name", like("solid x", "solid"), Printed(1000.0)),
        ("a name of 1 MB", like("solid x", &name), Printed(1000.0)),
        (
            "a name that is not UTF-8",
            [b"solid \xe4\xff".as_slice(), &text.as_bytes()[7..]].concat(),
            Printed(1000.0),
        ),
        ("text after the end", format!("{text}\n; by CAD 3.1\n").into_bytes(), Printed(1000.0)),
        (
            "normals that are no numbers",
            like("normal 0 0 0", "normal nan -nan inf"),
            Printed(1000.0),
        ),
        ("plus signs and exponents", number("+0.0e+00"), Printed(1000.0)),
        ("no endloop", like(" endloop\n", ""), syntax()),
        ("no endfacet", like("endfacet\n", ""), syntax()),
        ("two corners", like("  vertex 0 0 0\n", ""), syntax()),
        ("four corners", like("  vertex 0 0 0\n", "  vertex 0 0 0\n vertex 1 1 1\n"), syntax()),
        ("two numbers", like("vertex 0 0 0", "vertex 0 0"), syntax()),
        ("cut off", text.as_bytes()[..text.len() / 2 - 40].to_vec(), syntax()),
        ("commas", number("0,5"), syntax()),
        ("hexadecimal", number("0x10"), syntax()),
        ("a suffix", number("1.0f"), syntax()),
        ("a NUL in a number", number("1\0"), syntax()),
        ("nan", number("nan"), Refused("NotFinite", 4)),
        ("inf", number("-inf"), Refused("NotFinite", 4)),
        ("1e39", number("1e39"), Refused("NumberRange", 4)),
        ("1e400", number("1e400"), Refused("NumberRange", 4)),
    ]
}

fn what_is_in_the_mesh() -> Vec<Case> {
    let sound = cube();
    let all = |parts: &[Vec<Facet>]| binary(&parts.concat());
    let point = vec![[[1.0; 3]; 3]; 20];
    let flat: Vec<Facet> = cube().iter().map(|f| f.map(|[x, y, _]| [x, y, 0.0])).collect();
    let scaled =
        |s: f32| binary(&cube().iter().map(|f| f.map(|c| c.map(|x| x * s))).collect::<Vec<_>>());
    let moved =
        |d: f32| cube().iter().map(|f| f.map(|[x, y, z]| [x + d, y, z])).collect::<Vec<_>>();
    vec![
        ("one corner a quintillion away", with(1e30), Refused("OutOfEnvelope", 5)),
        ("the largest numbers", scaled(3e37), Refused("OutOfEnvelope", 5)),
        ("the smallest numbers", scaled(1e-40), Refused("NothingToPrint", 5)),
        ("in metres", scaled(0.001), Refused("NothingToPrint", 5)),
        (
            "a needle of a kilometre",
            binary(&block([0.0; 3], [1e6, 1.0, 1.0])),
            Refused("OutOfEnvelope", 5),
        ),
        ("points only", binary(&point), Refused("NoVolume", 5)),
        ("flat", binary(&flat), Refused("NoVolume", 5)),
        ("a facet alone", binary(&sound[..1]), Refused("NoVolume", 5)),
        ("far from the origin", binary(&moved(10_000.0)), Printed(1000.0)),
        ("inside out", binary(&turned(&sound)), Printed(1000.0)),
        ("one facet turned", all(&[turned(&sound[..1]), sound[1..].to_vec()]), Printed(1000.0)),
        ("one facet missing", binary(&sound[1..]), Printed(1000.0)),
        ("a side missing", binary(&sound[2..]), Printed(1000.0)),
        ("a facet twice", all(&[sound.clone(), sound[..1].to_vec()]), Printed(1000.0)),
        ("everything twice", all(&[sound.clone(), sound.clone()]), Printed(1000.0)),
        ("a facet without area", all(&[sound.clone(), point]), Printed(1000.0)),
        ("two that overlap", all(&[sound.clone(), moved(5.0)]), Printed(1500.0)),
        ("two that touch", all(&[sound.clone(), moved(10.0)]), Printed(2000.0)),
        ("one within another", all(&[sound.clone(), block([3.0; 3], [7.0; 3])]), Printed(1000.0)),
        ("a hollow", all(&[sound, turned(&block([3.0; 3], [7.0; 3]))]), Printed(936.0)),
    ]
}

/// Share by which a print may miss the volume: a small cube's rounded corners.
const SHARE: f64 = 0.03;

fn is_as_expected(ran: &Ran, ends: &Ends) -> bool {
    match ends {
        Refused(class, status) => {
            ran.err.starts_with(&format!("error[{class}]: ")) && ran.code == Some(*status)
        }
        Printed(volume) => {
            let Ok(report) = serde_json::from_str::<serde_json::Value>(&ran.out) else {
                return false;
            };
            let laid = report["print"]["part_mm3"].as_f64().unwrap();
            matches!(ran.code, Some(0 | 1)) && (laid / volume - 1.0).abs() < SHARE
        }
    }
}

fn every(cases: Vec<Case>) {
    let count = cases.len();
    let solid = ["--set", "fill_density=1", "--set", "skirts=0", "--orient", "keep"];
    let mut faults = Vec::new();
    for (name, bytes, ends) in cases {
        let scratch = Scratch::new();
        scratch.file("it.stl", bytes);
        let ran = scratch
            .run(&[["slice", "it.stl", "-o", "x.gcode", "--json"].as_slice(), &solid].concat());
        if !is_as_expected(&ran, &ends) {
            let volume = ran.out.lines().find(|line| line.contains("part_mm3"));
            faults.push(format!("{name}: {:?} {} {volume:?}", ran.code, ran.err));
        }
        let named = ran.err.is_empty() || ran.err.contains("it.stl");
        if !named || ran.err.len() > 4096 {
            faults.push(format!("{name}: {}", ran.err));
        }
        let left: &[&str] = if ran.err.is_empty() { &["it.stl", "x.gcode"] } else { &["it.stl"] };
        if scratch.names() != left {
            faults.push(format!("{name} leaves {:?}", scratch.names()));
        }
    }
    assert!(faults.is_empty(), "{} of {count}:\n{}", faults.len(), faults.join("\n"));
}

#[test]
fn broken_bytes_are_told_by_class_and_name_and_sound_ones_are_printed() {
    every(what_is_in_the_bytes());
}

#[test]
fn text_is_read_as_people_write_it_and_faults_are_told_by_line() {
    every(what_is_in_the_text());
}

#[test]
fn meshes_are_mended_or_refused_and_printed_in_their_volume() {
    every(what_is_in_the_mesh());
}

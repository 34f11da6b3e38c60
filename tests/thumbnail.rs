//! The small pictures at the head of every program, read as a print server reads them.

use std::io::Cursor;

use crate::run::{Scratch, model, sliced};

/// Side and pixels (opacity last) of each thumbnail.
fn thumbnails(program: &str) -> Vec<(usize, Vec<[u8; 4]>)> {
    let mut found = Vec::new();
    let mut lines = program.lines();
    while let Some(line) = lines.next() {
        let Some(words) = line.strip_prefix("; thumbnail begin ") else { continue };
        let (size, length) = words.split_once(' ').unwrap();
        let (width, height) = size.split_once('x').unwrap();
        assert_eq!(width, height);
        let letters: Vec<&str> = lines
            .by_ref()
            .take_while(|line| *line != "; thumbnail end")
            .map(|line| line.strip_prefix("; ").unwrap())
            .collect();
        let (last, full) = letters.split_last().unwrap();
        assert!(full.iter().all(|line| line.len() == 78) && (1..=78).contains(&last.len()));
        let letters = letters.concat();
        assert_eq!(letters.len(), length.parse::<usize>().unwrap());
        let (side, pixels) = decoded(&bytes(&letters));
        assert_eq!(side.to_string(), width);
        found.push((side, pixels));
    }
    found
}

fn bytes(letters: &str) -> Vec<u8> {
    let value = |c: u8| match c {
        b'A'..=b'Z' => c - b'A',
        b'a'..=b'z' => c - b'a' + 26,
        b'0'..=b'9' => c - b'0' + 52,
        b'+' => 62,
        b'/' => 63,
        other => panic!("{} is no letter of base64", char::from(other)),
    };
    let mut bytes = Vec::new();
    for four in letters.as_bytes().chunks(4) {
        assert_eq!(four.len(), 4);
        let known = four.iter().take_while(|c| **c != b'=').count();
        let bits = four[..known].iter().fold(0, |bits, c| bits << 6 | u32::from(value(*c)));
        bytes.extend(&(bits << (6 * (4 - known))).to_be_bytes()[1..known]);
    }
    bytes
}

fn decoded(bytes: &[u8]) -> (usize, Vec<[u8; 4]>) {
    let mut decoder = png::Decoder::new(Cursor::new(bytes));
    decoder.set_transformations(png::Transformations::EXPAND);
    let mut reader = decoder.read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    let width = reader.next_frame(&mut pixels).unwrap().width as usize;
    (width, pixels.chunks_exact(4).map(|pixel| pixel.try_into().unwrap()).collect())
}

#[test]
fn two_thumbnails_show_the_part() {
    let program = sliced("mushroom", &["--set", "layer_height_mm=0.3", "--layers", "conical"]);
    let found = thumbnails(&program);
    assert_eq!(found.iter().map(|(side, _)| *side).collect::<Vec<_>>(), [32, 300]);
    for (side, pixels) in found {
        let opaque = pixels.iter().filter(|pixel| pixel[3] == 255).count();
        let share = opaque as f64 / pixels.len() as f64;
        assert!((0.2..0.8).contains(&share), "{side}: {share}");
        let mut lights: Vec<u8> = pixels.iter().filter(|p| p[3] == 255).map(|p| p[1]).collect();
        lights.sort_unstable();
        assert!(lights[lights.len() - 1] - lights[0] > 60, "{side}: a part has lit and dark sides");
    }
    // Where print servers look for it, and short of what they skip.
    let (head, _) = program.split_once("; thumbnail end").unwrap();
    assert!(head.len() < 10_000);
    assert!(program.find(";LAYER:0").unwrap() < 100_000);
}

#[test]
fn the_same_part_turned_has_the_same_thumbnails() {
    let scratch = Scratch::new();
    let file = model("steps");
    let run = |orient: &str| {
        let arguments = ["slice", file.to_str().unwrap(), "-q", "-o", "-", "--orient", orient];
        scratch.run(&arguments).expect(0).out
    };
    let (straight, turned) = (thumbnails(&run("0,0,0")), thumbnails(&run("0,0,90")));
    assert!(straight == turned);
}

//! Reads OBJ (Wavefront, *Object Files*, appendix B1 of the Advanced Visualizer's manual): vertices
//! and polygons, of all objects and groups together. Polygons are cut into triangles from their first
//! corner. Curves, normals, textures and materials are passed over; no other file is opened.

use super::{Given, ModelError, facet, shown};
use crate::soup::Soup;
use crate::stl::without_mark;

pub(super) fn read(bytes: &[u8]) -> Result<Given, ModelError> {
    if bytes.contains(&0) {
        let what = "the file holds zero bytes: it is no text of one byte a character";
        return Err(ModelError::Malformed { format: "OBJ", what: what.to_owned() });
    }
    let mut vertices: Vec<[f64; 3]> = Vec::new();
    let mut soup = Soup::default();
    let mut corners = Vec::new();
    // A mark before the first line would hide its vertex, and all faces would take the wrong corners.
    let mut lines = Lines { rest: without_mark(bytes), number: 0 };
    let mut long = Vec::new();
    while let Some((number, line)) = lines.next_whole(&mut long) {
        let mut words = line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty());
        match words.next() {
            Some(b"v") => vertices.push(vertex(number, &mut words)?),
            Some(b"f") => {
                corners.clear();
                for word in words {
                    corners.push(vertices[index(number, word, vertices.len())?]);
                }
                if corners.len() < 3 {
                    return Err(syntax(number, "a face of three corners", line));
                }
                for pair in corners[1..].windows(2) {
                    let place = || format!("line {number}");
                    soup.facets.push(facet([corners[0], pair[0], pair[1]], place)?);
                }
            }
            _ => {}
        }
    }
    if vertices.is_empty() && soup.facets.is_empty() && !bytes.trim_ascii_start().starts_with(b"#")
    {
        let what = "there is neither a vertex nor a face in it".to_owned();
        return Err(ModelError::Malformed { format: "OBJ", what });
    }
    Ok(Given { objects: super::alone(&soup), soup, notes: Vec::new() })
}

/// The lines of a text, without comments.
struct Lines<'a> {
    rest: &'a [u8],
    number: usize,
}

impl<'a> Lines<'a> {
    fn next(&mut self) -> Option<&'a [u8]> {
        if self.rest.is_empty() {
            return None;
        }
        self.number += 1;
        let end = self.rest.iter().position(|b| *b == b'\n').unwrap_or(self.rest.len());
        let line = &self.rest[..end];
        self.rest = &self.rest[(end + 1).min(self.rest.len())..];
        let end = line.iter().position(|b| *b == b'#').unwrap_or(line.len());
        Some(line[..end].trim_ascii_end())
    }

    /// The next line with its number, and those that a backslash at its end joins to it.
    fn next_whole<'b>(&mut self, long: &'b mut Vec<u8>) -> Option<(usize, &'b [u8])>
    where
        'a: 'b,
    {
        let mut line = self.next()?;
        let number = self.number;
        if !line.ends_with(b"\\") {
            return Some((number, line));
        }
        long.clear();
        while let Some(start) = line.strip_suffix(b"\\") {
            long.extend(start.iter().chain(b" "));
            line = self.next().unwrap_or_default();
        }
        long.extend(line);
        Some((number, long))
    }
}

/// A position; a weight or a colour may follow it.
fn vertex<'a>(
    line: usize,
    words: &mut impl Iterator<Item = &'a [u8]>,
) -> Result<[f64; 3], ModelError> {
    let mut position = [0.0; 3];
    for c in &mut position {
        let word = words.next().ok_or_else(|| syntax(line, "three coordinates", b"less"))?;
        let number = std::str::from_utf8(word).ok().and_then(|word| word.parse::<f64>().ok());
        let number = number.ok_or_else(|| syntax(line, "a number", word))?;
        if !number.is_finite() {
            return Err(ModelError::NotFinite {
                place: format!("line {line}"),
                value: shown(word),
            });
        }
        *c = number;
    }
    Ok(position)
}

/// The vertex of a corner `v`, `v/t`, `v//n` or `v/t/n`: from 1, or backwards from −1.
fn index(line: usize, word: &[u8], count: usize) -> Result<usize, ModelError> {
    let end = word.iter().position(|b| *b == b'/').unwrap_or(word.len());
    let number = std::str::from_utf8(&word[..end]).ok().and_then(|word| word.parse::<i64>().ok());
    let number = number.ok_or_else(|| syntax(line, "the number of a vertex", word))?;
    let index = if number > 0 { Some(number - 1) } else { number.checked_add(count as i64) };
    let index = index.filter(|index| number != 0 && (0..count as i64).contains(index));
    index.map(|index| index as usize).ok_or_else(|| ModelError::Malformed {
        format: "OBJ",
        what: format!("line {line}: a corner is vertex {number}, of {count} so far"),
    })
}

fn syntax(line: usize, expected: &str, found: &[u8]) -> ModelError {
    let what = format!("line {line}: expected {expected}, found '{}'", shown(found));
    ModelError::Malformed { format: "OBJ", what }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vertices_and_polygons_are_read() {
        let text = b"# from somewhere\r\nmtllib x.mtl\no part\r\nv 0 0 0 1 0 0\nv 2 0 0\nv 2 2 0\n\
            v 0 2 0\nvn 0 0 1\nvt 0 0\ng side\nusemtl red\nf 1/1 2/1 \\\n 3/1/1 4//1 # a square\n\
            v 0 0 1e1\nf -1 -2 -5\nl 1 2\n";
        let given = read(text).unwrap();
        assert_eq!(
            given.soup.facets,
            [
                [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 2.0, 0.0]],
                [[0.0, 0.0, 0.0], [2.0, 2.0, 0.0], [0.0, 2.0, 0.0]],
                [[0.0, 0.0, 10.0], [0.0, 2.0, 0.0], [0.0, 0.0, 0.0]],
            ]
        );
    }

    #[test]
    fn a_mark_before_the_text_hides_no_vertex() {
        let text = "v 0 0 0\r\nv 1 0 0\r\nv 0 1 0\r\nv 5 5 5\r\nf 1 2 3\r\n";
        let plain = read(text.as_bytes()).unwrap().soup.facets;
        assert_eq!(plain, [[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]]);
        assert_eq!(read(format!("\u{feff}{text}").as_bytes()).unwrap().soup.facets, plain);
    }

    #[test]
    fn faults_name_their_line() {
        let start = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
        let cases = [
            ("f 1 2 4\n", "WrongFormat"),
            ("f 0 1 2\n", "WrongFormat"),
            ("f -4 1 2\n", "WrongFormat"),
            ("f 1 2 -9223372036854775808\n", "WrongFormat"),
            ("f 1 2\n", "WrongFormat"),
            ("f 1 2 x\n", "WrongFormat"),
            ("v 1 2\n", "WrongFormat"),
            ("v 1 2,5 3\n", "WrongFormat"),
            ("v 1 nan 3\n", "NotFinite"),
            ("v 1 1e999 3\n", "NotFinite"),
        ];
        for (line, class) in cases {
            let error = read(format!("{start}{line}").as_bytes()).unwrap_err();
            assert_eq!(error.class(), class, "{line}");
            assert!(error.to_string().contains("line 4"), "{error}");
        }
        let far = format!("{start}v 1e39 0 0\nf 1 2 4\n");
        assert_eq!(read(far.as_bytes()).unwrap_err().class(), "NumberRange");
        assert!(read(b"solid x\n").is_err() && read(b"v\x00 \x00").is_err());
    }
}

//! Reads ASCII STL as words of bytes: no lines, no character set.
//!
//! Line ends of any kind, no line ends at all, any case, several solids in a file and text after
//! `endloop` and `endfacet` are all accepted, because programs write them. A missing keyword or
//! number is not: the facet would be a guess. Numbers must match
//! `[+-]? (digits [. digits?] | . digits) ([eE] [+-]? digits)?` before they are converted, so that
//! neither `nan` nor `1,5` nor `0x1p4` slips through the converter of the standard library.

use super::classify::{is_space, without_mark};
use super::error::{Place, StlError};
use super::{Format, ReadReport, contradicts, normals_note, printable, tidy};
use crate::note::{self, Note};
use crate::soup::{Facet, Soup};
use std::ops::Range;

/// Reads an ASCII STL.
pub(super) fn read(bytes: &[u8]) -> Result<(Soup, ReadReport), StlError> {
    let mut parser = Parser::new(bytes);
    let mut found = Found::default();
    while let Some(word) = parser.peek() {
        if parser.is(&word, b"solid") {
            found.ended = false;
            parser.advance(&word);
            let name = parser.rest_of_line(&word, &mut found.name_was_odd);
            let more = parser.skip_to_keyword();
            found.name_was_odd |= more > 0;
            found.name.get_or_insert(name);
        } else if parser.is(&word, b"endsolid") {
            found.ended = true;
            parser.advance(&word);
            parser.rest_of_line(&word, &mut false);
            parser.skip_to_keyword();
        } else {
            parser.facet(&mut found)?;
        }
    }
    found.report()
}

/// What has been read so far.
#[derive(Default)]
struct Found {
    facets: Vec<Facet>,
    name: Option<String>,
    name_was_odd: bool,
    ended: bool,
    n_contradicting: usize,
    first_contradicting: usize,
}

impl Found {
    fn report(self) -> Result<(Soup, ReadReport), StlError> {
        if self.facets.is_empty() {
            return Err(StlError::NoTriangles);
        }
        let mut notes = Vec::new();
        if self.name_was_odd {
            let message = "the name of the solid held line ends or control characters; they are \
                           not passed on";
            notes.push(Note::new(note::NAME_SANITIZED, message.to_owned()));
        }
        if !self.ended {
            let message = format!(
                "the file ends without 'endsolid' after {} whole facets; all are used",
                self.facets.len()
            );
            notes.push(Note::new(note::MISSING_ENDSOLID, message));
        }
        notes.extend(normals_note(self.n_contradicting, self.first_contradicting));
        let name = self.name.unwrap_or_default();
        let facets = self.facets.len();
        let report = ReadReport { format: Format::Ascii, name, facets, notes };
        Ok((Soup { facets: self.facets }, report))
    }
}

/// Words that skipping stops at.
const KEYWORDS: [&[u8]; 7] =
    [b"facet", b"endfacet", b"outer", b"endloop", b"vertex", b"solid", b"endsolid"];

struct Parser<'a> {
    bytes: &'a [u8],
    /// Bytes before `bytes` in the file: the byte order mark.
    n_mark: usize,
    at: usize,
}

/// The place of a word.
type Word = Range<usize>;

impl<'a> Parser<'a> {
    fn new(file: &'a [u8]) -> Self {
        let bytes = without_mark(file);
        Self { bytes, n_mark: file.len() - bytes.len(), at: 0 }
    }

    /// Returns the next word without passing it.
    fn peek(&self) -> Option<Word> {
        self.word_from(self.at)
    }

    fn word_from(&self, at: usize) -> Option<Word> {
        let rest = self.bytes.get(at..)?;
        let start = at + rest.iter().position(|b| !is_space(*b))?;
        let n = self.bytes[start..].iter().position(|b| is_space(*b));
        Some(start..n.map_or(self.bytes.len(), |n| start + n))
    }

    fn advance(&mut self, word: &Word) {
        self.at = word.end;
    }

    fn is(&self, word: &Word, keyword: &[u8]) -> bool {
        self.bytes[word.clone()].eq_ignore_ascii_case(keyword)
    }

    /// Passes one of the words that a facet must have.
    fn need(&mut self, keyword: &[u8], expected: &'static str) -> Result<(), StlError> {
        match self.peek() {
            Some(word) if self.is(&word, keyword) => {
                self.advance(&word);
                Ok(())
            }
            word => Err(self.unexpected(word, expected)),
        }
    }

    /// Reads `facet normal … endfacet`.
    fn facet(&mut self, found: &mut Found) -> Result<(), StlError> {
        self.need(b"facet", "'facet'")?;
        self.need(b"normal", "'normal'")?;
        let normal = self.normal();
        self.need(b"outer", "'outer'")?;
        self.need(b"loop", "'loop'")?;
        let number = found.facets.len() + 1;
        let mut facet = [[0.0; 3]; 3];
        for (k, corner) in facet.iter_mut().enumerate() {
            self.need(b"vertex", "'vertex'")?;
            for c in corner {
                *c = self.coordinate(number, k + 1)?;
            }
        }
        self.need(b"endloop", "'endloop'")?;
        self.skip_to_keyword();
        self.need(b"endfacet", "'endfacet'")?;
        self.skip_to_keyword();
        if contradicts(normal, &facet) {
            if found.n_contradicting == 0 {
                found.first_contradicting = number;
            }
            found.n_contradicting += 1;
        }
        found.facets.push(facet);
        Ok(())
    }

    /// Reads what stands for a normal; whatever is no number is NaN, which is reported.
    fn normal(&mut self) -> [f32; 3] {
        let mut normal = [0.0; 3];
        for c in &mut normal {
            let Some(word) = self.peek() else { break };
            if self.is(&word, b"outer") {
                break;
            }
            let text = &self.bytes[word.clone()];
            *c = if is_number(text) { convert(text) as f32 } else { f32::NAN };
            self.advance(&word);
        }
        normal
    }

    fn coordinate(&mut self, facet: usize, corner: usize) -> Result<f32, StlError> {
        let Some(word) = self.peek() else {
            return Err(self.unexpected(None, "a number"));
        };
        let text = &self.bytes[word.clone()];
        if !is_number(text) {
            if is_named_nonsense(text) {
                let place = Place::Line(self.line(word.start));
                let value = shortened(text);
                return Err(StlError::NotFinite { facet, corner, value, place });
            }
            return Err(self.unexpected(Some(word), "a number"));
        }
        let value = convert(text);
        if value.abs() > f64::from(f32::MAX) {
            return Err(StlError::NumberRange {
                line: self.line(word.start),
                offset: self.n_mark + word.start,
                found: shortened(text),
            });
        }
        self.advance(&word);
        Ok(tidy(value as f32))
    }

    /// Passes the rest of the line that `after` stands on and returns it as a name; in a file of
    /// one line, passes the words before the next keyword.
    fn rest_of_line(&mut self, after: &Word, odd: &mut bool) -> String {
        let is_end = |b: &u8| *b == b'\n' || *b == b'\r';
        let line_end = self.bytes[after.end..].iter().position(is_end);
        let end = line_end.map_or(self.bytes.len(), |n| after.end + n);
        let mut name = Vec::new();
        while let Some(word) = self.peek() {
            let opens_facet = self.is(&word, b"facet")
                && self.word_from(word.end).is_some_and(|next| self.is(&next, b"normal"));
            let last_line = line_end.is_none();
            let is_frame = self.is(&word, b"endsolid") || self.is(&word, b"solid");
            if word.start >= end || opens_facet || (last_line && is_frame) {
                break;
            }
            let text = &self.bytes[word.clone()];
            *odd |= text.iter().any(|b| *b < 32);
            if name.len() < super::NAME_LENGTH {
                name.extend_from_slice(&text[..text.len().min(super::NAME_LENGTH)]);
                name.push(b' ');
            }
            self.advance(&word);
        }
        printable(name.trim_ascii())
    }

    /// Passes words that are no keywords and returns how many.
    fn skip_to_keyword(&mut self) -> usize {
        let mut n = 0;
        while let Some(word) = self.peek() {
            if KEYWORDS.iter().any(|k| self.is(&word, k)) {
                break;
            }
            self.advance(&word);
            n += 1;
        }
        n
    }

    /// The line of a byte, from 1; CR, LF and CRLF each end one.
    fn line(&self, at: usize) -> usize {
        let before = &self.bytes[..at.min(self.bytes.len())];
        let n_lf = before.iter().filter(|b| **b == b'\n').count();
        let lone_cr = |(i, b): (usize, &u8)| *b == b'\r' && self.bytes.get(i + 1) != Some(&b'\n');
        let n_cr = before.iter().enumerate().filter(|(i, b)| lone_cr((*i, b))).count();
        1 + n_lf + n_cr
    }

    fn unexpected(&self, word: Option<Word>, expected: &'static str) -> StlError {
        let at = word.as_ref().map_or(self.bytes.len(), |w| w.start);
        let found = match word {
            None => "the end of the file".to_owned(),
            Some(word) => {
                let text = &self.bytes[word];
                let digits = |part: &[u8]| part.iter().any(u8::is_ascii_digit);
                let comma = text.iter().position(|b| *b == b',');
                match comma {
                    Some(k) if digits(&text[..k]) && digits(&text[k..]) => {
                        format!("'{}' (a decimal comma)", shortened(text))
                    }
                    _ => format!("'{}'", shortened(text)),
                }
            }
        };
        StlError::AsciiSyntax { line: self.line(at), offset: self.n_mark + at, expected, found }
    }
}

/// Whether the whole of `text` is a decimal number.
fn is_number(text: &[u8]) -> bool {
    let digits = |text: &[u8]| text.iter().take_while(|b| b.is_ascii_digit()).count();
    let unsigned = |text: &[u8]| usize::from(text.first().is_some_and(|b| b"+-".contains(b)));
    let mut rest = &text[unsigned(text)..];
    let n_whole = digits(rest);
    rest = &rest[n_whole..];
    let mut n_digits = n_whole;
    if let Some(fraction) = rest.strip_prefix(b".") {
        let n = digits(fraction);
        n_digits += n;
        rest = &fraction[n..];
    }
    if n_digits == 0 {
        return false;
    }
    let Some(exponent) = rest.strip_prefix(b"e").or_else(|| rest.strip_prefix(b"E")) else {
        return rest.is_empty();
    };
    let exponent = &exponent[unsigned(exponent)..];
    !exponent.is_empty() && digits(exponent) == exponent.len()
}

/// Converts what [`is_number`] has accepted; too large becomes infinite.
fn convert(number: &[u8]) -> f64 {
    std::str::from_utf8(number).ok().and_then(|t| t.parse().ok()).unwrap_or(f64::INFINITY)
}

/// Whether a word is how some program writes NaN or infinity.
fn is_named_nonsense(text: &[u8]) -> bool {
    let unsigned = match text.first() {
        Some(b'+' | b'-') => &text[1..],
        _ => text,
    };
    let lower = unsigned.to_ascii_lowercase();
    let stem = match lower.iter().position(|b| *b == b'(') {
        Some(k) if lower.ends_with(b")") => &lower[..k],
        _ => &lower[..],
    };
    matches!(stem, b"nan" | b"inf" | b"infinity")
}

/// The first characters of a word, fit to print.
fn shortened(text: &[u8]) -> String {
    const LENGTH: usize = 20;
    let start = printable(&text[..text.len().min(LENGTH)]);
    if text.len() > LENGTH { format!("{start}… ({} bytes)", text.len()) } else { start }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stl;

    const FACET: &str = "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 \
                         0\nendloop\nendfacet\n";

    /// Facets read and the codes of the notes, or the class of the error.
    fn outcome(text: &str) -> Result<(usize, Vec<&'static str>), &'static str> {
        let (soup, report) = stl::read(text.as_bytes()).map_err(|e| e.class())?;
        assert_eq!(report.format, Format::Ascii);
        Ok((soup.facets.len(), report.notes.iter().map(|n| n.code).collect()))
    }

    fn name(text: &str) -> String {
        stl::read(text.as_bytes()).unwrap().1.name
    }

    #[test]
    fn every_layout_is_the_same_file() {
        let file = format!("solid a part\n{FACET}{FACET}endsolid a part\n");
        for text in [
            file.clone(),
            file.replace('\n', "\r\n"),
            file.replace('\n', "\r"),
            file.replace('\n', " "),
            file.replace(' ', "\t"),
            file.to_uppercase(),
            format!("\u{feff}  \n{file}"),
            file.replace("solid a part", "solid"),
            file.replace("endloop", "endloop ; 3").replace("endfacet", "endfacet # x"),
        ] {
            assert_eq!(outcome(&text), Ok((2, vec![])), "{text}");
        }
        assert_eq!(outcome(&format!("{file}{file}")), Ok((4, vec![])));
        assert_eq!(name(&file), "a part");
        assert_eq!(name(&file.replace('\n', " ")), "a part");
        assert_eq!(name(&file.replace("part", "p\u{e4}rt")), "a p??rt");
    }

    #[test]
    fn notes() {
        assert_eq!(outcome(&format!("solid\n{FACET}")), Ok((1, vec![note::MISSING_ENDSOLID])));
        let odd = format!("solid x\rM104 S999\r;\n{FACET}endsolid");
        assert_eq!(outcome(&odd), Ok((1, vec![note::NAME_SANITIZED])));
        assert_eq!(name(&odd), "x");
        for normal in ["nan 0 1", "0 0 -1", "0 0 x", "0 1e99 0"] {
            let text = format!("solid\n{FACET}endsolid")
                .replace("0 0 1\nouter", &format!("{normal}\nouter"));
            assert_eq!(outcome(&text), Ok((1, vec![note::NORMALS_IGNORED])), "{normal}");
        }
        let short = format!("solid\n{FACET}endsolid").replace("0 0 1\nouter", "\nouter");
        assert_eq!(outcome(&short), Ok((1, vec![])));
    }

    #[test]
    fn broken_grammar_is_refused_with_its_line() {
        let file = format!("solid a\r\n{}endsolid a\r\n", FACET.replace('\n', "\r\n"));
        let line = |text: &str| match stl::read(text.as_bytes()) {
            Err(StlError::AsciiSyntax { line, .. }) => line,
            other => panic!("{other:?}"),
        };
        assert_eq!(line(&file.replace("endloop\r\n", "")), 7);
        assert_eq!(line(&file.replace("endfacet\r\n", "")), 8);
        assert_eq!(line(&file.replace("vertex 0 1 0\r\n", "")), 6);
        assert_eq!(line(&file.replace("1 0 0\r\n", "1 0\r\n")), 6);
        assert_eq!(line(&file.replace("1 0 0", "1 0 0x1p3")), 5);
        assert_eq!(line(&file.replace("1 0 0", "1,0 0 0")), 5);
        assert_eq!(line(&file[..80]), 6);
    }

    #[test]
    fn numbers() {
        for good in ["1", "-1.5", "+.5", "5.", "1e5", "1.E+05", "0e0", "007"] {
            assert!(is_number(good.as_bytes()), "{good}");
        }
        for bad in
            ["", "+", ".", "e5", "1e", "1e+", "1,5", "0x10", "1.0f", "nan", "1_0", "--1", "1 "]
        {
            assert!(!is_number(bad.as_bytes()), "{bad}");
        }
        for nonsense in ["nan", "-NaN", "inf", "+Infinity", "-nan(ind)"] {
            assert!(is_named_nonsense(nonsense.as_bytes()), "{nonsense}");
        }
        assert!(!is_named_nonsense(b"-1.#IND"));
        let file = format!("solid\n{FACET}endsolid");
        assert_eq!(outcome(&file.replace("1 0 0", "1 nan 0")), Err("NotFinite"));
        assert_eq!(outcome(&file.replace("1 0 0", "1 1e39 0")), Err("NumberRange"));
        assert_eq!(
            outcome(&file.replace("1 0 0", &format!("1 {} 0", "2".repeat(1 << 20)))),
            Err("NumberRange")
        );
        assert_eq!(
            outcome(&file.replace("1 0 0", &format!("1 0.{} 0", "3".repeat(400)))),
            Ok((1, vec![]))
        );
    }

    #[test]
    fn long_names_and_long_words_make_short_messages() {
        assert_eq!(name(&format!("solid {}\n{FACET}endsolid", "A".repeat(1 << 20))).len(), 60);
        let error = stl::read(format!("solid\n{}", "B".repeat(1 << 20)).as_bytes());
        assert!(error.is_err());
        let file = format!("solid\n{FACET}{}", "C".repeat(1 << 20));
        assert_eq!(outcome(&file), Ok((1, vec![note::MISSING_ENDSOLID])));
        let file =
            format!("solid\n{}", FACET.replace("1 0 0", &format!("1 {} 0", "D".repeat(1 << 20))));
        assert!(stl::read(file.as_bytes()).unwrap_err().to_string().len() < 200);
    }
}

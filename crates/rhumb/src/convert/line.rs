//! A source, line by line, whatever its bytes are: what is no program is named, lines end with CR, LF
//! or both, and none is kept longer than anybody reads.

use std::borrow::Cow;
use std::io::{BufRead, ErrorKind};

use crate::failure::Failure;

/// Longest line of a source, bytes. Of a longer one, what follows is left out if it is a comment.
const LONGEST_LINE: usize = 1 << 20;

/// How much of the begin of a source tells whether it is text, bytes.
const BEGIN: usize = 4096;

/// Share of control characters from which bytes are no text.
const MOST_CONTROLS: f64 = 0.02;

/// A line of a source.
#[derive(Debug, Default)]
pub(super) struct Line {
    bytes: Vec<u8>,
    /// Counted from 1.
    number: usize,
    /// Whether the line before ended with CR, so that a LF that comes now belongs to it.
    after_cr: bool,
}

impl Line {
    /// Reads the next line; returns whether there is one.
    pub(super) fn read(&mut self, source: &mut impl BufRead, name: &str) -> Result<bool, Failure> {
        self.bytes.clear();
        let (mut has_begun, mut is_cut) = (false, false);
        loop {
            let buffer = fill(source, name)?;
            if buffer.is_empty() {
                break;
            }
            if std::mem::take(&mut self.after_cr) && buffer[0] == b'\n' {
                source.consume(1);
                continue;
            }
            has_begun = true;
            let end = buffer.iter().position(|&byte| byte == b'\n' || byte == b'\r');
            let piece = &buffer[..end.unwrap_or(buffer.len())];
            let kept = piece.len().min(LONGEST_LINE - self.bytes.len());
            self.bytes.extend_from_slice(&piece[..kept]);
            is_cut |= kept < piece.len();
            self.after_cr = end.is_some_and(|end| buffer[end] == b'\r');
            let read = piece.len() + usize::from(end.is_some());
            source.consume(read);
            if end.is_some() {
                break;
            }
        }
        self.number += usize::from(has_begun);
        if is_cut && !self.bytes.contains(&b';') {
            let number = self.number;
            let message = format!("{name}, line {number} is longer than {LONGEST_LINE} bytes");
            return Err(Failure::new("GcodeSyntax", message));
        }
        Ok(has_begun)
    }

    pub(super) fn text(&self) -> Cow<'_, str> {
        String::from_utf8_lossy(&self.bytes)
    }

    pub(super) fn number(&self) -> usize {
        self.number
    }
}

fn fill<'a>(source: &'a mut impl BufRead, name: &str) -> Result<&'a [u8], Failure> {
    loop {
        match source.fill_buf() {
            Ok(_) => break,
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            Err(error) => return Err(unreadable(name, &error)),
        }
    }
    source.fill_buf().map_err(|error| unreadable(name, &error))
}

fn unreadable(name: &str, error: &std::io::Error) -> Failure {
    Failure::new("Unreadable", format!("{name}: {error}"))
}

/// Looks at the begin of a source.
///
/// # Errors
///
/// `EmptyFile`, `WrongFormat`, `Encoding` or `GcodeSyntax` for what is no program.
pub(super) fn begin(source: &mut impl BufRead, name: &str) -> Result<(), Failure> {
    let bytes = fill(source, name)?;
    refusal(&bytes[..bytes.len().min(BEGIN)], name).map_or(Ok(()), Err)
}

fn refusal(begin: &[u8], name: &str) -> Option<Failure> {
    let no_program = |class, what: &str| Failure::new(class, format!("{name} {what}"));
    let wrong = |what: &str| no_program("WrongFormat", what);
    if begin.is_empty() {
        return Some(no_program("EmptyFile", "is empty"));
    }
    if begin.starts_with(b"GCDE") {
        let hint = "export it as text: \"Supports binary G-code\" in the printer settings, off";
        return Some(wrong("is binary G-code").hint(hint));
    }
    if begin.starts_with(b"PK\x03\x04") {
        let hint = "unpack the .gcode that lies in it (Metadata/plate_1.gcode)";
        return Some(wrong("is a ZIP or 3MF archive, not a program").hint(hint));
    }
    if begin.starts_with(b"\x1f\x8b") {
        return Some(wrong("is packed by gzip").hint("unpack it first"));
    }
    if begin.starts_with(b"\xff\xfe") || begin.starts_with(b"\xfe\xff") {
        let hint = "save it as UTF-8 or ASCII";
        return Some(no_program("Encoding", "is UTF-16 text").hint(hint));
    }
    // Terminals are told their colours by ESC, which some put into messages.
    let is_control = |byte: &&u8| matches!(byte, 0..=8 | 14..=26 | 28..=31 | 127);
    let controls = begin.iter().filter(is_control).count();
    (controls as f64 > MOST_CONTROLS * begin.len() as f64)
        .then(|| no_program("GcodeSyntax", "is binary data, not a program"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::BufReader;

    fn lines(bytes: &[u8], buffer: usize) -> Vec<(usize, String)> {
        let mut source = BufReader::with_capacity(buffer, bytes);
        let (mut line, mut all) = (Line::default(), Vec::new());
        while line.read(&mut source, "x").unwrap() {
            all.push((line.number(), line.text().into_owned()));
        }
        all
    }

    #[test]
    fn any_line_end_counts_once_for_any_buffer() {
        for end in ["\n", "\r\n", "\r"] {
            let text = ["G28", "", "G1 X1", "M84"].join(end);
            for (text, n) in [(text.clone(), 4), (text + end, 4)] {
                for buffer in 1..12 {
                    let read = lines(text.as_bytes(), buffer);
                    assert_eq!(read.len(), n, "{end:?} {buffer}: {read:?}");
                    assert_eq!(read[3], (4, "M84".to_owned()));
                    assert_eq!(read[1].1, "");
                }
            }
        }
        assert!(lines(b"", 8).is_empty());
    }

    #[test]
    fn endless_lines_are_refused_and_endless_comments_cut() {
        let long = "x".repeat(3 * LONGEST_LINE);
        let comment = lines(format!("G1 X5 ;{long}\nG28\n").as_bytes(), 4096);
        assert_eq!((comment.len(), comment[0].1.len()), (2, LONGEST_LINE));
        let mut source = long.as_bytes();
        let failure = Line::default().read(&mut source, "x").unwrap_err();
        assert_eq!(failure.class(), "GcodeSyntax");
    }

    #[test]
    fn what_is_no_program_is_named() {
        let class = |bytes: &[u8]| begin(&mut &*bytes, "x").map_err(|failure| failure.class());
        assert_eq!(class(b""), Err("EmptyFile"));
        assert_eq!(class(b"GCDE\x01\0\0\0"), Err("WrongFormat"));
        assert_eq!(class(b"PK\x03\x04..."), Err("WrongFormat"));
        assert_eq!(class(b"\xff\xfeG\x001\0"), Err("Encoding"));
        assert_eq!(class(&[7; 100]), Err("GcodeSyntax"));
        assert_eq!(class("; Gerät\nM117 \u{1b}[1mhot\nG28\n".as_bytes()), Ok(()));
    }
}

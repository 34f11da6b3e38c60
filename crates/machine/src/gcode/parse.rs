//! One line of a program, read back.
//!
//! Takes what firmwares take: spaces anywhere between words, lower case, line numbers and
//! checksums, comments after `;`. Numbers are plain decimals; anything else is an error with its
//! place. Never panics, whatever the text.

/// A line, taken apart.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line<'a> {
    /// The command, if there is one.
    pub command: Option<Command<'a>>,
    /// What follows the `;`.
    pub comment: Option<&'a str>,
}

/// A command with its words.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Command<'a> {
    /// What it is.
    pub code: Code<'a>,
    values: [f64; 26],
    given: u32,
}

/// What a command is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Code<'a> {
    /// `G`, `M` or `T` and its number, such as `G1`; a fraction (`G92.1`) is kept apart.
    Numbered(u8, u32, u32),
    /// A command by name, such as `SET_FAN_SPEED`, with all that follows it.
    Named(&'a str),
}

/// Why a line cannot be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("column {column}: {what}")]
pub struct SyntaxError {
    /// Counted from 1.
    pub column: usize,
    /// What is wrong there.
    pub what: &'static str,
}

impl Command<'_> {
    /// Returns the number of the word with this (upper-case) letter.
    #[must_use]
    pub fn word(&self, letter: u8) -> Option<f64> {
        let index = usize::from(letter.checked_sub(b'A')?);
        let is_given = index < 26 && self.given & (1 << index) != 0;
        is_given.then(|| self.values[index])
    }

    /// Returns whether this is the numbered command, such as `(b'G', 1)`.
    #[must_use]
    pub fn is(&self, letter: u8, number: u32) -> bool {
        self.code == Code::Numbered(letter, number, 0)
    }
}

/// Takes one line apart.
///
/// # Errors
///
/// [`SyntaxError`] with the column of the first character that does not fit.
pub fn parse_line(text: &str) -> Result<Line<'_>, SyntaxError> {
    let (code, comment) = match text.split_once(';') {
        Some((code, comment)) => (code, Some(comment)),
        None => (text, None),
    };
    let code = code.split('*').next().unwrap_or_default().trim_end();
    let mut words = Words { text: code.as_bytes(), at: 0 };
    words.skip_blanks();
    if words.peek().is_some_and(|c| c.eq_ignore_ascii_case(&b'N')) {
        words.next_word()?;
        words.skip_blanks();
    }
    if words.peek().is_none() {
        return Ok(Line { command: None, comment });
    }
    let start = words.at;
    let second = words.text.get(start + 1).copied().unwrap_or(b' ');
    if second.is_ascii_alphabetic() || second == b'_' {
        let code = Code::Named(code[start..].trim());
        return Ok(Line { command: Some(Command { code, values: [0.0; 26], given: 0 }), comment });
    }
    let code = words.code()?;
    let mut command = Command { code, values: [0.0; 26], given: 0 };
    loop {
        words.skip_blanks();
        if words.peek().is_none() {
            return Ok(Line { command: Some(command), comment });
        }
        let (letter, value) = words.next_word()?;
        let index = usize::from(letter - b'A');
        command.values[index] = value;
        command.given |= 1 << index;
    }
}

struct Words<'a> {
    text: &'a [u8],
    at: usize,
}

impl Words<'_> {
    fn peek(&self) -> Option<u8> {
        self.text.get(self.at).copied()
    }

    fn skip_blanks(&mut self) {
        while self.peek().is_some_and(|c| c.is_ascii_whitespace()) {
            self.at += 1;
        }
    }

    fn error(&self, what: &'static str) -> SyntaxError {
        SyntaxError { column: self.at + 1, what }
    }

    fn letter(&mut self) -> Result<u8, SyntaxError> {
        match self.peek() {
            Some(c) if c.is_ascii_alphabetic() => {
                self.at += 1;
                Ok(c.to_ascii_uppercase())
            }
            _ => Err(self.error("a letter is expected")),
        }
    }

    /// A run of digits; its end is where `at` then stands.
    fn digits(&mut self) -> usize {
        let start = self.at;
        while self.peek().is_some_and(|c| c.is_ascii_digit()) {
            self.at += 1;
        }
        self.at - start
    }

    fn code<'b>(&mut self) -> Result<Code<'b>, SyntaxError> {
        let letter = self.letter()?;
        let whole = self.count()?;
        let part = if self.peek() == Some(b'.') {
            self.at += 1;
            self.count()?
        } else {
            0
        };
        Ok(Code::Numbered(letter, whole, part))
    }

    fn count(&mut self) -> Result<u32, SyntaxError> {
        let start = self.at;
        self.digits();
        std::str::from_utf8(&self.text[start..self.at])
            .ok()
            .and_then(|digits| digits.parse().ok())
            .ok_or(self.error("a command number is expected"))
    }

    fn next_word(&mut self) -> Result<(u8, f64), SyntaxError> {
        let letter = self.letter()?;
        let start = self.at;
        if matches!(self.peek(), Some(b'+' | b'-')) {
            self.at += 1;
        }
        let mut digits = self.digits();
        if self.peek() == Some(b'.') {
            self.at += 1;
            digits += self.digits();
        }
        if digits == 0 {
            return Err(self.error("a number is expected"));
        }
        // Only ASCII signs, digits and points: both conversions hold.
        let number = std::str::from_utf8(&self.text[start..self.at])
            .ok()
            .and_then(|number| number.parse::<f64>().ok())
            .filter(|number| number.is_finite());
        number.map(|number| (letter, number)).ok_or(self.error("the number is too large"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn command(text: &str) -> Command<'_> {
        parse_line(text).unwrap().command.unwrap()
    }

    #[test]
    fn words_in_any_shape() {
        for text in [
            "G1 X1.5 Y-2 E.25",
            "g1x1.5y-2e.25",
            "N7 G1 X+1.5 Y-2. E0.25*31",
            "G01 X1.5Y-2 E.25 ; on",
        ] {
            let line = command(text);
            assert!(line.is(b'G', 1), "{text}");
            assert_eq!(
                [b'X', b'Y', b'E', b'Z'].map(|letter| line.word(letter)),
                [Some(1.5), Some(-2.0), Some(0.25), None],
                "{text}"
            );
        }
    }

    #[test]
    fn comments_blank_lines_and_named_commands() {
        assert_eq!(parse_line(";TYPE:Perimeter").unwrap().comment, Some("TYPE:Perimeter"));
        assert_eq!(parse_line("   ").unwrap(), Line { command: None, comment: None });
        assert_eq!(command("SET_FAN_SPEED FAN=1").code, Code::Named("SET_FAN_SPEED FAN=1"));
        assert_eq!(command("G92.1").code, Code::Numbered(b'G', 92, 1));
        assert_eq!(command("M104 S200").word(b'S'), Some(200.0));
        assert_eq!(command("M104 S200").word(b'@'), None);
        assert_eq!(command("M104 S200").word(200), None);
    }

    #[test]
    fn errors_name_the_column() {
        assert_eq!(parse_line("G1 X").unwrap_err().column, 5);
        assert_eq!(parse_line("G1 X1,5").unwrap_err().column, 6);
        assert_eq!(parse_line("G1 Xnan").unwrap_err().column, 5);
        assert_eq!(parse_line("G99999999999 X1").unwrap_err().what, "a command number is expected");
        assert!(parse_line(&format!("G1 X{}", "9".repeat(400))).is_err());
    }

    #[test]
    fn no_bytes_make_it_panic() {
        let mut state = 11_u64;
        for _ in 0..20_000 {
            let text: String = (0..12)
                .map(|_| {
                    state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                    let set = "G1X.-+*;N \té9_M\u{1f600}E";
                    set.chars().nth((state >> 33) as usize % set.chars().count()).unwrap()
                })
                .collect();
            let _ = parse_line(&text);
        }
    }
}

//! One line of a program, read back.
//!
//! Takes what firmwares take: spaces anywhere between words, lower case, line numbers and
//! checksums, comments after `;`. Numbers are plain decimals; anything else is an error with its
//! place. Never panics, whatever the text.
//!
//! Lines as rhumb writes them itself are most of any of its programs, and have a shorter way:
//! [`Command::read_plain`].

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
    /// A command without words, for [`read_plain`](Self::read_plain) to fill.
    pub const BLANK: Self = Self { code: Code::Named(""), values: [0.0; 26], given: 0 };

    /// Reads a line that is a command in the plainest form: an upper-case letter and a number, then
    /// words of an upper-case letter and a decimal number each, no letter twice, one blank between
    /// them and nothing else. Returns whether it was one; the others are for [`parse_line`], and
    /// what this command says then is undefined.
    pub fn read_plain(&mut self, line: &[u8]) -> bool {
        let Some((code, rest)) = plain_code(line) else { return false };
        (self.code, self.given) = (code, 0);
        let mut rest = rest;
        while let Some((&blank, word)) = rest.split_first() {
            let Some((&letter, number)) = word.split_first() else { return false };
            let index = usize::from(letter.wrapping_sub(b'A'));
            let bit = 1_u32.checked_shl(index as u32).unwrap_or(0);
            let is_second_command = matches!(letter, b'G' | b'M' | b'N');
            if blank != b' ' || index >= 26 || self.given & bit != 0 || is_second_command {
                return false;
            }
            let Some((value, after)) = plain_number(number) else { return false };
            self.values[index] = value;
            self.given |= bit;
            rest = after;
        }
        true
    }

    /// Returns the number of the word with this (upper-case) letter.
    #[must_use]
    pub fn word(&self, letter: u8) -> Option<f64> {
        let index = usize::from(letter.checked_sub(b'A')?);
        let is_given = index < 26 && self.given & (1 << index) != 0;
        is_given.then(|| self.values[index])
    }

    /// Returns the first letter of the alphabet that has a word and is none of `known`.
    #[must_use]
    pub fn letter_besides(&self, known: &[u8]) -> Option<u8> {
        let bit = |letter: &u8| 1_u32.checked_shl(u32::from(letter.wrapping_sub(b'A')));
        let known = known.iter().filter_map(bit).fold(0, |all, bit| all | bit);
        let others = self.given & !known;
        (b'A'..=b'Z').nth(others.trailing_zeros() as usize)
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
    // Elsewhere a letter alone is a switch: G28 X Y, M84 E.
    let needs_numbers = matches!(code, Code::Numbered(b'G', 0..=3 | 92, _));
    let mut command = Command { code, values: [0.0; 26], given: 0 };
    loop {
        words.skip_blanks();
        if words.peek().is_none() {
            return Ok(Line { command: Some(command), comment });
        }
        let (letter, value) = words.next_word_or_switch(!needs_numbers)?;
        let index = usize::from(letter - b'A');
        // Which of the two holds is for no reader to guess.
        if needs_numbers && command.given & (1 << index) != 0 {
            return Err(words.error("the line has this word twice"));
        }
        command.values[index] = value;
        command.given |= 1 << index;
    }
}

/// Reads `G1` and the like.
fn plain_code(line: &[u8]) -> Option<(Code<'static>, &[u8])> {
    let (&letter, rest) = line.split_first()?;
    // More digits than any command has go the long way, as do fractions.
    let digits = rest.iter().take(4).take_while(|c| c.is_ascii_digit()).count();
    let (digits, rest) = rest.split_at(digits);
    let number = digits.iter().fold(0, |number, digit| 10 * number + u32::from(digit - b'0'));
    let is_plain = letter.is_ascii_uppercase() && !digits.is_empty() && letter != b'N';
    is_plain.then_some((Code::Numbered(letter, number, 0), rest))
}

/// Powers of ten that a number of type `f64` holds exactly, as far as [`plain_number`] needs them.
const TENS: [f64; 16] =
    [1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15];

/// Reads a decimal number with digits on both sides of its point, if it has one, and at most 15 in
/// all; a negative zero is none. Digits and power of ten are exact, so their quotient is rounded
/// once, and is the number that reading it digit by digit gives (W. D. Clinger, 1990, "How to read
/// floating point numbers accurately").
fn plain_number(text: &[u8]) -> Option<(f64, &[u8])> {
    let is_negative = text.first() == Some(&b'-');
    let start = usize::from(is_negative);
    let mut digits = 0_u64;
    let mut at = start;
    let mut point = None;
    while let Some(&byte) = text.get(at) {
        let digit = byte.wrapping_sub(b'0');
        if digit <= 9 {
            digits = digits.wrapping_mul(10).wrapping_add(u64::from(digit));
        } else if byte == b'.' && point.is_none() {
            point = Some(at);
        } else {
            break;
        }
        at += 1;
    }
    let decimals = point.map_or(0, |point| at - point - 1);
    let whole = point.unwrap_or(at) - start;
    let is_plain = whole > 0 && (decimals > 0 || point.is_none()) && whole + decimals <= 15;
    if !is_plain || (is_negative && digits == 0) {
        return None;
    }
    let value = digits as f64 / TENS[decimals];
    Some((if is_negative { -value } else { value }, &text[at..]))
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
        self.next_word_or_switch(false)
    }

    /// A letter and its number; where a letter alone is allowed its number is zero.
    fn next_word_or_switch(&mut self, may_be_alone: bool) -> Result<(u8, f64), SyntaxError> {
        let letter = self.letter()?;
        if may_be_alone && self.peek().is_none_or(|c| c.is_ascii_whitespace()) {
            return Ok((letter, 0.0));
        }
        // RS274 and firmwares allow blanks between a letter and its number.
        self.skip_blanks();
        let start = self.at;
        if matches!(self.peek(), Some(b'+' | b'-')) {
            self.at += 1;
        }
        let digits_start = self.at;
        let mut digits = self.digits();
        let mut places = 0;
        if self.peek() == Some(b'.') {
            self.at += 1;
            places = self.digits();
            digits += places;
        }
        if digits == 0 {
            return Err(self.error("a number is expected"));
        }
        let word = &self.text[start..self.at];
        if digits <= EXACT_DIGITS {
            let magnitude = exact(&self.text[digits_start..self.at], places);
            return Ok((letter, if word[0] == b'-' { -magnitude } else { magnitude }));
        }
        // Only ASCII signs, digits and points: both conversions hold.
        let number = std::str::from_utf8(word)
            .ok()
            .and_then(|number| number.parse::<f64>().ok())
            .filter(|number| number.is_finite());
        number.map(|number| (letter, number)).ok_or(self.error("the number is too large"))
    }
}

/// Whole numbers with so many digits are exact in `f64`, as [`TENS`] are; so their quotient is the
/// nearest number to the decimal.
const EXACT_DIGITS: usize = 15;

/// The number that at most [`EXACT_DIGITS`] digits, `places` of them after the point, stand for.
fn exact(digits: &[u8], places: usize) -> f64 {
    let whole = digits
        .iter()
        .filter(|byte| **byte != b'.')
        .fold(0_u64, |whole, byte| 10 * whole + u64::from(byte - b'0'));
    whole as f64 / TENS[places]
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
        assert_eq!(command("G1 X1 Z2 B3").letter_besides(b"XYZ"), Some(b'B'));
        assert_eq!(command("G1 X1 Z2").letter_besides(b"ZX"), None);
    }

    #[test]
    fn plain_lines_are_read_the_same_way() {
        let mut plain = Command::BLANK;
        for text in [
            "G1 R12.345 T-93.1235 Z0.2 E0.03123 F1500",
            "G1 E-0.8 F2400",
            "G92 E0",
            "M104 S210",
            "G28",
            "G1 X0.1 Y-0.00001 Z123456789.012345",
            "G1 R0 T0.0000",
        ] {
            assert!(plain.read_plain(text.as_bytes()), "{text}");
            let long = command(text);
            assert_eq!((plain.code, plain.given), (long.code, long.given), "{text}");
            for letter in b'A'..=b'Z' {
                assert_eq!(plain.word(letter), long.word(letter), "{text}");
            }
        }
        for text in [
            "",
            ";",
            "G1 ",
            "G1  X1",
            "G1 X1 ",
            " G1 X1",
            "G1 X1;",
            "G1 X",
            "G1 X-",
            "G1 X.5",
            "G1 X5.",
            "G1 X-0",
            "G1 X+1",
            "G1 X1e1",
            "G1 X1 X2",
            "G1 X1 G1",
            "g1 X1",
            "G1 x1",
            "G",
            "N5 G1",
            "G92.1",
            "G1 X1.2.3",
            "G1 X1234567890123456",
            "G00001",
            "M117 Hello",
            "G1X1",
            "G1 \u{e9}1",
            "G1 X1*31",
        ] {
            assert!(!plain.read_plain(text.as_bytes()), "{text}");
        }
    }

    #[test]
    fn every_decimal_is_read_as_the_nearest_number() {
        let mut state = 5_u64;
        for _ in 0..20_000 {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            let decimals = (state >> 60) as usize % 7;
            let number = (state >> 20) as f64 / 1e9 - 4000.0;
            let text = format!("{number:.decimals$}");
            if number < 0.0 && text.bytes().all(|c| matches!(c, b'-' | b'0' | b'.')) {
                continue;
            }
            let (read, rest) = plain_number(text.as_bytes()).unwrap();
            assert_eq!((read, rest.len()), (text.parse().unwrap(), 0), "{text}");
        }
    }

    #[test]
    fn bare_letters_are_zero() {
        assert_eq!(command("G28 X Y").word(b'Y'), Some(0.0));
        assert_eq!(command("M84 X Y E").word(b'Z'), None);
    }

    #[test]
    fn numbers_are_the_nearest_to_their_decimals() {
        let mut state = 5_u64;
        for _ in 0..20_000 {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
            let whole = (state >> 20) % 10_u64.pow((state % 12) as u32 + 1);
            let places = (state >> 50) as usize % 7;
            let scale = 10_u64.pow(places as u32);
            let sign = if state.is_multiple_of(3) { "-" } else { "" };
            let text = if places == 0 {
                format!("{sign}{whole}")
            } else {
                format!("{sign}{}.{:0places$}", whole / scale, whole % scale)
            };
            let word = command(&format!("G1 X{text}")).word(b'X').unwrap();
            assert_eq!(word.to_bits(), text.parse::<f64>().unwrap().to_bits(), "{text}");
        }
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

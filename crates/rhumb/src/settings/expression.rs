//! Expressions of start and end programs; see [`template`](super::template).

use std::fmt;

use machine::gcode::decimal;

/// What an expression is worth.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Worth {
    /// A number.
    Number(f64),
    /// Yes or no.
    Truth(bool),
    /// A text.
    Text(String),
}

/// Where names get their worth.
pub(super) trait Names {
    /// Returns what a name stands for.
    fn get(&self, name: &str) -> Option<Worth>;
}

/// Why there is no worth.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Fault {
    /// It is no expression; what is wrong.
    Syntax(String),
    /// A name that stands for nothing.
    NoSuchName(String),
}

/// Decimal places of a number in a program: more than any firmware reads.
const DECIMALS: usize = 5;

/// Brackets in brackets: more is no program that a person wrote.
const DEEPEST: u32 = 64;

impl fmt::Display for Worth {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(number) => f.write_str(&decimal(*number, DECIMALS)),
            Self::Truth(truth) => write!(f, "{}", u8::from(*truth)),
            Self::Text(text) => f.write_str(text),
        }
    }
}

impl Worth {
    /// Returns whether it counts as yes.
    pub(super) fn is_true(&self) -> Result<bool, Fault> {
        match self {
            Self::Truth(truth) => Ok(*truth),
            Self::Number(number) => Ok(*number != 0.0),
            Self::Text(_) => Err(wrong("a text is neither true nor false")),
        }
    }

    fn number(&self) -> Result<f64, Fault> {
        match self {
            Self::Number(number) => Ok(*number),
            Self::Truth(truth) => Ok(f64::from(u8::from(*truth))),
            Self::Text(_) => Err(wrong("a number is expected, not a text")),
        }
    }
}

/// Returns what an expression is worth.
pub(super) fn evaluate(text: &str, names: &dyn Names) -> Result<Worth, Fault> {
    let mut parser = Parser { rest: text, names, depth: 0 };
    let worth = parser.any()?;
    match parser.peek() {
        None => Ok(worth),
        Some(_) => {
            let rest: String = parser.rest.chars().take(20).collect();
            Err(wrong(&format!("{rest:?} does not belong there")))
        }
    }
}

fn wrong(what: &str) -> Fault {
    Fault::Syntax(what.to_owned())
}

struct Parser<'a> {
    rest: &'a str,
    names: &'a dyn Names,
    depth: u32,
}

impl<'a> Parser<'a> {
    fn peek(&mut self) -> Option<char> {
        self.rest = self.rest.trim_start();
        self.rest.chars().next()
    }

    /// Takes a sign, if it comes next.
    fn sign(&mut self, sign: &str) -> bool {
        self.peek();
        let Some(rest) = self.rest.strip_prefix(sign) else { return false };
        self.rest = rest;
        true
    }

    /// Takes a word, if it comes next and ends there.
    fn word(&mut self, word: &str) -> bool {
        self.peek();
        let is_word = self
            .rest
            .strip_prefix(word)
            .is_some_and(|rest| !rest.starts_with(|c: char| c.is_ascii_alphanumeric() || c == '_'));
        is_word && self.sign(word)
    }

    fn any(&mut self) -> Result<Worth, Fault> {
        self.depth += 1;
        if self.depth > DEEPEST {
            return Err(wrong("the expression is nested too deeply"));
        }
        let mut worth = self.all()?;
        while self.sign("||") || self.word("or") {
            let other = self.all()?.is_true()?;
            worth = Worth::Truth(worth.is_true()? || other);
        }
        self.depth -= 1;
        Ok(worth)
    }

    fn all(&mut self) -> Result<Worth, Fault> {
        let mut worth = self.negated()?;
        while self.sign("&&") || self.word("and") {
            let other = self.negated()?.is_true()?;
            worth = Worth::Truth(worth.is_true()? && other);
        }
        Ok(worth)
    }

    fn negated(&mut self) -> Result<Worth, Fault> {
        let mut is_negated = false;
        let mut given = false;
        while !self.rest.trim_start().starts_with("!=") && (self.sign("!") || self.word("not")) {
            is_negated = !is_negated;
            given = true;
        }
        let worth = self.comparison()?;
        if given { Ok(Worth::Truth(worth.is_true()? != is_negated)) } else { Ok(worth) }
    }

    fn comparison(&mut self) -> Result<Worth, Fault> {
        let left = self.sum()?;
        for sign in ["==", "!=", "<>", "<=", ">=", "<", ">"] {
            if self.sign(sign) {
                let right = self.sum()?;
                return compared(&left, sign, &right).map(Worth::Truth);
            }
        }
        Ok(left)
    }

    fn sum(&mut self) -> Result<Worth, Fault> {
        let mut worth = self.product()?;
        loop {
            if self.sign("+") {
                let other = self.product()?;
                worth = match (&worth, &other) {
                    (Worth::Text(_), _) | (_, Worth::Text(_)) => {
                        Worth::Text(format!("{worth}{other}"))
                    }
                    _ => Worth::Number(worth.number()? + other.number()?),
                };
            } else if self.sign("-") {
                worth = Worth::Number(worth.number()? - self.product()?.number()?);
            } else {
                return Ok(worth);
            }
        }
    }

    fn product(&mut self) -> Result<Worth, Fault> {
        let mut worth = self.signed()?;
        loop {
            if self.sign("*") {
                worth = Worth::Number(worth.number()? * self.signed()?.number()?);
            } else if self.sign("/") {
                worth = Worth::Number(worth.number()? / self.divisor()?);
            } else if self.sign("%") {
                worth = Worth::Number(worth.number()? % self.divisor()?);
            } else {
                return Ok(worth);
            }
        }
    }

    fn divisor(&mut self) -> Result<f64, Fault> {
        let divisor = self.signed()?.number()?;
        if divisor == 0.0 { Err(wrong("division by zero")) } else { Ok(divisor) }
    }

    fn signed(&mut self) -> Result<Worth, Fault> {
        let mut sign = 1.0;
        let mut given = false;
        loop {
            if self.sign("-") {
                sign = -sign;
            } else if !self.sign("+") {
                break;
            }
            given = true;
        }
        let worth = self.operand()?;
        if given { Ok(Worth::Number(sign * worth.number()?)) } else { Ok(worth) }
    }

    fn operand(&mut self) -> Result<Worth, Fault> {
        match self.peek() {
            Some('(') => {
                self.sign("(");
                let worth = self.any()?;
                self.closing(")")?;
                Ok(worth)
            }
            Some('"') => {
                let (text, rest) =
                    self.rest[1..].split_once('"').ok_or_else(|| wrong("a text has no end"))?;
                self.rest = rest;
                Ok(Worth::Text(text.to_owned()))
            }
            Some(c) if c.is_ascii_digit() || c == '.' => self.literal(),
            Some(c) if c.is_ascii_alphabetic() || c == '_' => self.named(),
            Some(c) => Err(wrong(&format!("{c:?} does not belong there"))),
            None => Err(wrong("something is missing at the end")),
        }
    }

    fn literal(&mut self) -> Result<Worth, Fault> {
        let end = self.rest.find(|c: char| !c.is_ascii_digit() && c != '.');
        let (digits, rest) = self.rest.split_at(end.unwrap_or(self.rest.len()));
        self.rest = rest;
        digits.parse().map(Worth::Number).map_err(|_| wrong(&format!("{digits} is no number")))
    }

    fn named(&mut self) -> Result<Worth, Fault> {
        let end = self.rest.find(|c: char| !c.is_ascii_alphanumeric() && c != '_');
        let (name, rest) = self.rest.split_at(end.unwrap_or(self.rest.len()));
        self.rest = rest;
        match name {
            "true" => return Ok(Worth::Truth(true)),
            "false" => return Ok(Worth::Truth(false)),
            _ => {}
        }
        if self.peek() == Some('(') {
            self.sign("(");
            return self.function(name);
        }
        if self.peek() == Some('[') {
            self.sign("[");
            if self.any()?.number()? != 0.0 {
                return Err(wrong("there is one extruder, with the index 0"));
            }
            self.closing("]")?;
        }
        let shown: String = name.chars().take(60).collect();
        self.names.get(name).ok_or(Fault::NoSuchName(shown))
    }

    fn function(&mut self, name: &'a str) -> Result<Worth, Fault> {
        let mut arguments = vec![self.any()?.number()?];
        while self.sign(",") {
            arguments.push(self.any()?.number()?);
        }
        self.closing(")")?;
        match (name, arguments.as_slice()) {
            ("min", [first, rest @ ..]) => Ok(rest.iter().fold(*first, |a, b| a.min(*b))),
            ("max", [first, rest @ ..]) => Ok(rest.iter().fold(*first, |a, b| a.max(*b))),
            ("round", [value]) => Ok(value.round()),
            ("int", [value]) => Ok(value.trunc()),
            ("digits", [value, before, after]) => return Ok(digits(*value, *before, *after, ' ')),
            ("zdigits", [value, before, after]) => return Ok(digits(*value, *before, *after, '0')),
            _ => Err(wrong(&format!("there is no function {name} of {}", arguments.len()))),
        }
        .map(Worth::Number)
    }

    fn closing(&mut self, sign: &str) -> Result<(), Fault> {
        if self.sign(sign) { Ok(()) } else { Err(wrong(&format!("{sign:?} is missing"))) }
    }
}

/// A number with a fixed count of places before and after the point.
fn digits(value: f64, before: f64, after: f64, fill: char) -> Worth {
    let after = after.clamp(0.0, 6.0) as usize;
    let width = before.clamp(0.0, 20.0) as usize + if after > 0 { after + 1 } else { 0 };
    let number = format!("{value:.after$}");
    let missing = width.saturating_sub(number.len());
    Worth::Text(fill.to_string().repeat(missing) + &number)
}

fn compared(left: &Worth, sign: &str, right: &Worth) -> Result<bool, Fault> {
    use std::cmp::Ordering::{Equal, Greater, Less};
    let order = match (left, right) {
        (Worth::Text(a), Worth::Text(b)) => a.cmp(b),
        _ => {
            let (a, b) = (left.number()?, right.number()?);
            a.partial_cmp(&b).ok_or_else(|| wrong("it is not a number"))?
        }
    };
    Ok(match sign {
        "==" => order == Equal,
        "!=" | "<>" => order != Equal,
        "<" => order == Less,
        ">" => order == Greater,
        "<=" => order != Greater,
        _ => order != Less,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Few;

    impl Names for Few {
        fn get(&self, name: &str) -> Option<Worth> {
            match name {
                "a" => Some(Worth::Number(3.0)),
                "notch" => Some(Worth::Number(7.0)),
                "t" => Some(Worth::Text("PLA".into())),
                _ => None,
            }
        }
    }

    fn worth(text: &str) -> String {
        evaluate(text, &Few).unwrap().to_string()
    }

    #[test]
    fn precedence_is_that_of_arithmetic() {
        for (text, expected) in [
            ("1 + 2 * 3", "7"),
            ("(1 + 2) * 3", "9"),
            ("-a - -2", "-1"),
            ("7 % 4 / 2", "1.5"),
            ("2 * 3 == 6 and 1 < 2", "1"),
            ("not 1 > 2 && !(1 == 2)", "1"),
            ("1 != 1 or notch >= 7", "1"),
            ("a[0] <> 3", "0"),
            ("t == \"PLA\"", "1"),
            ("t + \"-\" + a", "PLA-3"),
            ("round(2.5) + int(-2.5)", "1"),
            ("zdigits(3.14159, 3, 2)", "003.14"),
            ("digits(3, 3, 0)", "  3"),
            ("true || false", "1"),
            (".5 + 0.25", "0.75"),
        ] {
            assert_eq!(worth(text), expected, "{text}");
        }
    }

    #[test]
    fn what_is_no_expression_has_no_worth() {
        let deep = "(".repeat(100_000);
        for text in
            ["", "1 +", "1 2", "(1", "a[1]", "b", "1/0", "t * 2", "f(1)", "\"x", "1.2.3", &deep]
        {
            assert!(evaluate(text, &Few).is_err(), "{text}");
        }
    }
}

//! Start and end programs: text with expressions in braces, in `PrusaSlicer`'s syntax.
//!
//! * `{temperature + 5}` is worth its value; `[temperature]` is the older form for a bare name. Names
//!   are those under which settings stand at the end of a program (`PrusaSlicer`'s where it has
//!   one); an index as in `{temperature[0]}` names the extruder and is 0.
//! * `{if first_layer_temperature > 220}…{elsif …}…{else}…{endif}` keeps one of its parts.
//! * Operators, weakest first: `or` `||`, `and` `&&`, `not` `!`, `== != <> < <= > >=`, `+ -`,
//!   `* / %`, sign. Functions: `min`, `max`, `round`, `int`, `digits` and `zdigits` (value, places
//!   before, places after the point). Texts are in double quotes; `==` and `+` take them too.
//!
//! A program is filled in as a whole, so an `if` may span lines.

use super::expression::{Fault, Names, Worth, evaluate};
use super::key::{KEYS, Kind, Value};
use super::merge::Settings;
use crate::failure::Failure;

/// Returns the lines of a program with everything in braces filled in.
///
/// # Errors
///
/// `ConfigSyntax` for a brace without its partner or an expression that is none,
/// `ConfigUnknownKey` for a name that is none.
pub fn fill(program: &str, name: &str, settings: &Settings) -> Result<Vec<String>, Failure> {
    fill_with(program, name, settings, &[])
}

/// Programs that stand at every layer.
#[derive(Debug, Clone, PartialEq)]
pub struct AtLayers {
    /// Before the layer is announced.
    pub before: String,
    /// After it is.
    pub after: String,
}

impl AtLayers {
    /// Returns the lines before and after a layer is announced: its number, counted from 0, and how
    /// high the print then stands, mm.
    ///
    /// # Errors
    ///
    /// As [`fill`].
    pub fn of(
        &self,
        number: usize,
        z: f64,
        settings: &Settings,
    ) -> Result<[Vec<String>; 2], Failure> {
        let numbers = [("layer_num", number as f64), ("layer_z", z)];
        Ok([
            fill_with(&self.before, "before_layer_gcode", settings, &numbers)?,
            fill_with(&self.after, "layer_gcode", settings, &numbers)?,
        ])
    }
}

/// Like [`fill`], with numbers that are no settings.
fn fill_with(
    program: &str,
    name: &str,
    settings: &Settings,
    numbers: &[(&str, f64)],
) -> Result<Vec<String>, Failure> {
    let names = OfSettings(settings, numbers);
    // A printer takes a carriage return for the end of a line: what follows is no part of a comment.
    let program = &program.replace("\r\n", "\n").replace('\r', "\n");
    let mut filler = Filler { names: &names, branches: Vec::new(), filled: String::new() };
    let mut rest = program.as_str();
    while let Some(open) = rest.find(['{', '[', '}']) {
        let before = &program[..program.len() - rest.len() + open];
        let line = before.matches('\n').count() + 1;
        let fail = |fault: Fault| failure(&fault, name, line);
        filler.text(&rest[..open]);
        rest = match rest.as_bytes()[open] {
            b'{' => {
                let (inside, after) = rest[open + 1..]
                    .split_once('}')
                    .ok_or_else(|| fail(Fault::Syntax("a brace has no partner".into())))?;
                filler.braces(inside.trim()).map_err(fail)?;
                after_a_lone_tag(inside, after, &rest[..open], filler.filled.as_str())
            }
            b'[' => filler.brackets(&rest[open + 1..]).map_err(fail)?,
            _ => return Err(fail(Fault::Syntax("a brace has no partner".into()))),
        };
    }
    filler.text(rest);
    if !filler.branches.is_empty() {
        let fault = Fault::Syntax("an if has no endif".into());
        return Err(failure(&fault, name, program.lines().count()));
    }
    Ok(filler.filled.lines().map(str::to_owned).collect())
}

/// A line that holds nothing but a tag leaves no empty line behind.
fn after_a_lone_tag<'a>(inside: &str, after: &'a str, before: &str, filled: &str) -> &'a str {
    let is_tag = ["if", "elsif", "else", "endif"]
        .contains(&inside.split_whitespace().next().unwrap_or_default());
    let begins_line = before.ends_with('\n') || before.is_empty() && !filled.ends_with(' ');
    match after.strip_prefix('\n') {
        Some(next) if is_tag && begins_line => next,
        _ => after,
    }
}

fn failure(fault: &Fault, program: &str, line: usize) -> Failure {
    match fault {
        Fault::Syntax(what) => {
            Failure::new("ConfigSyntax", format!("{program}, line {line}: {what}"))
        }
        Fault::NoSuchName(name) => Failure::new(
            "ConfigUnknownKey",
            format!("{program}, line {line}: there is nothing to fill in for {{{name}}}"),
        )
        .hint("names are those of the settings at the end of a program"),
    }
}

/// One `if` that is open.
struct Branch {
    /// Whether the text around it is kept.
    outer: bool,
    /// Whether one of its parts was kept already.
    taken: bool,
    /// Whether the present part is kept.
    kept: bool,
    has_else: bool,
}

struct Filler<'a> {
    names: &'a dyn Names,
    branches: Vec<Branch>,
    filled: String,
}

impl Filler<'_> {
    fn is_kept(&self) -> bool {
        self.branches.last().is_none_or(|branch| branch.kept)
    }

    fn text(&mut self, text: &str) {
        if self.is_kept() {
            self.filled.push_str(text);
        }
    }

    fn braces(&mut self, inside: &str) -> Result<(), Fault> {
        let (word, rest) = inside.split_once(char::is_whitespace).unwrap_or((inside, ""));
        match word {
            "if" => {
                let outer = self.is_kept();
                // What is left out is not looked at: it may name what is not there.
                let kept = outer && self.condition(rest)?;
                self.branches.push(Branch { outer, taken: kept, kept, has_else: false });
            }
            "elsif" | "else" => {
                let branch = self.branches.last().filter(|branch| !branch.has_else);
                let branch = branch.ok_or_else(|| stray(word))?;
                let open = branch.outer && !branch.taken;
                let kept = open && (word == "else" || self.condition(rest)?);
                if let Some(branch) = self.branches.last_mut() {
                    branch.kept = kept;
                    branch.taken |= kept;
                    branch.has_else = word == "else";
                }
            }
            "endif" => {
                self.branches.pop().ok_or_else(|| stray(word))?;
            }
            _ if self.is_kept() => {
                let worth = evaluate(inside, self.names)?;
                self.filled.push_str(&worth.to_string());
            }
            _ => {}
        }
        Ok(())
    }

    fn condition(&self, text: &str) -> Result<bool, Fault> {
        evaluate(text, self.names)?.is_true()
    }

    /// The older form of a name; returns what follows. Other brackets stay as they are.
    fn brackets<'b>(&mut self, after: &'b str) -> Result<&'b str, Fault> {
        let name = after.split(']').next().unwrap_or_default();
        let is_name = name.len() < after.len()
            && name.bytes().all(|c| c.is_ascii_alphanumeric() || c == b'_')
            && name.bytes().next().is_some_and(|c| c.is_ascii_alphabetic());
        if !is_name {
            self.text("[");
            return Ok(after);
        }
        if self.is_kept() {
            let worth = evaluate(name, self.names)?;
            self.filled.push_str(&worth.to_string());
        }
        Ok(&after[name.len() + 1..])
    }
}

fn stray(word: &str) -> Fault {
    Fault::Syntax(format!("{word} without an if"))
}

struct OfSettings<'a>(&'a Settings, &'a [(&'a str, f64)]);

impl Names for OfSettings<'_> {
    fn get(&self, name: &str) -> Option<Worth> {
        if let Some((_, number)) = self.1.iter().find(|(other, _)| *other == name) {
            return Some(Worth::Number(*number));
        }
        // A program inside a program would be filled in without end.
        let is_program = |name: &str| name.ends_with("_gcode");
        let key = KEYS.iter().find(|key| {
            key.program_name == name && !(key.kind == Kind::Text && is_program(key.name))
        })?;
        Some(match self.0.get(key).0 {
            Value::Number(number) => Worth::Number(*number),
            Value::Count(count) => Worth::Number(*count as f64),
            Value::Switch(switch) => Worth::Truth(*switch),
            // A setting is a word in a line and never ends one.
            Value::Text(text) => Worth::Text(text.replace(char::is_control, " ")),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn filled(program: &str) -> Vec<String> {
        fill(program, "start_gcode", &Settings::defaults()).unwrap()
    }

    #[test]
    fn names_are_filled_in() {
        assert_eq!(
            filled("M109 S{first_layer_temperature}\n; {layer_height} mm, {perimeters} walls"),
            ["M109 S215", "; 0.2 mm, 2 walls"]
        );
        assert_eq!(
            filled("M104 S[temperature] ; {filament_type[0]} [not a name] [1]"),
            ["M104 S210 ; PLA [not a name] [1]"]
        );
        assert!(filled("").is_empty());
    }

    #[test]
    fn programs_at_layers_know_their_layer() {
        let after = "{if layer_num % 2 == 1}M117 Layer [layer_num] at {layer_z}{endif}".to_owned();
        let programs = AtLayers { before: "; before {layer_z}".to_owned(), after };
        let settings = Settings::defaults();
        let [before, after] = programs.of(3, 0.8, &settings).unwrap();
        assert_eq!(
            (before, after),
            (vec!["; before 0.8".into()], vec!["M117 Layer 3 at 0.8".into()])
        );
        assert!(programs.of(2, 0.6, &settings).unwrap()[1].is_empty());
        assert!(fill("{layer_num}", "start_gcode", &settings).is_err());
    }

    #[test]
    fn arithmetic_in_braces() {
        assert_eq!(filled("M104 S{temperature[0] - 5 * 2}"), ["M104 S200"]);
        assert_eq!(filled("G1 Z{layer_height*3} E{round(0.2 + 7 / 2)}"), ["G1 Z0.6 E4"]);
        assert_eq!(filled("{min(temperature, 200)} {max(1, 2, 3)} {int(2.9)}"), ["200 3 2"]);
    }

    #[test]
    fn one_part_of_an_if_is_kept() {
        let program =
            "{if bed_temperature > 100}hot{elsif bed_temperature > 50}warm{else}cold{endif}";
        assert_eq!(filled(program), ["warm"]);
        let lines = "G28\n{if filament_type == \"PLA\" and not (perimeters < 2)}\nM106 S255\n\
            {if nozzle_diameter == 0.6}\nM900\n{endif}\n{else}\nM107 {nothing}\n{endif}\nM83";
        assert_eq!(filled(lines), ["G28", "M106 S255", "M83"]);
    }

    #[test]
    fn a_carriage_return_ends_a_line_and_no_value_does() {
        assert_eq!(filled("; a\rM104 S999\r\nG28\r"), ["; a", "M104 S999", "G28"]);
        let mut settings = Settings::defaults();
        settings.set("filament_type=PLA\nM104 S999\r").unwrap();
        let lines = fill("; {filament_type}!", "p", &settings).unwrap();
        assert_eq!(lines, ["; PLA M104 S999 !"]);
    }

    #[test]
    fn mistakes_are_named() {
        let settings = Settings::defaults();
        let class = |program: &str| fill(program, "p", &settings).unwrap_err().class();
        assert_eq!(class("M109 S{temprature}"), "ConfigUnknownKey");
        assert_eq!(class("M109 S[temprature]"), "ConfigUnknownKey");
        assert_eq!(class("M109 S{temperature"), "ConfigSyntax");
        assert_eq!(class("M109 Stemperature}"), "ConfigSyntax");
        assert_eq!(class("{start_gcode}"), "ConfigUnknownKey");
        assert_eq!(class("{if 1 > 2}M84"), "ConfigSyntax");
        assert_eq!(class("{endif}"), "ConfigSyntax");
        assert_eq!(class("{if 1 > 0}a{else}b{else}c{endif}"), "ConfigSyntax");
        assert_eq!(class("{1 / 0}"), "ConfigSyntax");
        let text = fill("G28\nM84\n{1 +}", "p", &settings).unwrap_err().to_string();
        assert!(text.contains("line 3"), "{text}");
    }
}

//! A printer at the other end of a serial line, as a rig for the search.
//!
//! Each line that goes out is answered by lines that end with `ok`; a line that begins with
//! `error` or `!!` refuses it. A line that begins with `Resend` or `rs` asks for the line again. `start`
//! says that the printer began anew: nothing it did before is worth anything then. Other lines are let
//! pass, so a chatty firmware does no harm; `busy` says that an answer will come.
//!
//! | line | meaning | answer before `ok` |
//! | --- | --- | --- |
//! | `G28` | home | |
//! | `G1 R… F…`, `G1 T… F…` | carriage (mm), bed (degrees, accumulated), F mm/min and degrees/min; letters of the dialect | |
//! | `M400` | wait until the motion has ended | |
//! | `M5801 T… P1 F…` | turn the bed towards T degrees until the sensor is on (`P0`: off), F degrees/min | `seek hit T…` where it switched, or `seek miss` |
//! | `M5802` | the digital sensor | `sensor on` or `sensor off` |
//! | `M5803` | the analogue sensor | `level …` |
//!
//! `M5801` to `M5803` are macros of the user's firmware; `docs/calibration.md` has some for
//! Klipper and RepRapFirmware. The firmware itself stops the bed at the edge and reports where it was, so what
//! the line delays does not matter.

use std::fs::{File, OpenOptions};
use std::io::{Read, Write};
use std::path::Path;
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::thread;
use std::time::{Duration, Instant};

use machine::calibration::rig::{Rig, RigError};
use machine::gcode::decimal;

use crate::failure::Failure;
use crate::interrupt::Interrupt;

/// How a printer is spoken to.
#[derive(Debug, Clone)]
pub(super) struct Manner {
    /// Letters of carriage and bed.
    pub(super) letters: [char; 2],
    /// Whether the bed counts counter-clockwise.
    pub(super) is_reversed: bool,
    /// Speed of the carriage, mm/s.
    pub(super) rail_speed: f64,
    /// Speed of the bed while it is watched, radians/s.
    pub(super) bed_speed: f64,
    /// Where the carriage is parked, mm.
    pub(super) park: f64,
    /// Longest time without an answer.
    pub(super) patience: Duration,
}

/// A printer on a line.
pub(super) struct SerialRig {
    out: File,
    lines: Receiver<String>,
    manner: Manner,
    interrupt: Interrupt,
    /// Whether a line was answered: what the printer says before is of no concern.
    is_begun: bool,
    /// Whether the printer began anew since, and has no home any more.
    is_lost: bool,
}

/// What comes back for a line.
enum Answer {
    Done(Vec<String>),
    /// The line was not understood, or came before the printer was there.
    Again,
}

/// How often a line is sent again. Noise is rare, and a printer that asks for ever never prints.
const MOST_REPEATS: usize = 5;

/// How long the `ok` after a wish for the line again may take; some firmwares send none.
const AFTERTHOUGHT: Duration = Duration::from_secs(1);

/// Longest line of a firmware, bytes; more is noise.
const LONGEST_LINE: usize = 1000;

/// Most lines before an answer: more is no conversation.
const MOST_LINES: usize = 10_000;

/// How often a wait looks whether someone asked to stop.
const GLANCE: Duration = Duration::from_millis(50);

impl SerialRig {
    /// Opens a device.
    ///
    /// # Errors
    ///
    /// `PrinterSilent`, when it cannot be opened or set to this speed.
    pub(super) fn open(
        device: &Path,
        baud: u32,
        manner: Manner,
        interrupt: Interrupt,
    ) -> Result<Self, Failure> {
        let failed = |error: &dyn std::fmt::Display| {
            Failure::new("PrinterSilent", format!("{}: {error}", device.display()))
                .hint("name the serial device of the printer, as --port /dev/ttyACM0")
        };
        let out = OpenOptions::new().read(true).write(true).open(device).map_err(|e| failed(&e))?;
        set_line(&out, baud).map_err(|e| failed(&e))?;
        let input = out.try_clone().map_err(|e| failed(&e))?;
        let (sender, lines) = channel();
        // The reader ends when the line does, or with the process.
        thread::spawn(move || read_lines(input, &sender));
        Ok(Self { out, lines, manner, interrupt, is_begun: false, is_lost: false })
    }

    /// Sends a line and returns what comes back before `ok`.
    fn ask(&mut self, line: &str) -> Result<Vec<String>, RigError> {
        for _ in 0..=MOST_REPEATS {
            self.clear(line)?;
            self.out
                .write_all(format!("{line}\n").as_bytes())
                .and_then(|()| self.out.flush())
                .map_err(|error| RigError::Gone(error.to_string()))?;
            if let Answer::Done(answer) = self.answer(line)? {
                self.is_begun = true;
                return Ok(answer);
            }
        }
        Err(RigError::Garbled(line.to_owned(), "send it again".to_owned()))
    }

    /// Lets pass what came since the last answer. An `ok` among it belongs to no line: from there on
    /// answers would be those of other lines.
    fn clear(&mut self, line: &str) -> Result<(), RigError> {
        while let Ok(text) = self.lines.try_recv() {
            self.look(&text)?;
            if self.is_begun && is_ok(&text) {
                let said = "ok before it was sent".to_owned();
                return Err(RigError::Garbled(line.to_owned(), said));
            }
        }
        Ok(())
    }

    /// Whether the printer still is what it was.
    fn look(&mut self, text: &str) -> Result<(), RigError> {
        if self.is_begun && is_start(text) {
            self.is_lost = true;
            return Err(RigError::Gone("it started anew".to_owned()));
        }
        Ok(())
    }

    fn answer(&mut self, line: &str) -> Result<Answer, RigError> {
        let mut answer = Vec::new();
        let mut is_again = false;
        let mut deadline = Instant::now() + self.manner.patience;
        while answer.len() < MOST_LINES {
            if self.interrupt.check().is_err() {
                return Err(RigError::Stopped);
            }
            match self.lines.recv_timeout(GLANCE) {
                Ok(text) if is_ok(&text) && is_again => return Ok(Answer::Again),
                Ok(text) if is_ok(&text) => return Ok(Answer::Done(answer)),
                Ok(text) if text.starts_with("!!") || is_error(&text) => {
                    return Err(RigError::Refused(line.to_owned(), text));
                }
                Ok(text) => {
                    self.look(&text)?;
                    if is_start(&text) {
                        return Ok(Answer::Again);
                    }
                    if is_resend(&text) {
                        is_again = true;
                        deadline = deadline.min(Instant::now() + AFTERTHOUGHT);
                    }
                    // A busy firmware says so; it is alive.
                    if text.contains("busy") {
                        deadline = Instant::now() + self.manner.patience;
                    }
                    answer.push(text);
                }
                Err(RecvTimeoutError::Timeout) if Instant::now() < deadline => {}
                Err(RecvTimeoutError::Timeout) if is_again => return Ok(Answer::Again),
                Err(RecvTimeoutError::Timeout) => return Err(RigError::Silent(line.to_owned())),
                Err(RecvTimeoutError::Disconnected) => {
                    return Err(RigError::Gone("the line was closed".to_owned()));
                }
            }
        }
        Err(RigError::Garbled(line.to_owned(), "no end of lines".to_owned()))
    }

    /// Sends a query and returns the rest of the line that begins with `key`.
    fn query(&mut self, line: &str, key: &str) -> Result<String, RigError> {
        let answer = self.ask(line)?;
        let said = |text: &'_ String| -> Option<String> {
            // Klipper marks what macros say as remarks.
            let text = text.strip_prefix("// ").unwrap_or(text);
            Some(text.strip_prefix(key)?.strip_prefix(' ')?.trim().to_owned())
        };
        let found = answer.iter().find_map(said);
        found.ok_or_else(|| {
            let said = answer.last().cloned().unwrap_or_default();
            RigError::Garbled(line.to_owned(), said)
        })
    }

    fn degrees(&self, theta: f64) -> f64 {
        if self.manner.is_reversed { -theta.to_degrees() } else { theta.to_degrees() }
    }

    fn bed_feed(&self) -> String {
        decimal(self.manner.bed_speed.to_degrees() * 60.0, 1)
    }

    fn wait(&mut self) -> Result<(), RigError> {
        self.ask("M400").map(drop)
    }
}

fn is_ok(text: &str) -> bool {
    text == "ok" || text.starts_with("ok ")
}

fn is_start(text: &str) -> bool {
    text == "start"
}

fn is_resend(text: &str) -> bool {
    text.starts_with("Resend") || text.starts_with("rs ")
}

fn is_error(text: &str) -> bool {
    text.get(..5).is_some_and(|start| start.eq_ignore_ascii_case("error"))
}

fn number(line: &str, text: &str) -> Result<f64, RigError> {
    let value = text.parse().ok().filter(|value: &f64| value.is_finite());
    value.ok_or_else(|| RigError::Garbled(line.to_owned(), text.to_owned()))
}

impl Rig for SerialRig {
    fn home(&mut self) -> Result<(), RigError> {
        for line in ["G90", "G28"] {
            self.ask(line)?;
        }
        self.wait()
    }

    fn carriage_to(&mut self, s: f64) -> Result<(), RigError> {
        let feed = decimal(self.manner.rail_speed * 60.0, 1);
        self.ask(&format!("G1 {}{} F{feed}", self.manner.letters[0], decimal(s, 4)))?;
        self.wait()
    }

    fn turn_to(&mut self, theta: f64) -> Result<(), RigError> {
        let (degrees, feed) = (decimal(self.degrees(theta), 5), self.bed_feed());
        self.ask(&format!("G1 {}{degrees} F{feed}", self.manner.letters[1]))?;
        self.wait()
    }

    fn turn_until(&mut self, is_on: bool, theta: f64) -> Result<Option<f64>, RigError> {
        let degrees = decimal(self.degrees(theta), 5);
        let line = format!("M5801 T{degrees} P{} F{}", u8::from(is_on), self.bed_feed());
        let said = self.query(&line, "seek")?;
        match said.strip_prefix("hit T") {
            Some(degrees) => {
                let theta = number(&line, degrees)?.to_radians();
                Ok(Some(if self.manner.is_reversed { -theta } else { theta }))
            }
            None if said == "miss" => Ok(None),
            None => Err(RigError::Garbled(line, said)),
        }
    }

    fn is_on(&mut self) -> Result<bool, RigError> {
        match self.query("M5802", "sensor")?.as_str() {
            "on" => Ok(true),
            "off" => Ok(false),
            other => Err(RigError::Garbled("M5802".to_owned(), other.to_owned())),
        }
    }

    fn level(&mut self) -> Result<f64, RigError> {
        let said = self.query("M5803", "level")?;
        number("M5803", &said)
    }

    fn park(&mut self) -> Result<(), RigError> {
        if self.is_lost {
            return Err(RigError::Gone("it started anew".to_owned()));
        }
        // Parking must work after a stop, too, and after answers too many.
        self.interrupt = Interrupt::default();
        self.is_begun = false;
        self.carriage_to(self.manner.park)
    }
}

/// Hands on lines until the device ends.
fn read_lines(mut input: File, sender: &std::sync::mpsc::Sender<String>) {
    let mut line = Vec::new();
    let mut buffer = [0; 256];
    loop {
        let Ok(count @ 1..) = input.read(&mut buffer) else { return };
        for &byte in &buffer[..count] {
            if byte != b'\n' && byte != b'\r' {
                if line.len() < LONGEST_LINE {
                    line.push(byte);
                }
                continue;
            }
            let text = String::from_utf8_lossy(&line).trim().to_owned();
            line.clear();
            if !text.is_empty() && sender.send(text).is_err() {
                return;
            }
        }
    }
}

/// Raw bytes at a speed. What is no terminal, a pipe say, is taken as it is.
#[cfg(unix)]
fn set_line(device: &File, baud: u32) -> std::io::Result<()> {
    use rustix::termios::{OptionalActions, isatty, tcgetattr, tcsetattr};
    if !isatty(device) {
        return Ok(());
    }
    let mut line = tcgetattr(device)?;
    line.make_raw();
    line.set_speed(baud)?;
    tcsetattr(device, OptionalActions::Flush, &line)?;
    Ok(())
}

#[cfg(not(unix))]
fn set_line(_: &File, _: u32) -> std::io::Result<()> {
    Err(std::io::Error::new(
        std::io::ErrorKind::Unsupported,
        "serial lines are supported on Unix only; scan elsewhere and use calibrate fit",
    ))
}

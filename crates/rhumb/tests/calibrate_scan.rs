//! `rhumb calibrate scan`, on simulated machines and over a pseudo-terminal.
#![cfg(unix)]

use machine::calibration::rig::Rig;
use nalgebra::Vector2;
use rhumb::calibration::Calibration;
use rustix::fs::{Mode, OFlags, open};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use std::fs::File;
use std::io::{BufRead, BufReader, Write};
use std::os::fd::OwnedFd;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::thread;
use std::time::Duration;
use twin::magnets::{Chance, Layout, Machine, SimulatedRig};

/// A folder of its own for each test, empty at first.
fn folder(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("scan-{name}"));
    let _ = std::fs::remove_dir_all(&path);
    std::fs::create_dir_all(&path).expect("a folder for the test");
    path
}

fn command(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_rhumb"));
    command.args(["calibrate", "scan"]).args(arguments).current_dir(folder);
    command
}

fn run(folder: &Path, arguments: &[&str]) -> Output {
    command(folder, arguments).output().expect("the binary runs")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

fn calibration(folder: &Path) -> Calibration {
    let bytes = std::fs::read(folder.join("calibration.toml")).expect("it is written");
    Calibration::read(&bytes, "calibration.toml").expect("it can be read")
}

/// What `--simulate` says of the machine: a and b, mm.
fn truth(said: &str) -> [f64; 2] {
    let number = |after: &str| {
        let rest = said.split_once(after).unwrap_or_else(|| panic!("{after:?} in {said}")).1;
        let word = rest.split_whitespace().next().expect("a number");
        word.parse::<f64>().expect("a number")
    };
    [number("really a "), number(" b ")]
}

const BOTH_SIDES: [&str; 4] = ["--set", "rail_min_mm=-120", "--set", "rail_max_mm=120"];

#[test]
fn simulated_machines_are_calibrated() {
    let folder = folder("simulated");
    for seed in ["0", "7"] {
        let mut arguments = vec!["--simulate", seed, "--log", "log.csv"];
        arguments.extend(BOTH_SIDES);
        let done = run(&folder, &arguments);
        assert_eq!(done.status.code(), Some(0), "{}", text(&done.stderr));
        let [a, b] = truth(&text(&done.stdout));
        let found = calibration(&folder);
        assert!((found.rail.a_mm - a).abs() < 0.015, "{found:?} {a}");
        assert!((found.rail.b_mm - b).abs() < 0.015, "{found:?} {b}");
        // The log says the same again.
        let again = Command::new(env!("CARGO_BIN_EXE_rhumb"))
            .args(["calibrate", "fit", "log.csv", "-o", "again.toml"])
            .current_dir(&folder)
            .output()
            .expect("the binary runs");
        assert_eq!(again.status.code(), Some(0), "{}", text(&again.stderr));
        let bytes = std::fs::read(folder.join("again.toml")).expect("it is written");
        let again = Calibration::read(&bytes, "again.toml").expect("it can be read");
        assert!((again.rail.b_mm - found.rail.b_mm).abs() < 1e-4, "{again:?}");
    }
}

#[test]
fn a_rail_that_ends_at_the_axis_is_told_what_to_do() {
    let folder = folder("short");
    let done = run(&folder, &["--simulate", "--set", "rail_min_mm=0", "--set", "rail_max_mm=120"]);
    assert_eq!(done.status.code(), Some(10));
    let said = text(&done.stderr);
    assert!(said.contains("no magnet was seen from both sides"), "{said}");
    assert!(said.contains("--inner-radius"), "{said}");
    assert!(!folder.join("calibration.toml").exists());
}

/// What goes wrong with a firmware.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Fault {
    None,
    /// Takes its time, as machines do.
    Slow,
    /// Chatter between answers, and noise.
    Chatter,
    /// The line is closed after so many commands.
    Disconnects(usize),
    /// No answer any more after so many commands.
    FallsSilent(usize),
    /// Nonsense in place of positions.
    Garbage,
    /// An error on every motion.
    Refuses,
    /// Stops for good, as Marlin does when a heater runs away.
    Halts(usize),
    /// A megabyte without the end of a line.
    Noise(usize),
    /// Asks for every third line again, once with the number of that line and once with another.
    Resends,
    /// Asks for the same line for ever.
    ResendsForEver(usize),
    /// Works on a line for longer than anybody waits for an answer, and says so.
    Busy,
    /// Tells its temperatures unasked.
    Temperatures,
    /// Two answers to each line.
    Flood(usize),
    /// Begins anew.
    Resets(usize),
    /// Begins when the line is opened, and has not heard the first line.
    Boots,
}

/// A firmware at the other end of a pseudo-terminal; returns the device and what it was told.
fn firmware(fault: Fault) -> (PathBuf, thread::JoinHandle<Vec<String>>) {
    let master = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC)
        .expect("a pseudo-terminal");
    grantpt(&master).expect("granted");
    unlockpt(&master).expect("unlocked");
    let name = ptsname(&master, Vec::new()).expect("its name");
    let path = PathBuf::from(name.to_str().expect("a path"));
    // Held open, so that the master does not end before the program opens the line; raw at once.
    let slave = open(&path, OFlags::RDWR | OFlags::NOCTTY | OFlags::CLOEXEC, Mode::empty())
        .expect("it opens");
    let mut line = rustix::termios::tcgetattr(&slave).expect("a terminal");
    line.make_raw();
    rustix::termios::tcsetattr(&slave, rustix::termios::OptionalActions::Now, &line).expect("raw");
    let handle = thread::spawn(move || serve(File::from(master), slave, fault));
    (path, handle)
}

fn machine() -> Machine {
    let mut chance = Chance::new(99);
    let layout = Layout {
        count: 16,
        radius: 100.0,
        centre: Vector2::new(0.4, -0.2),
        angle: 0.05,
        missing: vec![6],
        others: Vec::new(),
        placement: 0.05,
    };
    Machine { a: 0.25, b: -0.6, magnets: layout.magnets(&mut chance), ..Machine::default() }
}

fn serve(line: File, slave: OwnedFd, fault: Fault) -> Vec<String> {
    let mut rig = SimulatedRig::new(machine(), 1);
    let mut out = line.try_clone().expect("two ends");
    let mut told = Vec::new();
    let mut held = Some(slave);
    for command in BufReader::new(line).lines() {
        let Ok(command) = command else { break };
        // From now on the line ends with the program.
        held.take();
        told.push(command.clone());
        match fault {
            Fault::Disconnects(after) if told.len() > after => break,
            Fault::FallsSilent(after) if told.len() > after => continue,
            Fault::Slow => thread::sleep(Duration::from_millis(10)),
            _ => {}
        }
        if let Some(instead) = instead(fault, told.len()) {
            if out.write_all(&instead).is_err() {
                break;
            }
            continue;
        }
        let mut answer = match (fault, command.starts_with("G1")) {
            (Fault::Refuses, true) => "Error: not homed\n".to_owned(),
            _ => format!("{}ok\n", obey(&mut rig, &command)),
        };
        match fault {
            Fault::Chatter => {
                answer = answer.replace("seek ", "// seek ");
                answer = format!("// hello\n\u{1}\u{2}\r\necho:busy: processing\n{answer}");
            }
            Fault::Garbage if command.starts_with("M5801") => {
                answer = "seek hit Tx9\nok\n".to_owned();
            }
            Fault::Busy if told.len() == 30 => {
                for _ in 0..6 {
                    out.write_all(b"echo:busy: processing\n").expect("somebody listens");
                    thread::sleep(Duration::from_millis(500));
                }
            }
            Fault::Temperatures => {
                answer = format!(" T:210.0 /210.0 B:60.0 /60.0 @:64\n{answer}T:209.9 B:60.1\n");
            }
            Fault::Flood(after) if told.len() > after => answer.push_str("ok\n"),
            _ => {}
        }
        if out.write_all(answer.as_bytes()).is_err() {
            break;
        }
    }
    told
}

/// What a firmware says in place of doing what it is told.
fn instead(fault: Fault, told: usize) -> Option<Vec<u8>> {
    let text = match fault {
        Fault::Halts(after) if told > after => "Error:Printer halted. kill() called!\n".to_owned(),
        Fault::ResendsForEver(after) if told > after => "Resend: 5\nok\n".to_owned(),
        Fault::Resets(after) if told > after => "start\necho:Marlin 2.1\nok\n".to_owned(),
        Fault::Boots if told == 1 => "start\necho:Marlin 2.1\n".to_owned(),
        // What is asked for again comes again, and is done then.
        Fault::Resends if told % 12 == 3 => format!("Resend: {told}\nok\n"),
        Fault::Resends if told % 12 == 7 => "Resend: 5\nok\n".to_owned(),
        // Without an `ok`, once: its absence is waited for.
        Fault::Resends if told == 17 => "rs 17\n".to_owned(),
        Fault::Noise(after) if told == after => {
            let mut chance = 1_u32;
            let mut byte = || {
                chance = chance.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                let byte = chance.to_le_bytes()[3];
                if byte == b'\n' || byte == b'\r' { b'x' } else { byte }
            };
            return Some((0..1 << 20).map(|_| byte()).collect());
        }
        Fault::Noise(after) if told > after => String::new(),
        _ => return None,
    };
    Some(text.into_bytes())
}

fn obey(rig: &mut SimulatedRig, command: &str) -> String {
    let word = |letter: char| {
        let found = command.split(' ').skip(1).find_map(|word| word.strip_prefix(letter));
        found.map(|value| value.parse::<f64>().expect("words have numbers"))
    };
    let name = command.split(' ').next().expect("a command");
    match (name, word('R'), word('T')) {
        ("G28", ..) => rig.home().expect("simulated"),
        ("G1", Some(s), None) => rig.carriage_to(s).expect("simulated"),
        ("G1", None, Some(degrees)) => rig.turn_to(degrees.to_radians()).expect("simulated"),
        ("M5801", _, Some(degrees)) => {
            let is_on = word('P').expect("a state") == 1.0;
            let hit = rig.turn_until(is_on, degrees.to_radians()).expect("simulated");
            return match hit {
                Some(theta) => format!("seek hit T{:.5}\n", theta.to_degrees()),
                None => "seek miss\n".to_owned(),
            };
        }
        ("M5802", ..) => {
            let state = if rig.is_on().expect("simulated") { "on" } else { "off" };
            return format!("sensor {state}\n");
        }
        ("M5803", ..) => return format!("level {:.2}\n", rig.level().expect("simulated")),
        ("M400" | "G90", ..) => {}
        _ => panic!("{command:?} is no command of the protocol"),
    }
    String::new()
}

fn scan_over(line: &Path, folder: &Path, timeout: &str) -> Child {
    let mut arguments = vec!["--port", line.to_str().expect("a path"), "--timeout", timeout];
    arguments.extend(BOTH_SIDES);
    let mut command = command(folder, &arguments);
    command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("the binary runs")
}

#[test]
fn a_printer_on_a_line_is_calibrated() {
    for (name, fault, timeout) in [
        ("line", Fault::None, "20"),
        ("chatter", Fault::Chatter, "20"),
        ("boots", Fault::Boots, "20"),
        ("resends", Fault::Resends, "20"),
        ("temperatures", Fault::Temperatures, "20"),
        // It works for 3 s, and nobody waits for longer than 1.
        ("busy", Fault::Busy, "1"),
    ] {
        let folder = folder(name);
        let (line, firmware) = firmware(fault);
        let done = scan_over(&line, &folder, timeout).wait_with_output().expect("it ends");
        assert_eq!(done.status.code(), Some(0), "{name}: {}", text(&done.stderr));
        let found = calibration(&folder);
        let machine = machine();
        let a = machine.a + machine.rail_play / 2.0;
        assert!((found.rail.a_mm - a).abs() < 0.015, "{found:?}");
        assert!((found.rail.b_mm - machine.b).abs() < 0.015, "{found:?}");
        let told = firmware.join().expect("no command was strange");
        assert_eq!(told.first().map(String::as_str), Some("G90"));
        assert!(told.iter().any(|line| line.starts_with("G1 R120 ")), "parked");
    }
}

#[test]
fn whatever_a_printer_does_nothing_wrong_is_written() {
    for (name, fault, says) in [
        ("gone", Fault::Disconnects(100), "the printer is gone"),
        ("silent", Fault::FallsSilent(60), "did not answer"),
        ("garbage", Fault::Garbage, "answered"),
        ("refuses", Fault::Refuses, "refused"),
        ("halts", Fault::Halts(50), "Printer halted"),
        ("noise", Fault::Noise(50), "did not answer"),
        ("again", Fault::ResendsForEver(50), "send it again"),
        ("flood", Fault::Flood(50), "answered"),
        ("resets", Fault::Resets(50), "it started anew"),
        ("mute", Fault::FallsSilent(0), "did not answer"),
    ] {
        let folder = folder(name);
        let (line, _firmware) = firmware(fault);
        let done = scan_over(&line, &folder, "1").wait_with_output().expect("it ends");
        let said = text(&done.stderr);
        assert_eq!(done.status.code(), Some(10), "{name}: {said}");
        assert!(said.contains(says), "{name}: {said}");
        assert!(!folder.join("calibration.toml").exists(), "{name}");
    }
    let done = run(&folder("none"), &["--port", "no-such-device"]);
    assert_eq!(done.status.code(), Some(10), "{}", text(&done.stderr));
}

#[test]
fn a_stop_parks_the_machine() {
    let folder = folder("stop");
    let (line, firmware) = firmware(Fault::Slow);
    let mut child = scan_over(&line, &folder, "20");
    thread::sleep(Duration::from_millis(700));
    let pid = rustix::process::Pid::from_child(&child);
    rustix::process::kill_process(pid, rustix::process::Signal::INT).expect("it still runs");
    let status = child.wait().expect("it ends");
    assert_eq!(status.code(), Some(130), "{status:?}");
    assert!(!folder.join("calibration.toml").exists());
    let told = firmware.join().expect("no command was strange");
    let parked = told.iter().rposition(|line| line.starts_with("G1 R120 ")).expect("it is parked");
    assert!(told.len() - parked <= 2, "{:?}", &told[parked..]);
}

//! What is tried with bytes of any kind: each function feeds them to one door of the program and
//! checks what must hold whatever they are. A panic, a limit of memory or of time is a finding.

use std::fmt::Write as _;
use std::io::BufRead;
use std::path::Path;
use std::sync::OnceLock;

use machine::gcode::MOST_COLUMNS;
use mesh::model::Format;
use mesh::soup::Soup;
use rhumb::calibration::Calibration;
use rhumb::check::{check, refusal, refusal_of_converted};
use rhumb::convert::{self, convert_checked, middle};
use rhumb::failure::Failure;
use rhumb::interrupt::Interrupt;
use rhumb::models::{self, Model};
use rhumb::pipeline::{self, Watch, slice};
use rhumb::place::Wish;
use rhumb::progress::Silent;
use rhumb::settings::merge::Sources;
use rhumb::settings::{Job, Settings, file, key::Section, prusa, template};

/// The door of this name.
#[must_use]
pub fn door(name: &str) -> Option<fn(&[u8])> {
    let doors: [(&str, fn(&[u8])); 6] = [
        ("stl", stl),
        ("model", model),
        ("gcode", gcode),
        ("settings", settings),
        ("calibration", calibration),
        ("chain", chain),
    ];
    doors.into_iter().find(|door| door.0 == name).map(|door| door.1)
}

/// The job of the built-in profiles.
fn job() -> &'static (Settings, Job) {
    static JOB: OnceLock<(Settings, Job)> = OnceLock::new();
    JOB.get_or_init(|| {
        // Threads would make runs differ from each other.
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread();
        let _ = pool.build_global();
        let settings = Settings::defaults();
        let job = Job::resolve(&settings).expect("defaults fit together");
        (settings, job)
    })
}

/// What is said must be short, on few lines, and of a class with an exit status.
fn said(failure: &Failure) {
    let text = failure.to_string();
    assert!(text.len() <= 4096 * 4 && text.lines().count() <= 2, "{text}");
    assert!(!text.chars().any(|c| c.is_control() && c != '\n'), "{text:?}");
    assert!(failure.class() != "Bug" && failure.exit_status() != 70, "{text}");
}

/// Mends what was read; what comes out is closed, finite and has a volume.
fn mend(soup: &Soup) {
    let Ok((solid, _)) = mesh::health::solid_from_soup(soup) else { return };
    let volume = solid.volume_mm3();
    assert!(volume.is_finite(), "volume {volume}");
}

/// Any bytes as an STL file.
pub fn stl(bytes: &[u8]) {
    if let Ok((soup, _)) = mesh::stl::read(bytes) {
        assert!(soup.facets.len() <= bytes.len(), "facets come from bytes");
        assert!(soup.facets.iter().flatten().flatten().all(|c| c.is_finite()));
        mend(&soup);
    }
}

/// Any bytes as a 3MF (when they begin like an archive, or the first byte is even) or an OBJ file.
pub fn model(bytes: &[u8]) {
    let (Some(&first), is_archive) = (bytes.first(), bytes.starts_with(b"PK")) else { return };
    let (format, bytes) = match (is_archive, first % 3) {
        (true, _) => (Format::ThreeMf, bytes),
        (false, 0) => (Format::ThreeMf, &bytes[1..]),
        (false, _) => (Format::Obj, &bytes[1..]),
    };
    // An archive is packed here, so that what is fuzzed is the XML too and not the packing alone.
    let packed;
    let bytes = if format == Format::ThreeMf && !is_archive {
        packed = stored(&[("3D/3dmodel.model", bytes)]);
        &packed
    } else {
        bytes
    };
    let model = Model { name: Path::new("x"), format, bytes: bytes.into() };
    match models::read(&model, &Wish::default()) {
        Ok(given) => {
            assert!(given.soup.facets.iter().flatten().flatten().all(|c| c.is_finite()));
            if given.soup.facets.len() < 2000 {
                mend(&given.soup);
            }
        }
        Err(failure) => said(&failure),
    }
}

/// A ZIP archive of members that are not packed.
fn stored(members: &[(&str, &[u8])]) -> Vec<u8> {
    let (mut out, mut directory) = (Vec::new(), Vec::new());
    for (name, bytes) in members {
        let at = (out.len() as u32).to_le_bytes();
        let size = (bytes.len() as u32).to_le_bytes();
        let length = (name.len() as u16).to_le_bytes();
        let sum = crc(bytes).to_le_bytes();
        let common =
            [&[20, 0, 0, 0, 0, 0, 0, 0, 0, 0][..], &sum, &size, &size, &length, &[0, 0]].concat();
        out.extend([b"PK\x03\x04".as_slice(), &common, name.as_bytes(), bytes].concat());
        directory.extend(
            [b"PK\x01\x02\x14\0".as_slice(), &common, &[0; 10], &at, name.as_bytes()].concat(),
        );
    }
    let (n, size, at) = (members.len() as u16, directory.len() as u32, out.len() as u32);
    out.extend(directory);
    out.extend(b"PK\x05\x06\0\0\0\0");
    for half in [n, n] {
        out.extend(half.to_le_bytes());
    }
    out.extend(size.to_le_bytes());
    out.extend(at.to_le_bytes());
    out.extend([0, 0]);
    out
}

/// The checksum of ZIP members (CRC-32, ISO 3309).
fn crc(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(u32::MAX, |sum, byte| {
        (0..8).fold(sum ^ u32::from(*byte), |sum, _| {
            if sum & 1 == 1 { (sum >> 1) ^ 0xedb8_8320 } else { sum >> 1 }
        })
    })
}

/// Any bytes as another slicer's program: what is written is proved, and keeps the contract of text.
pub fn gcode(bytes: &[u8]) {
    let (_, job) = job();
    let request = convert::Request {
        name: "x",
        origin: nalgebra::Vector2::zeros(),
        job,
        keeps_dangerous: bytes.len() % 2 == 1,
        made_at: "2026-01-31 at 12:00:00",
    };
    let mut out = Vec::new();
    match convert_checked(&request, bytes, &mut out, &Interrupt::default()) {
        Ok((converted, verdict)) => {
            let refused = refusal_of_converted(&verdict);
            assert!(refused.is_none(), "{}", refused.expect("it is some"));
            assert!(converted.filament.is_finite() && converted.time.is_finite());
            lines_keep_the_contract(&out);
        }
        Err(failure) => said(&failure),
    }
    if let Err(failure) = middle(bytes, "x") {
        said(&failure);
    }
    // The proof reads any text.
    let verdict = check(bytes, job, None, false, |_| {}).expect("memory can be read");
    let _ = refusal(&verdict);
    let (_, _) = convert::segments(bytes, nalgebra::Vector2::zeros(), |_| {});
}

fn lines_keep_the_contract(text: &[u8]) {
    for line in text.lines().map(|line| line.expect("what is written is text")) {
        assert!(line.len() <= MOST_COLUMNS && line.is_ascii(), "{line}");
        assert!(!line.chars().any(char::is_control), "{line:?}");
        // The last lift is marked.
        let Some(words) = line.trim_end_matches(" ;E").strip_prefix("G1 ") else { continue };
        let is_plain = |number: &str| {
            let digits = number.strip_prefix('-').unwrap_or(number);
            number != "-0" && digits.bytes().all(|byte| byte == b'.' || byte.is_ascii_digit())
        };
        let is_word = |word: &str| {
            word.is_char_boundary(1) && is_plain(&word[1..]) && word[1..].parse::<f64>().is_ok()
        };
        assert!(words.split(' ').all(is_word), "{line}");
    }
}

/// Any bytes as a settings file of each section, as an exported configuration and as a start program.
pub fn settings(bytes: &[u8]) {
    for section in Section::ALL {
        if let Err(failure) = file::read(bytes, "x.toml", section) {
            said(&failure);
        }
    }
    if let Err(failure) = prusa::read(bytes, "x.ini") {
        said(&failure);
    }
    let sources = Sources { print: Some("x.toml".into()), ..Sources::default() };
    let settings = Settings::load(&sources, &|_| Ok(bytes.to_vec()));
    match settings.and_then(|settings| Job::resolve(&settings).map(|_| settings)) {
        Ok(_) => {}
        Err(failure) => said(&failure),
    }
    if let Ok(text) = std::str::from_utf8(bytes) {
        match template::fill(text, "start_gcode", &job().0) {
            Ok(lines) => {
                assert!(lines.iter().all(|line| !line.contains(['\n', '\r'])), "{lines:?}")
            }
            Err(failure) => said(&failure),
        }
    }
}

/// Any bytes as the log of a calibration scan and as a calibration file.
pub fn calibration(bytes: &[u8]) {
    if let Ok(calibration) = Calibration::read(bytes, "x.toml") {
        let (_, job) = job();
        let mut printer = job.printer.clone();
        if let Err(failure) = calibration.apply(&mut printer, job.bed_map_fade) {
            said(&failure);
        }
    }
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    if let Ok(log) = machine::calibration::log::parse(text)
        && let Ok(fit) = machine::calibration::fit::fit_log(&log)
    {
        assert!(fit.n_used() <= log.rows.len());
    }
}

/// A mesh on a small grid, which touches and crosses itself often, sliced and proved: the program is
/// refused by nothing, and no line breaks the contract.
pub fn chain(bytes: &[u8]) {
    let (Some((&[family, kind, size], rest)), (settings, job)) = (bytes.split_first_chunk(), job())
    else {
        return;
    };
    let side = 1.5 + f32::from(size % 8) / 2.0;
    let corner = |byte: &u8| [byte & 3, byte >> 2 & 3, byte >> 4 & 3].map(|c| f32::from(c) * side);
    let mut facets: Vec<[[f32; 3]; 3]> = Vec::new();
    if kind % 2 == 0 {
        let all: Vec<[f32; 3]> = rest.iter().take(48).map(corner).collect();
        facets.extend(all.chunks_exact(3).map(|c| [c[0], c[1], c[2]]));
    } else {
        // Blocks between pairs of corners: closed, and often through each other.
        for pair in rest.chunks_exact(2).take(4) {
            facets.extend(block(corner(&pair[0]), corner(&pair[1])));
        }
    }
    let model = binary(&facets);
    let (settings, job) = match family % 3 {
        0 => (settings.clone(), job.clone()),
        k => {
            let mut settings = settings.clone();
            let word = if k == 1 { "layers=conical" } else { "layers=spherical" };
            if settings.set(word).is_err() {
                return;
            }
            match Job::resolve(&settings) {
                Ok(job) => (settings, job),
                Err(_) => return,
            }
        }
    };
    let request = pipeline::Request {
        model: &model,
        name: "x",
        wish: Wish::default(),
        settings: &settings,
        job: &job,
        made_at: "2026-01-31 at 12:00:00",
    };
    let mut out = Vec::new();
    let watch = &mut Watch { progress: &mut Silent, interrupt: &Interrupt::default() };
    match slice(&request, &mut out, watch) {
        Ok(outcome) => {
            let part = Some(pipeline::part(&outcome));
            let verdict = check(&out[..], &job, part, true, |_| {}).expect("memory can be read");
            // What has holes that stay open, or was guessed, is no solid that beads could be
            // compared with: then the program owes only what keeps the machine whole.
            let is_solid = outcome.health.open_edges_left == 0 && !outcome.health.guessed;
            let refused = if is_solid { refusal(&verdict) } else { refusal_of_converted(&verdict) };
            if let Some(refused) = refused {
                let mut all = String::new();
                for finding in &verdict.findings {
                    let _ = writeln!(all, "{finding}");
                }
                panic!("{refused}\n{all}");
            }
            lines_keep_the_contract(&out);
        }
        Err(failure) => said(&failure),
    }
}

/// The facets of a block between two corners, seen from outside.
fn block(a: [f32; 3], b: [f32; 3]) -> Vec<[[f32; 3]; 3]> {
    let corner = |k: usize| {
        let pick = |axis: usize| {
            if k >> axis & 1 == 0 { a[axis].min(b[axis]) } else { a[axis].max(b[axis]) }
        };
        [pick(0), pick(1), pick(2)]
    };
    let sides =
        [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let halves =
        |[p, q, r, s]: [usize; 4]| [[p, q, r], [p, r, s]].map(|c: [usize; 3]| c.map(corner));
    sides.into_iter().flat_map(halves).collect()
}

fn binary(facets: &[[[f32; 3]; 3]]) -> Vec<u8> {
    let mut bytes = vec![b' '; 80];
    bytes.extend((facets.len() as u32).to_le_bytes());
    for facet in facets {
        bytes.extend([0; 12]);
        facet.iter().flatten().for_each(|c| bytes.extend(c.to_le_bytes()));
        bytes.extend([0; 2]);
    }
    bytes
}

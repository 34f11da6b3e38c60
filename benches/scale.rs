//! How the time of a slice grows: with triangles, with layers, and how it shrinks with threads.
//!
//! A sphere of 80 mm, without self-check, on one thread unless said otherwise; beside each slice its
//! floor, which is reading the mesh and writing as many bytes as the program has, and nothing else.
//! Medians of three runs, in ms of the clock. Run with `cargo bench -p rhumb --bench scale`; with
//! `-- --small` it leaves the largest mesh out.

use std::error::Error;
use std::fs;
use std::io::{self, Write};
use std::path::Path;
use std::time::Instant;

use mesh::{shapes, stl};
use rayon::ThreadPoolBuilder;
use rhumb::failure::Failure;
use rhumb::interrupt::Interrupt;
use rhumb::pipeline::{Request, Watch, slice};
use rhumb::place::Wish;
use rhumb::progress::Silent;
use rhumb::report::Timings;
use rhumb::settings::{Job, Settings};

const RADIUS_MM: f64 = 40.0;

/// Runs of which the middle one counts.
const RUNS: usize = 3;

/// What a slice took, ms, and its numbers.
struct Taken {
    whole: f64,
    timings: Timings,
    layers: usize,
    bytes: usize,
}

fn main() -> Result<(), Box<dyn Error>> {
    let small = std::env::args().any(|argument| argument == "--small");
    let folder = std::env::temp_dir().join(format!("rhumb-scale-{}", std::process::id()));
    fs::create_dir_all(&folder)?;
    let result = tables(&folder, small);
    fs::remove_dir_all(&folder)?;
    result
}

fn tables(folder: &Path, small: bool) -> Result<(), Box<dyn Error>> {
    let levels = if small { 6..=8 } else { 6..=9 };
    head("triangles")?;
    let mut points = Vec::new();
    for level in levels {
        let model = stl::write(&shapes::icosphere(level, RADIUS_MM));
        let taken = median(&model, 0.2, 1)?;
        let triangles = 20.0 * 4.0_f64.powi(level as i32);
        row(&format!("{triangles}"), &taken, floor(folder, &model, taken.bytes)?)?;
        points.push((triangles, taken.whole));
    }
    writeln!(io::stdout(), "\ntime ∝ triangles^{:.2}\n", exponent(&points))?;

    head("layers")?;
    let model = stl::write(&shapes::icosphere(6, RADIUS_MM));
    let mut points = Vec::new();
    for height in [0.3, 0.2, 0.1, 0.05] {
        let taken = median(&model, height, 1)?;
        row(&taken.layers.to_string(), &taken, floor(folder, &model, taken.bytes)?)?;
        points.push((taken.layers as f64, taken.whole));
    }
    writeln!(io::stdout(), "\ntime ∝ layers^{:.2}\n", exponent(&points))?;

    head("threads")?;
    for level in [6, 8] {
        let model = stl::write(&shapes::icosphere(level, RADIUS_MM));
        let most = std::thread::available_parallelism()?.get();
        for threads in (0..).map(|k| 1 << k).take_while(|threads| *threads <= most) {
            let taken = median(&model, 0.2, threads)?;
            let name = format!("{threads}, {} triangles", 20 * 4_u32.pow(level));
            row(&name, &taken, floor(folder, &model, taken.bytes)?)?;
        }
    }
    Ok(())
}

fn head(what: &str) -> io::Result<()> {
    writeln!(
        io::stdout(),
        "| {what} | read | repair | orient and place | schedule | slice, plan and write | all | floor |\n\
         | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: |"
    )
}

fn row(name: &str, taken: &Taken, floor: f64) -> io::Result<()> {
    let Timings { read, repair, orient, schedule, slice, .. } = taken.timings;
    let stages = [read, repair, orient, schedule, slice, taken.whole];
    let stages: Vec<String> = stages.iter().map(|ms| format!("{ms:.0}")).collect();
    writeln!(io::stdout(), "| {name} | {} | {floor:.1} |", stages.join(" | "))
}

/// The middle one of some slices on so many threads.
fn median(model: &[u8], height: f64, threads: usize) -> Result<Taken, Box<dyn Error>> {
    let mut settings = Settings::defaults();
    settings.set(&format!("layer_height_mm={height}"))?;
    let job = Job::resolve(&settings)?;
    let pool = ThreadPoolBuilder::new().num_threads(threads).build()?;
    let mut runs = Vec::new();
    for _ in 0..RUNS {
        runs.push(pool.install(|| once(model, &settings, &job))?);
    }
    runs.sort_by(|a, b| a.whole.total_cmp(&b.whole));
    Ok(runs.swap_remove(RUNS / 2))
}

fn once(model: &[u8], settings: &Settings, job: &Job) -> Result<Taken, Failure> {
    let wish = Wish::default();
    let request = Request { model, name: "sphere", wish, settings, job, made_at: "now" };
    let watch = &mut Watch { progress: &mut Silent, interrupt: &Interrupt::default() };
    let mut text = Vec::new();
    let start = Instant::now();
    let outcome = slice(&request, &mut text, watch)?;
    let whole = start.elapsed().as_secs_f64() * 1000.0;
    let layers = outcome.layout.levels.len();
    Ok(Taken { whole, timings: outcome.timings, layers, bytes: text.len() })
}

/// Reading a mesh from a warm cache and writing some bytes, ms.
fn floor(folder: &Path, model: &[u8], bytes: usize) -> io::Result<f64> {
    let (from, to) = (folder.join("model.stl"), folder.join("program.gcode"));
    fs::write(&from, model)?;
    let program = vec![b'G'; bytes];
    let start = Instant::now();
    let read = fs::read(&from)?;
    fs::write(&to, &program)?;
    let ms = start.elapsed().as_secs_f64() * 1000.0;
    assert_eq!(read.len(), model.len());
    Ok(ms)
}

/// The slope of a line through points on logarithmic scales, by least squares.
fn exponent(points: &[(f64, f64)]) -> f64 {
    let logs: Vec<(f64, f64)> = points.iter().map(|(x, y)| (x.ln(), y.ln())).collect();
    let n = logs.len() as f64;
    let mean = |of: fn(&(f64, f64)) -> f64| logs.iter().map(of).sum::<f64>() / n;
    let (x, y) = (mean(|p| p.0), mean(|p| p.1));
    let slope = logs.iter().map(|p| (p.0 - x) * (p.1 - y)).sum::<f64>();
    slope / logs.iter().map(|p| (p.0 - x).powi(2)).sum::<f64>()
}

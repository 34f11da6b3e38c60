//! Orientation, flat faces and schedule of a mesh of 5 million triangles, beside the whole slice
//! of it: together they may take a tenth. Run with `cargo bench -p rhumb --bench schedule`; with
//! `-- --no-slice` it takes seconds.

use std::io::{self, Write};
use std::time::Instant;

use mesh::mesh::Mesh;
use mesh::orient::{candidates, rate, rest};
use mesh::place::placed;
use mesh::topology::Solid;
use mesh::weld::weld;
use mesh::{flats, shapes, stl};
use rhumb::failure::Failure;
use rhumb::interrupt::Interrupt;
use rhumb::levels::layout;
use rhumb::pipeline::{Request, Watch, slice};
use rhumb::place::Wish;
use rhumb::progress::Silent;
use rhumb::settings::{Job, Settings};
use slicer::surface::Plane;

/// An ellipsoid of 5 242 880 triangles with two flat sides and terraces of 2 mm around it.
fn model() -> Mesh {
    const RADIUS_MM: f64 = 40.0;
    let mut mesh = shapes::icosphere(9, RADIUS_MM);
    for p in &mut mesh.vertices {
        // A part that is round from above would take longer to place than most parts do.
        p.x *= 1.4;
        p.z = p.z.clamp(0.3 * RADIUS_MM, 1.7 * RADIUS_MM);
        if (p.z / 8.0).fract() < 0.25 {
            p.z = (p.z / 8.0).floor() * 8.0 + 0.07;
        }
    }
    mesh
}

/// Runs some work and returns its time on the processors, ms, where the system tells it, or on
/// the clock: on a busy machine only the former can be compared.
fn timed<T>(name: &str, work: impl FnOnce() -> T) -> io::Result<(T, f64)> {
    let (start, busy) = (Instant::now(), processor_ms());
    let result = work();
    let ms = start.elapsed().as_secs_f64() * 1000.0;
    let busy = processor_ms().zip(busy).map(|(after, before)| after - before);
    let used = busy.map_or_else(String::new, |busy| format!(", {busy:.0} ms of processors"));
    writeln!(io::stdout(), "{name:>28} {ms:>10.1} ms{used}")?;
    Ok((result, busy.unwrap_or(ms)))
}

/// Time that all threads of this process have run, ms, in steps of 10; `None` off Linux.
fn processor_ms() -> Option<f64> {
    const MS_PER_TICK: f64 = 10.0;
    let text = std::fs::read_to_string("/proc/self/stat").ok()?;
    // The name of the program is in brackets and may hold spaces; times are fields 14 and 15.
    let (_, fields) = text.rsplit_once(')')?;
    let ticks = fields.split_whitespace().skip(11).take(2).map(str::parse::<f64>);
    Some(ticks.map(Result::ok).sum::<Option<f64>>()? * MS_PER_TICK)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let settings = Settings::defaults();
    let job = Job::resolve(&settings)?;
    // As a slice sees it: vertices in the order of the file.
    let bytes = stl::write(&model());
    let (mesh, _) = weld(&stl::read(&bytes)?.0);
    writeln!(io::stdout(), "{} triangles", mesh.triangles.len())?;

    let ((rotation, _), rest_ms) = timed("rest", || rest(&mesh, &job.orient))?;
    let (ranked, _) = timed("candidates", || candidates(&mesh, &job.orient))?;
    timed("rate one candidate", || ranked.first().map(|c| rate(&mesh, c, &job.orient)))?;
    let (part, _) = placed(&Solid::new(mesh.clone()), &rotation);
    let (found, _) = timed("flats", || flats::flats(part.mesh(), &job.flats))?;
    let (planned, layout_ms) = timed("flats and schedule", || layout(part.mesh(), &Plane, &job))?;
    let planned = planned?;
    let mut adaptive = settings.clone();
    adaptive.set("adaptive=true")?;
    let adaptive = Job::resolve(&adaptive)?;
    timed("the same, adaptive", || layout(part.mesh(), &Plane, &adaptive))?.0?;
    let missed = planned.missed().count();
    writeln!(
        io::stdout(),
        "{} layers, {} flat faces, {missed} missed",
        planned.levels.len(),
        found.len()
    )?;
    if std::env::args().any(|argument| argument == "--no-slice") {
        return Ok(());
    }
    drop((mesh, part));
    let (outcome, slice_ms) = timed("whole slice", || whole(&bytes, &settings, &job))?;
    let timings = outcome?;
    writeln!(
        io::stdout(),
        "of which orient {:.1} ms and schedule {:.1} ms; rest and schedule are {:.1} % of it",
        timings.orient,
        timings.schedule,
        (rest_ms + layout_ms) / slice_ms * 100.0
    )?;
    Ok(())
}

fn whole(model: &[u8], settings: &Settings, job: &Job) -> Result<rhumb::report::Timings, Failure> {
    let request =
        Request { model, name: "terraces", wish: Wish::default(), settings, job, made_at: "now" };
    let watch = &mut Watch { progress: &mut Silent, interrupt: &Interrupt::default() };
    Ok(slice(&request, &mut io::sink(), watch)?.timings)
}

//! `rhumb preview`: pictures of a program, drawn from what the twin replayed.

use mesh::mesh::Mesh;
use nalgebra::Vector2;
use twin::picture::camera::Gaze;
use twin::picture::deposit::{self, DepositSink, Picture, deposit_png};
use twin::picture::layer::{LayerSink, layer_svg};
use twin::picture::plot::{Flat, MotionSink, motion_svg, schedule_svg};
use twin::picture::print::{PrintSink, Shade, print_svg};
use twin::picture::relief::{height_png, section_png};
use twin::ramps::Clock;
use twin::segment::Segment;
use twin::verify::Verdict;

use super::verify::{job_of, names_itself, part, read_program};
use super::{DONE, display_name, write_file};
use crate::args::{Coloring, DepositView, Plot, Preview};
use crate::check::{check, findings};
use crate::convert::{middle, segments};
use crate::failure::Failure;
use crate::page::columns::Columns;
use crate::page::{About, page};
use crate::report;
use crate::settings::Job;

/// Pieces that are drawn of a whole print as SVG: about a megabyte of picture, and more than a page
/// shows.
const MOST_PIECES: usize = 20_000;

pub(super) fn run(arguments: &Preview) -> Result<u8, Failure> {
    let ending = arguments.output.extension().and_then(|ending| ending.to_str());
    let ending = ending.unwrap_or_default().to_ascii_lowercase();
    let only = |flag: &str, wanted: &str| {
        let message = format!("{flag} is drawn as .{wanted}, not as .{ending}");
        (ending != wanted).then(|| Failure::new("Usage", message))
    };
    let misfit = match (arguments.layer, arguments.plot) {
        (Some(_), _) => only("--layer", "svg"),
        (_, Some(_)) => only("--plot", "svg"),
        _ if arguments.view != DepositView::Solid => only("--view", "png"),
        _ => None,
    };
    if let Some(failure) = misfit {
        return Err(failure);
    }
    let program = Program::read(arguments)?;
    let picture = match ending.as_str() {
        "html" | "htm" => program.page()?.into_bytes(),
        "png" => program.png()?,
        "svg" => program.svg()?.into_bytes(),
        _ => {
            return Err(Failure::new(
                "Usage",
                format!("{} ends neither in .html nor .png nor .svg", arguments.output.display()),
            ));
        }
    };
    write_file(&arguments.output, &[&arguments.program], &picture)?;
    Ok(DONE)
}

/// A program to be drawn.
struct Program<'a> {
    arguments: &'a Preview,
    bytes: Vec<u8>,
    job: Job,
    part: Option<Mesh>,
    /// Written by another slicer for a printer that is not polar.
    is_foreign: bool,
}

/// What a reading of a program came to.
struct Reading {
    verdict: Option<Verdict>,
    findings: Vec<report::Finding>,
}

impl<'a> Program<'a> {
    fn read(arguments: &'a Preview) -> Result<Self, Failure> {
        let bytes = read_program(&arguments.program)?;
        let settings = &arguments.settings;
        let is_told = settings.dialect.is_some() || settings.printer.is_some();
        Ok(Self {
            arguments,
            job: job_of(&bytes, settings)?,
            part: arguments.model.as_deref().map(part).transpose()?,
            is_foreign: !is_told && !names_itself(&bytes),
            bytes,
        })
    }

    /// Reads it to its end; `each` sees every motion. Another slicer's program is moved so that the
    /// middle of its print lies on the axis.
    fn replay(&self, each: impl FnMut(&Segment)) -> Result<Reading, Failure> {
        let origin = match self.is_foreign {
            true => middle(self.bytes.as_slice(), &self.name()).unwrap_or_default(),
            false => Vector2::zeros(),
        };
        self.replay_about(origin, each)
    }

    fn replay_about(
        &self,
        origin: Vector2<f64>,
        mut each: impl FnMut(&Segment),
    ) -> Result<Reading, Failure> {
        if !self.is_foreign {
            let part = self.part.as_ref();
            let verdict = check(self.bytes.as_slice(), &self.job, part, false, each)?;
            return Ok(Reading { findings: findings(&verdict), verdict: Some(verdict) });
        }
        let mut count = 0;
        let (unreadable, more) = segments(&self.bytes, origin, |segment| {
            count += 1;
            each(segment);
        });
        if count == 0 {
            let message = format!("{}: no line moves anything", self.name());
            return Err(Failure::new("GcodeSyntax", message));
        }
        let mut findings: Vec<report::Finding> = unreadable
            .into_iter()
            .map(|line| report::Finding {
                check: "text",
                severity: "warning",
                line: line.line,
                measured: 1.0,
                limit: 0.0,
                message: format!("line {} is not understood: {}", line.line, line.message),
            })
            .collect();
        if let (Some(last), true) = (findings.last_mut(), more > 0) {
            last.message.push_str(&format!("; and {more} lines more"));
        }
        Ok(Reading { findings, verdict: None })
    }

    fn name(&self) -> String {
        display_name(&self.arguments.program)
    }

    fn page(&self) -> Result<String, Failure> {
        let job = &self.job;
        let mut columns = Columns::new(&job.printer);
        // Places are told as the program says them.
        let mut clock = Clock::new(&job.printer);
        let reading = self.replay_about(Vector2::zeros(), |segment| {
            clock.segment(segment, |timed| columns.add(timed));
        })?;
        clock.finish(|timed| columns.add(timed));
        let axis = job.printer.alignment.part_from_bed(&Vector2::zeros());
        let is_judged = !self.is_foreign || !reading.findings.is_empty();
        let about = About {
            name: &self.name(),
            dialect: if self.is_foreign { "another slicer's" } else { job.dialect.name },
            axis: (!self.is_foreign).then_some([axis.x, axis.y]),
            filament_area: job.plan.filament.area,
            density_g_per_mm3: (!self.is_foreign).then_some(job.density_g_per_mm3),
            nozzle: job.printer.nozzle_diameter,
            findings: is_judged.then_some(reading.findings.as_slice()),
        };
        page(&about, &columns)
    }

    fn png(&self) -> Result<Vec<u8>, Failure> {
        let [width, height] = size(&self.arguments.size)?;
        let gaze = Gaze {
            azimuth: angle("--azimuth", self.arguments.azimuth)?,
            elevation: angle("--elevation", self.arguments.elevation)?,
        };
        let mut sink = DepositSink::new(&self.job.printer, self.job.plan.filament.area);
        self.replay(|segment| sink.add(segment))?;
        let relief = match self.arguments.view {
            DepositView::Solid => None,
            DepositView::Height => Some(height_png(&sink, [width, height])),
            DepositView::Section => {
                Some(section_png(&sink, gaze.azimuth, self.shade(), [width, height]))
            }
        };
        if let Some(relief) = relief {
            return relief
                .map(|relief| relief.png)
                .map_err(|error| Failure::new("Bug", format!("picture: {error}")));
        }
        deposit_png(&sink, &Picture { width, height, gaze, shade: self.shade() })
            .map_err(|error| Failure::new("Bug", format!("picture: {error}")))
    }

    fn shade(&self) -> Shade {
        match self.arguments.color_by {
            Coloring::Height => Shade::Height,
            Coloring::Role => Shade::Role,
        }
    }

    fn svg(&self) -> Result<String, Failure> {
        let printer = &self.job.printer;
        if let Some(layer) = self.arguments.layer {
            let mut sink = LayerSink::new(layer, printer);
            self.replay(|segment| sink.add(segment))?;
            return Ok(layer_svg(sink, printer));
        }
        match self.arguments.plot {
            Some(Plot::Motion) => {
                let mut sink = MotionSink::new(printer, self.job.plan.filament.area);
                let mut clock = Clock::new(printer);
                self.replay(|segment| clock.segment(segment, |timed| sink.add(timed)))?;
                clock.finish(|timed| sink.add(timed));
                Ok(motion_svg(&sink))
            }
            Some(Plot::Schedule) => self.schedule(),
            None => {
                let mut sink = PrintSink::new(MOST_PIECES, printer);
                self.replay(|segment| sink.add(segment))?;
                Ok(print_svg(sink, self.shade()))
            }
        }
    }

    fn schedule(&self) -> Result<String, Failure> {
        let Some(verdict) = self.replay(|_| {})?.verdict else {
            let message = format!("{}: another slicer's program", self.name());
            return Err(Failure::new("Usage", message)
                .hint("--plot schedule reads the layers of programs that rhumb wrote"));
        };
        let faces = self.part.as_ref().map(|part| mesh::flats::flats(part, &self.job.flats));
        let faces = faces.unwrap_or_default();
        let flats: Vec<Flat> =
            faces.iter().map(|face| Flat { z: face.z_mm, area: face.area_mm2 }).collect();
        Ok(schedule_svg(&verdict.totals.layers, &flats))
    }
}

/// Reads `WxH`.
fn size(text: &str) -> Result<[usize; 2], Failure> {
    let side = |text: &str| text.trim().parse().ok().filter(|n| (1..=deposit::LARGEST).contains(n));
    let sides = text.split_once(['x', 'X', '×']).and_then(|(w, h)| Some([side(w)?, side(h)?]));
    sides.ok_or_else(|| {
        let most = deposit::LARGEST;
        Failure::new(
            "Usage",
            format!("--size {text} is not WIDTHxHEIGHT with sides from 1 to {most}"),
        )
    })
}

fn angle(flag: &str, degrees: f64) -> Result<f64, Failure> {
    if degrees.is_finite() && degrees.abs() <= 360.0 {
        return Ok(degrees.to_radians());
    }
    Err(Failure::new("Usage", format!("{flag} {degrees} is not an angle from -360 to 360 degrees")))
}

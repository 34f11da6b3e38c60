//! The whole slice, from the bytes of a model to the text of a program.
//!
//! Layers are worked in windows: the sections and toolpaths of a window in parallel, its plan and
//! its text in order, while the next window is being filled. Text leaves as soon as a window is planned,
//! so memory holds the mesh and two windows, and the bytes are the same for any number of threads.

use std::io::Write;
use std::path::Path;

use geom::bounding::Bounds;
use machine::gcode::Emitter;
use machine::gcode::label::Labels;
use machine::program::Step;
use mesh::health::Health;
use mesh::mesh::Mesh;
use mesh::model::Format;
use mesh::note::Note;
use mesh::topology::Solid;
use nalgebra::{Point3, Rotation3};
use plan::objects::Objects;
use plan::planner::{Planner, Totals};
use slicer::layer::{Filled, Floating};
use slicer::level::Level;
use slicer::section::Tears;
use slicer::toolpath::{LayerPaths, LostArea};
use twin::picture::thumbnail::Thumbnail;

use crate::choice::{Choice, choose};
use crate::failure::Failure;
use crate::filling::{Batch, Filling};
use crate::groups::{Group, groups};
use crate::interrupt::Interrupt;
use crate::levels::{Layout, check_cuts};
use crate::models::{self, Arrangement, File, Model};
use crate::objects::Object;
use crate::output;
use crate::overhang::{Overhang, overhangs};
use crate::own::{self, Configured, Own};
use crate::place::{Fit, Placed, Wish, check_envelope, check_size, place, suspect_units};
use crate::program_text;
use crate::progress::Progress;
use crate::report::{Timings, Warning};
use crate::settings::{Job, Settings};
use crate::shelf::Shelf;
use crate::stages::{LayerKind, Stage, stages};
use crate::stopwatch::Stopwatch;
use crate::supports::supports;

/// What to slice and how.
pub struct Request<'a> {
    /// The bytes of an STL file, for [`slice()`].
    pub model: &'a [u8],
    /// What to call the model.
    pub name: &'a str,
    /// Where it is wanted.
    pub wish: Wish,
    /// All settings, for the end of the program.
    pub settings: &'a Settings,
    /// The same, as parameters.
    pub job: &'a Job,
    /// When the program was made, for its first line.
    pub made_at: &'a str,
}

/// Who is told of progress, and who may stop it.
pub struct Watch<'a> {
    /// Told what is being done.
    pub progress: &'a mut dyn Progress,
    /// Asked before every window of layers.
    pub interrupt: &'a Interrupt,
}

/// What came of it, besides the text.
pub struct Outcome {
    /// The model's mesh.
    pub health: Health,
    /// Where it was put.
    pub placed: Placed,
    /// The layers, and the flat faces that they meet.
    pub layout: Layout,
    /// The surface that they follow.
    pub layers: LayerKind,
    /// Their thickness along the normal, mm.
    pub heights: Vec<f64>,
    /// The surfaces that were weighed, if the user left the choice.
    pub choice: Option<Choice>,
    /// What hangs over, when layers are curved.
    pub overhang: Option<Overhang>,
    /// The islands that begin in mid-air, each with its layer; part frame.
    pub floating: Vec<(usize, Floating)>,
    /// The sums of the program.
    pub totals: Totals,
    /// Area that no bead fits in.
    pub lost: LostArea,
    /// Volume of these places, mm³.
    pub lost_volume: f64,
    /// What the user should know.
    pub warnings: Vec<Warning>,
    /// Milliseconds by stage.
    pub timings: Timings,
}

/// Slices a model and writes the program to `out`.
///
/// # Errors
///
/// [`Failure`] with what is wrong with model, settings or output.
pub fn slice(
    request: &Request<'_>,
    out: &mut (dyn Write + Send),
    watch: &mut Watch<'_>,
) -> Result<Outcome, Failure> {
    let name = Path::new(request.name);
    let model = Model { name, format: Format::Stl, bytes: request.model.into() };
    slice_all(request, vec![model], &Arrangement::default(), out, watch)
}

/// Slices models of any format, all on one bed and layer by layer together, and writes the program to
/// `out`.
///
/// # Errors
///
/// [`Failure`] with what is wrong with models, settings or output.
pub fn slice_all(
    request: &Request<'_>,
    models: Vec<Model<'_>>,
    arrangement: &Arrangement,
    out: &mut (dyn Write + Send),
    watch: &mut Watch<'_>,
) -> Result<Outcome, Failure> {
    let job = request.job;
    let mut clock = Stopwatch::start();
    let loaded = load(request, models, arrangement, &mut clock, watch)?;
    let Loaded { given, placed, overlap, own, health, read_ms, repair_ms, .. } = loaded;
    let fit = check_envelope(&placed, job)?;
    let mut warnings: Vec<Warning> = health.notes.iter().map(warning).collect();
    warnings.extend(loaded.warnings);
    warnings.extend(placement_warnings(&given, &placed, fit, job));
    warnings.extend(overlap.map(|[a, b]| Warning {
        code: "ModelsOverlap".to_owned(),
        message: format!("models {a} and {b} overlap where they stand, seen from above"),
    }));
    let orient_ms = clock.lap();

    // The slicer works in a frame that turns with the part, so that its choices do too.
    let turned = Rotation3::from_axis_angle(&nalgebra::Vector3::z_axis(), -placed.azimuth);
    let upright = placed.solid.moved(|p| turned * p);
    let choice = weighed(&upright, &placed, job, watch)?;
    let chosen = choice.as_ref().map(|choice| choice.best().job(job));
    let job = chosen.as_ref().unwrap_or(job);
    let (stages, mut layout) = stages(&placed.solid, job)?;
    check_cuts(placed.solid.mesh(), stages.iter().map(|stage| stage.printed.len()).sum(), job)?;
    warnings.extend(layout.warnings(job.schedule.snap));
    let curved = stages.iter().find(|stage| stage.kind != LayerKind::Planar);
    let overhang = curved
        .map(|stage| overhangs(placed.solid.mesh(), &*stage.surface, job.orient.overhang_rad));
    let layers_kind = curved.map_or(LayerKind::Planar, |stage| stage.kind);
    let schedule_ms = clock.lap();
    let mut job = job.clone();
    job.plan.resample.azimuth = placed.azimuth;
    let mut text = Emitter::for_printer(out, job.dialect, &job.printer);
    // On a bed that turns no side is the front: the picture is that of the upright part, too.
    let thumbnail = Thumbnail::draw(&upright);
    let start = start_with_objects(&placed, &own, &job, &mut text);
    program_text::head(&mut text, request.name, request.made_at, &thumbnail, &start)
        .map_err(written)?;
    let outlines = placed.objects.iter().map(|object| object.outline.clone()).collect();
    let objects = Objects { outlines };
    let groups = groups(&placed, &turned, &own, &job);
    let parts = Parts { all: &upright, groups: &groups, objects: &objects };
    let with = (&job, request.settings);
    let mut printed = layers(&parts, &stages, with, &mut text, watch)?;
    for (_, island) in &mut printed.floating {
        island.at = turned.inverse() * island.at;
    }
    layout.levels = std::mem::take(&mut printed.levels);
    program_text::tail(
        &mut text,
        &job.end,
        &printed.totals,
        &program_text::Material::of(&job, layout.levels.len()),
        request.settings,
    )
    .map_err(written)?;
    text.finish().map_err(written)?;
    warnings.extend(printed.warnings(&job));
    let timings = Timings {
        read: read_ms,
        repair: repair_ms,
        orient: orient_ms,
        schedule: schedule_ms,
        slice: clock.lap(),
        ..Timings::default()
    };
    let Printed { totals, lost, lost_volume, heights, floating, .. } = printed;
    Ok(Outcome {
        health,
        placed,
        layout,
        layers: layers_kind,
        heights,
        choice,
        overhang,
        floating,
        totals,
        lost,
        lost_volume,
        warnings,
        timings,
    })
}

/// The surface that suits the part, where the user left that open.
fn weighed(
    upright: &Solid,
    placed: &Placed,
    job: &Job,
    watch: &mut Watch<'_>,
) -> Result<Option<Choice>, Failure> {
    let time = |job: &Job| time_of(upright, placed, job, watch);
    job.choose_layers.then(|| choose(&placed.solid, job, time)).transpose()
}

/// How long a part takes to print, s: it is sliced for nobody.
fn time_of(
    upright: &Solid,
    placed: &Placed,
    job: &Job,
    watch: &mut Watch<'_>,
) -> Result<f64, Failure> {
    let (stages, _) = stages(&placed.solid, job)?;
    check_cuts(placed.solid.mesh(), stages.iter().map(|stage| stage.printed.len()).sum(), job)?;
    let mut job = job.clone();
    job.plan.resample.azimuth = placed.azimuth;
    let mut nobody = std::io::sink();
    let mut text =
        Emitter::for_printer(&mut nobody as &mut (dyn Write + Send), job.dialect, &job.printer);
    let parts = Parts { all: upright, groups: &[], objects: &Objects::default() };
    job.at_layers = None;
    let settings = Settings::defaults();
    Ok(layers(&parts, &stages, (&job, &settings), &mut text, watch)?.totals.time)
}

/// The start program, and after it which objects there are, where there are several and they are told.
fn start_with_objects(
    placed: &Placed,
    own: &[Own],
    job: &Job,
    text: &mut Emitter<&mut (dyn Write + Send)>,
) -> Vec<String> {
    let mut start = job.start.clone();
    for own in own {
        let model = own.model + 1;
        start.extend(own.said.iter().map(|said| format!("; model {model}: {said}")));
    }
    if let Some(words) = job.labels.filter(|_| placed.objects.len() > 1) {
        let labels = Labels::new(words, placed.objects.iter().map(|object| object.name.as_str()));
        let hulls: Vec<_> = placed.objects.iter().map(Object::hull).collect();
        start.extend(labels.definitions(&hulls));
        text.label(labels);
    }
    start
}

#[expect(clippy::needless_pass_by_value, reason = "the shape that map_err calls")]
fn written(error: std::io::Error) -> Failure {
    output::failed(Path::new("program"), &error)
}

fn warning(note: &Note) -> Warning {
    Warning { code: note.code.to_owned(), message: note.message.clone() }
}

/// What is odd about where the part lies, and where the model was: the box around it as given.
fn placement_warnings(given: &Bounds, placed: &Placed, fit: Fit, job: &Job) -> Vec<Warning> {
    let mut warnings = Vec::new();
    let mut warn = |code: &str, message: String| {
        warnings.push(Warning { code: code.to_owned(), message });
    };
    // A model that does not stand near the origin was made for another frame.
    let far = given.min.xy().coords.norm().max(given.max.xy().coords.norm());
    if !given.is_empty() && (given.min.z.abs() > RECENTRED_MM || far > job.printer.rail.max) {
        let shift = placed.placement.shift;
        warn(
            "Recentred",
            format!(
                "the model was moved by ({:.3}, {:.3}, {:.3}) mm onto the bed and the axis",
                shift.x, shift.y, shift.z
            ),
        );
    }
    if fit == Fit::Barely {
        warn("AtEnvelope", "the part reaches to the very end of the machine's travel".into());
    }
    if let Some(message) = suspect_units(placed, job) {
        warn("UnitsSuspect", message);
    }
    warnings
}

/// How far above or below z = 0 a model may stand without a word, mm.
const RECENTRED_MM: f64 = 0.01;

/// What the layers amount to.
#[derive(Default)]
struct Printed {
    totals: Totals,
    lost: LostArea,
    lost_volume: f64,
    tears: Tears,
    torn_layers: usize,
    /// Islands that begin in mid-air, with their layer; places in the frame that turns with the part.
    floating: Vec<(usize, Floating)>,
    adhesion_out_of_reach: usize,
    /// Planes without a bead of the part, and the height of the first, mm: those that nothing was laid
    /// above yet, and those that something was.
    empty: (usize, f64),
    gaps: (usize, f64),
    /// The layers that were printed.
    levels: Vec<Level>,
    /// Their thickness along the normal, mm.
    heights: Vec<f64>,
}

/// What is sliced, in the frame that turns with the part.
pub(crate) struct Parts<'a> {
    /// All models.
    pub(crate) all: &'a Solid,
    /// By how they are filled, where models differ in that.
    pub(crate) groups: &'a [Group],
    objects: &'a Objects,
}

fn layers(
    parts: &Parts<'_>,
    stages: &[Stage],
    (job, settings): (&Job, &Settings),
    text: &mut Emitter<&mut (dyn Write + Send)>,
    watch: &mut Watch<'_>,
) -> Result<Printed, Failure> {
    let printed = Printed::default();
    let shelves: Vec<Shelf> = stages.iter().map(|stage| Shelf::of(stage.levels.len())).collect();
    let columns = supports(parts.all, (stages, &shelves), job, watch)?;
    let mut planner = Planner::new(&job.printer, job.plan);
    if job.tells_progress {
        planner = planner.telling_time();
    }
    if job.draws_arcs {
        planner = planner.drawing_arcs();
    }
    if parts.objects.outlines.len() > 1 && job.labels.is_some() {
        planner = planner.with_objects(parts.objects.clone());
    }
    let count: usize = stages.iter().map(|stage| stage.printed.len()).sum();
    watch.progress.stage("slice", count as u64);
    let progress = &mut *watch.progress;
    let mut printing = Printing { stages, job, settings, planner, text, progress, printed };
    let mut filling = Filling::new(parts, (stages, &shelves), &columns, job, watch.interrupt);
    let mut filled = filling.next().transpose()?;
    while let Some(batch) = filled {
        watch.interrupt.check()?;
        let (planned, next) = rayon::join(|| printing.print(batch), || filling.next());
        planned?;
        filled = next.transpose()?;
    }
    let Printing { planner, mut printed, .. } = printing;
    let (steps, totals) =
        planner.finish().map_err(|error| Failure::new("Bug", error.to_string()))?;
    text.leave_part();
    write(text, &steps)?;
    printed.totals = totals;
    if printed.totals.part() <= 0.0 {
        return Err(nothing_to_print(count, job));
    }
    Ok(printed)
}

/// Layers on their way into the program.
struct Printing<'a, 't, 'o> {
    stages: &'a [Stage],
    job: &'a Job,
    settings: &'a Settings,
    planner: Planner<'a>,
    text: &'t mut Emitter<&'o mut (dyn Write + Send)>,
    progress: &'t mut dyn Progress,
    printed: Printed,
}

impl Printing<'_, '_, '_> {
    /// Plans the layers of a window and writes them.
    fn print(&mut self, batch: Batch) -> Result<(), Failure> {
        let stage = &self.stages[batch.stage];
        let is_one_of_many = self.stages.len() > 1;
        for tears in &batch.tears {
            self.printed.count_tears(tears);
        }
        if is_one_of_many && stage.morph.is_none() && batch.window.start == stage.printed.start {
            write(self.text, &[surface_remark(stage, stage.printed.start)])?;
        }
        for (k, mut filled) in batch.window.zip(batch.layers) {
            self.progress.advance(1);
            let stands_on_bed = batch.stage == 0 && stage.kind == LayerKind::Planar;
            if stands_on_bed {
                self.printed.count_empty(&filled.paths, &stage.levels[k]);
            }
            // Layers of one stage may pass beside the part, above or below it.
            if filled.paths.is_empty() && is_one_of_many && !stands_on_bed {
                continue;
            }
            if stage.morph.is_some() {
                write(self.text, &[surface_remark(stage, k)])?;
            }
            filled.paths.index = self.printed.levels.len();
            self.planner.follow(stage.form(k));
            self.printed.count(&filled, &stage.levels[k]);
            let normal = |p: &Point3<f64>| stage.normal(k, p);
            let steps = self.planner.layer_on(&filled.paths, normal).map_err(|error| {
                Failure::new("OutOfEnvelope", error.to_string()).hint(out_of_reach(self.job))
            })?;
            self.write(&steps)?;
        }
        Ok(())
    }

    /// Writes a layer, with what the printer wants to be told at each.
    fn write(&mut self, steps: &[Step]) -> Result<(), Failure> {
        let Some(programs) = &self.job.at_layers else { return write(self.text, steps) };
        for step in steps {
            let Step::Layer(layer) = step else {
                write(self.text, std::slice::from_ref(step))?;
                continue;
            };
            let [before, after] = programs.of(layer.index, layer.top, self.settings)?;
            let before = before.into_iter().map(Step::Custom);
            let after = after.into_iter().map(Step::Custom);
            let all: Vec<Step> = before.chain([step.clone()]).chain(after).collect();
            write(self.text, &all)?;
        }
        Ok(())
    }
}

/// Models on the bed.
struct Loaded {
    /// The box around the only model, as its file has it; empty when there are several, of which
    /// each lies as if it were alone.
    given: Bounds,
    placed: Placed,
    /// Two of several models that overlap.
    overlap: Option<[usize; 2]>,
    /// Models that are filled other than the rest.
    own: Vec<Own>,
    /// What of settings of objects is not taken over.
    warnings: Vec<Warning>,
    health: Health,
    read_ms: f64,
    repair_ms: f64,
}

/// Reads and repairs models and puts them on the bed.
fn load(
    request: &Request<'_>,
    models: Vec<Model<'_>>,
    arrangement: &Arrangement,
    clock: &mut Stopwatch,
    watch: &mut Watch<'_>,
) -> Result<Loaded, Failure> {
    let (job, wish) = (request.job, request.wish);
    watch.progress.stage("read", 1);
    let read = |model: Model<'_>| Ok((model.name.to_owned(), models::read(&model, &wish)?));
    let given = models.into_iter().map(read).collect::<Result<Vec<_>, Failure>>()?;
    let read_ms = clock.lap();
    watch.progress.stage("repair", 1);
    let (mut files, mut healths) = (Vec::new(), Vec::new());
    for (name, given) in given {
        check_size(&given.soup, job)?;
        let mut file = models::file(&given, &name, wish)?;
        drop(given);
        if arrangement.split {
            file = file.split(&wish);
        }
        healths.append(&mut file.healths);
        files.push(file);
    }
    let health = models::together(healths, arrangement.copies);
    let (own, warnings) = own_settings(&files, arrangement, request.settings)?;
    let repair_ms = clock.lap();
    watch.progress.stage("orient", 1);
    let is_one = files.iter().map(|file| file.objects.len()).sum::<usize>() == 1
        && arrangement.copies == 1
        && arrangement.at.is_empty()
        && own.is_empty();
    let only = if is_one { files.pop() } else { None };
    let (given, (placed, overlap)) = match only {
        Some(File { mut objects, wish, .. }) => {
            let solid = objects.remove(0).solid;
            (solid.mesh().bounds(), (place(solid, &wish, &job.orient)?, None))
        }
        None => (Bounds::default(), models::arrange(files, arrangement, &job.orient)?),
    };
    Ok(Loaded { given, placed, overlap, own, warnings, health, read_ms, repair_ms })
}

/// The models that are filled other than the rest, and what of it is not taken over.
fn own_settings(
    files: &[File],
    arrangement: &Arrangement,
    settings: &Settings,
) -> Result<(Vec<Own>, Vec<Warning>), Failure> {
    let models = || files.iter().flat_map(|file| &file.objects);
    own::check_numbers(&arrangement.own, models().count())?;
    if !arrangement.file_settings {
        return Ok((arrangement.own.clone(), Vec::new()));
    }
    let configured = models().enumerate().filter_map(|(model, object)| {
        let settings = object.settings.as_ref()?;
        Some(Configured { model, name: &object.name, settings })
    });
    let configured: Vec<_> = configured.collect();
    own::with_those_of_files(&arrangement.own, &configured, settings)
}

/// What helps where the machine cannot get to a place of a layer.
fn out_of_reach(job: &Job) -> &'static str {
    if job.printer.head.is_some() {
        return "tilt less (--set tilt=needed, tilt_max_deg), move the part with --place, or correct the \
                ranges of the head in the printer profile";
    }
    "move the part off the axis with --place, or correct the calibration"
}

/// How a program says which surface the following layers lie on.
pub const SURFACE_REMARK: &str = "layer surface = ";

fn surface_remark(stage: &Stage, k: usize) -> Step {
    Step::Remark(format!("{SURFACE_REMARK}{}", stage.describe(k)))
}

fn nothing_to_print(layers: usize, job: &Job) -> Failure {
    Failure::new(
        "NothingToPrint",
        format!(
            "no bead fits in any of the {layers} layers; all that is in them is narrower than {} mm or \
             shorter than a bead is wide",
            job.paths.thin.least_width
        ),
    )
    .hint("check the units of the file (--units), or print with a finer nozzle")
}

fn write(text: &mut Emitter<&mut (dyn Write + Send)>, steps: &[Step]) -> Result<(), Failure> {
    steps.iter().try_for_each(|step| text.step(step)).map_err(written)
}

impl Printed {
    fn count_tears(&mut self, tears: &Tears) {
        self.torn_layers += usize::from(tears.closed + tears.dropped > 0);
        self.tears.closed += tears.closed;
        self.tears.widest = self.tears.widest.max(tears.widest);
        self.tears.dropped += tears.dropped;
        self.tears.dropped_length += tears.dropped_length;
    }

    /// Counts layers without a bead that others lie above: these begin in mid-air.
    fn count_empty(&mut self, paths: &LayerPaths, level: &Level) {
        if paths.lays_part() {
            let (count, first) = std::mem::take(&mut self.empty);
            if self.gaps.0 == 0 {
                self.gaps.1 = first;
            }
            self.gaps.0 += count;
            return;
        }
        if self.empty.0 == 0 {
            self.empty.1 = level.upper;
        }
        self.empty.0 += 1;
    }

    fn count(&mut self, filled: &Filled, level: &Level) {
        let index = self.levels.len();
        self.levels.push(Level { index, ..*level });
        self.heights.push(filled.paths.thickness);
        let lost = &filled.paths.lost;
        self.lost.area += lost.area;
        self.lost_volume += lost.area * level.thickness();
        if lost.worst_area > self.lost.worst_area {
            (self.lost.worst_area, self.lost.worst) = (lost.worst_area, lost.worst);
        }
        self.floating.extend(filled.floating.iter().map(|island| (index, *island)));
        self.adhesion_out_of_reach += filled.adhesion_out_of_reach;
    }

    fn warnings(&self, job: &Job) -> Vec<Warning> {
        let mut warnings = Vec::new();
        let mut warn = |code: &str, message: String| {
            warnings.push(Warning { code: code.to_owned(), message });
        };
        if self.lost.worst_area > WORTH_TELLING_MM2 {
            warn(
                "ThinFeatures",
                format!(
                    "{:.2} mm³ are thinner than {} mm and stay empty; the largest such place has \
                     {:.3} mm²",
                    self.lost_volume, job.paths.thin.least_width, self.lost.worst_area
                ),
            );
        }
        if let (count @ 1.., first) = self.gaps {
            warn("EmptyLayers", empty_layers(count, first));
        }
        if let Some((layer, Floating { at, area })) = self.floating.first() {
            let more = match self.floating.len() - 1 {
                0 => String::new(),
                more => format!(" ({more} more such places are in the report)"),
            };
            warn(
                "FloatingPart",
                format!(
                    "layer {layer} begins {area:.2} mm² in mid-air at x {:.2} y {:.2} z {:.2}, with \
                     nothing below{more}",
                    at.x, at.y, at.z
                ),
            );
        }
        if self.torn_layers > 0 {
            warn(
                "OpenOutlines",
                format!(
                    "outlines of {} layers are open: {} gaps up to {:.2} mm were closed, {} pieces \
                     ({:.1} mm) were dropped",
                    self.torn_layers,
                    self.tears.closed,
                    self.tears.widest,
                    self.tears.dropped,
                    self.tears.dropped_length
                ),
            );
        }
        if self.totals.paced > 0.0 {
            warn(
                "FirmwarePace",
                format!(
                    "{:.0} mm of beads lie so near the axis that the firmware runs them as fast as \
                     its axes can, whatever F says; with --place the part can stand beside it",
                    self.totals.paced.max(1.0)
                ),
            );
        }
        if self.totals.residual > WORTH_TELLING_RAD {
            warn(
                "TiltResidual",
                format!(
                    "the nozzle points up to {:.1}° beside where it should: one tilt axis follows \
                     directions in the plane of the rail only",
                    self.totals.residual.to_degrees()
                ),
            );
        }
        if self.adhesion_out_of_reach > 0 {
            warn(
                "AdhesionLeftOut",
                format!(
                    "{} loops of skirt or brim are out of reach and were left out",
                    self.adhesion_out_of_reach
                ),
            );
        }
        warnings
    }
}

fn empty_layers(count: usize, first: f64) -> String {
    format!(
        "no bead fits into {count} of the layers, the first at z {first:.2} mm: what is above begins in \
         mid-air; turn the part (--orient), cut it (--cut), or print more walls"
    )
}

/// Lost places smaller than this are the sharp corners of every part, mm²: a quarter of a bead's
/// cross-section seen from above.
const WORTH_TELLING_MM2: f64 = 0.04;

/// Directions missed by less than this are not seen, radians: one degree.
const WORTH_TELLING_RAD: f64 = std::f64::consts::PI / 180.0;

/// Returns the part as it was sliced.
#[must_use]
pub fn part(outcome: &Outcome) -> &Mesh {
    outcome.placed.solid.mesh()
}

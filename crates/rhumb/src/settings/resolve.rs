//! From settings to the parameters of each stage, put together and checked.

use geom::tolerance::Tolerances;
use machine::drive::Drives;
use machine::gcode::Dialect;
use machine::gcode::label::LabelWords;
use machine::profile::Printer;
use mesh::flats::FlatParams;
use mesh::orient::OrientParams;
use plan::planner::PlanParams;
use slicer::clearance::NozzleProfile;
use slicer::layer::PathParams;
use slicer::level::ScheduleParams;
use twin::check::text::unsafe_command;
use twin::motor::Motor;
use twin::motor::lag::BedDrive;

use super::lookup::Lookup;
use super::machine::{check_printer, drives, printer, suit};
use super::merge::Settings;
use super::motion::{nozzle, plan};
use super::paths::paths;
use super::schedule::{check_layers, schedule};
use super::template::AtLayers;
use super::{surface, template};
use crate::failure::Failure;
use crate::ranges::Span;
use crate::stages::LayerKind;

/// Everything that a slice needs to know, checked.
#[derive(Debug, Clone, PartialEq)]
pub struct Job {
    /// The machine.
    pub printer: Printer,
    /// The words of its program.
    pub dialect: Dialect,
    /// What counts as one flat face.
    pub orient: OrientParams,
    /// Which faces are flat.
    pub flats: FlatParams,
    /// Flat faces smaller than this need not be met, mm².
    pub least_flat_mm2: f64,
    /// The surface that layers follow; of ranges the first that is curved.
    pub layers: LayerKind,
    /// The ranges of heights whose layers are given; empty where one surface serves all.
    pub spans: Vec<Span>,
    /// Whether the surface is chosen for each part.
    pub choose_layers: bool,
    /// Whether a cone too steep for the nozzle is lowered.
    pub lower_cone: bool,
    /// The shape of the nozzle.
    pub nozzle: NozzleProfile,
    /// Planar layers under curved ones.
    pub base_layers: usize,
    /// Whether curved layers grow out of the planar ones.
    pub morph: bool,
    /// Whether planar layers finish the flat top of a part in curved ones.
    pub planar_top: bool,
    /// Where layers lie.
    pub schedule: ScheduleParams,
    /// How layers are filled.
    pub paths: PathParams,
    /// How lines become moves; the azimuth is the part's and set later.
    pub plan: PlanParams,
    /// Grams in a mm³ of filament.
    pub density_g_per_mm3: f64,
    /// Height at which a probed bed is no longer corrected for, mm.
    pub bed_map_fade: f64,
    /// What turns pulses into motion.
    pub drives: Drives,
    /// What turns the bed, for its lag.
    pub bed_drive: BedDrive,
    /// How lines of several objects are told apart, if they are.
    pub labels: Option<LabelWords>,
    /// Whether the program tells how far it is.
    pub tells_progress: bool,
    /// Whether runs of lines on a circle become arcs.
    pub draws_arcs: bool,
    /// Most cuts of a facet by a layer; not a setting of the print, but of how long to work for it.
    pub most_cuts: f64,
    /// Program before the print.
    pub start: Vec<String>,
    /// Program after the print.
    pub end: Vec<String>,
    /// Programs at every layer, if there are any.
    pub at_layers: Option<AtLayers>,
}

/// Most cuts of a facet by a layer unless the user says: minutes of work. A detailed scan of a million
/// facets has a hundredth of it.
pub const MOST_CUTS: f64 = 1e9;

impl Job {
    /// Returns the same job with layers that follow another surface.
    #[must_use]
    pub fn with_layers(&self, kind: LayerKind) -> Self {
        let mut job = self.clone();
        let curved = kind != LayerKind::Planar;
        (job.layers, job.choose_layers, job.lower_cone) = (kind, false, false);
        job.spans = Vec::new();
        (job.plan.curved, job.plan.order.uphill) = (curved, curved);
        job
    }

    /// Checks settings against each other and returns the parameters of all stages.
    ///
    /// # Errors
    ///
    /// `ConfigRange` or `ConfigConflict` for values that do not fit together.
    pub fn resolve(settings: &Settings) -> Result<Self, Failure> {
        let get = Lookup(settings);
        let mut printer = printer(&get)?;
        let dialect = Dialect::by_name(get.text("dialect"))
            .ok_or_else(|| conflict("there is no such dialect", get.text("dialect")))?
            .on(&printer);
        suit(&mut printer, &dialect)?;
        let tolerances = Tolerances::new(get.number("simplify_mm"), get.number("chord_mm"))
            .map_err(|error| Failure::new("ConfigConflict", error.to_string()))?;
        check_printer(&printer)?;
        check_layers(&get)?;
        surface::check(&get)?;
        Ok(Self {
            orient: OrientParams {
                class_tolerance_rad: get.number("flat_angle_deg").to_radians(),
                overhang_rad: get.number("overhang_angle_deg").to_radians(),
            },
            flats: FlatParams {
                angle_rad: get.number("flat_angle_deg").to_radians(),
                depth_mm: get.number("flat_depth_mm"),
            },
            least_flat_mm2: get.number("flat_area_min_mm2"),
            layers: surface::layers(&get),
            spans: surface::spans(&get),
            choose_layers: get.text("layers") == "auto",
            lower_cone: get.switch("cone_angle_max"),
            nozzle: nozzle(&get),
            base_layers: surface::base_layers(&get),
            morph: get.text("blend") == "morph",
            planar_top: get.text("top") == "planar",
            schedule: schedule(&get)?,
            paths: paths(&get, &printer, &tolerances),
            plan: plan(&get, dialect, &tolerances)?,
            density_g_per_mm3: get.number("filament_density_g_per_cm3") / 1000.0,
            bed_map_fade: get.number("bed_map_fade_mm"),
            drives: drives(&get)?,
            bed_drive: BedDrive {
                motor: Motor::NEMA_17,
                current: get.number("bed_motor_current_a"),
                gear_ratio: get.number("bed_gear_ratio"),
                inertia: get.number("bed_inertia_kg_m2"),
            },
            labels: labels(&get, &dialect),
            tells_progress: get.switch("remaining_times") && dialect.progress(0, 0).is_some(),
            draws_arcs: false,
            most_cuts: MOST_CUTS,
            start: start(&get, &dialect, settings)?,
            end: safe(template::fill(get.text("end_gcode"), "end_gcode", settings)?, "end_gcode")?,
            at_layers: at_layers(&get, settings)?,
            printer,
            dialect,
        })
    }
}

fn labels(get: &Lookup<'_>, dialect: &Dialect) -> Option<LabelWords> {
    match get.text("gcode_label_objects") {
        "disabled" => None,
        "octoprint" => Some(LabelWords::Comments),
        _ => Some(dialect.label_words()),
    }
}

pub(super) fn conflict(what: &str, value: &str) -> Failure {
    Failure::new("ConfigConflict", format!("{what}: {value:?}"))
}

/// The start program, and after it how far filament is pushed ahead of its flow.
fn start(get: &Lookup<'_>, dialect: &Dialect, settings: &Settings) -> Result<Vec<String>, Failure> {
    let lines = template::fill(get.text("start_gcode"), "start_gcode", settings)?;
    let mut lines = safe(lines, "start_gcode")?;
    let advance = get.number("pressure_advance_s");
    if advance > 0.0 {
        lines.push(dialect.pressure_advance(advance).ok_or_else(|| {
            conflict("pressure_advance_s: no command for it is known in dialect", dialect.name)
                .hint("put the firmware's own command into start_gcode")
        })?);
    }
    Ok(lines)
}

/// The lines of a program of the user's, if no print would be refused for one of them.
fn safe(lines: Vec<String>, name: &str) -> Result<Vec<String>, Failure> {
    let found = (1..).zip(&lines).find_map(|(k, line)| Some((k, unsafe_command(line)?)));
    match found {
        None => Ok(lines),
        Some((line, command)) => {
            let what = format!("{name}, line {line}: {command} is no command of a print");
            Err(Failure::new("ConfigConflict", what).hint(
                "it would change the printer for good or stop it, or what it does is not known; send \
                 it by hand, or call a macro of the printer that does",
            ))
        }
    }
}

/// The programs at every layer, where there are any; what cannot be filled in is found here.
fn at_layers(get: &Lookup<'_>, settings: &Settings) -> Result<Option<AtLayers>, Failure> {
    let [before, after] = ["before_layer_gcode", "layer_gcode"].map(|name| get.text(name));
    if before.is_empty() && after.is_empty() {
        return Ok(None);
    }
    let programs = AtLayers { before: before.to_owned(), after: after.to_owned() };
    let [before, after] = programs.of(0, 0.0, settings)?;
    safe(before, "before_layer_gcode")?;
    safe(after, "layer_gcode")?;
    Ok(Some(programs))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn resolve(set: &[&str]) -> Result<Job, Failure> {
        let mut settings = Settings::defaults();
        for pair in set {
            settings.set(pair)?;
        }
        Job::resolve(&settings)
    }

    #[test]
    fn defaults_resolve() {
        let job = resolve(&[]).unwrap();
        assert_eq!(job.dialect.name, "polar");
        assert!((job.printer.bed.speed - std::f64::consts::TAU).abs() < 1e-12);
        assert_eq!(job.start[1], "M190 S60");
    }

    #[test]
    fn values_that_do_not_fit_together_are_refused() {
        let class = |set: &[&str]| resolve(set).unwrap_err().class();
        assert_eq!(class(&["layer_height_mm=0.5"]), "ConfigRange");
        assert_eq!(class(&["external_perimeter_extrusion_width_mm=0.1"]), "ConfigRange");
        assert_eq!(class(&["chord_mm=0.001"]), "ConfigConflict");
        assert_eq!(class(&["rail_min_mm=200"]), "ConfigConflict");
        assert_eq!(class(&["home_z_mm=300"]), "ConfigConflict");
        assert_eq!(class(&["z_increment_mm=0.35"]), "ConfigConflict");
        let between = "wall_sequence=inner-outer-inner";
        assert_eq!(class(&["external_perimeters_first=true", between]), "ConfigConflict");
        assert!(resolve(&["z_increment_mm=0.35", "snap=off"]).is_ok());
        assert_eq!(class(&["spiral_vase=true", "layers=conical", "blend=morph"]), "ConfigConflict");
        for other in ["spiral_vase=true", "blend=morph", "curved_from_mm=3", "top=planar"] {
            assert_eq!(
                class(&["layers=planar:0-8,conical:8-", other]),
                "ConfigConflict",
                "{other}"
            );
        }
        assert_eq!(class(&["start_gcode=M109 S{no}"]), "ConfigUnknownKey");
        for name in ["start_gcode", "end_gcode", "before_layer_gcode", "layer_gcode"] {
            for command in ["M500", "M112 ; halt", "M302 P1", "G28.2"] {
                let pair = format!("{name}=G4 P0\n{command}");
                let refused = resolve(&[&pair]).unwrap_err();
                assert_eq!(refused.class(), "ConfigConflict", "{pair}");
                assert!(refused.to_string().contains(&format!("{name}, line 2")), "{refused}");
            }
            assert!(resolve(&[&format!("{name}=M117 one M500 two\n; M500\nPAUSE")]).is_ok());
        }
        assert!(resolve(&["fill_density=100%"]).unwrap().paths.skins.all_solid);
    }
}

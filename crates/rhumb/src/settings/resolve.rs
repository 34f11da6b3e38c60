//! From settings to the parameters of each stage: the only place that looks values up by name.

use geom::tolerance::Tolerances;
use machine::drive::{Drive, Drives, Transmission};
use machine::gcode::Dialect;
use machine::gcode::dialect::Space;
use machine::gcode::label::LabelWords;
use machine::height_map::HeightMap;
use machine::kinematics::{Alignment, BedScale};
use machine::profile::{Axis, NozzleShape, Printer, Turntable};
use machine::program::{BedTurn, Joints};
use mesh::flats::FlatParams;
use mesh::orient::OrientParams;
use plan::acceleration::Accelerations;
use plan::cooling::CoolingParams;
use plan::order::OrderParams;
use plan::planner::{HeatParams, PlanParams};
use plan::resample::ResampleParams;
use plan::route::{FilamentParams, Speeds};
use plan::scarf::{ScarfParams, ScarfPlacement};
use plan::seam::SeamPosition;
use plan::tilt::TiltParams;
use slicer::adhesion::AdhesionParams;
use slicer::clearance::{LayerOrder, NozzleProfile, Uphill};
use slicer::compensation::CompensationParams;
use slicer::fuzzy::FuzzyParams;
use slicer::infill::{InfillParams, IroningParams, Pattern, SolidPattern};
use slicer::layer::{FirstLayerParams, PathParams};
use slicer::level::adaptive::AdaptiveParams;
use slicer::level::{ScheduleParams, Snap};
use slicer::skins::SkinParams;
use slicer::support::{SupportParams, SupportPattern};
use slicer::thin::ThinParams;
use slicer::walls::WallParams;
use twin::motor::Motor;
use twin::motor::lag::BedDrive;

use super::head;
use super::key::{Key, Value};
use super::merge::Settings;
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
            plan: plan(&get, dialect, &tolerances),
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
            end: template::fill(get.text("end_gcode"), "end_gcode", settings)?,
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

fn printer(get: &Lookup<'_>) -> Result<Printer, Failure> {
    Ok(Printer {
        name: get.text("printer_model").to_owned(),
        rail: Axis {
            min: get.number("rail_min_mm"),
            max: get.number("rail_max_mm"),
            speed: get.number("rail_speed_mm_per_s"),
            acceleration: get.number("rail_acceleration_mm_per_s2"),
        },
        lift: Axis {
            min: get.number("z_min_mm"),
            max: get.number("z_max_mm"),
            speed: get.number("z_speed_mm_per_s"),
            acceleration: get.number("z_acceleration_mm_per_s2"),
        },
        bed: Turntable {
            speed: get.number("bed_speed_deg_per_s").to_radians(),
            acceleration: get.number("bed_acceleration_deg_per_s2").to_radians(),
        },
        path_acceleration: get.number("path_acceleration_mm_per_s2"),
        rail_jerk: get.number("rail_jerk_mm_per_s"),
        bed_jerk: get.number("bed_jerk_deg_per_s").to_radians(),
        extruder_speed: get.number("extruder_speed_mm_per_s"),
        nozzle_diameter: get.number("nozzle_diameter_mm"),
        nozzle: NozzleShape {
            flat_radius: get.number("nozzle_flat_radius_mm"),
            half_angle: get.number("nozzle_half_angle_deg").to_radians(),
            block_height: get.number("nozzle_block_height_mm"),
            block_radius: get.number("nozzle_block_radius_mm"),
            carriage_height: get.number("carriage_height_mm"),
            carriage_width: get.number("carriage_width_mm"),
        },
        axis_clearance: get.number("axis_clearance_mm"),
        moves_per_second: get.number("moves_per_second"),
        home: Joints {
            s: get.number("home_rail_mm"),
            turn: BedTurn::default(),
            z: get.number("home_z_mm"),
        },
        nozzle_temperature_max: get.number("max_nozzle_temperature_c"),
        nozzle_temperature_min_extrude: get.number("min_extrude_temperature_c"),
        bed_temperature_max: get.number("max_bed_temperature_c"),
        alignment: Alignment {
            bed: BedScale { is_reversed: get.switch("bed_reversed"), ..BedScale::IDEAL },
            ..Alignment::IDEAL
        },
        bed_map: HeightMap::default(),
        most_turn: most_turn(get.number("turns_max")),
        head: head::head(get)?,
    })
}

fn drives(get: &Lookup<'_>) -> Result<Drives, Failure> {
    let drive = |axis: &str| -> Result<Drive, Failure> {
        let transmission = if axis == "bed" {
            Transmission::Shaft
        } else {
            let name = format!("{axis}_transmission");
            let text = get.text(&name);
            Transmission::parse(text).ok_or_else(|| {
                let wanted = Transmission::WANTED;
                Failure::new("ConfigRange", format!("{name} = {text:?} is not {wanted}"))
            })?
        };
        Ok(Drive {
            motor_steps: get.count(&format!("{axis}_motor_steps")) as u32,
            microsteps: get.count(&format!("{axis}_microsteps")) as u32,
            gear_ratio: get.number(&format!("{axis}_gear_ratio")),
            transmission,
        })
    };
    Ok(Drives {
        rail: drive("rail")?,
        bed: drive("bed")?,
        lift: drive("z")?,
        filament: drive("extruder")?,
    })
}

/// Takes from a printer what its firmware cannot use.
fn suit(printer: &mut Printer, dialect: &Dialect) -> Result<(), Failure> {
    if printer.head.is_some() && !dialect.speaks_of_heads() && dialect.space != Space::Part {
        return Err(conflict(
            "a firmware that turns part coordinates into joints itself knows of no tilt",
            dialect.name,
        )
        .hint("use dialect = \"polar\" or \"rrf-direct\""));
    }
    if dialect.space != Space::IdealPlane {
        return Ok(());
    }
    // A radius is never negative, wherever the rail may reach.
    printer.rail.min = printer.rail.min.max(0.0);
    if printer.most_turn.is_finite() {
        return Err(conflict(
            "turns_max cannot be kept where the firmware turns the bed",
            dialect.name,
        ));
    }
    Ok(())
}

/// Bound of the bed's turn, radians; 0 turns stand for none.
fn most_turn(turns: f64) -> f64 {
    if turns > 0.0 { turns * std::f64::consts::TAU } else { f64::INFINITY }
}

fn check_printer(printer: &Printer) -> Result<(), Failure> {
    let (rail, lift) = (&printer.rail, &printer.lift);
    if rail.min >= rail.max {
        return Err(Failure::new(
            "ConfigConflict",
            format!("rail_min_mm = {} is not below rail_max_mm = {}", rail.min, rail.max),
        ));
    }
    if !rail.reaches(printer.home.s) || !lift.reaches(printer.home.z) {
        return Err(Failure::new(
            "ConfigConflict",
            format!(
                "home_rail_mm = {} or home_z_mm = {} lies outside of the travel of its axis",
                printer.home.s, printer.home.z
            ),
        ));
    }
    Ok(())
}

fn check_layers(get: &Lookup<'_>) -> Result<(), Failure> {
    let (least, greatest) = (get.number("min_layer_height_mm"), get.number("max_layer_height_mm"));
    for name in ["layer_height_mm", "first_layer_height_mm"] {
        let height = get.number(name);
        if height < least || height > greatest {
            return Err(Failure::new(
                "ConfigRange",
                format!(
                    "{name} = {height} is out of range; this printer lays {least} to {greatest} mm"
                ),
            )
            .hint("min_layer_height_mm and max_layer_height_mm belong to the printer settings"));
        }
    }
    let thickest = get.number("layer_height_mm").max(get.number("first_layer_height_mm"));
    let nozzle = get.number("nozzle_diameter_mm");
    for (name, width) in widths(get) {
        // Below its thickness a line is no bead, above about three bores it does not form one.
        if width < thickest || width > 3.0 * nozzle {
            return Err(Failure::new(
                "ConfigRange",
                format!(
                    "{name} = {width} is out of range; layers of {thickest} mm and a nozzle of \
                     {nozzle} mm give beads from {thickest} to {} mm",
                    3.0 * nozzle
                ),
            ));
        }
    }
    let (thinnest, widest) = (get.number("thin_width_min_mm"), get.number("thin_width_max_mm"));
    if thinnest >= widest {
        return Err(Failure::new(
            "ConfigConflict",
            format!("thin_width_min_mm = {thinnest} is not below thin_width_max_mm = {widest}"),
        ));
    }
    Ok(())
}

const WIDTHS: [&str; 5] = [
    "external_perimeter_extrusion_width_mm",
    "perimeter_extrusion_width_mm",
    "infill_extrusion_width_mm",
    "solid_infill_extrusion_width_mm",
    "top_infill_extrusion_width_mm",
];

/// The widths of beads that a print has.
fn widths(get: &Lookup<'_>) -> impl Iterator<Item = (&'static str, f64)> {
    let support = Some("support_material_extrusion_width_mm");
    let support = support.filter(|_| get.switch("support_material"));
    let first = Some("first_layer_extrusion_width_mm").filter(|name| get.number(name) > 0.0);
    WIDTHS.into_iter().chain(support).chain(first).map(|name| (name, get.number(name)))
}

fn schedule(get: &Lookup<'_>) -> Result<ScheduleParams, Failure> {
    // A bead is no bead when it is thicker than wide.
    let narrowest = widths(get).map(|(_, width)| width).fold(f64::INFINITY, f64::min);
    let params = ScheduleParams {
        first_layer_height: get.number("first_layer_height_mm"),
        layer_height: get.number("layer_height_mm"),
        least_height: get.number("min_layer_height_mm"),
        greatest_height: get.number("max_layer_height_mm").min(narrowest),
        increment: get.number("z_increment_mm"),
        snap: match get.text("snap") {
            "greedy" => Snap::Greedy,
            "off" => Snap::Off,
            _ => Snap::Optimal,
        },
        adaptive: get.switch("adaptive").then(|| AdaptiveParams {
            cusp: get.number("cusp_mm"),
            area_share: get.number("cusp_area_share"),
            growth: CAP_GROWTH,
        }),
    };
    if params.snap == Snap::Optimal || params.adaptive.is_some() {
        check_increment(&params)?;
    }
    Ok(params)
}

/// How much thicker layers of an adaptive schedule may become per mm of height: a layer of 0.2 mm
/// is followed by one of at most 0.22 mm. More, and the change is seen on the part; less, and thin
/// layers reach far beyond the slope that asks for them.
const CAP_GROWTH: f64 = 0.1;

fn check_increment(params: &ScheduleParams) -> Result<(), Failure> {
    let (least, greatest) = (params.least_height, params.greatest_height);
    // Limits may be off by the rounding of their decimals.
    const NOISE: f64 = 1e-6;
    let thickest = (greatest / params.increment + NOISE).floor() * params.increment;
    if thickest + NOISE * params.increment < least {
        return Err(Failure::new(
            "ConfigConflict",
            format!(
                "no multiple of z_increment_mm = {} lies between {least} and {greatest} mm, the \
                 limits of a layer",
                params.increment
            ),
        )
        .hint("min_layer_height_mm and max_layer_height_mm belong to the printer settings"));
    }
    Ok(())
}

fn paths(get: &Lookup<'_>, printer: &Printer, tolerances: &Tolerances) -> PathParams {
    let density = get.number("fill_density");
    PathParams {
        walls: WallParams {
            count: get.count("perimeters"),
            external_width: get.number("external_perimeter_extrusion_width_mm"),
            width: get.number("perimeter_extrusion_width_mm"),
            one_on_top: get.switch("only_one_perimeter_top"),
            more_on_overhangs: get.switch("extra_perimeters"),
        },
        thin: ThinParams {
            least_width: get.number("thin_width_min_mm"),
            least_gap: get.number("gap_width_min_mm"),
            greatest_width: get.number("thin_width_max_mm"),
        },
        skins: SkinParams {
            top_layers: solid_layers(get, "top"),
            bottom_layers: solid_layers(get, "bottom"),
            solid_below_area: get.number("solid_infill_below_area_mm2"),
            all_solid: density >= 1.0,
            solid_every: get.count("solid_infill_every_layers"),
        },
        first_layer: FirstLayerParams {
            width: Some(get.number("first_layer_extrusion_width_mm")).filter(|width| *width > 0.0),
            one_wall: get.switch("only_one_perimeter_first_layer"),
        },
        infill: InfillParams {
            density,
            pattern: pattern(get.text("fill_pattern")),
            solid_pattern: solid_pattern(get.text("solid_fill_pattern")),
            top_pattern: solid_pattern(get.text("top_fill_pattern")),
            angle: get.number("fill_angle_deg").to_radians(),
            width: get.number("infill_extrusion_width_mm"),
            solid_width: get.number("solid_infill_extrusion_width_mm"),
            top_width: get.number("top_infill_extrusion_width_mm"),
            longest_join: get.number("infill_anchor_max_mm"),
            bridge_flow: get.number("bridge_flow_ratio"),
            overlap: get.number("infill_overlap"),
            // Branches lie over each other in every layer.
            every: match get.text("fill_pattern") {
                "lightning" => 1,
                _ => get.count("infill_every_layers"),
            },
            thickest: get.number("nozzle_diameter_mm").min(get.number("infill_extrusion_width_mm")),
            ironing: get.switch("ironing").then(|| IroningParams {
                spacing: get.number("ironing_spacing_mm"),
                flow: get.number("ironing_flow"),
                inset: get.number("top_infill_extrusion_width_mm") / 2.0,
            }),
        },
        adhesion: AdhesionParams {
            skirts: get.count("skirts"),
            skirt_distance: get.number("skirt_distance_mm"),
            brim_width: get.number("brim_width_mm"),
            brim_outside: matches!(get.text("brim_type"), "outer_only" | "outer_and_inner"),
            brim_inside: matches!(get.text("brim_type"), "inner_only" | "outer_and_inner"),
            brim_separation: get.number("brim_separation_mm"),
            reach: printer.rail.max,
        },
        compensation: CompensationParams {
            all: get.number("xy_size_compensation_mm"),
            holes: get.number("hole_size_compensation_mm"),
            first_layer: get.number("elefant_foot_compensation_mm"),
        },
        fuzzy: get.switch("fuzzy_skin").then(|| FuzzyParams {
            depth: get.number("fuzzy_skin_thickness_mm"),
            step: get.number("fuzzy_skin_point_dist_mm"),
        }),
        support: support(get, printer),
        vase: get.switch("spiral_vase"),
        tolerance: tolerances.simplify_mm(),
    }
}

/// How many solid layers there are at least on this side of the part.
fn solid_layers(get: &Lookup<'_>, side: &str) -> usize {
    /// Rounding of a thickness given in decimals, layers.
    const SLACK: f64 = 1e-6;
    let count = get.count(&format!("{side}_solid_layers"));
    let thickness = get.number(&format!("{side}_solid_min_thickness_mm"));
    let needed = (thickness / get.number("layer_height_mm") - SLACK).ceil().max(0.0) as usize;
    if count == 0 { 0 } else { count.max(needed) }
}

/// How parts are supported, if they are.
fn support(get: &Lookup<'_>, printer: &Printer) -> Option<SupportParams> {
    if !(get.switch("support_material") && get.switch("support_material_auto")) {
        return None;
    }
    let (top_gap, bottom_gap) = (
        get.number("support_material_contact_distance_mm"),
        get.number("support_material_bottom_contact_distance_mm"),
    );
    let top_interface = get.count("support_material_interface_layers");
    let bottom_interface = get.whole("support_material_bottom_interface_layers");
    let bridges = get.switch("dont_support_bridges");
    Some(SupportParams {
        threshold: get.number("support_material_threshold_deg").to_radians(),
        wall_width: get.number("external_perimeter_extrusion_width_mm"),
        on_bed_only: get.switch("support_material_buildplate_only"),
        longest_bridge: if bridges { get.number("max_bridge_length_mm") } else { 0.0 },
        xy_gap: get.number("support_material_xy_spacing_mm"),
        top_gap,
        bottom_gap: if bottom_gap > 0.0 { bottom_gap } else { top_gap },
        top_interface,
        bottom_interface: usize::try_from(bottom_interface).unwrap_or(top_interface),
        width: get.number("support_material_extrusion_width_mm"),
        spacing: get.number("support_material_spacing_mm"),
        interface_spacing: get.number("support_material_interface_spacing_mm"),
        angle: get.number("support_material_angle_deg").to_radians(),
        pattern: match get.text("support_material_pattern") {
            "rectilinear-grid" => SupportPattern::RectilinearGrid,
            "honeycomb" => SupportPattern::Honeycomb,
            _ => SupportPattern::Rectilinear,
        },
        sheath: get.switch("support_material_with_sheath"),
        reach: printer.rail.max,
    })
}

fn pattern(word: &str) -> Pattern {
    match word {
        "alignedrectilinear" => Pattern::AlignedRectilinear,
        "grid" => Pattern::Grid,
        "triangles" => Pattern::Triangles,
        "stars" => Pattern::Stars,
        "cubic" => Pattern::Cubic,
        "lightning" => Pattern::Lightning,
        "gyroid" => Pattern::Gyroid,
        "honeycomb" => Pattern::Honeycomb,
        "concentric" => Pattern::Concentric,
        "archimedeanchords" => Pattern::Archimedean,
        _ => Pattern::Rectilinear,
    }
}

fn solid_pattern(word: &str) -> SolidPattern {
    match word {
        "monotonic" => SolidPattern::Monotonic { joined: true },
        "monotoniclines" => SolidPattern::Monotonic { joined: false },
        "concentric" => SolidPattern::Concentric,
        "archimedeanchords" => SolidPattern::Archimedean,
        _ => SolidPattern::Rectilinear,
    }
}

/// The start program, and after it how far filament is pushed ahead of its flow.
fn start(get: &Lookup<'_>, dialect: &Dialect, settings: &Settings) -> Result<Vec<String>, Failure> {
    let mut lines = template::fill(get.text("start_gcode"), "start_gcode", settings)?;
    let advance = get.number("pressure_advance_s");
    if advance > 0.0 {
        lines.push(dialect.pressure_advance(advance).ok_or_else(|| {
            conflict("pressure_advance_s: no command for it is known in dialect", dialect.name)
                .hint("put the firmware's own command into start_gcode")
        })?);
    }
    Ok(lines)
}

/// The programs at every layer, where there are any; what cannot be filled in is found here.
fn at_layers(get: &Lookup<'_>, settings: &Settings) -> Result<Option<AtLayers>, Failure> {
    let [before, after] = ["before_layer_gcode", "layer_gcode"].map(|name| get.text(name));
    if before.is_empty() && after.is_empty() {
        return Ok(None);
    }
    let programs = AtLayers { before: before.to_owned(), after: after.to_owned() };
    programs.of(0, 0.0, settings)?;
    Ok(Some(programs))
}

/// How far combed travel keeps from outlines, as a share of the width of the outermost bead.
const COMB_SHARE: f64 = 0.4;

fn plan(get: &Lookup<'_>, dialect: Dialect, tolerances: &Tolerances) -> PlanParams {
    let curved = surface::layers(get) != LayerKind::Planar;
    let diameter = get.number("filament_diameter_mm");
    PlanParams {
        order: OrderParams {
            seam: match get.text("seam_position") {
                "nearest" => SeamPosition::Nearest,
                "rear" => SeamPosition::Rear(get.number("seam_angle_deg").to_radians()),
                "random" => SeamPosition::Random,
                "corner" => SeamPosition::Corner,
                _ => SeamPosition::Aligned,
            },
            infill_first: get.switch("infill_first"),
            external_first: get.switch("external_perimeters_first"),
            uphill: curved,
        },
        speeds: Speeds {
            external_perimeter: get.number("external_perimeter_speed_mm_per_s"),
            perimeter: get.number("perimeter_speed_mm_per_s"),
            small_perimeter: get.number("small_perimeter_speed_mm_per_s"),
            infill: get.number("infill_speed_mm_per_s"),
            solid_infill: get.number("solid_infill_speed_mm_per_s"),
            top_solid_infill: get.number("top_solid_infill_speed_mm_per_s"),
            gap_fill: get.number("gap_fill_speed_mm_per_s"),
            bridge: get.number("bridge_speed_mm_per_s"),
            overhang: [3, 2, 1, 0].map(|k| get.number(&format!("overhang_speed_{k}_mm_per_s"))),
            ironing: get.number("ironing_speed_mm_per_s"),
            support: [
                get.number("support_material_speed_mm_per_s"),
                get.number("support_material_interface_speed_mm_per_s"),
            ],
            first_layer: get.number("first_layer_speed_mm_per_s"),
            travel: get.number("travel_speed_mm_per_s"),
        },
        filament: FilamentParams {
            area: std::f64::consts::FRAC_PI_4 * diameter * diameter,
            multiplier: get.number("extrusion_multiplier"),
            volume_per_second: get.number("max_volumetric_speed_mm3_per_s"),
            least_flow: get.number("min_volumetric_speed_mm3_per_s"),
            retract_length: get.number("retract_length_mm"),
            retract_speed: get.number("retract_speed_mm_per_s"),
            feed_speed: match get.number("deretract_speed_mm_per_s") {
                0.0 => get.number("retract_speed_mm_per_s"),
                speed => speed,
            },
            retract_between_layers: get.switch("retract_layer_change"),
            retract_before_travel: get.number("retract_before_travel_mm"),
            retract_lift: get.number("retract_lift_mm"),
            wipe: get.number("wipe_mm"),
            // Within the half of the outermost bead, so that its own ends are inside.
            comb: get
                .switch("avoid_crossing_perimeters")
                .then(|| COMB_SHARE * get.number("external_perimeter_extrusion_width_mm")),
        },
        resample: ResampleParams {
            chord: tolerances.chord_mm(),
            travel_chord: get.number("travel_chord_mm"),
            dialect,
            azimuth: 0.0,
        },
        accelerations: accelerations(get),
        scarf: scarf(get),
        cooling: CoolingParams {
            least_layer_time: get.number("slowdown_below_layer_time_s"),
            least_speed: get.number("min_print_speed_mm_per_s"),
        },
        heat: HeatParams {
            first_layer_temperature: get.number("first_layer_temperature_c"),
            temperature: get.number("temperature_c"),
            fan: get.number("fan_speed"),
            bridge_fan: get.number("bridge_fan_speed"),
            least_fan: get.number("min_fan_speed"),
            short_layer: get.number("slowdown_below_layer_time_s"),
            long_layer: get.number("fan_below_layer_time_s"),
            layers_without_fan: get.count("disable_fan_first_layers"),
            full_fan_layer: get.count("full_fan_speed_layer"),
        },
        curved,
        tilt: TiltParams { tilt: head::tilt(get), clears: clears(get) },
    }
}

/// The steepest slope that a nozzle clears, seen from its own axis, radians.
fn clears(get: &Lookup<'_>) -> f64 {
    let uphill = Uphill {
        extent: f64::INFINITY,
        thickness: get.number("layer_height_mm"),
        allowance: crate::stages::GOUGE_MM,
        order: LayerOrder::LowToHigh,
    };
    nozzle(get).steepest(&uphill)
}

fn nozzle(get: &Lookup<'_>) -> NozzleProfile {
    NozzleProfile {
        flat_radius: get.number("nozzle_flat_radius_mm"),
        half_angle: get.number("nozzle_half_angle_deg").to_radians(),
        block_height: get.number("nozzle_block_height_mm"),
        block_radius: get.number("nozzle_block_radius_mm"),
    }
}

fn accelerations(get: &Lookup<'_>) -> Accelerations {
    let of = |what: &str| get.number(&format!("{what}_acceleration_mm_per_s2"));
    Accelerations {
        external_perimeter: of("external_perimeter"),
        perimeter: of("perimeter"),
        infill: of("infill"),
        solid_infill: of("solid_infill"),
        top_solid_infill: of("top_solid_infill"),
        bridge: of("bridge"),
        first_layer: of("first_layer"),
        travel: of("travel"),
        usual: of("default"),
    }
}

fn scarf(get: &Lookup<'_>) -> ScarfParams {
    ScarfParams {
        placement: match get.text("scarf_seam_placement") {
            "contours" => ScarfPlacement::Contours,
            "everywhere" => ScarfPlacement::Everywhere,
            _ => ScarfPlacement::Nowhere,
        },
        inner: get.switch("scarf_seam_on_inner_perimeters"),
        start: get.number("scarf_seam_start_height"),
        length: get.number("scarf_seam_length_mm"),
        entire: get.switch("scarf_seam_entire_loop"),
        piece: get.number("scarf_seam_max_segment_length_mm"),
    }
}

/// Values by name. A name that is not in the table, or of another kind, is a mistake of ours that
/// the first test of every build finds.
pub(super) struct Lookup<'a>(&'a Settings);

impl Lookup<'_> {
    fn value(&self, name: &str) -> &Value {
        self.0.get(Key::by_name(name).expect("names are in the table")).0
    }

    pub(super) fn number(&self, name: &str) -> f64 {
        match self.value(name) {
            Value::Number(number) => *number,
            other => unreachable!("{name} is a number, not {other}"),
        }
    }

    fn whole(&self, name: &str) -> i64 {
        match self.value(name) {
            Value::Count(count) => *count,
            other => unreachable!("{name} is a count, not {other}"),
        }
    }

    pub(super) fn count(&self, name: &str) -> usize {
        match self.value(name) {
            Value::Count(count) => usize::try_from(*count).expect("counts are not negative"),
            other => unreachable!("{name} is a count, not {other}"),
        }
    }

    pub(super) fn switch(&self, name: &str) -> bool {
        match self.value(name) {
            Value::Switch(switch) => *switch,
            other => unreachable!("{name} is a switch, not {other}"),
        }
    }

    pub(super) fn text(&self, name: &str) -> &str {
        match self.value(name) {
            Value::Text(text) => text,
            other => unreachable!("{name} is a text, not {other}"),
        }
    }
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
        assert!(resolve(&["fill_density=100%"]).unwrap().paths.skins.all_solid);
    }
}

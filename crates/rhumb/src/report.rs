//! What a slice amounts to, as data: `--report` writes it, `--json` prints it.

use serde::Serialize;

/// The report. Lengths mm, areas mm², volumes mm³, times s unless a name says otherwise.
#[derive(Debug, Clone, Serialize)]
pub struct Report {
    /// Version of rhumb.
    pub rhumb: &'static str,
    /// What came in.
    pub model: Model,
    /// Its mesh.
    pub mesh: MeshHealth,
    /// How it was laid down.
    pub orientation: Orientation,
    /// Its layers.
    pub layers: Layers,
    /// The print.
    pub print: Print,
    /// What the check of the finished program found.
    pub verify: Verify,
    /// Milliseconds spent in each stage.
    pub timings_ms: Timings,
    /// What the user should know.
    pub warnings: Vec<Warning>,
}

/// What came in.
#[derive(Debug, Clone, Serialize)]
pub struct Model {
    /// Name of the file.
    pub file: String,
    /// Facets in the file.
    pub triangles: usize,
    /// Volume as sliced.
    pub volume_mm3: f64,
    /// Least and greatest corner as placed.
    pub bounds_mm: [[f64; 3]; 2],
}

/// The mesh and what was mended.
#[derive(Debug, Clone, Serialize)]
pub struct MeshHealth {
    /// Connected parts.
    pub shells: usize,
    /// Sides with one facet, after repair.
    pub open_edges: usize,
    /// Sides with more than two facets.
    pub nonmanifold_edges: usize,
    /// Facets turned over.
    pub flipped: usize,
    /// Facets without area removed.
    pub degenerate: usize,
    /// Facets that occurred twice removed.
    pub duplicate: usize,
    /// Codes of what was done.
    pub repairs: Vec<String>,
}

/// How the part was laid down.
#[derive(Debug, Clone, Serialize)]
pub struct Orientation {
    /// Rotation from the model to the part, rows.
    pub part_from_model: [[f64; 3]; 3],
    /// Direction in the model that points down.
    pub normal_model: [f64; 3],
    /// Area of the flat faces in that direction, both ways.
    pub area_mm2: f64,
    /// All choices, the best first.
    pub candidates: Vec<OrientationCandidate>,
}

/// One way to lay the part down.
#[derive(Debug, Clone, Serialize)]
pub struct OrientationCandidate {
    /// Direction in the model that points down.
    pub normal_model: [f64; 3],
    /// Area of the flat faces in that direction, both ways.
    pub area_mm2: f64,
    /// Area that rests on the bed.
    pub bed_area_mm2: f64,
    /// Height of the part.
    pub height_mm: f64,
}

/// The layers.
#[derive(Debug, Clone, Serialize)]
pub struct Layers {
    /// The surface that they follow.
    pub kind: &'static str,
    /// Ranges of heights, where layers are given by those.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub ranges: Vec<LayerRange>,
    /// How many.
    pub count: usize,
    /// Upper levels.
    pub levels_mm: Vec<f64>,
    /// Thicknesses.
    pub heights_mm: Vec<f64>,
    /// Flat faces and how far the nearest layer misses them.
    pub flats: Vec<Flat>,
    /// Flat tops that planar layers were to finish (`top = planar`) and that stay steps.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub flats_stepped: Vec<FlatLeft>,
    /// Area too thin for any bead, summed over the layers.
    pub lost_mm2: f64,
    /// Share of the part that is not too thin for a bead.
    pub covered_share: f64,
    /// The surfaces that were weighed, when the choice was left to rhumb.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub weighed: Option<Weighed>,
    /// Area that hangs over with planar layers; only for curved ones.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub overhang_planar_mm2: Option<f64>,
    /// Area that hangs over with these layers; only for curved ones.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub overhang_mm2: Option<f64>,
    /// Islands that begin in mid-air, with nothing below.
    pub floating: Vec<FloatingIsland>,
}

/// A range of heights with layers of its own.
#[derive(Debug, Clone, Serialize)]
pub struct LayerRange {
    /// The word for its layers.
    pub kind: &'static str,
    /// What they follow.
    pub surface: String,
    /// Where its highest places begin.
    pub from_mm: f64,
    /// Where they end.
    pub to_mm: f64,
    /// Its thinnest layer, along the normal, where nothing ends it.
    pub thinnest_mm: f64,
    /// Its thickest.
    pub thickest_mm: f64,
}

/// Surfaces that were weighed for a part.
#[derive(Debug, Clone, Serialize)]
pub struct Weighed {
    /// All of them, planes first.
    pub candidates: Vec<WeighedSurface>,
    /// The one that was taken.
    pub chosen: String,
    /// The steepest cone that the nozzle clears, of those tried.
    pub steepest_deg: f64,
    /// The reason, in words.
    pub why: String,
}

/// A surface that was weighed.
#[derive(Debug, Clone, Serialize)]
pub struct WeighedSurface {
    /// What it is.
    pub surface: String,
    /// Area that hangs over.
    pub unsupported_mm2: f64,
    /// Mean height of stair steps, by the thickness of a layer.
    pub steps: f64,
    /// Estimated time.
    pub time_s: f64,
    /// What all that comes to; the least is best.
    pub cost: f64,
}

/// An island that begins in mid-air.
#[derive(Debug, Clone, Serialize)]
pub struct FloatingIsland {
    /// Its layer, counted from 0.
    pub layer: usize,
    /// Its lowest place, part frame.
    pub at_mm: [f64; 3],
    /// Its area.
    pub area_mm2: f64,
}

/// A flat face.
#[derive(Debug, Clone, Serialize)]
pub struct Flat {
    /// Its height.
    pub z_mm: f64,
    /// Its area.
    pub area_mm2: f64,
    /// Distance of the nearest layer.
    pub error_mm: f64,
    /// `up` or `down`.
    pub facing: &'static str,
    /// Whether it is too small to be met on purpose.
    pub ignored: bool,
}

/// A flat top that stays a flight of steps.
#[derive(Debug, Clone, Serialize)]
pub struct FlatLeft {
    /// Its height.
    pub z_mm: f64,
    /// Its area.
    pub area_mm2: f64,
    /// The reason, in words.
    pub why: String,
}

/// The print.
#[derive(Debug, Clone, Serialize, Default)]
pub struct Print {
    /// Estimated time.
    pub time_s: f64,
    /// Filament.
    pub filament_mm: f64,
    /// Its weight.
    pub filament_g: f64,
    /// Volume laid, skirt, brim and supports included.
    pub extruded_mm3: f64,
    /// Volume of the part itself.
    pub part_mm3: f64,
    /// Filament of supports; absent when there are none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub support_filament_mm: Option<f64>,
    /// Its weight.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub support_filament_g: Option<f64>,
    /// Way without laying material.
    pub travel_mm: f64,
    /// Moves of the nozzle.
    pub moves: usize,
    /// Times that filament is drawn back.
    pub retractions: usize,
    /// Turns of the bed, whichever way.
    pub bed_turns: f64,
    /// Beads with less flow than the filament should have, mostly near the axis; absent when there
    /// are none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub slow_flow: Option<SlowFlow>,
}

/// Beads with less flow than the filament should have.
#[derive(Debug, Clone, Serialize)]
pub struct SlowFlow {
    /// The flow that they are below.
    pub limit_mm3_per_s: f64,
    /// In how many places.
    pub places: usize,
    /// How long in all.
    pub time_s: f64,
    /// What length of beads.
    pub length_mm: f64,
    /// The least flow.
    pub least_mm3_per_s: f64,
    /// Where that is, part frame.
    pub at_mm: [f64; 3],
    /// Its distance from the rotation axis.
    pub from_axis_mm: f64,
}

/// A number without the noise of its last bits.
pub(crate) fn tidy(number: f64) -> f64 {
    (number * 1e6).round() / 1e6
}

impl SlowFlow {
    /// Returns what was found below a limit, if anything was.
    #[must_use]
    pub fn of(found: &plan::slow_flow::SlowFlow, limit: f64) -> Option<Self> {
        let at = &found.at;
        (found.places > 0).then(|| Self {
            limit_mm3_per_s: limit,
            places: found.places,
            time_s: tidy(found.time),
            length_mm: tidy(found.length),
            least_mm3_per_s: tidy(found.least),
            at_mm: [tidy(at.x), tidy(at.y), tidy(at.z)],
            from_axis_mm: tidy(at.x.hypot(at.y)),
        })
    }
}

impl std::fmt::Display for SlowFlow {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(
            f,
            "below {} mm³/s in {} places, {:.1} mm of beads in {:.1} s; least {:.3} mm³/s at z {:.2} mm, \
             {:.2} mm from the axis",
            self.limit_mm3_per_s,
            self.places,
            self.length_mm,
            self.time_s,
            self.least_mm3_per_s,
            self.at_mm[2],
            self.from_axis_mm
        )
    }
}

/// What the check found.
#[derive(Debug, Clone, Serialize, Default)]
pub struct Verify {
    /// Findings; empty when all is well.
    pub findings: Vec<Finding>,
}

/// One finding.
#[derive(Debug, Clone, Serialize)]
pub struct Finding {
    /// What was checked.
    pub check: &'static str,
    /// `error` or `warning`.
    pub severity: &'static str,
    /// Line of the program.
    pub line: usize,
    /// What was found.
    pub measured: f64,
    /// What is allowed.
    pub limit: f64,
    /// In words.
    pub message: String,
}

/// Milliseconds by stage.
#[derive(Debug, Clone, Serialize, Default)]
pub struct Timings {
    /// Reading the file.
    pub read: f64,
    /// Welding and repair.
    pub repair: f64,
    /// Orientation and placement.
    pub orient: f64,
    /// Flat faces and levels of the layers.
    pub schedule: f64,
    /// Sections, toolpaths, plan and text.
    pub slice: f64,
    /// Reading the program back.
    pub verify: f64,
    /// Everything.
    pub total: f64,
}

/// A remark.
#[derive(Debug, Clone, Serialize, PartialEq, Eq)]
pub struct Warning {
    /// A word that scripts rely on.
    pub code: String,
    /// In words.
    pub message: String,
}

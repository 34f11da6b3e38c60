//! What can be typed.

mod calibrate;
mod curve;

use std::path::PathBuf;

use clap::{ArgAction, Args, Parser, Subcommand, ValueEnum};

use crate::settings::{Sources, ranges};

pub use calibrate::{
    Calibrate, CalibrateFit, CalibratePins, CalibratePivot, CalibrateScan, CalibrateShow, Procedure,
};
pub use curve::{Archimedes, Curve, LoxodromeCurve};

/// A curved-layer slicer for polar 3-D printers.
#[derive(Debug, Parser)]
#[command(name = "rhumb", version, about, propagate_version = true, max_term_width = 100)]
pub struct Arguments {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
    /// How to speak.
    #[command(flatten)]
    pub manner: Manner,
}

/// How rhumb speaks, for every command.
#[derive(Debug, Clone, Args)]
pub struct Manner {
    /// Print results as one JSON object on standard output
    #[arg(long, global = true)]
    pub json: bool,
    /// Say nothing but results and errors
    #[arg(short, long, global = true)]
    pub quiet: bool,
    /// Say more
    #[arg(short, long, global = true)]
    pub verbose: bool,
    /// Number of threads; all processors by default
    #[arg(long, global = true, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
    /// Colour the output
    #[arg(long, global = true, value_enum, default_value_t = Color::Auto)]
    pub color: Color,
    /// How to print errors
    #[arg(long, global = true, value_enum, default_value_t = ErrorFormat::Text)]
    pub error_format: ErrorFormat,
}

/// When to colour.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Color {
    /// On a terminal.
    Auto,
    /// Always.
    Always,
    /// Never.
    Never,
}

/// How to print errors.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ErrorFormat {
    /// For people.
    Text,
    /// For programs.
    Json,
}

/// The commands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Turn a model into a program for the printer
    Slice(Box<Slice>),
    /// Turn many models into programs; what was done before is not done again
    Batch(Box<Batch>),
    /// Say what is in a mesh and what a repair would do
    Inspect(Inspect),
    /// List the ways to lay a model down, and write it turned
    Orient(Orient),
    /// Turn any slicer's Cartesian program into one for a polar printer
    Convert(Box<Convert>),
    /// Find the true rotation centre and write it to a calibration file
    #[command(subcommand)]
    Calibrate(Box<Calibrate>),
    /// Read a program again and prove it on a model of the machine
    Verify(Verify),
    /// Draw a program
    Preview(Preview),
    /// Send a program to a print server, Moonraker or OctoPrint
    Send(Send),
    /// Turn a program into the pulses of the motors
    Steps(Box<Steps>),
    /// Turn a stepper on its driver: currents, speed, angle, final error
    Motor(MotorTurn),
    /// Write a bare spherical spiral, for CAD or for a look
    #[command(subcommand)]
    Curve(Curve),
    /// List, show and check settings
    #[command(subcommand)]
    Profile(Profile),
    /// Write the completions of a shell to standard output
    Completions(Completions),
    /// Write a built-in model
    #[command(hide = true)]
    Model(Model),
}

/// Which settings to use.
#[derive(Debug, Clone, Args)]
pub struct SettingsArguments {
    /// Printer settings: a built-in name or a TOML file
    #[arg(long, value_name = "NAME|FILE")]
    pub printer: Option<String>,
    /// Material settings: a built-in name or a TOML file
    #[arg(long, value_name = "NAME|FILE")]
    pub material: Option<String>,
    /// Print settings: a built-in name or a TOML file
    #[arg(long, value_name = "NAME|FILE")]
    pub print: Option<String>,
    /// Set one value; wins over all files (repeatable)
    #[arg(long, value_name = "KEY=VALUE", action = ArgAction::Append)]
    pub set: Vec<String>,
    /// The words of the program: polar, rrf-direct, klipper-polar, rrf-polar, marlin-polar,
    /// grblhal-polar or cartesian
    #[arg(long, value_name = "NAME")]
    pub dialect: Option<String>,
    /// How this very machine misses the ideal one
    #[arg(long, value_name = "CAL.toml")]
    pub calibration: Option<PathBuf>,
}

impl SettingsArguments {
    /// Returns the sources that these options name.
    #[must_use]
    pub fn sources(&self) -> Sources {
        let mut set = self.set.clone();
        if let Some(dialect) = &self.dialect {
            set.push(format!("dialect={dialect}"));
        }
        Sources {
            printer: self.printer.clone(),
            material: self.material.clone(),
            print: self.print.clone(),
            set,
        }
    }
}

/// How the model is placed.
#[derive(Debug, Clone, Args)]
pub struct PlaceArguments {
    /// How to lay the model down: flat (on its largest flat face), keep, its rank in the list of
    /// `rhumb orient`, or turns about x, y and z in degrees
    ///
    /// By default flat; a 3MF of several objects is kept as it is.
    #[arg(long, value_name = "flat|keep|RANK|RX,RY,RZ", allow_hyphen_values = true)]
    pub orient: Option<String>,
    /// Turn the model about x instead of laying it down, degrees
    #[arg(
        long,
        value_name = "DEG",
        default_value_t = 0.0,
        hide_default_value = true,
        allow_hyphen_values = true,
        conflicts_with = "orient"
    )]
    pub rotate_x: f64,
    /// Turn the model about y, after x, instead of laying it down, degrees
    #[arg(
        long,
        value_name = "DEG",
        default_value_t = 0.0,
        hide_default_value = true,
        allow_hyphen_values = true,
        conflicts_with = "orient"
    )]
    pub rotate_y: f64,
    /// Turn the model about z once it lies, degrees
    #[arg(
        long,
        value_name = "DEG",
        default_value_t = 0.0,
        hide_default_value = true,
        allow_hyphen_values = true
    )]
    pub rotate_z: f64,
    /// Mirror the model along an axis of its file (repeatable)
    #[arg(long, value_enum, value_name = "AXIS", action = ArgAction::Append)]
    pub mirror: Vec<Axis>,
    /// Cut the part at this height above the bed, mm
    #[arg(long, value_name = "Z", allow_hyphen_values = true)]
    pub cut: Option<f64>,
    /// What is printed of a part that is cut; the upper part is set down
    #[arg(long, value_enum, default_value_t = Part::Lower, requires = "cut")]
    pub keep: Part,
    /// Where the part's footprint is centred, mm from the rotation axis
    #[arg(long, value_name = "X,Y", default_value = "0,0", allow_hyphen_values = true)]
    pub place: String,
    /// Scale the model
    #[arg(long, value_name = "S", default_value_t = 1.0)]
    pub scale: f64,
    /// What a unit of the file is; a 3MF has its own
    #[arg(long, value_enum, default_value_t = Units::Mm)]
    pub units: Units,
}

/// An axis of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Axis {
    /// The first.
    X,
    /// The second.
    Y,
    /// The third.
    Z,
}

/// What is kept of a part that is cut.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Part {
    /// What is below.
    Lower,
    /// What is above.
    Upper,
}

/// Units of a file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Units {
    /// Millimetres.
    Mm,
    /// Inches.
    Inch,
    /// Metres.
    M,
}

impl Units {
    /// Millimetres in a unit.
    #[must_use]
    pub fn mm(self) -> f64 {
        match self {
            Self::Mm => 1.0,
            Self::Inch => 25.4,
            Self::M => 1000.0,
        }
    }
}

/// The surface that layers follow. A shorter way to write settings.
#[derive(Debug, Clone, Default, Args)]
pub struct LayerArguments {
    /// The surface that layers follow: planar, conical, spherical, caps, or auto, which weighs them for
    /// the part; or ranges of heights in mm, such as planar:0-8,blend:8-14,conical:14- (a blend leads
    /// from planes to curved layers, or back; the last range goes up to the top)
    #[arg(long, value_name = "KIND|RANGES", value_parser = layers_value)]
    pub layers: Option<String>,
    /// Slope of conical layers; positive when they fall outwards, negative for bowls; `max` for the
    /// steepest that the nozzle clears
    #[arg(long, value_name = "DEG|max", allow_hyphen_values = true)]
    pub cone_angle: Option<String>,
    /// Height of the centre of spherical layers, mm, at or below the bed
    #[arg(long, value_name = "Z", allow_hyphen_values = true)]
    pub sphere_centre: Option<String>,
    /// Radius of the sphere whose cap is lifted from layer to layer, mm
    #[arg(long, value_name = "R")]
    pub cap_radius: Option<String>,
}

/// Reads what `--layers` is given, to say at once what is wrong with it.
fn layers_value(text: &str) -> Result<String, String> {
    const WORDS: [&str; 5] = ["planar", "conical", "spherical", "caps", "auto"];
    if ranges::is_ranges(text) {
        ranges::parse(text)?;
    } else if !WORDS.contains(&text) {
        return Err(format!(
            "give one of {}, or ranges of heights such as planar:0-8,blend:8-14,conical:14-",
            WORDS.join(", ")
        ));
    }
    Ok(text.to_owned())
}

impl LayerArguments {
    /// Returns them as settings.
    #[must_use]
    pub fn set(&self) -> Vec<String> {
        [
            ("layers", &self.layers),
            ("cone_angle_deg", &self.cone_angle),
            ("sphere_centre_mm", &self.sphere_centre),
            ("cap_radius_mm", &self.cap_radius),
        ]
        .into_iter()
        .filter_map(|(key, value)| value.as_ref().map(|value| (key, value.as_str())))
        .flat_map(|(key, value)| match (key, value) {
            ("cone_angle_deg", "max") => vec![format!("{key}=75"), "cone_angle_max=true".into()],
            ("cone_angle_deg", "-max") => vec![format!("{key}=-75"), "cone_angle_max=true".into()],
            _ => vec![format!("{key}={value}")],
        })
        .collect()
    }
}

/// Arguments of `slice`.
#[derive(Debug, Args)]
pub struct Slice {
    /// The model: STL, 3MF or OBJ; `-` reads standard input. Several are printed together, layer by
    /// layer
    #[arg(required = true, value_name = "MODEL")]
    pub models: Vec<PathBuf>,
    /// Where the footprint of each model is centred, mm from the rotation axis, one for each copy of
    /// each model in their order; packed around the axis by default
    #[arg(long, value_name = "X,Y", action = ArgAction::Append, allow_hyphen_values = true)]
    pub at: Vec<String>,
    /// How far the footprints of several models stay apart, mm
    #[arg(long, value_name = "MM", default_value_t = 6.0)]
    pub gap: f64,
    /// Set one value for a model alone, by its place in the command line, counted from 1, each object of
    /// a 3MF as one: walls, skins, infill, moved outlines (repeatable)
    #[arg(long, value_name = "N:KEY=VALUE", action = ArgAction::Append)]
    pub object: Vec<String>,
    /// Take over the settings that a 3MF of PrusaSlicer or OrcaSlicer holds for single objects, as far as
    /// an object alone can have them
    #[arg(long)]
    pub file_settings: bool,
    /// Take each model apart into its bodies, which keep their places and are models each, with names and
    /// numbers of their own
    #[arg(long)]
    pub split: bool,
    /// How often to print every model
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=100))]
    pub copies: u16,
    /// Where the program goes; `-` writes standard output [default: MODEL.gcode]
    #[arg(short, long, value_name = "OUT.gcode")]
    pub output: Option<PathBuf>,
    /// The surface that layers follow
    #[command(flatten)]
    pub layers: LayerArguments,
    /// How the model is placed
    #[command(flatten)]
    pub place: PlaceArguments,
    /// Which settings to use
    #[command(flatten)]
    pub settings: SettingsArguments,
    /// Write the report as JSON
    #[arg(long, value_name = "FILE.json")]
    pub report: Option<PathBuf>,
    /// Write the mesh exactly as it was sliced
    #[arg(long, value_name = "FILE.stl")]
    pub export_placed: Option<PathBuf>,
    /// Write the program in part coordinates, too, for viewers
    #[arg(long, value_name = "FILE.gcode")]
    pub preview_gcode: Option<PathBuf>,
    /// Write runs of short lines on a circle as arcs (G2, G3), in dialects whose firmwares draw them in
    /// part coordinates: cartesian. Circles about the axis are one move of a polar dialect anyway
    #[arg(long)]
    pub arcs: bool,
    /// How much work it may be
    #[command(flatten)]
    pub effort: Effort,
    /// Stop when standard input ends
    #[arg(long, hide = true)]
    pub stop_at_end_of_input: bool,
}

/// How much work a slice may be.
#[derive(Debug, Clone, Args)]
pub struct Effort {
    /// How far to check the finished program: all that is quick, or support, overlap and clearance
    /// of every bead too
    #[arg(long, value_enum, default_value_t = Proof::Quick)]
    pub verify: Proof,
    /// Do not check the finished program
    #[arg(long, conflicts_with = "verify")]
    pub no_verify: bool,
    /// Refuse models whose facets are cut by layers more often than this, in millions: work for hours
    #[arg(long, value_name = "MILLIONS", default_value_t = 1000.0)]
    pub most_cuts: f64,
}

/// Arguments of `batch`.
#[derive(Debug, Args)]
pub struct Batch {
    /// Models; of a folder all in it
    #[arg(required = true, value_name = "MODEL")]
    pub models: Vec<PathBuf>,
    /// Where programs and reports go: MODEL.gcode, MODEL.json and batch.json
    #[arg(long, value_name = "DIR")]
    pub out_dir: PathBuf,
    /// How many models are sliced at the same time; each takes its own memory
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub jobs: u16,
    /// Slice only every N-th model, beginning with the K-th: one share of the work for each of N
    /// machines
    #[arg(long, value_name = "K/N")]
    pub shard: Option<String>,
    /// Give a model up after so many seconds
    #[arg(long, value_name = "SECONDS")]
    pub time_limit: Option<f64>,
    /// The surface that layers follow
    #[command(flatten)]
    pub layers: LayerArguments,
    /// How the models are placed
    #[command(flatten)]
    pub place: PlaceArguments,
    /// Which settings to use
    #[command(flatten)]
    pub settings: SettingsArguments,
    /// How much work it may be
    #[command(flatten)]
    pub effort: Effort,
}

/// How far a program is checked.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Proof {
    /// Text, machine, and every bead by itself.
    Quick,
    /// What lies below and around every bead, too.
    Full,
}

/// Arguments of `inspect`.
#[derive(Debug, Args)]
pub struct Inspect {
    /// The model
    pub model: PathBuf,
}

/// Arguments of `orient`.
#[derive(Debug, Args)]
pub struct Orient {
    /// The model
    pub model: PathBuf,
    /// Where the turned mesh goes
    #[arg(short, long, value_name = "OUT.stl")]
    pub output: Option<PathBuf>,
    /// How the model is placed
    #[command(flatten)]
    pub place: PlaceArguments,
    /// Which settings to use
    #[command(flatten)]
    pub settings: SettingsArguments,
}

/// Arguments of `convert`.
#[derive(Debug, Args)]
pub struct Convert {
    /// The program, as PrusaSlicer, Cura, Orca or Slic3r write it; `-` reads standard input
    pub program: PathBuf,
    /// Where the new program goes; `-` writes standard output [default: IN.polar.gcode]
    #[arg(short, long, value_name = "OUT.gcode")]
    pub output: Option<PathBuf>,
    /// The place of the source's bed that becomes the rotation axis, mm; `auto` for the middle of
    /// what is printed
    #[arg(long, value_name = "X,Y|auto", default_value = "0,0", allow_hyphen_values = true)]
    pub origin: String,
    /// Keep commands that change the machine for good, take a guard away or delete files (such as M92,
    /// M302, M500, M851)
    #[arg(long)]
    pub allow_dangerous: bool,
    /// Do not check the finished program
    #[arg(long)]
    pub no_verify: bool,
    /// Which settings to use
    #[command(flatten)]
    pub settings: SettingsArguments,
}

/// Arguments of `verify`.
#[derive(Debug, Args)]
pub struct Verify {
    /// The program
    pub program: PathBuf,
    /// The mesh as it was sliced (see `slice --export-placed`)
    #[arg(long, value_name = "PLACED.stl")]
    pub model: Option<PathBuf>,
    /// How far to check: all that is quick, or support, overlap and clearance of every bead too
    #[arg(long, value_enum, default_value_t = Proof::Full)]
    pub proof: Proof,
    /// Say how far the bed lags behind its motor where it changes its speed (see bed_inertia_kg_m2)
    #[arg(long)]
    pub load_angle: bool,
    /// Run the program on a machine that misses the ideal one like this, and say how far the part
    /// is off
    #[arg(long, value_name = "CAL.toml")]
    pub machine_error: Option<PathBuf>,
    /// Which settings to use; the dialect is the one that the program names
    #[command(flatten)]
    pub settings: SettingsArguments,
}

/// Arguments of `preview`.
#[derive(Debug, Args)]
pub struct Preview {
    /// The program
    pub program: PathBuf,
    /// Where the picture goes: a page to turn and play (html), the deposit (png), lines (svg)
    #[arg(short, long, value_name = "FILE.html|png|svg")]
    pub output: PathBuf,
    /// Draw one layer from above, counted from 0, instead of the whole print (svg)
    #[arg(long, value_name = "K", conflicts_with = "plot")]
    pub layer: Option<usize>,
    /// Draw a plot instead: bed speed, carriage speed and flow over time, or the heights of layers
    /// against the flat faces of --model (svg)
    #[arg(long, value_enum, value_name = "motion|schedule")]
    pub plot: Option<Plot>,
    /// The mesh as it was sliced (see `slice --export-placed`), for its flat faces and for findings
    #[arg(long, value_name = "PLACED.stl")]
    pub model: Option<PathBuf>,
    /// What the colours of the whole print mean (png, svg)
    #[arg(long, value_enum, default_value_t = Coloring::Role)]
    pub color_by: Coloring,
    /// What of the deposit to show: as it would stand there, its height map from straight above, or a
    /// section upright through the rotation axis at --azimuth (png)
    #[arg(long, value_enum, default_value_t = DepositView::Solid)]
    pub view: DepositView,
    /// Azimuth of the eye about the part, degrees from x towards y (png)
    #[arg(long, value_name = "DEG", default_value_t = -60.0, allow_hyphen_values = true)]
    pub azimuth: f64,
    /// Elevation of the eye above the bed, degrees (png)
    #[arg(long, value_name = "DEG", default_value_t = 30.0, allow_hyphen_values = true)]
    pub elevation: f64,
    /// Size of the picture, pixels (png)
    #[arg(long, value_name = "WxH", default_value = "1200x900")]
    pub size: String,
    /// Which settings to use; the dialect is the one that the program names
    #[command(flatten)]
    pub settings: SettingsArguments,
}

/// Arguments of `send`.
#[derive(Args)]
pub struct Send {
    /// The program
    pub program: PathBuf,
    /// The print server, such as <http://printer.local:7125>
    #[arg(long, value_name = "URL")]
    pub to: String,
    /// Its key; better in RHUMB_API_KEY or in the key file, where other users do not see it
    #[arg(long, value_name = "KEY")]
    pub api_key: Option<String>,
    /// A file with keys, lines of `"HOST:PORT" = "KEY"`, that only its owner can read
    /// [default: ~/.config/rhumb/keys.toml]
    #[arg(long, value_name = "KEYS.toml")]
    pub keys: Option<PathBuf>,
    /// Start to print it
    #[arg(long)]
    pub start: bool,
    /// What to call it there
    #[arg(long, value_name = "NAME.gcode")]
    pub name: Option<String>,
    /// What to do when a file of this name is there
    #[arg(long, value_enum, default_value_t = IfExists::Refuse)]
    pub if_exists: IfExists,
    /// Which kind of server it is; asked when not given
    #[arg(long, value_enum)]
    pub server: Option<ServerKind>,
}

impl std::fmt::Debug for Send {
    /// All but the key.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Send").field("program", &self.program).finish_non_exhaustive()
    }
}

/// What to do with a file of the same name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum IfExists {
    /// Send nothing.
    Refuse,
    /// Replace it.
    Replace,
    /// Store the new one beside it, with a number.
    Rename,
    /// Take it for the same file: send nothing, but start it when that is wanted.
    Keep,
}

/// Kinds of print servers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ServerKind {
    /// Klipper's.
    Moonraker,
    /// `OctoPrint`.
    Octoprint,
}

/// How a deposit is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum DepositView {
    /// As it would stand there.
    Solid,
    /// From straight above, coloured by height.
    Height,
    /// Cut upright through the rotation axis.
    Section,
}

/// What is plotted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Plot {
    /// Speeds and flow over time.
    Motion,
    /// Heights of layers and flat faces.
    Schedule,
}

/// What colours mean.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Coloring {
    /// How high a bead lies.
    Height,
    /// What it is for.
    Role,
}

/// Arguments of `steps`.
#[derive(Debug, Args)]
#[command(after_long_help = STEPS_FORMATS)]
pub struct Steps {
    /// The program; or a table of prescribed points, a CSV file with t_s,x_mm,y_mm,z_mm
    #[arg(required_unless_present = "example")]
    pub program: Option<PathBuf>,
    /// Where the pulses go, in the format that the end of the name says; `-` writes CSV to standard
    /// output. Without it only their sums are told
    #[arg(short, long, value_name = "FILE.(csv|bin|lpt)")]
    pub output: Option<PathBuf>,
    /// Draw how far whole steps put the nozzle off, over the bed
    #[arg(long, value_name = "FILE.svg")]
    pub picture: Option<PathBuf>,
    /// How the phases of a motor follow each other in a file of port words
    #[arg(long, value_enum, default_value_t = PhaseSequence::Half)]
    pub sequence: PhaseSequence,
    /// Run the built-in table of points on motors DSh-4-6B with 1.6 mm a pulse
    #[arg(long, conflicts_with = "program")]
    pub example: bool,
    /// Which settings to use: motors, microsteps, gears, belts and screws belong to the printer; the
    /// dialect is the one that the program names
    #[command(flatten)]
    pub settings: SettingsArguments,
}

/// Arguments of `motor`.
#[derive(Debug, Args)]
pub struct MotorTurn {
    /// How far to turn, degrees
    #[arg(long, value_name = "DEG", default_value_t = 10.0, allow_hyphen_values = true)]
    pub angle: f64,
    /// Draw currents, speed and angle over time
    #[arg(short, long, value_name = "FILE.svg")]
    pub output: Option<PathBuf>,
    /// Greatest speed, degrees a second
    #[arg(long, value_name = "DEG", default_value_t = 180.0)]
    pub speed: f64,
    /// Acceleration, degrees per s²
    #[arg(long, value_name = "DEG", default_value_t = 6000.0)]
    pub acceleration: f64,
    /// Torque against which it turns, N·m
    #[arg(long, value_name = "NM", default_value_t = 0.0, allow_hyphen_values = true)]
    pub load: f64,
    /// Inertia of what it turns, kg·m²
    #[arg(long, value_name = "KGM2", default_value_t = 0.0)]
    pub inertia: f64,
    /// Dry friction, N·m
    #[arg(long, value_name = "NM", default_value_t = 0.0)]
    pub friction: f64,
    /// Supply of the driver, V
    #[arg(long, value_name = "V", default_value_t = 12.0)]
    pub supply: f64,
    /// Limit of the phase currents, A
    #[arg(long, value_name = "A", default_value_t = 2.5)]
    pub current: f64,
    /// Frequency of the driver's sawtooth, Hz
    #[arg(long, value_name = "HZ", default_value_t = 50_000.0)]
    pub pwm: f64,
    /// Microsteps in a full step
    #[arg(long, value_name = "N", default_value_t = 256, value_parser = clap::value_parser!(u32).range(1..=1024))]
    pub microsteps: u32,
    /// How long to watch it after the turn, s
    #[arg(long, value_name = "S", default_value_t = 0.15)]
    pub settling: f64,
    /// Do not feed the position back
    #[arg(long)]
    pub open_loop: bool,
}

/// The formats of `steps`, for its help.
const STEPS_FORMATS: &str = "\
Formats:
  .csv  line,time_s,duration_s,R,theta,Z,E: the line of the program, when the interval begins and how
        long it takes, and the pulses of each motor in it, negative backwards. Lines that begin with #
        say what a pulse moves and where the motors stand at first, in pulses from zero.
  .bin  little-endian: RHUMBSTP, version 1 and number of axes (1 byte each); for each axis its name
        (8 bytes), what a pulse moves (f64, mm or degrees), its first count (i64); then for each interval
        its duration in µs and the pulses of each axis, as LEB128, pulses folded (2n, or -2n - 1).
  .lpt  time_us,word: a parallel port's words in the order in which they are put out. Bits 0-3 are the
        phases A-D of a four-phase motor, bits 4-7 say whose: R, theta, Z, E. Full or half steps, whatever
        the profile's microsteps.
The place that pulses add up to is never more than half a step from where the program wants the axis.";

/// Orders of the phases of a motor.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum PhaseSequence {
    /// Two phases at a time; a word is a full step.
    Full,
    /// One and two phases by turns; a word is half a step.
    Half,
}

/// What to do with settings.
#[derive(Debug, Subcommand)]
pub enum Profile {
    /// List the built-in profiles
    List,
    /// Show every setting with its value and where it comes from
    Show {
        /// A built-in profile or a TOML file
        name: Option<String>,
        /// More settings
        #[command(flatten)]
        settings: SettingsArguments,
    },
    /// Check a settings file
    Check {
        /// The file
        file: PathBuf,
    },
    /// Take over print and filament settings of PrusaSlicer
    Import {
        /// What PrusaSlicer exports as a configuration, or a 3MF with settings of PrusaSlicer, OrcaSlicer or
        /// Bambu Studio
        file: PathBuf,
        /// What the new profiles are called: NAME.print.toml and NAME.material.toml [default: as FILE]
        #[arg(short, long, value_name = "NAME")]
        output: Option<PathBuf>,
    },
}

/// Arguments of `completions`.
#[derive(Debug, Args)]
pub struct Completions {
    /// The shell
    #[arg(value_enum)]
    pub shell: clap_complete::Shell,
}

/// Arguments of `model`.
#[derive(Debug, Args)]
pub struct Model {
    /// Its name; without one, all names are listed
    pub name: Option<String>,
    /// Where it goes [default: NAME.stl]
    #[arg(short, long, value_name = "OUT.stl")]
    pub output: Option<PathBuf>,
}

//! The stages of a print whose layers are given by ranges of heights.
//!
//! Planar ranges end where they are told to, or at the top of the part, and meet the flat faces in them.
//! Curved layers begin as wedges on the planar ones, or on the last side of a blend; planar layers on
//! them begin with one that fills what they leave below it. A blend is told by the heights of the highest
//! places of the layers that it begins and ends on: on the axis, and in bowls at the rim of the part.

use machine::gcode::decimal;
use mesh::mesh::Mesh;
use mesh::topology::Solid;
use slicer::blend::{Aim, Side};
use slicer::level::{FlatFace, Level, misses};

use crate::blend::{self, Curved, Laid, Way};
use crate::failure::Failure;
use crate::levels::{self, Layout, MetFlat};
use crate::settings::Job;
use crate::stages::{
    self, LayerKind, Space, Stage, base, blend_reach, curved, extent, unfit, within_clearance,
};

/// What the layers of a range follow.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Follows {
    /// A family.
    Family(LayerKind),
    /// Sides of their own, from planes to the curved layers of the next range, or from those of the one
    /// before to planes.
    Blend,
}

/// A range of heights, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Span {
    /// Its layers.
    pub follows: Follows,
    /// Where it begins; `None` where a blend of no given height ends.
    pub from: Option<f64>,
    /// Where it ends; `None` for the top of the part, and for a blend of no given height.
    pub to: Option<f64>,
}

impl Span {
    fn curved(&self) -> Option<LayerKind> {
        match self.follows {
            Follows::Family(LayerKind::Planar) | Follows::Blend => None,
            Follows::Family(kind) => Some(kind),
        }
    }
}

/// What a range came to be.
#[derive(Debug, Clone, PartialEq)]
pub struct LaidSpan {
    /// The word for its layers.
    pub word: &'static str,
    /// What they follow, in words.
    pub follows: String,
    /// The heights that its highest places begin and end at, mm.
    pub heights: [f64; 2],
    /// How thin and how thick its layers are along their normals where nothing ends them, mm.
    pub thickness: [f64; 2],
}

/// Lays out the stages of a part that stands on the bed, by the ranges of a job; `layout` tells its flat
/// faces.
///
/// # Errors
///
/// `LimitExceeded`, or `OutOfEnvelope` for layers that do not fit the part or each other.
pub fn stages(solid: &Solid, job: &Job, layout: Layout) -> Result<(Vec<Stage>, Layout), Failure> {
    let mut pile = Pile::new(solid, job)?;
    for k in 0..pile.spans.len() {
        if !pile.ended {
            pile.lay(k, &layout)?;
        }
    }
    let missing = pile.top - pile.height();
    if !pile.ended && missing > job.schedule.layer_height {
        return Err(Failure::new(
            "OutOfEnvelope",
            format!(
                "the ranges of layers end at {} mm, and the part is {} mm high",
                decimal(pile.height(), 3),
                decimal(pile.top, 3)
            ),
        )
        .hint("leave the end of the last range out: it then goes up to the top of the part"));
    }
    let Pile { stages, laid, flats, unreached, .. } = pile;
    Ok((stages, Layout { flats, spans: laid, unreached, ..layout }))
}

/// Stages laid on each other so far.
struct Pile<'a> {
    part: &'a Mesh,
    job: &'a Job,
    spans: Vec<Span>,
    /// Height of the part, mm.
    top: f64,
    stages: Vec<Stage>,
    laid: Vec<LaidSpan>,
    flats: Vec<MetFlat>,
    /// Layers so far.
    count: usize,
    /// What the next range begins on.
    ground: Ground,
    /// Whether the last range has reached the top of the part.
    ended: bool,
    /// The words of ranges that begin above the part.
    unreached: Vec<&'static str>,
}

/// What a range begins on.
#[derive(Debug, Clone, Copy)]
enum Ground {
    /// The bed, or planar layers that end at this height, mm.
    Flat(f64),
    /// Curved layers, or a blend that leads to them, whose last side meets the axis here, mm; and up to
    /// which height they may lie, mm.
    Curved(f64, f64),
}

impl<'a> Pile<'a> {
    fn new(solid: &'a Solid, job: &'a Job) -> Result<Self, Failure> {
        let part = solid.mesh();
        let mut spans = job.spans.clone();
        let top = part.bounds().max.z;
        for span in &mut spans {
            let is_reached = span.from.is_none_or(|from| from < top);
            if let (Some(kind), true) = (span.curved(), is_reached) {
                let kind = within_clearance(solid, job, kind)?;
                let surface = kind.surface().map_err(|error| unfit(&error))?;
                surface.fits(&extent(part)).map_err(|error| unfit(&error))?;
                span.follows = Follows::Family(kind);
            }
        }
        Ok(Self {
            part,
            job,
            spans,
            top,
            stages: Vec::new(),
            laid: Vec::new(),
            flats: Vec::new(),
            count: 0,
            ground: Ground::Flat(0.0),
            ended: false,
            unreached: Vec::new(),
        })
    }

    /// The height that has been reached.
    fn height(&self) -> f64 {
        match self.ground {
            Ground::Flat(height) | Ground::Curved(_, height) => height,
        }
    }

    fn lay(&mut self, k: usize, layout: &Layout) -> Result<(), Failure> {
        let span = self.spans[k];
        if span.from.is_some_and(|from| from >= self.top) {
            let word = |span: &Span| match span.follows {
                Follows::Blend => "blend",
                Follows::Family(kind) => kind.word(),
            };
            self.unreached.extend(self.spans[k..].iter().map(word));
            self.ended = true;
            return Ok(());
        }
        match span.follows {
            Follows::Blend => self.blend(k),
            Follows::Family(LayerKind::Planar) => self.planar(&span, layout),
            Follows::Family(kind) => self.curved(kind, k),
        }
    }

    fn push(&mut self, stage: Stage, laid: LaidSpan) {
        self.count += stage.printed.len();
        self.stages.push(stage);
        self.laid.push(laid);
    }

    fn planar(&mut self, span: &Span, layout: &Layout) -> Result<(), Failure> {
        let from = match (self.ground, span.from) {
            (Ground::Flat(height), _) => height,
            (Ground::Curved(..), from) => from.unwrap_or_default(),
        };
        let to = span.to.filter(|to| *to < self.top);
        self.ended = to.is_none();
        let levels = self.planes(from, to, layout)?;
        let Some(last) = levels.last() else { return Ok(()) };
        let (count, end) = (levels.len(), last.upper);
        self.meet(from, &levels, layout);
        let (thin, thick) = levels
            .iter()
            .map(Level::thickness)
            .fold((f64::INFINITY, 0.0_f64), |(a, b), t| (a.min(t), b.max(t)));
        let stage = self.with_neighbours(levels, count);
        if let Some(below) = self.stages.last_mut()
            && below.kind != LayerKind::Planar
            && below.morph.is_none()
        {
            below.ceiling = Some(stage.lowest_ground());
        }
        let word = LayerKind::Planar.word();
        self.push(
            stage,
            LaidSpan { word, follows: word.into(), heights: [from, end], thickness: [thin, thick] },
        );
        self.ground = Ground::Flat(end);
        Ok(())
    }

    /// The planar layers between two heights, or up to the top of the part.
    fn planes(&self, from: f64, to: Option<f64>, layout: &Layout) -> Result<Vec<Level>, Failure> {
        let height = to.unwrap_or(self.top) - from;
        let first = match self.ground {
            Ground::Flat(0.0) => self.job.schedule.first_layer_height,
            _ => self.job.schedule.layer_height,
        };
        if to.is_some() && height < first {
            return Err(Failure::new(
                "OutOfEnvelope",
                format!(
                    "a range of planar layers from {} to {} mm is lower than a layer of {first} mm",
                    decimal(from, 3),
                    decimal(from + height, 3)
                ),
            ));
        }
        let wanted = layout.flats.iter().filter(|met| met.wanted).map(|met| met.flat);
        let inside = wanted.filter(|flat| flat.z_mm > from && flat.z_mm <= from + height);
        let mut flats: Vec<FlatFace> =
            inside.map(|flat| FlatFace { level: flat.z_mm - from, area: flat.area_mm2 }).collect();
        if to.is_some() {
            // What comes next begins here: that matters more than any face.
            const MORE: f64 = 100.0;
            let largest = flats.iter().map(|flat| flat.area).fold(1.0, f64::max);
            flats.push(FlatFace { level: height, area: MORE * largest });
        }
        levels::planes(height, &flats, first, self.job).map(|all| {
            all.into_iter()
                .map(|level| Level {
                    index: self.count + level.index,
                    lower: from + level.lower,
                    upper: from + level.upper,
                })
                .collect()
        })
    }

    /// Tells the flat faces among planar layers.
    fn meet(&mut self, from: f64, levels: &[Level], layout: &Layout) {
        let Some(end) = levels.last().map(|level| level.upper) else { return };
        let is_inside = |met: &&MetFlat| {
            let z = met.flat.z_mm;
            (z > from + layout.tolerance || z == from && from == 0.0)
                && (z <= end + layout.tolerance || self.ended)
        };
        let inside: Vec<MetFlat> = layout.flats.iter().filter(is_inside).copied().collect();
        let faces: Vec<FlatFace> = inside
            .iter()
            .map(|met| FlatFace { level: met.flat.z_mm, area: met.flat.area_mm2 })
            .collect();
        let misses = misses(levels, &faces);
        self.flats.extend(inside.iter().zip(misses).map(|(met, miss)| MetFlat { miss, ..*met }));
    }

    /// Planar layers with those below and above that decide on their skins.
    fn with_neighbours(&self, levels: Vec<Level>, count: usize) -> Stage {
        let (height, skins) = (self.job.schedule.layer_height, &self.job.paths.skins);
        let (Some(first), Some(last)) = (levels.first().copied(), levels.last().copied()) else {
            return stages::flat(levels);
        };
        let below = if first.lower > 0.0 { skins.bottom_layers.max(1) } else { 0 };
        let above = if self.ended { 0 } else { skins.top_layers.max(1) };
        let beside = |from: f64, k: usize, index: usize| Level {
            index,
            lower: from + height * k as f64,
            upper: from + height * (k + 1) as f64,
        };
        let lower = (0..below).map(|k| {
            let from = first.lower - height * below as f64;
            beside(from, k, first.index.saturating_sub(below - k).max(1))
        });
        let upper = (0..above).map(|k| beside(last.upper, k, last.index + 1 + k));
        let all: Vec<Level> = lower.chain(levels).chain(upper).collect();
        Stage { printed: below..below + count, ..stages::flat(all) }
    }

    fn curved(&mut self, kind: LayerKind, k: usize) -> Result<(), Failure> {
        if let Ground::Flat(0.0) = self.ground {
            // Nothing curved holds on the bed.
            let base = base(self.job);
            if let Some(last) = base.printed.end.checked_sub(1).map(|last| base.levels[last]) {
                self.count += base.printed.len();
                self.stages.push(base);
                self.ground = Ground::Flat(last.upper);
            }
        }
        let span = self.spans[k];
        let (floor, start) = match self.ground {
            Ground::Flat(height) => (height, None),
            Ground::Curved(level, height) => (height, Some(level)),
        };
        let to = span.to.filter(|to| *to < self.top);
        let next = self.spans.get(k + 1).filter(|_| to.is_some());
        let is_blended = next.is_some_and(|next| next.follows == Follows::Blend);
        let end = match (to, next.and_then(|next| next.to)) {
            (Some(to), Some(end)) if is_blended => {
                let reach = self.reach(kind, end);
                let aim = Curved { kind, reach }.aim();
                aim.map(|aim| aim.level_at(to, reach))
            }
            _ => None,
        };
        if let Some(end) = end
            && end <= start.unwrap_or(floor)
        {
            return Err(Failure::new(
                "OutOfEnvelope",
                format!(
                    "{} layers would have no room on the axis between {} and {} mm",
                    kind.word(),
                    decimal(start.unwrap_or(floor), 3),
                    decimal(end, 3)
                ),
            )
            .hint("give the range more height, or choose flatter layers"));
        }
        let space =
            Space { floor, start, end, ceiling: to.filter(|_| end.is_none()), index: self.count };
        let stage = curved(self.part, kind, &space, self.job)?;
        let reached = to.unwrap_or(self.top);
        self.ended = to.is_none();
        if stage.printed.is_empty() {
            self.unreached.push(kind.word());
            return Ok(());
        }
        let level = stage.levels[stage.printed.start];
        let thickness = level.thickness() / stage.surface.level_step(1.0);
        let laid = LaidSpan {
            word: kind.word(),
            follows: kind.describe(),
            heights: [self.height(), reached],
            thickness: [thickness; 2],
        };
        let last = stage.levels[stage.printed.end - 1].upper;
        self.push(stage, laid);
        self.ground = Ground::Curved(last, reached);
        Ok(())
    }

    /// How far from the axis a blend has layers that ends at this height.
    fn reach(&self, kind: LayerKind, height: f64) -> f64 {
        // Bowls rise outwards: what lies beside them is met by their rims.
        let rises = matches!(kind, LayerKind::Conical(angle) if angle < 0.0);
        blend_reach(self.part, (!rises).then_some(height), self.job)
    }

    fn blend(&mut self, k: usize) -> Result<(), Failure> {
        let span = self.spans[k];
        let above = self.spans.get(k + 1).and_then(Span::curved);
        let below = k.checked_sub(1).and_then(|k| self.spans[k].curved());
        let (way, kind) = match (above, below) {
            (Some(kind), _) => (Way::Up, kind),
            (None, Some(kind)) => (Way::Down, kind),
            // Refused where ranges are read.
            (None, None) => return Ok(()),
        };
        // Beyond the last blend but one everything is flat again.
        let reach = span
            .to
            .map_or_else(|| blend_reach(self.part, None, self.job), |to| self.reach(kind, to));
        let curved = Curved { kind, reach };
        let from = self.height();
        let sides = match span.to {
            Some(to) => blend::between(&curved, way, [from, to], self.job)?,
            None => blend::shortest(&curved, from, self.job)?,
        };
        let Some(last) = sides.last().copied() else { return Ok(()) };
        let ground = self.side(&curved)?;
        let highest = |side: &Side| side.level.max(side.height(reach));
        let mut thickness = [f64::INFINITY, 0.0_f64];
        let mut below = ground;
        for side in &sides {
            let [thin, thick] = below.thickness_to(side, reach);
            thickness = [thickness[0].min(thin), thickness[1].max(thick)];
            below = *side;
        }
        let laid = Laid { sides: &sides, ground, way, before: self.count };
        let stage = blend::stage(&curved, &laid, self.job)?;
        let word = match way {
            Way::Up => format!("from planar to {}", kind.describe()),
            Way::Down => format!("from {} to planar", kind.describe()),
        };
        let height = highest(&last).min(self.top);
        let told = LaidSpan { word: "blend", follows: word, heights: [from, height], thickness };
        self.push(stage, told);
        self.ground = match way {
            Way::Up => Ground::Curved(last.level, height),
            Way::Down => Ground::Flat(last.level),
        };
        Ok(())
    }

    /// The side that the next layer begins on.
    fn side(&self, curved: &Curved) -> Result<Side, Failure> {
        let side = match self.ground {
            Ground::Flat(height) => Side::plane(height),
            Ground::Curved(level, _) => {
                curved.aim().unwrap_or(Aim::Cone { slope: 0.0 }).layer(level)
            }
        };
        side.map_err(|error| unfit(&error))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::Settings;
    use mesh::shapes;

    fn job(layers: &str, set: &[&str]) -> Job {
        let mut settings = Settings::defaults();
        settings.set(&format!("layers={layers}")).unwrap();
        for pair in set {
            settings.set(pair).unwrap();
        }
        Job::resolve(&settings).unwrap()
    }

    fn laid(part: Mesh, layers: &str, set: &[&str]) -> Result<(Vec<Stage>, Layout), Failure> {
        stages::stages(&Solid::new(part), &job(layers, set))
    }

    const FLAT_CONE: &[&str] = &["cone_angle_deg=20"];

    #[test]
    fn ranges_begin_and_end_where_they_are_told_to() {
        let part = shapes::dome(20.0, 96);
        let ranges = "planar:0-5,blend:5-9.5,conical:9.5-12,blend:12-17,planar";
        let (stages, layout) = laid(part, ranges, &["cone_angle_deg=8"]).unwrap();
        assert_eq!(stages.len(), 5);
        let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-6, "{a} is not {b}");
        for (span, heights) in
            layout.spans.iter().zip([[0.0, 5.0], [5.0, 9.5], [9.5, 12.0], [12.0, 17.0]])
        {
            near(span.heights[0], heights[0]);
            near(span.heights[1], heights[1]);
            assert!(span.thickness[0] >= 0.1 - 1e-6 && span.thickness[1] <= 0.3 + 1e-6, "{span:?}");
        }
        // On the axis every layer begins where the one below ends.
        let mut height = 0.0;
        for stage in &stages {
            for k in stage.printed.clone() {
                let lower = match &stage.morph {
                    Some(sides) => sides[k].level,
                    None => stage.levels[k].lower,
                };
                near(lower, height);
                height = stage.levels[k].upper;
            }
        }
    }

    #[test]
    fn a_blend_that_is_too_low_is_refused_and_what_would_do_is_told() {
        let refused = laid(shapes::dome(20.0, 96), "planar:0-3,blend:3-4,conical", FLAT_CONE);
        let failure = refused.err().unwrap();
        assert_eq!(failure.class(), "OutOfEnvelope");
        let hint = failure.to_string();
        assert!(hint.contains("would take"), "{hint}");
    }

    #[test]
    fn ranges_that_end_below_the_top_are_refused() {
        let refused = laid(shapes::dome(20.0, 96), "planar:0-3,conical:3-5", FLAT_CONE);
        assert_eq!(refused.err().unwrap().class(), "OutOfEnvelope");
        // And those above it are not needed.
        let (stages, _) = laid(shapes::dome(20.0, 96), "planar:0-90,conical", FLAT_CONE).unwrap();
        assert_eq!(stages.len(), 1);
    }

    #[test]
    fn a_part_that_ends_within_a_blend_has_no_layers_above_it() {
        // A face that is a layer of the family that is never reached.
        let (stages, layout) =
            laid(shapes::dome(20.0, 96), "planar:0-16,blend,conical", FLAT_CONE).unwrap();
        assert_eq!(layout.unreached, ["conical"]);
        assert_eq!(layout.spans.last().unwrap().heights, [16.0, 20.0]);
        assert!(layout.warnings(job("planar", &[]).schedule.snap)[0].message.contains("conical"));
        assert!(stages.last().unwrap().printed.is_empty() || stages.len() == 2);
    }
}

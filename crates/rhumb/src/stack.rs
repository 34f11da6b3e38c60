//! The sections that a window of layers needs: its own, and those above and below that decide on
//! its skins.
//!
//! Planar layers whose sections and neighbours are those of the layer below, as between upright walls,
//! are taken apart into walls and skins once for all of them.

use std::borrow::Cow;
use std::collections::VecDeque;
use std::ops::Range;
use std::sync::{Mutex, PoisonError};

use geom::region::Region;
use mesh::topology::Solid;
use nalgebra::{Point2, Point3};
use rayon::prelude::*;
use slicer::blend::Side;
use slicer::chart::{Chart, carried, carried_point, carried_to_side};
use slicer::compensation::{CompensationParams, compensated};
use slicer::infill::Pattern;
use slicer::infill::lightning::{Branches, Stratum, grow};
use slicer::layer::{Filled, Parted, PathParams, Pieces};
use slicer::level::Level;
use slicer::lift::Lift;
use slicer::polyhole::{Bore, PolyholeParams, bores, with_polyholes};
use slicer::section::{Cutter, Section, Tears};
use slicer::skins::{Neighbours, SKIN_TOLERANCE_MM};
use slicer::stacking::Stair;
use slicer::support::{Column, Shade, SupportParams, hanging};

use crate::failure::Failure;
use crate::filling::WINDOW;
use crate::interrupt::Interrupt;
use crate::settings::Job;
use crate::shelf::Use;
use crate::stages::Stage;

/// How closely layers as seen along the axis follow their outlines, mm: supports keep more than ten
/// times that distance.
const SEEN_TOLERANCE_MM: f64 = 0.02;

/// Sections of a stage, as far as they are needed. See the [module](self).
pub(crate) struct Stack<'a> {
    solid: &'a Solid,
    /// `None` where every layer has a surface of its own.
    cutter: Option<Cutter<'a>>,
    stage: &'a Stage,
    /// The curved layers that the first planar one lies on.
    stair: Option<Stair<'a>>,
    job: &'a Job,
    /// The supports of the layers printed, if there are any.
    columns: &'a [Column],
    /// The lines of sparse infill of the layers printed, where they are found for all together.
    branches: Vec<Branches>,
    /// What layers were taken apart into for that, of the lowest ones printed: they are filled first.
    kept: Vec<Mutex<Option<Pieces>>>,
    /// Where sections that others want, too, are put by.
    shelf: Use<'a>,
    /// Sections from `first` on.
    sections: VecDeque<Cut>,
    first: usize,
}

/// The section of a layer.
struct Cut {
    section: Section,
    /// A thinned-out copy for comparing layers.
    cover: Region,
    /// Where the wedge of the layer on the floor is too narrow for a bead, in its chart.
    narrow: Region,
    /// What of that is left to the layer above, in the charts of both; known when that is cut.
    bare: Option<[Region; 2]>,
    /// Whether the section of the layer below is the same to the last bit, as between upright walls.
    repeats: bool,
}

/// How much is kept of what layers were taken apart into, bytes: that of a hundred layers of a fine model.
/// Layers beyond that are taken apart once more.
const KEPT_BYTES: usize = 12 << 20;

/// Wedges on the floor narrower than this share of the least width of a bead that is printed are left to
/// the layer above: so near that width, only bits and pieces of a bead would be laid.
const BARE_IN_WIDTHS: f64 = 1.5;

/// The next layer takes over what it can lay this share of.
const TAKEN_SHARE: f64 = 0.5;

impl<'a> Stack<'a> {
    pub(crate) fn new(
        solid: &'a Solid,
        stage: &'a Stage,
        below: Option<&'a Stage>,
        job: &'a Job,
    ) -> Self {
        let same = stage.morph.is_none();
        let cutter = same.then(|| Cutter::new(solid, &*stage.surface, &stage.levels));
        let skins = &job.paths.skins;
        let first = stage.printed.start.saturating_sub(skins.bottom_layers.max(1));
        let stair = below.and_then(|below| below.stair(&stage.levels[stage.printed.start]));
        let sections = VecDeque::new();
        let (branches, kept, shelf) = (Vec::new(), Vec::new(), Use::Leave);
        let columns = &[];
        Self { solid, cutter, stage, stair, job, columns, branches, kept, shelf, sections, first }
    }

    /// Shares sections with others of the same solid, stage and job.
    pub(crate) fn share(&mut self, shelf: Use<'a>) {
        self.shelf = shelf;
    }

    /// Stands on these supports, of which there is one for every layer printed.
    pub(crate) fn stand_on(&mut self, columns: &'a [Column]) {
        self.columns = columns;
    }

    /// Finds the sparse infill that depends on all layers above.
    ///
    /// # Errors
    ///
    /// When the user interrupts.
    pub(crate) fn grow(&mut self, interrupt: &Interrupt) -> Result<(), Failure> {
        let params = &self.job.paths;
        let how = &params.infill;
        if how.pattern != Pattern::Lightning || how.density <= 0.0 || params.skins.all_solid {
            return Ok(());
        }
        let Self { solid, stage, stair, job, first, columns, shelf, .. } = *self;
        let shelf = if let Use::Empty(shelf) = shelf { Use::PutBy(shelf) } else { shelf };
        let Range { start, end } = stage.printed;
        let mut ahead = Self { stair, first, columns, shelf, ..Self::new(solid, stage, None, job) };
        let mut cores: Vec<(Region, f64)> = Vec::with_capacity(end - start);
        let mut room = KEPT_BYTES;
        for from in stage.printed.clone().step_by(WINDOW) {
            interrupt.check()?;
            let window = from..(from + WINDOW).min(end);
            ahead.reach(&window, |_| {});
            let core = |run: Range<usize>| {
                let core = |(k, layer): (usize, &Option<Parted<'_>>)| {
                    layer.as_ref().map(|layer| layer.core(&ahead.params(k))).unwrap_or_default()
                };
                let mut layers = ahead.part_run(run.clone());
                let cores = run.zip(&layers).map(core).collect::<Vec<_>>();
                // The others of a run are as the first.
                (cores, layers.swap_remove(0).map(Parted::into_pieces))
            };
            let runs: Vec<_> = ahead.runs(window).into_par_iter().map(core).collect();
            for (run, pieces) in runs {
                let size = pieces.as_ref().map_or(0, Pieces::size);
                // The lowest: once there is no room, none of those above are kept.
                let left = room.checked_sub(size);
                room = left.unwrap_or(0);
                self.kept.push(Mutex::new(pieces.filter(|_| left.is_some())));
                self.kept.extend(run[1..].iter().map(|_| Mutex::default()));
                cores.extend(run);
            }
        }
        let strata = (0..cores.len()).into_par_iter().map(|i| {
            let (core, above) = (&cores[i].0, cores.get(i + 1));
            let above = above.map(|(above, _)| self.region_below(above, start + i));
            let closed = above.map_or_else(|| core.clone(), |above| core.difference(&above));
            let level = &stage.levels[start + i];
            let reach = level.thickness() / stage.surface.level_step(1.0);
            Stratum { core: core.clone(), closed, reach }
        });
        let strata: Vec<Stratum> = strata.collect();
        // Layers of other thicknesses have lines that are a little nearer or farther.
        let spacing = cores.iter().map(|(_, spacing)| *spacing).fold(0.0, f64::max);
        self.branches = grow(&strata, |i, p| self.point_below(p, start + i - 1), spacing);
        Ok(())
    }

    /// A place of layer `k + 1` on layer `k`.
    fn point_below(&self, p: &Point2<f64>, k: usize) -> Point2<f64> {
        if self.stage.morph.is_some() {
            let charts = [k, k + 1].map(|i| self.chart(i));
            return charts[0].under(&charts[1].seen_from_above(p));
        }
        let [to, from] = [k, k + 1].map(|i| self.stage.levels[i].upper);
        carried_point(&*self.stage.surface, p, from, to)
    }

    /// A region of layer `k + 1` on layer `k`.
    fn region_below(&self, region: &Region, k: usize) -> Region {
        if self.stage.morph.is_some() {
            let charts = [k, k + 1].map(|i| self.chart(i));
            return charts[0].region_under(&charts[1].region_from_above(region));
        }
        let [to, from] = [k, k + 1].map(|i| self.stage.levels[i].upper);
        carried(&*self.stage.surface, region, from, to)
    }

    fn chart(&self, k: usize) -> Chart {
        let lift = self.lift(k);
        lift.surface.chart(lift.level.upper)
    }

    /// Cuts what is missing for a window and drops what no later window needs; `torn` sees every
    /// section whose outlines are.
    pub(crate) fn reach(&mut self, window: &Range<usize>, mut torn: impl FnMut(&Tears)) {
        let skins = &self.job.paths.skins;
        let keep_from = window.start.saturating_sub(skins.bottom_layers.max(1));
        while self.first < keep_from {
            self.sections.pop_front();
            self.first += 1;
        }
        let have = self.first + self.sections.len();
        let want = (window.end + skins.top_layers.max(1)).min(self.stage.levels.len());
        let cut: Vec<Cut> = (have..want)
            .into_par_iter()
            .map(|k| {
                let (section, cover) = self.shelf.cut(k, || self.cut(k));
                let narrow = self.narrow(&cover, k);
                Cut { section, cover, narrow, bare: None, repeats: false }
            })
            .collect();
        for mut cut in cut {
            torn(&cut.section.tears);
            let below = self.sections.back();
            cut.repeats = below.is_some_and(|below| below.section.region == cut.section.region);
            self.sections.push_back(cut);
        }
        for i in 0..self.sections.len().saturating_sub(1) {
            if self.sections[i].bare.is_none() {
                let bare = self.left_bare(self.first + i);
                self.sections[i].bare = Some(bare);
            }
        }
    }

    /// The section of layer `k` as it is to be printed, and a thinned-out copy.
    fn cut(&self, k: usize) -> (Section, Region) {
        let mut section = self.section(k);
        let level = &self.stage.levels[k];
        let is_first = level.index == 0 && self.stage.floor.is_none();
        let chart = self.stage.surface.chart(level.middle());
        let how = &self.job.paths.compensation;
        if let Some(polyholes) = &how.polyholes {
            section.region = self.with_polyholes(section.region, k, &chart, polyholes);
        }
        if *how != CompensationParams::default() {
            section.region = compensated(section.region, is_first, &chart, how);
        }
        let cover = section.region.thinned(SKIN_TOLERANCE_MM);
        (section, cover)
    }

    /// A section of layer `k` whose upright bores, those that a layer above or below has too, are polygons.
    /// Layers beside are cut once more for that: few prints ask for it, and few layers have round holes.
    fn with_polyholes(
        &self,
        section: Region,
        k: usize,
        chart: &Chart,
        params: &PolyholeParams,
    ) -> Region {
        let tolerance = self.job.paths.tolerance;
        let found = bores(&section, chart, tolerance, params);
        if found.is_empty() {
            return section;
        }
        let beside = [k.checked_sub(1), Some(k + 1).filter(|k| *k < self.stage.levels.len())];
        let beside: Vec<Bore> = beside
            .into_iter()
            .flatten()
            .flat_map(|k| {
                let chart = self.stage.surface.chart(self.stage.levels[k].middle());
                bores(&self.section(k).region, &chart, tolerance, params)
            })
            .collect();
        let goes_on = |bore: &&Bore| beside.iter().any(|b| b.is_like(bore, params.threshold));
        let upright: Vec<Bore> = found.iter().filter(goes_on).copied().collect();
        let is_odd = self.stage.levels[k].index % 2 == 1;
        with_polyholes(&section, &upright, is_odd, chart, params)
    }

    /// Where the wedge of a layer on the floor is too narrow for a bead, in its chart.
    fn narrow(&self, section: &Region, k: usize) -> Region {
        let Stage { floor, printed, morph, .. } = self.stage;
        if floor.is_none() || morph.is_some() || !printed.contains(&k) {
            return Region::default();
        }
        let lift = self.lift(k);
        let material = self.at_upper(section, k, k, &lift);
        lift.too_narrow(&material, BARE_IN_WIDTHS * self.job.paths.thin.least_width)
    }

    /// What layer `k` leaves to the next, which has room for a bead there, in the charts of both.
    fn left_bare(&self, k: usize) -> [Region; 2] {
        let narrow = &self.sections[k - self.first].narrow;
        if narrow.is_empty() || !self.stage.printed.contains(&(k + 1)) {
            return [Region::default(), Region::default()];
        }
        let levels = &self.stage.levels;
        let [from, to] = [k, k + 1].map(|k| levels[k].upper);
        let above = self.material(k + 1, &self.lift(k + 1));
        let above = above.difference(&self.sections[k + 1 - self.first].narrow);
        let seen = carried(&*self.stage.surface, narrow, from, to);
        let taken = seen.filtered(|island| {
            let island = Region::from_island((*island).clone());
            island.intersection(&above).area() >= TAKEN_SHARE * island.area()
        });
        [carried(&*self.stage.surface, &taken, to, from), taken]
    }

    fn section(&self, k: usize) -> Section {
        let tolerance = self.job.paths.tolerance;
        if let Some(cutter) = &self.cutter {
            return cutter.section(k, tolerance);
        }
        let Some(middle) = self.middle(k) else { return Section::default() };
        Cutter::at_levels(self.solid, middle.sheet.surface(), vec![middle.level])
            .section(0, tolerance)
    }

    /// The surface halfway through a layer with a surface of its own.
    fn middle(&self, k: usize) -> Option<Side> {
        let sides = self.stage.morph.as_ref()?;
        sides[k].halfway(&sides[k + 1]).ok()
    }

    /// Fills the layers of a window.
    pub(crate) fn fill(&self, window: Range<usize>) -> Vec<Filled> {
        if self.job.paths.infill.every <= 1 {
            let runs: Vec<Vec<Filled>> =
                self.runs(window).into_par_iter().map(|run| self.fill_run(run)).collect();
            return runs.into_iter().flatten().collect();
        }
        let start = window.start;
        let parted = window.clone().into_par_iter().map(|k| self.part(k));
        let mut parted: Vec<Option<Parted<'_>>> = parted.collect();
        for (index, group) in self.combined(&window) {
            let layers = &mut parted[group.start - window.start..group.end - window.start];
            self.combine(layers, group, index);
        }
        let filled = parted.into_par_iter().enumerate();
        let fill = |(i, layer): (usize, Option<Parted<'_>>)| {
            layer.map(|layer| layer.fill(&self.params(start + i))).unwrap_or_default()
        };
        filled.map(fill).collect()
    }

    /// The groups of layers of a window whose sparse infill is laid at once: as many as are wanted, or as
    /// many as are not too thick together.
    /// With each comes how many there are below it.
    fn combined(&self, window: &Range<usize>) -> Vec<(usize, Range<usize>)> {
        /// Rounding of a sum of heights, mm.
        const SLACK_MM: f64 = 1e-6;
        if self.stage.morph.is_some() {
            return Vec::new();
        }
        let how = &self.job.paths.infill;
        let levels = &self.stage.levels;
        let most = how.thickest * self.stage.surface.level_step(1.0) + SLACK_MM;
        let mut groups: Vec<Range<usize>> = Vec::new();
        // What lies on a stair has a lower side of its own.
        let stair = usize::from(self.stair.is_some());
        for k in self.stage.printed.start + stair..window.end {
            match groups.last_mut() {
                Some(group)
                    if k != window.start
                        && group.len() < how.every
                        && levels[k].upper - levels[group.start].lower <= most =>
                {
                    group.end = k + 1;
                }
                _ => groups.push(k..k + 1),
            }
        }
        let groups = groups.into_iter().enumerate();
        groups.filter(|(_, group)| group.start >= window.start && group.len() > 1).collect()
    }

    /// Has the sparse infill that all layers of a group have laid by the last of them.
    fn combine(&self, layers: &mut [Option<Parted<'_>>], group: Range<usize>, index: usize) {
        let (params, levels) = (&self.job.paths, &self.stage.levels);
        let surface = &*self.stage.surface;
        let last = group.end - 1;
        let moved = |region: &Region, from: usize, to: usize| {
            carried(surface, region, levels[from].upper, levels[to].upper)
        };
        let mut common: Option<Region> = None;
        for (k, layer) in group.clone().zip(layers.iter()).rev() {
            let Some(layer) = layer else { return };
            let sparse = moved(&layer.sparse(), k, last);
            let all =
                common.as_ref().map_or_else(|| sparse.clone(), |all| all.intersection(&sparse));
            if all.is_empty() {
                return;
            }
            common = Some(all);
        }
        let (Some(common), lower) = (common, levels[group.start].lower) else { return };
        let chart = surface.chart(levels[last].upper);
        let lift = self.lift(last);
        let clear = Lift { level: Level { lower, ..lift.level }, ..lift }.clear_of_floor(&common);
        let region = chart
            .opened(&clear, params.infill.width)
            .without_small_islands(params.skins.solid_below_area);
        if region.is_empty() {
            return;
        }
        for (k, layer) in group.zip(layers) {
            let Some(layer) = layer else { continue };
            layer.leave_out(&moved(&region, last, k), params);
            if k == last {
                layer.fill_thick(region.clone(), lower, index);
            }
        }
    }

    /// Takes layers apart of which each repeats the one before: once for all.
    fn part_run(&self, run: Range<usize>) -> Vec<Option<Parted<'_>>> {
        let first = self.part(run.start);
        let part = |k: usize| {
            let again = first.as_ref()?.again_on(&self.lift(k));
            again.map(|layer| self.branched(layer, k)).or_else(|| self.part(k))
        };
        let rest: Vec<_> = (run.start + 1..run.end).into_par_iter().map(part).collect();
        std::iter::once(first).chain(rest).collect()
    }

    /// Fills layers of which each repeats the one before.
    fn fill_run(&self, run: Range<usize>) -> Vec<Filled> {
        let layers = run.clone().into_par_iter().zip(self.part_run(run));
        let fill = |(k, layer): (usize, Option<Parted<'_>>)| {
            layer.map(|layer| layer.fill(&self.params(k))).unwrap_or_default()
        };
        layers.map(fill).collect()
    }

    /// The layers of a window, in runs of such as are the same but for their height.
    fn runs(&self, window: Range<usize>) -> Vec<Range<usize>> {
        let mut runs: Vec<Range<usize>> = Vec::new();
        for k in window.clone() {
            match runs.last_mut() {
                Some(run) if k > window.start && self.repeats(k) => run.end = k + 1,
                _ => runs.push(k..k + 1),
            }
        }
        runs
    }

    /// Whether a layer and all that it is compared with are those of the layer below, one higher.
    fn repeats(&self, k: usize) -> bool {
        let stands_free = |k: usize| self.column(k).is_none_or(Column::is_empty);
        if self.stage.morph.is_some() || !stands_free(k) || !stands_free(k - 1) {
            return false;
        }
        let ((above, below), (others_above, others_below)) = (self.beside(k), self.beside(k - 1));
        let lowest = below.last().copied().unwrap_or(k);
        let highest = above.last().copied().unwrap_or(k);
        (above.len(), below.len()) == (others_above.len(), others_below.len())
            && self.params(k) == self.params(k - 1)
            && (lowest..=highest).all(|i| self.sections[i - self.first].repeats)
    }

    /// How a layer is filled.
    fn params(&self, k: usize) -> PathParams {
        let index = self.stage.levels[k].index;
        self.job.paths.of_layer(index, index == 0 && self.stage.floor.is_none())
    }

    /// Takes a layer apart; `None` where nothing of it is.
    fn part(&self, k: usize) -> Option<Parted<'_>> {
        let lift = self.lift(k);
        let support = self.column(k).filter(|column| !column.is_empty());
        if let Some(pieces) = self.kept_of(k) {
            return Some(self.branched(Parted::of(&lift, pieces).on(support), k));
        }
        let material = self.material(k, &lift);
        if material.is_empty() && support.is_none() {
            return None;
        }
        let (above, below) = self.beside(k);
        let cover = |i: &usize| self.at_upper(&self.sections[i - self.first].cover, *i, k, &lift);
        let above: Vec<Cow<'_, Region>> = above.iter().map(cover).collect();
        let below: Vec<Cow<'_, Region>> = below.iter().map(cover).collect();
        let neighbours = Neighbours {
            above: above.iter().map(AsRef::as_ref).collect(),
            below: below.iter().map(AsRef::as_ref).collect(),
            support,
        };
        let parted = Parted::new(&lift, &material, &neighbours, &self.params(k)).on(support);
        Some(self.branched(parted, k))
    }

    /// What layer `k` was taken apart into before; it is wanted once.
    fn kept_of(&self, k: usize) -> Option<Pieces> {
        let kept = self.kept.get(k.checked_sub(self.stage.printed.start)?)?;
        kept.lock().unwrap_or_else(PoisonError::into_inner).take()
    }

    /// What of layer `k` is support.
    fn column(&self, k: usize) -> Option<&'a Column> {
        self.columns.get(k.wrapping_sub(self.stage.printed.start))
    }

    fn branched<'b>(&'b self, parted: Parted<'b>, k: usize) -> Parted<'b> {
        let branches = self.branches.get(k.wrapping_sub(self.stage.printed.start));
        parted.with_branches(branches.map_or(&[], Vec::as_slice))
    }

    /// Layers of a window as they are seen along the axis, for what supports them.
    pub(crate) fn shades(&self, window: Range<usize>, params: &SupportParams) -> Vec<Shade> {
        window.into_par_iter().map(|k| self.shade(k, params)).collect()
    }

    fn shade(&self, k: usize, params: &SupportParams) -> Shade {
        let lift = self.lift(k);
        let material = self.material(k, &lift);
        let level = &self.stage.levels[k];
        let chart = lift.surface.chart(level.upper);
        let thickness = level.thickness() / lift.surface.level_step(1.0);
        let on_bed = level.index == 0 && self.stage.floor.is_none();
        let below = k.checked_sub(1).filter(|i| *i >= self.first && !on_bed);
        let hanging = below.filter(|_| !material.is_empty()).map(|i| {
            let below = self.at_upper(&self.sections[i - self.first].cover, i, k, &lift);
            hanging(&material, &below, &chart, thickness, params)
        });
        let seen = |region: &Region| chart.region_from_above(region).thinned(SEEN_TOLERANCE_MM);
        // What is too low to be laid stands there all the same, in the layers of the floor.
        let standing = if lift.floor.is_some() {
            let section = &self.sections[k - self.first].section.region;
            let section = self.at_upper(section, k, k, &lift);
            Cow::Owned(Lift { floor: None, ..lift }.printable(&section))
        } else {
            material
        };
        Shade {
            material: seen(&standing),
            hanging: hanging.map(|region| seen(&region)).unwrap_or_default(),
            thickness,
        }
    }

    fn lift(&self, k: usize) -> Lift<'_> {
        let Stage { surface, levels, floor, ceiling, .. } = self.stage;
        let level = levels[k];
        if let Some(sides) = &self.stage.morph {
            let (surface, below) = (sides[k + 1].sheet.surface(), Some(sides[k]));
            let (floor, ceiling, stair, bare) = (None, None, None, None);
            return Lift { surface, level, floor, ceiling, stair, below, bare };
        }
        let stair = self.stair.filter(|_| k == self.stage.printed.start);
        let (floor, ceiling) = (*floor, *ceiling);
        // Its own stage has a layer below, but for the first one.
        let below = k.checked_sub(self.first + 1).and_then(|i| self.sections.get(i));
        let bare = below.and_then(|cut| cut.bare.as_ref()).map(|[_, above]| above);
        let bare = bare.filter(|bare| !bare.is_empty());
        Lift { surface: &**surface, level, floor, ceiling, stair, below: None, bare }
    }

    /// The material of a layer on its upper side.
    fn material(&self, k: usize, lift: &Lift<'_>) -> Cow<'_, Region> {
        let region = self.at_upper(&self.sections[k - self.first].section.region, k, k, lift);
        // Cones without slope are planes that may begin and end anywhere.
        if lift.floor.is_none() && lift.ceiling.is_none() {
            return region;
        }
        let printable = lift.printable(&region);
        let bare = self.sections[k - self.first].bare.as_ref();
        let bare = bare.map(|[own, _]| own).filter(|own| !own.is_empty());
        Cow::Owned(match bare {
            Some(bare) => printable.difference(bare),
            None => printable,
        })
    }

    /// A region of layer `i`, taken to the upper side of layer `k`: there the nozzle runs, and that is
    /// where regions are compared.
    fn at_upper<'r>(
        &self,
        region: &'r Region,
        i: usize,
        k: usize,
        lift: &Lift<'_>,
    ) -> Cow<'r, Region> {
        let levels = &self.stage.levels;
        if let Some(sides) = &self.stage.morph {
            let (upper, above) = (lift.surface, sides[k + 1].level);
            // Half the thickness along the normal of the upper side, away from the axis.
            let outwards = |r: f64| {
                let at = Point3::new(r, 0.0, upper.height(above, r));
                let way = lift.thickness(&at) / 2.0 * upper.normal(&at).x;
                if way.is_finite() { way } else { 0.0 }
            };
            // Between sides that are not alike regions are compared straight up and down: side faces
            // then lie on top of each other.
            let chart = upper.chart(above);
            let carried = self.middle(i).map(|middle| {
                let from = middle.sheet.surface().chart(middle.level);
                carried_to_side(region, [&from, &chart], outwards)
            });
            return Cow::Owned(carried.unwrap_or_default());
        }
        if lift.surface.form().is_flat() {
            return Cow::Borrowed(region);
        }
        Cow::Owned(carried(lift.surface, region, levels[i].middle(), levels[k].upper))
    }

    /// The layers above and below that decide on the skins of layer `k`, the nearest first.
    fn beside(&self, k: usize) -> (Vec<usize>, Vec<usize>) {
        let skins = &self.job.paths.skins;
        let have = self.first..self.first + self.sections.len();
        let above = (k + 1..=k + skins.top_layers.max(1)).take_while(|i| have.contains(i));
        let below = (k.saturating_sub(skins.bottom_layers.max(1))..k).rev();
        (above.collect(), below.take_while(|i| have.contains(i)).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::Settings;
    use crate::shelf::Shelf;

    /// What was put by to find branches is what a layer is taken apart into when it is printed, supports and
    /// all, on planes and on cones.
    #[test]
    fn layers_that_were_kept_are_filled_as_if_they_were_not() {
        for (model, layers) in [("mushroom", "planar"), ("gear", "planar"), ("umbrella", "conical")]
        {
            let solid = Solid::new(mesh::shapes::by_name(model).unwrap());
            let mut settings = Settings::defaults();
            settings.set(&format!("layers={layers}")).unwrap();
            settings.set("fill_pattern=lightning").unwrap();
            settings.set("extra_perimeters=true").unwrap();
            let job = Job::resolve(&settings).unwrap();
            let (stages, _) = crate::stages::stages(&solid, &job).unwrap();
            let stage = stages.last().unwrap();
            let below = stages.iter().rev().nth(1);
            let shelf = Shelf::of(stage.levels.len());
            let columns: Vec<Column> = vec![Column::default(); stage.printed.len()];
            let fill = |forget: bool| -> Vec<Filled> {
                let mut stack = Stack::new(&solid, stage, below, &job);
                stack.stand_on(&columns);
                if !forget {
                    stack.share(Use::Empty(&shelf));
                }
                stack.grow(&Interrupt::default()).unwrap();
                let kept = stack.kept.iter().filter(|kept| kept.lock().unwrap().is_some()).count();
                assert!(kept > 0, "{model}");
                if forget {
                    stack.kept.clear();
                }
                let starts = stage.printed.clone().step_by(WINDOW);
                let window = |from: usize| {
                    let window = from..(from + WINDOW).min(stage.printed.end);
                    stack.reach(&window, |_| {});
                    stack.fill(window)
                };
                starts.flat_map(window).collect()
            };
            assert!(fill(true) == fill(false), "{model}");
        }
    }

    /// Layers that repeat the one below are what they would be if each were taken apart.
    #[test]
    fn runs_of_equal_layers_are_filled_as_each_of_them_alone() {
        for (model, least) in [("gear", 20), ("steps", 20), ("cone", 0)] {
            let solid = Solid::new(mesh::shapes::by_name(model).unwrap());
            let job = Job::resolve(&Settings::defaults()).unwrap();
            let (stages, _) = crate::stages::stages(&solid, &job).unwrap();
            let mut stack = Stack::new(&solid, &stages[0], None, &job);
            let window = stages[0].printed.clone();
            stack.reach(&window, |_| {});
            let alone =
                |k| stack.part(k).map(|layer| layer.fill(&stack.params(k))).unwrap_or_default();
            let each: Vec<Filled> = window.clone().map(alone).collect();
            let repeated = window.clone().filter(|k| *k > 0 && stack.repeats(*k)).count();
            assert!(repeated >= least, "{model}: {repeated} of {} layers", window.len());
            assert!(stack.fill(window) == each, "{model}");
        }
    }
}

//! The sections that a window of layers needs: its own, and those above and below that decide on
//! its skins.

use std::collections::VecDeque;
use std::ops::Range;

use geom::region::Region;
use mesh::topology::Solid;
use rayon::prelude::*;
use slicer::chart::carried;
use slicer::layer::{Filled, fill_layer};
use slicer::level::Level;
use slicer::lift::Lift;
use slicer::section::{Cutter, Section, Tears};
use slicer::skins::{Neighbours, SKIN_TOLERANCE_MM};
use slicer::stacking::Stair;

use crate::settings::Job;
use crate::stages::Stage;

/// Sections of a stage, as far as they are needed. See the [module](self).
pub(crate) struct Stack<'a> {
    cutter: Cutter<'a>,
    stage: &'a Stage,
    /// The curved layers that the first planar one lies on.
    stair: Option<Stair<'a>>,
    job: &'a Job,
    /// Sections from `first` on, each with a thinned-out copy for comparing layers.
    sections: VecDeque<(Section, Region)>,
    first: usize,
}

impl<'a> Stack<'a> {
    pub(crate) fn new(
        solid: &'a Solid,
        stage: &'a Stage,
        below: Option<&'a Stage>,
        job: &'a Job,
    ) -> Self {
        let cutter = Cutter::new(solid, &*stage.surface, &stage.levels);
        let skins = &job.paths.skins;
        let first = stage.printed.start.saturating_sub(skins.bottom_layers.max(1));
        let stair = below.and_then(|below| below.stair(&stage.levels[stage.printed.start]));
        Self { cutter, stage, stair, job, sections: VecDeque::new(), first }
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
        let cut: Vec<(Section, Region)> = (have..want)
            .into_par_iter()
            .map(|k| {
                let section = self.cutter.section(k, self.job.paths.tolerance);
                let cover = section.region.thinned(SKIN_TOLERANCE_MM);
                (section, cover)
            })
            .collect();
        for (section, _) in &cut {
            torn(&section.tears);
        }
        self.sections.extend(cut);
    }

    /// Fills the layers of a window.
    pub(crate) fn fill(&self, window: Range<usize>) -> Vec<Filled> {
        window.into_par_iter().map(|k| self.fill_one(k)).collect()
    }

    fn fill_one(&self, k: usize) -> Filled {
        let Stage { surface, levels, floor, ceiling, .. } = self.stage;
        let stair = self.stair.filter(|_| k == self.stage.printed.start);
        let lift =
            Lift { surface: &**surface, level: levels[k], floor: *floor, ceiling: *ceiling, stair };
        let region = &self.sections[k - self.first].0.region;
        if surface.form().is_flat() {
            let (above, below) = self.beside(k);
            let at = |i: &usize| &self.sections[i - self.first].1;
            let neighbours = Neighbours {
                above: above.iter().map(at).collect(),
                below: below.iter().map(at).collect(),
            };
            // Cones without slope are planes that may begin and end anywhere.
            if floor.is_some() || ceiling.is_some() {
                let material = lift.printable(region);
                return fill_layer(&lift, &material, &neighbours, &self.job.paths);
            }
            return fill_layer(&lift, region, &neighbours, &self.job.paths);
        }
        // The nozzle runs on the upper side, and that is where regions are compared.
        let upper = levels[k].upper;
        let to_upper =
            |region: &Region, level: &Level| carried(lift.surface, region, level.middle(), upper);
        let material = lift.printable(&to_upper(region, &levels[k]));
        if material.is_empty() {
            return Filled::default();
        }
        let (above, below) = self.beside(k);
        let cover = |i: &usize| to_upper(&self.sections[i - self.first].1, &levels[*i]);
        let above: Vec<Region> = above.iter().map(cover).collect();
        let below: Vec<Region> = below.iter().map(cover).collect();
        let neighbours =
            Neighbours { above: above.iter().collect(), below: below.iter().collect() };
        fill_layer(&lift, &material, &neighbours, &self.job.paths)
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

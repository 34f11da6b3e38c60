//! The sections that a window of layers needs: its own, and those above and below that decide on
//! its skins.

use std::collections::VecDeque;
use std::ops::Range;

use geom::region::Region;
use mesh::topology::Solid;
use nalgebra::Point3;
use rayon::prelude::*;
use slicer::chart::{carried, carried_to_cone};
use slicer::compensation::{CompensationParams, compensated};
use slicer::layer::{Filled, fill_layer};
use slicer::level::Level;
use slicer::lift::Lift;
use slicer::section::{Cutter, Section, Tears};
use slicer::skins::{Neighbours, SKIN_TOLERANCE_MM};
use slicer::stacking::{Side, Stair};
use slicer::surface::LayerSurface;

use crate::settings::Job;
use crate::stages::Stage;

/// Sections of a stage, as far as they are needed. See the [module](self).
pub(crate) struct Stack<'a> {
    solid: &'a Solid,
    /// `None` where every layer has a surface of its own.
    cutter: Option<Cutter<'a>>,
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
        let same = stage.morph.is_none();
        let cutter = same.then(|| Cutter::new(solid, &*stage.surface, &stage.levels));
        let skins = &job.paths.skins;
        let first = stage.printed.start.saturating_sub(skins.bottom_layers.max(1));
        let stair = below.and_then(|below| below.stair(&stage.levels[stage.printed.start]));
        Self { solid, cutter, stage, stair, job, sections: VecDeque::new(), first }
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
                let mut section = self.section(k);
                let level = &self.stage.levels[k];
                let is_first = level.index == 0 && self.stage.floor.is_none();
                let chart = self.stage.surface.chart(level.middle());
                let how = &self.job.paths.compensation;
                if *how != CompensationParams::default() {
                    section.region = compensated(section.region, is_first, &chart, how);
                }
                let cover = section.region.thinned(SKIN_TOLERANCE_MM);
                (section, cover)
            })
            .collect();
        for (section, _) in &cut {
            torn(&section.tears);
        }
        self.sections.extend(cut);
    }

    fn section(&self, k: usize) -> Section {
        let tolerance = self.job.paths.tolerance;
        if let Some(cutter) = &self.cutter {
            return cutter.section(k, tolerance);
        }
        let Some(middle) = self.middle(k) else { return Section::default() };
        Cutter::at_levels(self.solid, &middle.cone, vec![middle.level]).section(0, tolerance)
    }

    /// The surface halfway through a layer with a surface of its own.
    fn middle(&self, k: usize) -> Option<Side> {
        let sides = self.stage.morph.as_ref()?;
        sides[k].halfway(&sides[k + 1]).ok()
    }

    /// Fills the layers of a window.
    pub(crate) fn fill(&self, window: Range<usize>) -> Vec<Filled> {
        window.into_par_iter().map(|k| self.fill_one(k)).collect()
    }

    fn fill_one(&self, k: usize) -> Filled {
        let Stage { surface, levels, floor, ceiling, .. } = self.stage;
        if let Some(sides) = &self.stage.morph {
            return self.fill_morphed(k, [&sides[k], &sides[k + 1]]);
        }
        let stair = self.stair.filter(|_| k == self.stage.printed.start);
        let lift = Lift {
            surface: &**surface,
            level: levels[k],
            floor: *floor,
            ceiling: *ceiling,
            stair,
            below: None,
        };
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

    /// Fills a layer between two sides that are not alike. Regions are compared straight up and down:
    /// side faces then lie on top of each other.
    fn fill_morphed(&self, k: usize, [lower, upper]: [&Side; 2]) -> Filled {
        let level = self.stage.levels[k];
        let (surface, below) = (&upper.cone, Some(*lower));
        let lift = Lift { surface, level, floor: None, ceiling: None, stair: None, below };
        let half = |r: f64| {
            let at = Point3::new(r, 0.0, upper.cone.height(upper.level, r));
            lift.thickness(&at) / 2.0
        };
        let to_upper = |region: &Region, i: usize| match self.middle(i) {
            Some(middle) => carried_to_cone(region, [&middle.cone, &upper.cone], half),
            None => Region::default(),
        };
        let material = to_upper(&self.sections[k - self.first].0.region, k);
        if material.is_empty() {
            return Filled::default();
        }
        let (above, below) = self.beside(k);
        let cover = |i: &usize| to_upper(&self.sections[i - self.first].1, *i);
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

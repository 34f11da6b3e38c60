//! Layers filled window by window, ahead of those that are being planned.

use std::ops::Range;

use slicer::layer::Filled;
use slicer::section::Tears;
use slicer::support::Column;

use crate::failure::Failure;
use crate::groups::{stacks, surround, together};
use crate::interrupt::Interrupt;
use crate::pipeline::Parts;
use crate::settings::Job;
use crate::shelf::{Shelf, Use};
use crate::stack::Stack;
use crate::stages::Stage;

/// Layers that are worked at once: enough to keep all threads busy, and as many as most numbers of layers
/// whose sparse infill is laid at once divide. A window of a fine model is a few megabytes.
pub(crate) const WINDOW: usize = 48;

/// The layers of a window with their lines.
pub(crate) struct Batch {
    /// Counted from 0.
    pub(crate) stage: usize,
    /// Which layers of the stage.
    pub(crate) window: Range<usize>,
    /// In their order.
    pub(crate) layers: Vec<Filled>,
    /// Of the sections that were cut for them.
    pub(crate) tears: Vec<Tears>,
}

/// Fills the layers of all stages, window after window; every stage has one at least.
pub(crate) struct Filling<'a> {
    parts: &'a Parts<'a>,
    stages: &'a [Stage],
    shelves: &'a [Shelf],
    columns: &'a [Vec<Column>],
    job: &'a Job,
    stage: usize,
    /// The next layer of the stage; `None` where the stage is not begun.
    next: Option<usize>,
    stacks: Vec<Stack<'a>>,
    is_first: bool,
    interrupt: &'a Interrupt,
}

impl<'a> Filling<'a> {
    /// Nothing is filled yet; supports stand in `columns`, by stage and layer, and sections that are known
    /// already in `shelves`, by stage.
    pub(crate) fn new(
        parts: &'a Parts<'a>,
        (stages, shelves): (&'a [Stage], &'a [Shelf]),
        columns: &'a [Vec<Column>],
        job: &'a Job,
        interrupt: &'a Interrupt,
    ) -> Self {
        let (next, stacks, is_first) = (None, Vec::new(), true);
        let stage = 0;
        Self { parts, stages, shelves, columns, job, stage, next, stacks, is_first, interrupt }
    }

    fn below(&self) -> Option<&'a Stage> {
        self.stage.checked_sub(1).map(|below| &self.stages[below])
    }

    fn begin(&mut self, stage: &'a Stage) -> Result<usize, Failure> {
        self.stacks = stacks(self.parts.groups, self.parts.all, stage, self.below(), self.job);
        if let Some(first) = self.stacks.first_mut() {
            first.stand_on(&self.columns[self.stage]);
        }
        if let ([all], true) = (&mut self.stacks[..], self.parts.groups.is_empty()) {
            all.share(Use::Empty(&self.shelves[self.stage]));
        }
        for stack in &mut self.stacks {
            stack.grow(self.interrupt)?;
        }
        Ok(stage.printed.start)
    }

    /// Skirt and brim, which go round all.
    fn surrounded(&self, layers: &mut [Filled], stage: &'a Stage, first: usize) {
        let mut all = Stack::new(self.parts.all, stage, self.below(), self.job);
        let first = first..first + 1;
        all.reach(&first, |_| {});
        if let (Some(layer), Some(all)) = (layers.first_mut(), all.fill(first).pop()) {
            surround(layer, all);
        }
    }

    fn window(&mut self, stage: &'a Stage) -> Result<Batch, Failure> {
        let start = match self.next {
            Some(start) => start,
            None => self.begin(stage)?,
        };
        let window = start..(start + WINDOW).min(stage.printed.end);
        let mut tears = Vec::new();
        for stack in &mut self.stacks {
            stack.reach(&window, |torn| tears.push(*torn));
        }
        let each = self.stacks.iter().map(|stack| stack.fill(window.clone())).collect();
        let mut layers = together(each);
        if self.is_first && !self.parts.groups.is_empty() && !window.is_empty() {
            self.surrounded(&mut layers, stage, start);
        }
        self.is_first &= window.is_empty();
        let batch = Batch { stage: self.stage, window: window.clone(), layers, tears };
        self.next = Some(window.end);
        if window.end >= stage.printed.end {
            (self.stage, self.next) = (self.stage + 1, None);
            self.stacks.clear();
        }
        Ok(batch)
    }
}

impl Iterator for Filling<'_> {
    type Item = Result<Batch, Failure>;

    fn next(&mut self) -> Option<Self::Item> {
        let stage = self.stages.get(self.stage)?;
        Some(self.window(stage))
    }
}

//! What PrusaSlicer and its kin say of the objects of a package in a configuration beside the model.
//!
//! Two things are taken from it: which volumes are no part of the shape (regions with other settings,
//! material that is to be taken away, places for supports), which they keep in the meshes as runs of
//! triangles, or as components of their own; and the settings that an object alone is to have.

use super::part::{each_element, integer, text};
use crate::model::archive::Archive;
use crate::model::{ModelError, OwnSettings, Slicer};
use quick_xml::events::BytesStart;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::RangeInclusive;

/// Where slicers write it, and which.
const CONFIGURATIONS: [(&str, Slicer); 2] = [
    ("Metadata/Slic3r_PE_model.config", Slicer::Prusa),
    ("Metadata/model_settings.config", Slicer::Orca),
];

/// What is said of objects, by their numbers in the first part.
#[derive(Debug, Default)]
pub(super) struct Config {
    /// Runs of triangles of an object that are left out, from 0.
    runs: BTreeMap<u32, Vec<RangeInclusive<usize>>>,
    /// Components of an object that are left out.
    components: BTreeSet<(u32, u32)>,
    /// The settings of an object: keys and values.
    settings: BTreeMap<u32, (Slicer, Vec<(String, String)>)>,
}

impl Config {
    /// Looks it up; what cannot be read says nothing.
    pub(super) fn of(archive: &Archive) -> Self {
        let mut all = Self::default();
        for (name, slicer) in CONFIGURATIONS {
            let Some(Ok(member)) = archive.open(name) else { continue };
            let mut reading = Reading::default();
            if each_element(member, |element, is_end| reading.element(element, is_end)).is_ok() {
                all.runs.extend(reading.runs);
                all.components.extend(reading.components);
                let said = reading.settings.into_iter();
                all.settings.extend(said.map(|(object, pairs)| (object, (slicer, pairs))));
            }
        }
        all.runs.values_mut().for_each(join);
        all
    }

    pub(super) fn leaves_out(&self) -> bool {
        !(self.runs.is_empty() && self.components.is_empty())
    }

    /// The settings that an object alone is to have.
    pub(super) fn settings(&self, object: u32) -> Option<OwnSettings> {
        let (slicer, pairs) = self.settings.get(&object)?;
        Some(OwnSettings { slicer: *slicer, pairs: pairs.clone() })
    }

    /// Whether a triangle of an object is left out.
    pub(super) fn leaves_out_triangle(&self, object: u32, triangle: usize) -> bool {
        self.runs.get(&object).is_some_and(|runs| {
            let next = runs.partition_point(|run| *run.end() < triangle);
            runs.get(next).is_some_and(|run| run.contains(&triangle))
        })
    }

    /// Whether a component of an object is left out.
    pub(super) fn leaves_out_component(&self, object: u32, component: u32) -> bool {
        self.components.contains(&(object, component))
    }
}

/// Brings runs into order, and joins those that overlap: however many a file has, one is found in a
/// few steps.
fn join(runs: &mut Vec<RangeInclusive<usize>>) {
    runs.sort_by_key(|run| *run.start());
    runs.dedup_by(|next, run| {
        let is_joined = next.start() <= run.end();
        if is_joined {
            *run = *run.start()..=*run.end().max(next.end());
        }
        is_joined
    });
}

#[derive(Default)]
struct Reading {
    runs: BTreeMap<u32, Vec<RangeInclusive<usize>>>,
    components: BTreeSet<(u32, u32)>,
    settings: BTreeMap<u32, Vec<(String, String)>>,
    object: Option<u32>,
    /// Whether the reader is within a component.
    in_part: bool,
    /// The volume within which the reader is.
    run: Option<RangeInclusive<usize>>,
}

/// What is said of an object besides its settings.
const NO_SETTINGS: [&str; 3] = ["name", "module", "thumbnail_file"];

impl Reading {
    fn element(&mut self, element: &BytesStart, is_end: bool) -> Result<(), ModelError> {
        let name = element.local_name();
        match (name.as_ref(), is_end, self.object) {
            (b"object", _, _) => {
                self.object = if is_end { None } else { Some(integer(element, b"id")?) };
            }
            (b"volume", true, _) => self.run = None,
            (b"volume", false, Some(_)) => {
                let end = |name| integer(element, name).map(|n| n as usize);
                self.run = Some(end(b"firstid")?..=end(b"lastid")?);
            }
            (b"part", true, _) => self.in_part = false,
            (b"part", false, Some(object)) => {
                self.in_part = true;
                let kind = text(element, b"subtype")?;
                if kind.is_some_and(|kind| kind != "normal_part") {
                    self.components.insert((object, integer(element, b"id")?));
                }
            }
            (b"metadata", false, Some(object)) => {
                let key = text(element, b"key")?.unwrap_or_default();
                let value = text(element, b"value")?.unwrap_or_default();
                self.metadata(object, key, value);
            }
            _ => {}
        }
        Ok(())
    }

    /// Takes what is said of an object, or of the volume of it that the reader is in.
    fn metadata(&mut self, object: u32, key: String, value: String) {
        if let Some(run) = &self.run {
            let is_other = match key.as_str() {
                "volume_type" => value != "ModelPart",
                "modifier" => value == "1",
                _ => false,
            };
            if is_other {
                self.runs.entry(object).or_default().push(run.clone());
            }
        } else if !self.in_part && !key.is_empty() && !NO_SETTINGS.contains(&key.as_str()) {
            self.settings.entry(object).or_default().push((key, value));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_are_found_in_any_order() {
        let mut runs = vec![20..=29, 0..=3, 2..=9, 25..=26, 29..=31];
        join(&mut runs);
        assert_eq!(runs, [0..=9, 20..=31]);
        let config = Config { runs: BTreeMap::from([(1, runs)]), ..Config::default() };
        let found: Vec<usize> = (0..40).filter(|t| config.leaves_out_triangle(1, *t)).collect();
        assert_eq!(found, (0..=9).chain(20..=31).collect::<Vec<_>>());
        assert!(!config.leaves_out_triangle(2, 5));
    }
}

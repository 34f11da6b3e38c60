//! Which volumes of a package are no part of the shape: regions with other settings, material that is
//! to be taken away, places for supports. PrusaSlicer and its kin keep them in the meshes, as runs of
//! triangles, or as components of their own, and say in a configuration beside the model which they
//! are. Nothing else of it is looked at.

use super::part::{each_element, integer, text};
use crate::model::ModelError;
use crate::model::archive::Archive;
use quick_xml::events::BytesStart;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::RangeInclusive;

/// Where slicers write it.
const CONFIGURATIONS: [&str; 2] =
    ["Metadata/Slic3r_PE_model.config", "Metadata/model_settings.config"];

/// What is left out, by the numbers of the objects in the first part.
#[derive(Debug, Default)]
pub(super) struct LeftOut {
    /// Runs of triangles of an object, from 0.
    runs: BTreeMap<u32, Vec<RangeInclusive<usize>>>,
    /// Components of an object.
    components: BTreeSet<(u32, u32)>,
}

impl LeftOut {
    /// Looks them up; what cannot be read leaves nothing out.
    pub(super) fn of(archive: &Archive) -> Self {
        let mut all = Self::default();
        for name in CONFIGURATIONS {
            let Some(Ok(member)) = archive.open(name) else { continue };
            let mut reading = Reading::default();
            if each_element(member, |element, is_end| reading.element(element, is_end)).is_ok() {
                all.runs.extend(reading.found.runs);
                all.components.extend(reading.found.components);
            }
        }
        all.runs.values_mut().for_each(join);
        all
    }

    pub(super) fn is_empty(&self) -> bool {
        self.runs.is_empty() && self.components.is_empty()
    }

    /// Whether a triangle of an object is left out.
    pub(super) fn has_triangle(&self, object: u32, triangle: usize) -> bool {
        self.runs.get(&object).is_some_and(|runs| {
            let next = runs.partition_point(|run| *run.end() < triangle);
            runs.get(next).is_some_and(|run| run.contains(&triangle))
        })
    }

    /// Whether a component of an object is left out.
    pub(super) fn has_component(&self, object: u32, component: u32) -> bool {
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
    found: LeftOut,
    object: Option<u32>,
    /// The volume within which the reader is.
    run: Option<RangeInclusive<usize>>,
}

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
            (b"part", false, Some(object)) => {
                let kind = text(element, b"subtype")?;
                if kind.is_some_and(|kind| kind != "normal_part") {
                    self.found.components.insert((object, integer(element, b"id")?));
                }
            }
            (b"metadata", false, Some(object)) => {
                let key = text(element, b"key")?.unwrap_or_default();
                let value = text(element, b"value")?.unwrap_or_default();
                let is_other = match key.as_str() {
                    "volume_type" => value != "ModelPart",
                    "modifier" => value == "1",
                    _ => false,
                };
                if let Some(run) = self.run.clone().filter(|_| is_other) {
                    self.found.runs.entry(object).or_default().push(run);
                }
            }
            _ => {}
        }
        Ok(())
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
        let left_out = LeftOut { runs: BTreeMap::from([(1, runs)]), ..LeftOut::default() };
        let found: Vec<usize> = (0..40).filter(|t| left_out.has_triangle(1, *t)).collect();
        assert_eq!(found, (0..=9).chain(20..=31).collect::<Vec<_>>());
        assert!(!left_out.has_triangle(2, 5));
    }
}

//! Reads 3MF: the Core Specification 1.3 of the 3MF Consortium, and of its Production Extension
//! that objects lie in files of their own.
//!
//! Of a package, the objects that the build places are taken, with the transforms of places and
//! components, in millimetres. Objects that are supports or something else than a model are left
//! out, and so are places that are not to be printed. Document types are refused, so there are no
//! entities and nothing is fetched; what the package holds for other programs is not looked at.

mod config;
mod part;

use super::archive::Archive;
use super::{Built, Embedded, Given, ModelError, facet};
use crate::note::{self, Note};
use crate::soup::Soup;
use config::Config;
use part::{Component, Object, Part, Shape, Transform};
use std::collections::BTreeMap;
use std::io::Read;
use std::ops::Range;

/// Where the model of a package is, unless its relationships say otherwise.
const USUAL: &str = "3D/3dmodel.model";

/// Components in components: more than anyone draws, and an end for those that hold themselves.
const DEEPEST: usize = 32;

/// Objects that are placed, and facets of all of them unless the file itself has more: a package
/// of a kilobyte can say "twice that, twice that, …".
const MOST_PLACED: usize = 100_000;
const MOST_FACETS: usize = 20_000_000;

pub(super) fn read(bytes: &[u8]) -> Result<Given, ModelError> {
    let archive = Archive::of(bytes).map_err(malformed)?;
    let root = part::root(&archive)?.unwrap_or_else(|| USUAL.to_owned());
    let config = Config::of(&archive);
    let mut package = Package { archive, parts: BTreeMap::new(), config };
    package.load(&root)?;
    let build = package.parts[&root].build.clone();
    let mut placed = Placed { most: MOST_FACETS.max(package.n_facets()), ..Placed::default() };
    for item in build.iter().filter(|item| item.is_printed) {
        let before = placed.soup.facets.len();
        package.place(&root, &item.what, &Transform::IDENTITY, 0, &mut placed)?;
        let facets = before..placed.soup.facets.len();
        if !facets.is_empty() {
            placed.objects.push(package.built(&root, &item.what, facets));
        }
    }
    let notes = package.notes();
    Ok(Given { soup: placed.soup, objects: placed.objects, notes })
}

/// Where slicers keep the settings of a print.
const SETTINGS: [&str; 3] = [
    "Metadata/Slic3r_PE.config",
    "Metadata/SuperSlicer.config",
    "Metadata/project_settings.config",
];

/// The settings of another slicer.
pub(super) fn settings(bytes: &[u8]) -> Result<Option<Embedded>, ModelError> {
    let archive = Archive::of(bytes).map_err(malformed)?;
    for name in SETTINGS {
        let Some(member) = archive.open(name) else { continue };
        let mut text = Vec::new();
        let read = member.map_err(malformed)?.take(MOST_SETTINGS).read_to_end(&mut text);
        read.map_err(|error| malformed(format!("{name}: {error}")))?;
        let is_json = text.trim_ascii_start().starts_with(b"{");
        return Ok(Some(if is_json { Embedded::Orca(text) } else { Embedded::Prusa(text) }));
    }
    Ok(None)
}

/// Settings are a few tens of kilobytes; more than this are none, bytes.
const MOST_SETTINGS: u64 = 16 << 20;

fn malformed(what: impl Into<String>) -> ModelError {
    ModelError::Malformed { format: "3MF", what: what.into() }
}

/// A package, and its parts that were looked at.
struct Package<'a> {
    archive: Archive<'a>,
    parts: BTreeMap<String, Part>,
    config: Config,
}

/// What is placed so far.
#[derive(Default)]
struct Placed {
    soup: Soup,
    objects: Vec<Built>,
    /// How many objects were gone through.
    visits: usize,
    /// The largest number of facets.
    most: usize,
}

impl Package<'_> {
    fn load(&mut self, name: &str) -> Result<(), ModelError> {
        if !self.parts.contains_key(name) {
            let member = self.archive.open(name);
            let member = member.ok_or_else(|| {
                malformed(format!("there is no {} in it", super::shown(name.as_bytes())))
            })?;
            let part = part::read(member.map_err(malformed)?)?;
            self.parts.insert(name.to_owned(), part);
        }
        Ok(())
    }

    fn n_facets(&self) -> usize {
        self.parts.values().flat_map(|part| part.objects.values()).map(Object::n_facets).sum()
    }

    /// Adds an object and its components where a transform puts them.
    fn place(
        &mut self,
        part: &str,
        component: &Component,
        to_build: &Transform,
        depth: usize,
        placed: &mut Placed,
    ) -> Result<(), ModelError> {
        let place = component.transform.in_unit(self.parts[part].mm);
        let part = component.part.as_deref().unwrap_or(part);
        self.load(part)?;
        placed.visits += 1;
        if placed.visits > MOST_PLACED {
            let what = format!("the 3MF places more than {MOST_PLACED} objects");
            return Err(ModelError::Excessive { what });
        }
        if depth > DEEPEST {
            return Err(malformed(format!("objects hold each other more than {DEEPEST} deep")));
        }
        let (id, here) = (component.object, &self.parts[part]);
        let object = here.objects.get(&id);
        let object = object.ok_or_else(|| malformed(format!("there is no object {id} in it")))?;
        if !object.is_printed {
            return Ok(());
        }
        let to_build = place.then(to_build);
        match &object.shape {
            Shape::Mesh(mesh) => {
                // Runs are of the objects that the build places.
                let config = Some(&self.config).filter(|_| depth == 0);
                mesh_at(mesh, &to_build.of_unit(here.mm), id, config, placed)
            }
            Shape::Components(components) => {
                let mut components = components.clone();
                components.retain(|c| !self.config.leaves_out_component(id, c.object));
                components.iter().try_for_each(|component| {
                    self.place(part, component, &to_build, depth + 1, placed)
                })
            }
        }
    }

    /// What is known of a place of the build that is made of these facets.
    fn built(&self, root: &str, what: &Component, facets: Range<usize>) -> Built {
        let part = what.part.as_deref().unwrap_or(root);
        let object = self.parts.get(part).and_then(|part| part.objects.get(&what.object));
        let name = object.map_or_else(String::new, |object| super::shown(object.name.as_bytes()));
        Built { name, facets, settings: self.config.settings(what.object) }
    }

    /// What the user should know of the package.
    fn notes(&self) -> Vec<Note> {
        let mut notes = Vec::new();
        let mut names = self.parts.values().flat_map(|part| part.objects.values());
        if names.any(|object| object.name.contains(char::is_control)) {
            let what = "the name of an object holds line ends or other control characters; they are \
                        left out";
            notes.push(Note::new(note::NAME_SANITIZED, what.to_owned()));
        }
        if self.config.leaves_out() {
            let what = "volumes that change settings, take material away or are for supports are \
                        left out";
            notes.push(Note::new(note::VOLUMES_LEFT_OUT, what.to_owned()));
        }
        let is_settings = |name: &[u8]| {
            let name = name.to_ascii_lowercase();
            name.starts_with(b"metadata/")
                && [&b".config"[..], b".gcode", b".ini", b".json"]
                    .iter()
                    .any(|end| name.ends_with(end))
        };
        if self.archive.names().any(is_settings) {
            let what = "settings of another slicer in the file are not taken over: only the shapes \
                        and their places are (rhumb profile import makes profiles of them, and \
                        --file-settings takes those of single objects)";
            notes.push(Note::new(note::EMBEDDED_SETTINGS_IGNORED, what.to_owned()));
        }
        notes
    }
}

/// Adds a mesh where a transform puts it.
fn mesh_at(
    mesh: &part::Mesh,
    to_build: &Transform,
    id: u32,
    config: Option<&Config>,
    placed: &mut Placed,
) -> Result<(), ModelError> {
    if placed.soup.facets.len() + mesh.triangles.len() > placed.most {
        let what = format!(
            "the objects of the 3MF have more than {} facets in all their places",
            placed.most
        );
        return Err(ModelError::Excessive { what });
    }
    let is_mirrored = to_build.determinant() < 0.0;
    placed.soup.facets.reserve(mesh.triangles.len());
    for (number, &[a, b, c]) in mesh.triangles.iter().enumerate() {
        if config.is_some_and(|config| config.leaves_out_triangle(id, number)) {
            continue;
        }
        let [b, c] = if is_mirrored { [c, b] } else { [b, c] };
        let corners = [a, b, c].map(|v| to_build.point(&mesh.vertices[v as usize]));
        let place = || format!("object {id}, triangle {number}");
        if corners.as_flattened().iter().any(|c| !c.is_finite()) {
            return Err(ModelError::NotFinite { place: place(), value: "out of range".to_owned() });
        }
        placed.soup.facets.push(facet(corners, place)?);
    }
    Ok(())
}

#[cfg(test)]
mod tests;

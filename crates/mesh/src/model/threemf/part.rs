//! One XML file of a package: its objects and what it builds.

use super::malformed;
use crate::model::archive::{Archive, Member};
use crate::model::{ModelError, shown};
use quick_xml::Reader;
use quick_xml::events::attributes::Attribute;
use quick_xml::events::{BytesStart, Event};
use std::collections::BTreeMap;
use std::io::{self, BufReader};

/// Objects, and the places at which they are built.
pub(super) struct Part {
    /// Millimetres in its unit.
    pub(super) mm: f64,
    pub(super) objects: BTreeMap<u32, Object>,
    pub(super) build: Vec<Item>,
}

/// A thing that can be placed.
pub(super) struct Object {
    /// Whether it is a model, and not a support or something else.
    pub(super) is_printed: bool,
    /// What it is called, whatever that may hold.
    pub(super) name: String,
    pub(super) shape: Shape,
}

pub(super) enum Shape {
    Mesh(Mesh),
    Components(Vec<Component>),
}

/// Vertices in the unit of the part, and triangles whose corners are among them.
#[derive(Default)]
pub(super) struct Mesh {
    pub(super) vertices: Vec<[f64; 3]>,
    pub(super) triangles: Vec<[u32; 3]>,
}

/// An object in a place.
#[derive(Debug, Clone)]
pub(super) struct Component {
    /// The part that it is in, unless it is in this one.
    pub(super) part: Option<String>,
    pub(super) object: u32,
    pub(super) transform: Transform,
}

/// A place of the build.
#[derive(Debug, Clone)]
pub(super) struct Item {
    pub(super) what: Component,
    pub(super) is_printed: bool,
}

/// Twelve numbers, as the format has them: three rows for x, y and z, then the translation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Transform([[f64; 3]; 4]);

impl Transform {
    pub(super) const IDENTITY: Self =
        Self([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0; 3]]);

    fn vector(&self, v: &[f64; 3]) -> [f64; 3] {
        [0, 1, 2].map(|k| (0..3).map(|i| v[i] * self.0[i][k]).sum())
    }

    pub(super) fn point(&self, p: &[f64; 3]) -> [f64; 3] {
        let v = self.vector(p);
        [0, 1, 2].map(|k| v[k] + self.0[3][k])
    }

    /// This one first, then another.
    pub(super) fn then(&self, next: &Self) -> Self {
        let [x, y, z, shift] = &self.0;
        Self([next.vector(x), next.vector(y), next.vector(z), next.point(shift)])
    }

    /// The same in millimetres, of one between lengths of some millimetres.
    pub(super) fn in_unit(&self, mm: f64) -> Self {
        let [x, y, z, shift] = self.0;
        Self([x, y, z, shift.map(|c| c * mm)])
    }

    /// One from lengths of some millimetres, of one from millimetres.
    pub(super) fn of_unit(&self, mm: f64) -> Self {
        let [x, y, z, shift] = self.0;
        let [x, y, z] = [x, y, z].map(|row| row.map(|c| c * mm));
        Self([x, y, z, shift])
    }

    pub(super) fn determinant(&self) -> f64 {
        let [[a, b, c], [d, e, f], [g, h, i], _] = self.0;
        a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)
    }
}

impl Object {
    pub(super) fn n_facets(&self) -> usize {
        if let Shape::Mesh(mesh) = &self.shape { mesh.triangles.len() } else { 0 }
    }
}

/// The name of the part that a package is about, where it says so.
pub(super) fn root(archive: &Archive) -> Result<Option<String>, ModelError> {
    let Some(member) = archive.open("_rels/.rels") else { return Ok(None) };
    let mut found = None;
    each_element(member.map_err(malformed)?, |element, _| {
        let is_model = text(element, b"Type")?.is_some_and(|kind| kind.ends_with("/3dmodel"));
        if element.local_name().as_ref() == b"Relationship" && is_model && found.is_none() {
            found = text(element, b"Target")?.map(|target| member_name(&target));
        }
        Ok(())
    })?;
    Ok(found)
}

/// Names in a package begin with a slash, those in the archive do not.
fn member_name(target: &str) -> String {
    target.trim_start_matches('/').to_owned()
}

/// Reads a part.
pub(super) fn read(member: Member) -> Result<Part, ModelError> {
    let mut reading = Reading { part: None, object: None };
    each_element(member, |element, is_end| reading.element(element, is_end))?;
    reading.part.ok_or_else(|| malformed("there is no <model> in it"))
}

/// Calls `each` with the start of every element, and again at its end when it is not empty.
pub(super) fn each_element(
    member: Member,
    mut each: impl FnMut(&BytesStart, bool) -> Result<(), ModelError>,
) -> Result<(), ModelError> {
    let mut reader = Reader::from_reader(BufReader::new(member));
    let mut bytes = Vec::new();
    let mut open: Vec<Vec<u8>> = Vec::new();
    loop {
        bytes.clear();
        match reader.read_event_into(&mut bytes) {
            Ok(Event::Eof) if open.is_empty() => return Ok(()),
            Ok(Event::Eof) => return Err(malformed("its XML is cut short")),
            Ok(Event::DocType(_)) => return Err(malformed("its XML has a document type")),
            Ok(Event::Start(element)) => {
                if open.len() >= DEEPEST_ELEMENT {
                    return Err(malformed("its XML has elements in elements without end"));
                }
                open.push(element.name().as_ref().to_vec());
                each(&element, false)?;
            }
            Ok(Event::Empty(element)) => {
                each(&element, false)?;
                each(&element, true)?;
            }
            Ok(Event::End(_)) => {
                let name = open.pop().unwrap_or_default();
                each(&BytesStart::new(String::from_utf8_lossy(&name)), true)?;
            }
            Ok(_) => {}
            Err(error) => return Err(broken(&error, reader.error_position())),
        }
    }
}

/// Elements in elements; the format needs nine, and whatever else may be there is not drawn.
const DEEPEST_ELEMENT: usize = 256;

fn broken(error: &quick_xml::Error, at: u64) -> ModelError {
    if let quick_xml::Error::Io(error) = error {
        return match error.kind() {
            io::ErrorKind::FileTooLarge => ModelError::Excessive {
                what: "a file within the 3MF unfolds to more than a hundred times its size"
                    .to_owned(),
            },
            _ => malformed("the archive is damaged"),
        };
    }
    malformed(format!("its XML is broken at byte {at}"))
}

/// A part that is being read.
struct Reading {
    part: Option<Part>,
    /// The object within which the reader is.
    object: Option<(u32, Object)>,
}

impl Reading {
    fn element(&mut self, element: &BytesStart, is_end: bool) -> Result<(), ModelError> {
        let name = element.local_name();
        let name = name.as_ref();
        if is_end {
            return if name == b"object" { self.object_ends() } else { Ok(()) };
        }
        if name == b"model" && self.part.is_none() {
            let mm = unit(text(element, b"unit")?.as_deref())?;
            self.part = Some(Part { mm, objects: BTreeMap::new(), build: Vec::new() });
        }
        let Some(part) = &mut self.part else { return Ok(()) };
        match (name, &mut self.object) {
            (b"object", None) => self.object = Some(object(element)?),
            (b"object", Some(_)) => return Err(malformed("an object is in an object")),
            (b"item", None) => {
                let is_printed = text(element, b"printable")?.is_none_or(|word| word != "0");
                part.build.push(Item { what: component(element)?, is_printed });
            }
            (b"vertex", Some((id, object))) => {
                let vertex = numbers(element, *id)?;
                object.mesh(*id)?.vertices.push(vertex);
            }
            (b"triangle", Some((id, object))) => {
                let triangle = corners(element, *id)?;
                object.mesh(*id)?.triangles.push(triangle);
            }
            (b"component", Some((id, object))) => {
                let component = component(element)?;
                object.components(*id)?.push(component);
            }
            _ => {}
        }
        Ok(())
    }

    fn object_ends(&mut self) -> Result<(), ModelError> {
        let (Some((id, object)), Some(part)) = (self.object.take(), &mut self.part) else {
            return Ok(());
        };
        if let Shape::Mesh(mesh) = &object.shape {
            let n = mesh.vertices.len();
            let is_wrong = |triangle: &&[u32; 3]| triangle.iter().any(|v| *v as usize >= n);
            if let Some(triangle) = mesh.triangles.iter().find(is_wrong) {
                let what = format!("object {id} has a triangle {triangle:?} of {n} vertices");
                return Err(malformed(what));
            }
        }
        if part.objects.insert(id, object).is_some() {
            return Err(malformed(format!("there are two objects {id}")));
        }
        Ok(())
    }
}

impl Object {
    fn mesh(&mut self, id: u32) -> Result<&mut Mesh, ModelError> {
        match &mut self.shape {
            Shape::Mesh(mesh) => Ok(mesh),
            Shape::Components(_) => Err(both(id)),
        }
    }

    fn components(&mut self, id: u32) -> Result<&mut Vec<Component>, ModelError> {
        if let Shape::Mesh(mesh) = &self.shape {
            if !mesh.vertices.is_empty() || !mesh.triangles.is_empty() {
                return Err(both(id));
            }
            self.shape = Shape::Components(Vec::new());
        }
        match &mut self.shape {
            Shape::Components(components) => Ok(components),
            Shape::Mesh(_) => Err(both(id)),
        }
    }
}

fn both(id: u32) -> ModelError {
    malformed(format!("object {id} has a mesh and components"))
}

fn unit(word: Option<&str>) -> Result<f64, ModelError> {
    match word.unwrap_or("millimeter") {
        "micron" => Ok(0.001),
        "millimeter" => Ok(1.0),
        "centimeter" => Ok(10.0),
        "inch" => Ok(25.4),
        "foot" => Ok(304.8),
        "meter" => Ok(1000.0),
        other => Err(malformed(format!("its unit is '{}'", shown(other.as_bytes())))),
    }
}

fn object(element: &BytesStart) -> Result<(u32, Object), ModelError> {
    let id = integer(element, b"id")?;
    let kind = text(element, b"type")?;
    let is_printed = kind.is_none_or(|kind| kind == "model");
    let name = text(element, b"name")?.unwrap_or_default();
    Ok((id, Object { is_printed, name, shape: Shape::Mesh(Mesh::default()) }))
}

fn component(element: &BytesStart) -> Result<Component, ModelError> {
    let transform = text(element, b"transform")?;
    Ok(Component {
        part: text(element, b"path")?.map(|path| member_name(&path)),
        object: integer(element, b"objectid")?,
        transform: transform.map_or(Ok(Transform::IDENTITY), |text| matrix(&text))?,
    })
}

fn matrix(text: &str) -> Result<Transform, ModelError> {
    let wrong = || malformed(format!("a transform is '{}'", shown(text.as_bytes())));
    let mut words = text.split_ascii_whitespace();
    let mut transform = Transform::IDENTITY;
    for number in transform.0.as_flattened_mut() {
        let word = words.next().ok_or_else(wrong)?;
        *number = word.parse().ok().filter(|n: &f64| n.is_finite()).ok_or_else(wrong)?;
    }
    if words.next().is_some() { Err(wrong()) } else { Ok(transform) }
}

/// The attributes of an element, without the prefixes of their names.
fn attributes<'a>(
    element: &'a BytesStart,
) -> impl Iterator<Item = Result<Attribute<'a>, ModelError>> {
    let mut attributes = element.attributes();
    attributes.with_checks(false);
    attributes.map(|attribute| attribute.map_err(|_| malformed("an attribute is broken")))
}

/// An attribute as text, references to characters resolved; there are no other entities.
pub(super) fn text(element: &BytesStart, name: &[u8]) -> Result<Option<String>, ModelError> {
    for attribute in attributes(element) {
        let attribute = attribute?;
        if attribute.key.local_name().as_ref() == name {
            let value = attribute.unescape_value();
            return value
                .map(|value| Some(value.into_owned()))
                .map_err(|_| malformed("an attribute holds an unknown entity"));
        }
    }
    Ok(None)
}

pub(super) fn integer(element: &BytesStart, name: &[u8]) -> Result<u32, ModelError> {
    let value = text(element, name)?.unwrap_or_default();
    value.trim().parse().map_err(|_| {
        let (name, value) = (String::from_utf8_lossy(name), shown(value.as_bytes()));
        malformed(format!("{name} is '{value}', which is no number of an object"))
    })
}

/// The position of a vertex.
fn numbers(element: &BytesStart, id: u32) -> Result<[f64; 3], ModelError> {
    let mut position = [f64::NAN; 3];
    for attribute in attributes(element) {
        let attribute = attribute?;
        let k = match attribute.key.as_ref() {
            b"x" => 0,
            b"y" => 1,
            b"z" => 2,
            _ => continue,
        };
        let word = attribute.value.trim_ascii();
        let number = std::str::from_utf8(word).ok().and_then(|word| word.parse::<f64>().ok());
        let number = number
            .ok_or_else(|| malformed(format!("object {id} has a coordinate '{}'", shown(word))))?;
        if !number.is_finite() {
            let place = format!("object {id} of the 3MF");
            return Err(ModelError::NotFinite { place, value: shown(word) });
        }
        position[k] = number;
    }
    if position.iter().any(|c| c.is_nan()) {
        return Err(malformed(format!("object {id} has a vertex without x, y and z")));
    }
    Ok(position)
}

/// The corners of a triangle.
fn corners(element: &BytesStart, id: u32) -> Result<[u32; 3], ModelError> {
    let mut corners = [None; 3];
    for attribute in attributes(element) {
        let attribute = attribute?;
        let k = match attribute.key.as_ref() {
            b"v1" => 0,
            b"v2" => 1,
            b"v3" => 2,
            _ => continue,
        };
        let word = std::str::from_utf8(&attribute.value).ok();
        corners[k] = word.and_then(|word| word.trim().parse::<u32>().ok());
    }
    let [Some(a), Some(b), Some(c)] = corners else {
        return Err(malformed(format!("object {id} has a triangle without v1, v2 and v3")));
    };
    Ok([a, b, c])
}

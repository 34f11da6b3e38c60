//! The models of a print: what their files hold, and where several of them stand.
//!
//! Several models are laid down each for itself. Unless the user gives their places, they are
//! packed around the rotation axis by the circles of their footprints: each goes as near to the
//! middle as the larger ones before it leave room, and the middle of all of them is the axis.

use std::borrow::Cow;
use std::path::Path;

use geom::bounding::Bounds;
use geom::circle::{Circle, smallest_around};
use geom::region::Region;
use mesh::health::{Health, solid_from_soup};
use mesh::mesh::Mesh;
use mesh::model::{self, Format, Given, OwnSettings};
use mesh::note::{self, Note};
use mesh::orient::OrientParams;
use mesh::place::{Placement, reference_azimuth};
use mesh::soup::Soup;
use mesh::split;
use mesh::topology::Solid;
use nalgebra::{Point2, Rotation3, Vector2, Vector3};

use crate::failure::Failure;
use crate::objects::{Extent, Object, hull, outline, overlap};
use crate::own::Own;
use crate::place::{Placed, Pose, Wish, place, place_together, whole_places};

/// A file of a model.
#[derive(Debug, Clone)]
pub struct Model<'a> {
    /// Its name, for messages.
    pub name: &'a Path,
    /// How it is written.
    pub format: Format,
    /// Its bytes; those that are owned are given up as soon as they are read.
    pub bytes: Cow<'a, [u8]>,
}

/// Where several models stand.
#[derive(Debug, Clone, PartialEq)]
pub struct Arrangement {
    /// The centres of their footprints on the bed, mm from the axis, one for each; packed when empty.
    pub at: Vec<Point2<f64>>,
    /// How far packed footprints stay apart, mm.
    pub gap: f64,
    /// How often every model is printed.
    pub copies: usize,
    /// Models that are filled other than the rest.
    pub own: Vec<Own>,
    /// Whether settings that a file holds for single objects are taken over.
    pub file_settings: bool,
    /// Whether the bodies of a model are models each, where the model has them.
    pub split: bool,
}

impl Default for Arrangement {
    fn default() -> Self {
        Self {
            at: Vec::new(),
            gap: 6.0,
            copies: 1,
            own: Vec::new(),
            file_settings: false,
            split: false,
        }
    }
}

/// Reads a file; mirrored and scaled as is wished.
///
/// # Errors
///
/// Classes with exit status 4, or `LimitExceeded`, about the file.
pub fn read(model: &Model<'_>, wish: &Wish) -> Result<Given, Failure> {
    let mut given = model::read(model.format, &model.bytes)
        .map_err(|error| unusable(error.class(), &error, error.hint()).about(model.name))?;
    has_room(given.soup.facets.len()).map_err(|failure| failure.about(model.name))?;
    if wish.scale != 1.0 {
        given.soup = given.soup.scaled(wish.scale);
    }
    if wish.mirror.iter().any(|is| *is) {
        mirror(&mut given, wish.mirror);
    }
    Ok(given)
}

/// Memory that no mesh of so many facets does with less than, beside the facets, bytes for each.
const LEAST_ROOM: usize = 72;

/// Sees that there is memory to make a mesh of so many facets: where it ends later, the process ends with it
/// and says nothing that a user understands.
fn has_room(facets: usize) -> Result<(), Failure> {
    let room = Vec::<u8>::new().try_reserve_exact(facets.saturating_mul(LEAST_ROOM));
    room.map_err(|_| {
        Failure::new("LimitExceeded", format!("there is no memory for a mesh of {facets} facets"))
            .hint("export the model with fewer facets")
    })
}

/// Mirrors along some axes; what was outside stays outside.
fn mirror(given: &mut Given, along: [bool; 3]) {
    let turns_over = along.iter().filter(|is| **is).count() % 2 == 1;
    for facet in &mut given.soup.facets {
        for corner in facet.iter_mut() {
            for (c, _) in corner.iter_mut().zip(along).filter(|(_, is)| *is) {
                // Not −0.
                *c = 0.0 - *c;
            }
        }
        if turns_over {
            facet.swap(1, 2);
        }
    }
}

/// Makes a solid of what a file holds.
///
/// # Errors
///
/// `NoVolume` or `LimitExceeded`, about the file.
pub fn repaired(given: &Given, name: &Path) -> Result<(Solid, Health), Failure> {
    let (solid, health) = solid_from_soup(&given.soup)
        .map_err(|error| unusable(error.class(), &error, error.hint()).about(name))?;
    Ok((solid, health.with_notes(&given.notes)))
}

/// What a file holds, made ready to be placed.
pub struct File {
    /// The objects: several have places with regard to each other.
    pub objects: Vec<Whole>,
    /// What is known of their meshes, each with a name for people.
    pub healths: Vec<(String, Health)>,
    /// How they are laid down.
    pub wish: Wish,
}

/// A model that encloses something.
pub struct Whole {
    /// What it is called.
    pub name: String,
    /// Its surface.
    pub solid: Solid,
    /// The settings that its file has for it alone.
    pub settings: Option<OwnSettings>,
}

/// Objects of one file that are looked at each for itself: no plate holds more, and each pair of them is
/// compared. The objects of a file with more are one model.
const MOST_OBJECTS: usize = 500;

/// Makes solids of what a file holds, one for each of its objects. One of several that encloses nothing
/// is left out, and told.
///
/// # Errors
///
/// `NoVolume` or `LimitExceeded`, about the file.
pub fn file(given: &Given, name: &Path, wish: Wish) -> Result<File, Failure> {
    let pose = match wish.pose {
        Pose::Usual => usual_pose(given.objects.len()),
        pose => pose,
    };
    let wish = Wish { pose, ..wish };
    let file_name = name.file_name().unwrap_or(name.as_os_str()).to_string_lossy();
    let stem = name.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    if !(2..=MOST_OBJECTS).contains(&given.objects.len()) {
        let (solid, health) = repaired(given, name)?;
        let settings = given.objects.first().and_then(|object| object.settings.clone());
        let settings = settings.filter(|_| given.objects.len() == 1);
        let objects = vec![Whole { name: stem, solid, settings }];
        return Ok(File { objects, healths: vec![(file_name.into_owned(), health)], wish });
    }
    let mut objects = Vec::new();
    let mut about = Health::default().with_notes(&given.notes);
    let mut healths = Vec::new();
    for (k, object) in given.objects.iter().enumerate() {
        let name = if object.name.is_empty() { &stem } else { &object.name };
        let soup = Soup { facets: given.soup.facets[object.facets.clone()].to_vec() };
        match solid_from_soup(&soup) {
            Ok((solid, health)) => {
                let settings = object.settings.clone();
                objects.push(Whole { name: name.clone(), solid, settings });
                healths.push((format!("{file_name}, object {} ({name})", k + 1), health));
            }
            Err(error) => {
                let what = format!("object {} ({name}) is left out: {error}", k + 1);
                about.notes.push(Note::new(note::OBJECT_LEFT_OUT, what));
            }
        }
    }
    if objects.is_empty() {
        // As one, so that the message is about the file.
        repaired(given, name)?;
    }
    healths.push((file_name.into_owned(), about));
    Ok(File { objects, healths, wish })
}

impl File {
    /// Takes the models apart into their bodies, which keep their places with regard to each other. With
    /// more than 500 of them they stay as they are, which is told.
    #[must_use]
    pub fn split(self, wish: &Wish) -> Self {
        let count: usize = self.objects.iter().map(|object| split::count(&object.solid)).sum();
        let mut healths = self.healths;
        if count > MOST_OBJECTS {
            let what =
                format!("{count} bodies are too many for --split, which takes {MOST_OBJECTS}");
            if let Some((_, health)) = healths.last_mut() {
                health.notes.push(Note::new(note::NOT_SPLIT, what));
            }
            return Self { objects: self.objects, healths, wish: self.wish };
        }
        let parts = |object: Whole| {
            if split::count(&object.solid) < 2 {
                return vec![object];
            }
            let bodies = split::bodies(&object.solid);
            let Whole { name, settings, .. } = object;
            let whole = |body| Whole {
                name: name.clone(),
                solid: Solid::new(body),
                settings: settings.clone(),
            };
            bodies.into_iter().map(whole).collect()
        };
        let pose = match wish.pose {
            Pose::Usual => usual_pose(count),
            pose => pose,
        };
        let wish = Wish { pose, ..self.wish };
        Self { objects: self.objects.into_iter().flat_map(parts).collect(), healths, wish }
    }
}

fn unusable(class: &'static str, error: &dyn std::error::Error, hint: Option<String>) -> Failure {
    let failure = Failure::new(class, error.to_string());
    match hint {
        Some(hint) => failure.hint(hint),
        None => failure,
    }
}

/// Lays the models of several files down, each file as is wished, and puts them on the bed together, as
/// one solid. The place that is wished for the first is that of the middle of all. Two models that overlap
/// as far as their outlines from above tell are told, counted from 1.
///
/// # Errors
///
/// As [`place`].
pub fn arrange(
    files: Vec<File>,
    arrangement: &Arrangement,
    orient: &OrientParams,
) -> Result<(Placed, Option<[usize; 2]>), Failure> {
    let aside = files.first().map_or(Point2::origin(), |file| file.wish.centre);
    let (mut parts, mut before) = (Vec::new(), 0);
    for file in files {
        let n_models = file.objects.len();
        parts.extend(std::iter::repeat_n(laid(file, before, orient)?, arrangement.copies));
        before += n_models;
    }
    let centres = if arrangement.at.is_empty() {
        let radii: Vec<f64> = parts.iter().map(|part| part.placed.reach).collect();
        packed(&radii, arrangement.gap)
    } else {
        arrangement.at.clone()
    };
    let mut all = Mesh::default();
    let (mut objects, mut rests) = (Vec::new(), Vec::new());
    for (part, centre) in parts.into_iter().zip(centres) {
        let aside = Vector3::new(centre.x + aside.x, centre.y + aside.y, 0.0);
        let whole = Extent::added(&mut all, part.placed.solid.mesh(), &aside);
        for (name, model, extent) in part.models {
            let extent = extent.behind(&whole);
            objects.push(Object { name, model, extent, outline: Region::default() });
            rests.push(part.placed.rest);
        }
    }
    let azimuth = whole_places(reference_azimuth(&all));
    let reach = all.vertices.iter().map(|p| p.xy().coords.norm()).fold(0.0, f64::max);
    let placement = Placement { rotation: Rotation3::identity(), shift: Vector3::zeros() };
    let overlap = find_outlines(&all, &mut objects);
    let solid = Solid::new(all);
    Ok((Placed { solid, placement, rest: None, azimuth, reach, objects, rests }, overlap))
}

/// The models of one file, laid down.
#[derive(Clone)]
struct Laid {
    placed: Placed,
    /// Name, number and extent of each.
    models: Vec<(String, usize, Extent)>,
}

/// Lays the models of a file down; `before` are those of the files before it.
fn laid(file: File, before: usize, orient: &OrientParams) -> Result<Laid, Failure> {
    let wish = Wish { centre: Point2::origin(), ..file.wish };
    let (names, mut solids): (Vec<_>, Vec<_>) =
        file.objects.into_iter().map(|object| (object.name, object.solid)).unzip();
    let (placed, extents) = if solids.len() == 1 {
        let placed = place(solids.remove(0), &wish, orient)?;
        let extent = Extent::of(placed.solid.mesh());
        (placed, vec![Some(extent)])
    } else {
        place_together(solids, &wish, orient)?
    };
    let numbered = names.into_iter().zip(before..).zip(extents);
    let models = numbered.filter_map(|((name, model), extent)| Some((name, model, extent?)));
    Ok(Laid { placed, models: models.collect() })
}

/// Finds the outlines of objects, seen from above, and two of them, counted from 1, that overlap. An
/// object whose box no other reaches into has the hull of its outline.
fn find_outlines(all: &Mesh, objects: &mut [Object]) -> Option<[usize; 2]> {
    let boxes: Vec<Bounds> =
        objects.iter().map(|o| Bounds::of(&all.vertices[o.extent.vertices.clone()])).collect();
    let meets = |a: &Bounds, b: &Bounds| {
        (0..2).all(|k| a.min[k] < b.max[k] - TOUCHING_MM && b.min[k] < a.max[k] - TOUCHING_MM)
    };
    for (i, object) in objects.iter_mut().enumerate() {
        let part = object.extent.mesh(all);
        let is_alone = (0..boxes.len()).all(|j| j == i || !meets(&boxes[i], &boxes[j]));
        object.outline = if is_alone { hull(&part) } else { outline(&part) };
    }
    let pairs = (0..objects.len()).flat_map(|j| (0..j).map(move |i| (i, j)));
    let mut near = pairs.filter(|(i, j)| meets(&boxes[*i], &boxes[*j]));
    let found = near.find(|(i, j)| overlap(&objects[*i].outline, &objects[*j].outline));
    found.map(|(i, j)| [i + 1, j + 1])
}

/// The pose of models for which the user wants none: flat, but objects that have places with regard
/// to each other keep them.
#[must_use]
pub fn usual_pose(objects: usize) -> Pose {
    if objects > 1 { Pose::Keep } else { Pose::Flat }
}

/// Returns what is known of several models as of one.
#[must_use]
pub fn together(mut each: Vec<(String, Health)>, copies: usize) -> Health {
    if each.len() == 1 && copies == 1 {
        return each.remove(0).1;
    }
    let mut all = Health::default();
    for (name, health) in each {
        all.facets += copies * health.facets;
        all.triangles += copies * health.triangles;
        all.shells += copies * health.shells;
        all.open_edges += copies * health.open_edges;
        all.open_edges_left += copies * health.open_edges_left;
        all.nonmanifold_edges += copies * health.nonmanifold_edges;
        all.welded += copies * health.welded;
        all.flipped += copies * health.flipped;
        all.degenerate += copies * health.degenerate;
        all.duplicate += copies * health.duplicate;
        all.guessed |= health.guessed;
        all.overlaps |= health.overlaps;
        all.volume_before_mm3 += copies as f64 * health.volume_before_mm3;
        all.volume_mm3 += copies as f64 * health.volume_mm3;
        all.area_before_mm2 += copies as f64 * health.area_before_mm2;
        all.area_mm2 += copies as f64 * health.area_mm2;
        let named = |note: &Note| Note::new(note.code, format!("{name}: {}", note.message));
        all.notes.extend(health.notes.iter().map(named));
    }
    all
}

/// What is nearer than it should be by less than this touches, mm: rounding.
const TOUCHING_MM: f64 = 1e-9;

/// The centres of circles that stay a gap apart, packed about the origin.
fn packed(radii: &[f64], gap: f64) -> Vec<Point2<f64>> {
    // With half the gap around each, they touch.
    let radii: Vec<f64> = radii.iter().map(|radius| radius + gap / 2.0).collect();
    let mut order: Vec<usize> = (0..radii.len()).collect();
    order.sort_by(|a, b| radii[*b].total_cmp(&radii[*a]));
    let mut circles: Vec<Circle> = Vec::with_capacity(radii.len());
    for &i in &order {
        let centre = nearest_gap(&circles, radii[i]);
        circles.push(Circle { centre, radius: radii[i] });
    }
    let middle = middle(&circles);
    let mut centres = vec![Point2::origin(); radii.len()];
    for (i, circle) in order.into_iter().zip(&circles) {
        centres[i] = circle.centre - middle.coords;
    }
    centres
}

/// The place nearest to the origin for a circle that touches others and overlaps none.
fn nearest_gap(circles: &[Circle], radius: f64) -> Point2<f64> {
    let is_free = |p: &Point2<f64>| {
        circles.iter().all(|c| (p - c.centre).norm() >= c.radius + radius - TOUCHING_MM)
    };
    let Some(first) = circles.first() else { return Point2::origin() };
    let beside = |circle: &Circle| circle.centre + Vector2::x() * (circle.radius + radius);
    let mut places: Vec<Point2<f64>> = circles.iter().map(beside).collect();
    for (i, a) in circles.iter().enumerate() {
        for b in &circles[..i] {
            places.extend(touching_both(a, b, radius).into_iter().flatten());
        }
    }
    let free = places.into_iter().filter(is_free);
    // The circles lie about the first, the largest.
    let nearest = free.min_by(|a, b| {
        let far = |p: &Point2<f64>| (p - first.centre).norm_squared();
        far(a).total_cmp(&far(b))
    });
    // Beside the circle that reaches farthest along x there is always room.
    nearest.unwrap_or_else(|| {
        let end = circles.iter().map(|c| c.centre.x + c.radius).fold(0.0, f64::max);
        Point2::new(end + radius, 0.0)
    })
}

/// The centres of the circles of a radius that touch two others.
fn touching_both(a: &Circle, b: &Circle, radius: f64) -> Option<[Point2<f64>; 2]> {
    let way = b.centre - a.centre;
    let apart = way.norm();
    let (ra, rb) = (a.radius + radius, b.radius + radius);
    if apart <= 0.0 || apart > ra + rb {
        return None;
    }
    let along = (apart * apart + ra * ra - rb * rb) / (2.0 * apart);
    let aside = (ra * ra - along * along).max(0.0).sqrt();
    let (along, aside) = (way * (along / apart), Vector2::new(-way.y, way.x) * (aside / apart));
    Some([a.centre + along + aside, a.centre + along - aside])
}

/// The middle of the smallest circle around some, by points on them.
fn middle(circles: &[Circle]) -> Point2<f64> {
    const POINTS: usize = 64;
    let on = |circle: &Circle| {
        let circle = *circle;
        (0..POINTS).map(move |i| {
            let (sin, cos) = (i as f64 / POINTS as f64 * std::f64::consts::TAU).sin_cos();
            circle.centre + Vector2::new(cos, sin) * circle.radius
        })
    };
    let points: Vec<Point2<f64>> = circles.iter().flat_map(on).collect();
    smallest_around(&points).map_or(Point2::origin(), |circle| circle.centre)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reach(radii: &[f64], gap: f64) -> f64 {
        let centres = packed(radii, gap);
        for (i, a) in centres.iter().enumerate() {
            for (j, b) in centres[..i].iter().enumerate() {
                assert!((a - b).norm() > radii[i] + radii[j] + gap - 1e-6, "{i} and {j}");
            }
        }
        centres.iter().zip(radii).map(|(c, r)| c.coords.norm() + r).fold(0.0, f64::max)
    }

    #[test]
    fn circles_are_packed_about_the_axis() {
        assert_eq!(reach(&[10.0], 5.0), 10.0);
        // Two stand opposite to each other, seven as coins around a coin.
        assert!((reach(&[10.0, 10.0], 5.0) - 22.5).abs() < 0.1);
        assert!((reach(&[10.0; 7], 5.0) - 35.0).abs() < 0.1);
        // In general, half of the disc is covered.
        let mixed: Vec<f64> = (0..40).map(|i| 3.0 + f64::from(i * 7 % 11)).collect();
        let area: f64 = mixed.iter().map(|r| r * r).sum();
        assert!(reach(&mixed, 0.0).powi(2) < 2.0 * area, "{}", reach(&mixed, 0.0));
    }

    #[test]
    fn a_mirror_image_has_its_outside_outside() {
        let bytes = mesh::stl::write(&mesh::shapes::steps());
        let model =
            Model { name: Path::new("steps.stl"), format: Format::Stl, bytes: bytes.into() };
        let image = |mirror| {
            let given = read(&model, &Wish { mirror, ..Wish::default() }).unwrap();
            repaired(&given, model.name).unwrap()
        };
        let (as_is, _) = image([false; 3]);
        for mirror in [[true, false, false], [true, true, false], [true; 3]] {
            let (solid, health) = image(mirror);
            assert!((health.volume_before_mm3 - 10_742.4).abs() < 0.1, "{mirror:?}");
            assert_eq!(solid.mesh().bounds().max.x, -as_is.mesh().bounds().min.x);
        }
    }
}

//! How the model comes to stand on the bed.

use geom::bounding::Bounds;
use mesh::cut::{Keep, cut};
use mesh::health::solid_from_soup;
use mesh::mesh::Mesh;
use mesh::orient::{OrientParams, Rest, candidates, laid, rest};
use mesh::place::{Placement, footprint, reference_azimuth};
use mesh::soup::{Facet, Soup};
use mesh::topology::Solid;
use nalgebra::{Point2, Point3, Rotation3, Vector3};

use crate::failure::Failure;
use crate::objects::{Extent, Object};
use crate::settings::Job;

/// How the model is laid down.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Pose {
    /// On its largest flat face.
    Flat,
    /// By its place in the list of `rhumb orient`, counted from 1.
    Ranked(usize),
    /// As it is.
    Keep,
    /// Turned about x, then y, then z, radians.
    Turned([f64; 3]),
    /// Flat; of a file whose objects have places with regard to each other, as it is.
    Usual,
}

/// Where the user wants the model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wish {
    /// How it is laid down.
    pub pose: Pose,
    /// Where its footprint is centred, mm from the axis.
    pub centre: Point2<f64>,
    /// Millimetres in a unit of the file, times the scale.
    pub scale: f64,
    /// Along which axes of the file the model is mirrored.
    pub mirror: [bool; 3],
    /// How far it is turned about z once it lies, radians.
    pub turn: f64,
    /// At which height, mm above the bed, it is cut, and what is kept; the upper part is set down.
    pub cut: Option<(f64, Keep)>,
}

impl Default for Wish {
    fn default() -> Self {
        Self {
            pose: Pose::Flat,
            centre: Point2::origin(),
            scale: 1.0,
            mirror: [false; 3],
            turn: 0.0,
            cut: None,
        }
    }
}

impl Pose {
    /// Reads `flat`, `keep`, a rank or three angles in degrees.
    ///
    /// # Errors
    ///
    /// `Usage`.
    pub fn parse(text: &str) -> Result<Self, Failure> {
        match text {
            "flat" => Ok(Self::Flat),
            "keep" => Ok(Self::Keep),
            _ if text.bytes().all(|b| b.is_ascii_digit()) => {
                text.parse().ok().filter(|rank| *rank > 0).map(Self::Ranked).ok_or_else(|| {
                    Failure::new("Usage", format!("--orient {text:?}: ranks count from 1"))
                })
            }
            _ => numbers::<3>(text)
                .map(|angles| Self::Turned(angles.map(f64::to_radians)))
                .ok_or_else(|| {
                    Failure::new(
                        "Usage",
                        format!("--orient {text:?} is not flat, keep, a rank or RX,RY,RZ"),
                    )
                }),
        }
    }
}

/// Reads `X,Y`.
///
/// # Errors
///
/// `Usage`.
pub fn parse_centre(text: &str) -> Result<Point2<f64>, Failure> {
    parse_place("--place", text)
}

/// Reads the `X,Y` of an option.
///
/// # Errors
///
/// `Usage`.
pub fn parse_place(option: &str, text: &str) -> Result<Point2<f64>, Failure> {
    numbers::<2>(text)
        .map(Point2::from)
        .ok_or_else(|| Failure::new("Usage", format!("{option} {text:?} is not X,Y")))
}

/// `N` finite numbers with commas between them.
fn numbers<const N: usize>(text: &str) -> Option<[f64; N]> {
    let mut numbers = [0.0; N];
    let mut parts = text.split(',');
    for number in &mut numbers {
        *number = parts.next()?.trim().parse().ok().filter(|n: &f64| n.is_finite())?;
    }
    parts.next().is_none().then_some(numbers)
}

/// A model on the bed.
#[derive(Clone)]
pub struct Placed {
    /// The part, in the part frame.
    pub solid: Solid,
    /// From the model to the part.
    pub placement: Placement,
    /// What it rests on; `None` when the user chose the pose.
    pub rest: Option<Rest>,
    /// A direction that turns with the part, radians.
    pub azimuth: f64,
    /// Farthest point from the rotation axis, mm.
    pub reach: f64,
    /// The models, where there are several; what each rests on is in the same order.
    pub objects: Vec<Object>,
    /// What each of several models rests on.
    pub rests: Vec<Option<Rest>>,
}

/// Lays a solid down and puts it in its place. The solid is taken, so that a mesh of millions is
/// not in memory twice.
///
/// # Errors
///
/// `Usage` for a rank that the list of candidates does not have.
pub fn place(solid: Solid, wish: &Wish, orient: &OrientParams) -> Result<Placed, Failure> {
    let (rotation, rest) = match wish.pose {
        Pose::Flat | Pose::Usual => {
            let (rotation, rest) = rest(solid.mesh(), orient);
            (rotation, Some(rest))
        }
        Pose::Ranked(rank) => {
            let ranked = candidates(solid.mesh(), orient);
            let Some(candidate) = ranked.get(rank.wrapping_sub(1)) else {
                return Err(no_such_rank(rank, ranked.len()));
            };
            (laid(solid.mesh(), candidate), Some(Rest::Flat(*candidate)))
        }
        Pose::Keep => (Rotation3::identity(), None),
        // nalgebra takes roll, pitch and yaw in this very order: about x, then y, then z.
        Pose::Turned([x, y, z]) => (Rotation3::from_euler_angles(x, y, z), None),
    };
    let rotation = if wish.turn == 0.0 {
        rotation
    } else {
        Rotation3::from_axis_angle(&Vector3::z_axis(), wish.turn) * rotation
    };
    let mut placement = Placement::on_bed(solid.mesh(), &rotation);
    let mut solid = solid.into_moved(|p| placement.point(p));
    if let Some((height, keep)) = wish.cut {
        solid = cut_at(&solid, height, keep)?;
        let again = Placement::on_bed(solid.mesh(), &Rotation3::identity());
        placement.shift += again.shift;
        solid = solid.into_moved(|p| again.point(p));
    }
    let azimuth = whole_places(reference_azimuth(solid.mesh()));
    if wish.centre != Point2::origin() {
        let aside = Vector3::new(wish.centre.x, wish.centre.y, 0.0);
        placement.shift += aside;
        solid = solid.into_moved(|p| p + aside);
    }
    let reach = solid.mesh().vertices.iter().map(|p| p.xy().coords.norm()).fold(0.0, f64::max);
    let (objects, rests) = (Vec::new(), Vec::new());
    Ok(Placed { solid, placement, rest, azimuth, reach, objects, rests })
}

/// Lays down several solids that keep their places with regard to each other, as one. Of one that a cut
/// takes away altogether there is nothing in the result.
///
/// # Errors
///
/// As [`place`].
pub fn place_together(
    solids: Vec<Solid>,
    wish: &Wish,
    orient: &OrientParams,
) -> Result<(Placed, Vec<Option<Extent>>), Failure> {
    let mut all = Mesh::default();
    let mut add = |solid: Solid| Extent::added(&mut all, &solid.into_mesh(), &Vector3::zeros());
    let extents: Vec<Extent> = solids.into_iter().map(&mut add).collect();
    let placed = place(Solid::new(all), &Wish { cut: None, ..*wish }, orient)?;
    let Some((height, keep)) = wish.cut else {
        return Ok((placed, extents.into_iter().map(Some).collect()));
    };
    let piece = |extent: &Extent| {
        let whole = Solid::new(extent.mesh(placed.solid.mesh()));
        cut_at(&whole, height, keep).map(Solid::into_mesh)
    };
    let mut left = Mesh::default();
    let mut add = |mesh: Mesh| Extent::added(&mut left, &mesh, &Vector3::zeros());
    let extents = extents.iter().map(|extent| piece(extent).ok().map(&mut add)).collect();
    if left.triangles.is_empty() {
        // Of all together nothing is left, either: the message is about them.
        cut_at(&placed.solid, height, keep)?;
    }
    let as_is = Wish { pose: Pose::Keep, turn: 0.0, cut: None, ..*wish };
    Ok((place(Solid::new(left), &as_is, orient)?, extents))
}

/// What a cut leaves of a part that stands on the bed.
fn cut_at(solid: &Solid, height: f64, keep: Keep) -> Result<Solid, Failure> {
    let soup = cut(solid, height, keep);
    solid_from_soup(&soup).map(|(solid, _)| solid).map_err(|_| {
        let tall = solid.mesh().bounds().size().z;
        let side = if keep == Keep::Lower { "below" } else { "above" };
        let what = format!("nothing is left {side} --cut {height}; the part is {tall:.3} mm tall");
        Failure::new("NothingToPrint", what)
    })
}

fn no_such_rank(rank: usize, count: usize) -> Failure {
    Failure::new("Usage", format!("--orient {rank}: the model has {count} ways to lie"))
        .hint("rhumb orient lists them")
}

/// The nearest angle that a program can say exactly (0.0001°): the program of a part that is turned
/// by such an angle is then the same but for that angle, rounding included.
pub(crate) fn whole_places(radians: f64) -> f64 {
    ((radians.to_degrees() * 1e4).round() / 1e4).to_radians()
}

/// Share of the rail's end within which a part counts as being at it.
const NEARLY_MM: f64 = 0.5;

/// How far a part of exactly the machine's size may seem to stick out, mm: coordinates of an STL are
/// good to 8 µm at 100 mm, and no wall is driven nearer to its outline than half a bead.
const ROUNDING_MM: f64 = 0.01;

/// What fits in the machine, and what nearly does not.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fit {
    /// With room to spare.
    Well,
    /// Just.
    Barely,
}

/// Checks, before anything is done with them, that the corners of a model are not farther apart than
/// the machine could ever hold, however the model is laid down. Facets of two corners do not count:
/// a repair takes them away.
///
/// # Errors
///
/// `OutOfEnvelope`, with a guess at the units where that would explain it.
pub fn check_size(soup: &Soup, job: &Job) -> Result<(), Failure> {
    let most = (2.0 * job.printer.rail.max).hypot(job.printer.lift.max);
    // A model of exactly that size is measured again where it lies.
    let fits = |bounds: &Bounds| bounds.size().max() <= most + 1.0;
    if fits(&soup.bounds()) {
        return Ok(());
    }
    let mut bounds = Bounds::default();
    let is_facet = |[a, b, c]: &&Facet| a != b && b != c && c != a;
    for corner in soup.facets.iter().filter(is_facet).flatten() {
        bounds.add(&Point3::from(corner.map(f64::from)));
    }
    if fits(&bounds) {
        return Ok(());
    }
    let size = bounds.size();
    let what = format!(
        "the model measures {} x {} x {} mm; the machine holds nothing longer than {most:.1} mm",
        length(size.x),
        length(size.y),
        length(size.z)
    );
    Err(Failure::new("OutOfEnvelope", what).hint(too_large(&size, job)))
}

/// A length for people, however large.
fn length(mm: f64) -> String {
    if mm < 1e9 { format!("{mm:.1}") } else { format!("{mm:.1e}") }
}

/// Checks that the part is within reach and not too tall.
///
/// # Errors
///
/// `OutOfEnvelope` or `NothingToPrint`, with a guess at the units where that would explain it.
pub fn check_envelope(placed: &Placed, job: &Job) -> Result<Fit, Failure> {
    let size = placed.solid.mesh().bounds().size();
    let (reach, height) = (placed.reach, size.z);
    let (most_reach, most_height) = (job.printer.rail.max, job.printer.lift.max);
    // Neither NaN nor infinity may pass.
    if !(reach <= most_reach + ROUNDING_MM && height <= most_height + ROUNDING_MM) {
        let what = if reach <= most_reach + ROUNDING_MM {
            format!("the part is {height:.1} mm tall; the lift reaches {most_height} mm")
        } else {
            format!(
                "the part reaches {reach:.1} mm from the rotation axis; the carriage reaches \
                 {most_reach} mm"
            )
        };
        return Err(Failure::new("OutOfEnvelope", what).hint(too_large(&size, job)));
    }
    let least_height = job.schedule.first_layer_height / 2.0;
    if height <= least_height || size.x.max(size.y) < job.paths.thin.least_width {
        return Err(Failure::new(
            "NothingToPrint",
            format!(
                "the part measures {:.3} x {:.3} x {:.3} mm: thinner than half a layer or \
                 narrower than any bead",
                size.x, size.y, size.z
            ),
        )
        .hint(too_small(&size, job)));
    }
    let nearly = reach > most_reach - NEARLY_MM || height > most_height - NEARLY_MM;
    Ok(if nearly { Fit::Barely } else { Fit::Well })
}

/// Other units in which a size would make sense: name, factor.
const OTHER_UNITS: [(&str, f64); 3] = [
    ("metres (--units m)", 1000.0),
    ("inches (--units inch)", 25.4),
    ("micrometres (--scale 0.001)", 0.001),
];

fn sensible(size: &Vector3<f64>, factor: f64, job: &Job) -> bool {
    let scaled = size * factor;
    let across = scaled.x.hypot(scaled.y) / 2.0;
    across <= job.printer.rail.max
        && scaled.z <= job.printer.lift.max
        && scaled.max() >= SENSIBLE_SIZE_MM
}

/// A part smaller than this in all directions is more likely in other units.
const SENSIBLE_SIZE_MM: f64 = 2.0;

fn too_large(size: &Vector3<f64>, job: &Job) -> String {
    match OTHER_UNITS.iter().find(|(_, factor)| *factor < 1.0 && sensible(size, *factor, job)) {
        Some((name, _)) => format!("are the units of the file {name}?"),
        None => "turn it with --orient, scale it with --scale, or cut it".into(),
    }
}

fn too_small(size: &Vector3<f64>, job: &Job) -> String {
    match OTHER_UNITS.iter().find(|(_, factor)| *factor > 1.0 && sensible(size, *factor, job)) {
        Some((name, _)) => format!("are the units of the file {name}?"),
        None => "check the units of the file (--units) or scale it with --scale".into(),
    }
}

/// Returns what to say when a part that prints is suspiciously small.
#[must_use]
pub fn suspect_units(placed: &Placed, job: &Job) -> Option<String> {
    let size = placed.solid.mesh().bounds().size();
    (size.max() < SENSIBLE_SIZE_MM).then(|| {
        format!(
            "the part measures only {:.2} x {:.2} x {:.2} mm; {}",
            size.x,
            size.y,
            size.z,
            too_small(&size, job)
        )
    })
}

/// Returns the smallest circle around the footprint of a mesh: centre and radius, mm.
#[must_use]
pub fn footprint_of(mesh: &Mesh) -> Option<(Point2<f64>, f64)> {
    footprint(mesh).map(|circle| (circle.centre, circle.radius))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::Settings;
    use mesh::shapes;

    fn job() -> Job {
        Job::resolve(&Settings::defaults()).unwrap()
    }

    fn placed(mesh: Mesh, wish: &Wish) -> Placed {
        place(Solid::new(mesh), wish, &job().orient).unwrap()
    }

    #[test]
    fn one_far_corner_is_refused_before_any_work() {
        let far = |x: f32| Soup { facets: vec![[[0.0; 3], [x, 0.0, 0.0], [0.0, 9.0, 1.0]]] };
        let refused = check_size(&far(1e30), &job()).unwrap_err();
        assert_eq!(refused.class(), "OutOfEnvelope");
        assert!(refused.to_string().contains("1.0e30 x 9.0 x 1.0 mm"), "{refused}");
        // From corner to corner of the machine, 312.4 mm.
        assert!(
            check_size(&far(312.0), &job()).is_ok() && check_size(&far(314.0), &job()).is_err()
        );
        let needle = Soup { facets: vec![[[0.0; 3], [1e30, 0.0, 0.0], [0.0; 3]]] };
        assert!(check_size(&needle, &job()).is_ok(), "it has no area and goes away");
    }

    #[test]
    fn ranks_are_those_of_the_list() {
        let mesh = shapes::block(10.0, 20.0, 30.0);
        let heights = [1, 3, 5].map(|rank| {
            let wish = Wish { pose: Pose::Ranked(rank), ..Wish::default() };
            placed(mesh.clone(), &wish).solid.mesh().bounds().max.z
        });
        assert_eq!(heights, [10.0, 20.0, 30.0]);
        let wish = Wish { pose: Pose::Ranked(7), ..Wish::default() };
        let missing = place(Solid::new(mesh), &wish, &job().orient).map(|_| ()).unwrap_err();
        assert_eq!(missing.class(), "Usage");
        assert!(missing.to_string().contains("6 ways"), "{missing}");
    }

    #[test]
    fn poses_are_read() {
        assert_eq!(Pose::parse("flat").unwrap(), Pose::Flat);
        assert_eq!(Pose::parse("3").unwrap(), Pose::Ranked(3));
        let Pose::Turned(angles) = Pose::parse("90, 0,-45").unwrap() else { panic!("turned") };
        assert!((angles[0] - std::f64::consts::FRAC_PI_2).abs() < 1e-12);
        for bad in ["up", "1,2", "1,2,3,4", "1,2,nan", "", "0", "-1", "99999999999999999999"] {
            assert_eq!(Pose::parse(bad).unwrap_err().class(), "Usage", "{bad}");
        }
        assert_eq!(parse_centre("3,-4").unwrap(), Point2::new(3.0, -4.0));
    }

    #[test]
    fn a_part_stands_centred_on_the_bed_or_where_it_is_wanted() {
        let wish = Wish { centre: Point2::new(30.0, 0.0), ..Wish::default() };
        let part = placed(shapes::cube(20.0), &wish);
        let bounds = part.solid.mesh().bounds();
        assert!(bounds.min.z.abs() < 1e-12);
        assert!((bounds.min.x - 20.0).abs() < 1e-9 && (bounds.max.x - 40.0).abs() < 1e-9);
        assert!((part.reach - 40.0_f64.hypot(10.0)).abs() < 1e-9);
    }

    #[test]
    fn a_cut_leaves_a_part_that_stands_on_the_bed() {
        let cut = |height: f64, keep: Keep| {
            let wish = Wish { pose: Pose::Keep, cut: Some((height, keep)), ..Wish::default() };
            place(Solid::new(shapes::steps()), &wish, &job().orient)
        };
        for (keep, tall) in [(Keep::Lower, 5.0), (Keep::Upper, 10.0)] {
            let part = cut(5.0, keep).unwrap();
            let bounds = part.solid.mesh().bounds();
            assert_eq!((bounds.min.z, bounds.max.z), (0.0, tall));
            // The first step is lower than the cut, so the upper part is centred anew.
            assert!((footprint_of(part.solid.mesh()).unwrap().0.coords).norm() < 1e-6);
        }
        for (height, keep) in [(0.0, Keep::Lower), (-1.0, Keep::Lower), (15.0, Keep::Upper)] {
            let nothing = cut(height, keep).map(|_| ()).unwrap_err();
            assert_eq!(nothing.class(), "NothingToPrint", "{height}");
        }
    }

    #[test]
    fn a_turn_is_about_the_axis_once_the_part_lies() {
        let turned = |turn: f64| {
            let wish = Wish { turn, ..Wish::default() };
            placed(shapes::block(30.0, 20.0, 10.0), &wish).solid.mesh().bounds().size()
        };
        let quarter = turned(std::f64::consts::FRAC_PI_2);
        assert!((quarter - Vector3::new(20.0, 30.0, 10.0)).norm() < 1e-9, "{quarter}");
    }

    #[test]
    fn what_does_not_fit_is_refused_with_a_guess_at_the_units() {
        let check = |size: f64| {
            let part = placed(shapes::cube(size), &Wish::default());
            check_envelope(&part, &job())
        };
        assert_eq!(check(20.0).unwrap(), Fit::Well);
        let large = check(20_000.0).unwrap_err();
        assert_eq!(large.class(), "OutOfEnvelope");
        assert!(large.to_string().contains("units"), "{large}");
        let tiny = check(0.02).unwrap_err();
        assert_eq!(tiny.class(), "NothingToPrint");
        assert!(tiny.to_string().contains("metres"), "{tiny}");
        assert_eq!(check(1e30).unwrap_err().class(), "OutOfEnvelope");
        let reach = 120.0 * std::f64::consts::SQRT_2;
        assert_eq!(check(reach - 0.1).unwrap(), Fit::Barely);
        assert!(suspect_units(&placed(shapes::cube(0.8), &Wish::default()), &job()).is_some());
    }
}

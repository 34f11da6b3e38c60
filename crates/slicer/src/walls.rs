//! Walls: closed beads along the outlines of an island.
//!
//! The island is eaten up from its border, one wall at a time. What is left after wall `i` begins
//! one spacing further in than what was left before; the wall's centreline runs half a bead width
//! inside the edge that it eats from. The outer flank of the outermost bead is round, so the first
//! wall leaves `(width − spacing)/2` of its own place empty at the outline; all edges behind it
//! are that much nearer to the outline, and the layer as a whole takes exactly the volume of the
//! part.
//!
//! Where what is left is thinner than two spacings, two beads do not fit side by side: such places
//! are taken out and handed to [`thin`](crate::thin), which lays a single bead of the width there
//! is. Outermost walls are let through somewhat narrower places, so that outlines stay closed; in
//! these *tight* places their beads overlap and hold only what the place holds. An inset tells for
//! nothing whether there are any such places, so parts without them pay nothing.

use geom::grid::{GridPoint, mm};
use geom::polyline::nearest_on_ring;
use geom::region::{GridBounds, Island, Part, Region, Ring, ring_length, ring_sides, signed_area};
use nalgebra::Point2;

use crate::bead::Bead;
use crate::chart::Chart;
use crate::toolpath::Role;

/// How many walls, and how wide.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WallParams {
    /// Number of walls; 0 for none.
    pub count: usize,
    /// Width of the outermost bead, mm.
    pub external_width: f64,
    /// Width of the others, mm.
    pub width: f64,
    /// Whether islands with nothing above have a single wall.
    pub one_on_top: bool,
    /// Whether steep overhangs have more walls, so that infill does not begin in mid-air.
    pub more_on_overhangs: bool,
}

/// A closed centreline in the chart, with the bead around it.
#[derive(Debug, Clone, PartialEq)]
pub struct WallLoop {
    /// 0 for the outermost wall, then inwards.
    pub depth: usize,
    /// The centreline, mm, material to the left, and the bead at each point.
    pub points: Vec<(Point2<f64>, Bead)>,
}

impl WallLoop {
    fn positions(&self) -> Vec<Point2<f64>> {
        self.points.iter().map(|(at, _)| *at).collect()
    }
}

/// A place too thin for two beads side by side.
#[derive(Debug, Clone, PartialEq)]
pub struct ThinPlace {
    /// The place.
    pub region: Region,
    /// What a bead in it is: part of the outside, or a filler between walls.
    pub role: Role,
}

/// The walls of an island and what they leave.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Walls {
    /// Loops grouped by the outline that they follow, the external one first.
    pub groups: Vec<Vec<WallLoop>>,
    /// Where infill goes.
    pub interior: Region,
    /// What is too thin for walls or infill.
    pub thin: Vec<ThinPlace>,
}

/// Area (mm²) by which an inset may run into itself before the place counts as thin. Crossings of
/// short sides at noisy corners stay below; a wall that is 10 µm too thin over 1 mm is above.
const NEGLIGIBLE_LOSS_MM2: f64 = 0.01;

/// How closely walls behind the outermost follow the outline, mm: nobody sees them, and their
/// points are paid for in every step to come.
const INNER_TOLERANCE_MM: f64 = 0.005;

/// Returns the walls of one island (a region with a single outer ring) for beads `thickness` thick.
#[must_use]
pub fn walls(island: &Region, chart: &Chart, thickness: f64, params: &WallParams) -> Walls {
    let mut walls = Walls { interior: island.clone(), ..Walls::default() };
    if params.count == 0 {
        // No wall keeps the round flanks of infill inside the outline.
        let bead = Bead { width: params.width, thickness };
        walls.interior = chart.inset(island, (bead.width - bead.spacing()) / 2.0);
    }
    for depth in 0..params.count {
        let (width, role) = match depth {
            0 => (params.external_width, Role::ExternalPerimeter),
            _ => (params.width, Role::GapFill),
        };
        let bead = Bead { width, thickness };
        let spacing = bead.spacing();
        let least_pair = match depth {
            0 => width + LEAST_PAIR_SHARE * spacing,
            _ => 2.0 * spacing,
        };
        let left = split(&walls.interior, chart, spacing, least_pair);
        if !left.thin.is_empty() {
            walls.thin.push(ThinPlace { region: left.thin, role });
        }
        let lines = centreline(&left.thick, chart, depth, params, thickness);
        let tight = TightBeads::new(&left.tight, &lines, bead);
        for ring in lines.rings() {
            let wall = WallLoop { depth, points: tight.along(ring, bead) };
            add_to_group(&mut walls.groups, wall, width, is_hole(ring));
        }
        walls.interior = left.core.thinned(INNER_TOLERANCE_MM);
    }
    walls
}

/// How near two outermost beads may lie, as a share of their spacing. Nearer, and a single wide
/// bead is better; PrusaSlicer's classic walls allow the same overlap.
const LEAST_PAIR_SHARE: f64 = 0.6;

fn is_hole(ring: &Ring) -> bool {
    signed_area(ring) < 0.0
}

/// The line that the nozzle follows inside what is left before wall `depth`.
fn centreline(
    left: &Region,
    chart: &Chart,
    depth: usize,
    params: &WallParams,
    thickness: f64,
) -> Region {
    let external = Bead { width: params.external_width, thickness };
    let inner = Bead { width: params.width, thickness };
    let from_edge = match depth {
        0 => external.width / 2.0,
        // Half a spacing, and what the edges behind the first wall moved towards the outline.
        _ => inner.spacing() / 2.0 + (external.width - external.spacing()) / 2.0,
    };
    chart.inset(left, from_edge)
}

/// A region taken apart by thickness.
pub(crate) struct Split {
    /// Where two beads are laid side by side.
    pub(crate) thick: Region,
    /// The part of it that is thinner than two spacings.
    tight: Region,
    /// The rest: places where a single bead may fit.
    pub(crate) thin: Region,
    /// What is farther than the spacing from the border of `thick`.
    pub(crate) core: Region,
}

/// How closely the border of thin places is known, mm. They are found by shrinking the region and
/// growing it again, and arcs simplified this far cost a fraction of exact ones; a bead that ends
/// 10 µm sooner or later is the same bead.
const THIN_BORDER_MM: f64 = 0.01;

/// Thin places into which no disc of this radius (mm) fits are what acute corners of thick ones
/// leave over, or too thin for any bead.
const CORNER_RADIUS_MM: f64 = 0.04;

/// Takes the places thinner than twice `spacing` out of a region.
pub(crate) fn split_thin(region: &Region, chart: &Chart, spacing: f64) -> Split {
    split(region, chart, spacing, 2.0 * spacing)
}

/// Takes the places thinner than `least_pair` out of a region; those thinner than twice `spacing`
/// are tight.
fn split(region: &Region, chart: &Chart, spacing: f64, least_pair: f64) -> Split {
    let (core, loss) = chart.inset_with_loss(region, spacing);
    let whole = |core| Split {
        thick: region.clone(),
        tight: Region::default(),
        thin: Region::default(),
        core,
    };
    if loss <= NEGLIGIBLE_LOSS_MM2 {
        return whole(core);
    }
    let narrow = out_of_reach(region, chart, &core, spacing);
    if narrow.is_empty() {
        return whole(core);
    }
    let (thin, tight) = if least_pair < 2.0 * spacing {
        let half = least_pair / 2.0;
        let thin = out_of_reach(region, chart, &chart.inset(region, half), half);
        let tight = narrow.difference(&thin).filtered(holds_a_disc);
        (thin, tight)
    } else {
        (narrow, Region::default())
    };
    let thick = region.difference(&thin);
    let core = chart.inset(&thick, spacing);
    Split { thick, tight, thin, core }
}

/// The places of a region that its inset does not reach when it grows by `distance` again.
fn out_of_reach(region: &Region, chart: &Chart, inset: &Region, distance: f64) -> Region {
    let grown = distance + 2.0 * THIN_BORDER_MM;
    let reached = chart.outset_sharp(&inset.thinned(THIN_BORDER_MM), grown);
    region.difference(&reached).filtered(holds_a_disc)
}

fn holds_a_disc(island: &&Island) -> bool {
    let (area, perimeter) = island.iter().fold((0.0, 0.0), |(area, perimeter), ring| {
        (area + signed_area(ring), perimeter + ring_length(ring))
    });
    // The radius of a disc inside a convex area is at most twice its area by its perimeter; corner
    // slivers fail that without further work.
    2.0 * area >= CORNER_RADIUS_MM * perimeter
        && !Region::from_island((*island).clone()).inset(CORNER_RADIUS_MM).is_empty()
}

/// Puts a loop behind the one that it follows: the nearest of the wall before, of its own kind.
fn add_to_group(groups: &mut Vec<Vec<WallLoop>>, added: WallLoop, width: f64, is_hole: bool) {
    let start = added.points[0].0;
    let nearest = groups
        .iter()
        .enumerate()
        .filter_map(|(index, group)| {
            let last = group.last()?;
            let line = last.positions();
            let same_kind = area_sign(&line) == if is_hole { -1.0 } else { 1.0 };
            let follows = last.depth + 1 == added.depth && same_kind;
            let distance = nearest_on_ring(&line, &start)?.distance;
            follows.then_some((distance, index))
        })
        .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    match nearest {
        // A wall that splits in two behind a neck leaves one part to start a group of its own.
        Some((distance, index)) if distance < 2.0 * width => groups[index].push(added),
        _ => groups.push(vec![added]),
    }
}

/// The beads of a wall in tight places: all that is laid in a place has just its volume.
struct TightBeads {
    places: Vec<TightPlace>,
}

/// A place where two beads overlap.
struct TightPlace {
    region: Region,
    /// The box around it: most of a wall is near no such place.
    around: GridBounds,
    bead: Bead,
}

impl TightBeads {
    /// `lines` are all centrelines that run through the places.
    fn new(tight: &Region, lines: &Region, bead: Bead) -> Self {
        let places = tight
            .islands()
            .iter()
            .filter_map(|island| {
                let region = Region::from_island(island.clone());
                let around = region.bounds()?;
                let length: f64 = lines
                    .rings()
                    .flat_map(|ring| ring_sides(ring))
                    .filter(|side| may_meet(&around, side))
                    .flat_map(|(a, b)| region.parts(&mm(a), &mm(b)))
                    .filter(|part| part.inside)
                    .map(|part| part.length())
                    .sum();
                let share = region.area() / length;
                // A line that only clips the corner of a place is not to blame for its area.
                let spacing = share.clamp(bead.spacing() / 2.0, bead.spacing());
                let bead = Bead::with_spacing(spacing, bead.thickness);
                Some(TightPlace { region, around, bead })
            })
            .collect();
        Self { places }
    }

    /// The points of a centreline with their beads; where the bead changes there are two.
    fn along(&self, ring: &Ring, bead: Bead) -> Vec<(Point2<f64>, Bead)> {
        let mut points: Vec<(Point2<f64>, Bead)> = Vec::with_capacity(ring.len());
        for (a, b) in ring_sides(ring) {
            let mut pieces = vec![(Part { from: mm(a), to: mm(b), inside: false }, bead)];
            let near = |place: &&TightPlace| may_meet(&place.around, &(a, b));
            for place in self.places.iter().filter(near) {
                pieces = pieces
                    .into_iter()
                    .flat_map(|(piece, old)| {
                        place.region.parts(&piece.from, &piece.to).into_iter().map(move |part| {
                            let bead = if part.inside { place.bead } else { old };
                            (part, bead)
                        })
                    })
                    .collect();
            }
            for (piece, bead) in pieces {
                let continues = points.last().is_some_and(|(_, last)| *last == bead);
                if !continues && !points.is_empty() {
                    points.push((piece.from, bead));
                }
                if points.is_empty() {
                    points.push((piece.from, bead));
                }
                points.push((piece.to, bead));
            }
        }
        // The last piece ends where the first begins.
        points.pop();
        points
    }
}

/// Whether a side comes into a box.
fn may_meet(around: &GridBounds, (a, b): &(GridPoint, GridPoint)) -> bool {
    a.x.max(b.x) >= around.min.x
        && a.x.min(b.x) <= around.max.x
        && a.y.max(b.y) >= around.min.y
        && a.y.min(b.y) <= around.max.y
}

fn area_sign(points: &[Point2<f64>]) -> f64 {
    let next = points.iter().cycle().skip(1);
    points.iter().zip(next).map(|(a, b)| a.coords.perp(&b.coords)).sum::<f64>().signum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use geom::region::Fill;

    const PARAMS: WallParams = WallParams {
        count: 2,
        external_width: 0.45,
        width: 0.45,
        one_on_top: false,
        more_on_overhangs: false,
    };

    fn polygon(points: &[[f64; 2]]) -> Region {
        let ring: Vec<Point2<f64>> = points.iter().map(|&p| Point2::from(p)).collect();
        Region::from_rings([ring.as_slice()], Fill::NonZero)
    }

    fn rectangle(width: f64, height: f64) -> Region {
        polygon(&[[0.0, 0.0], [width, 0.0], [width, height], [0.0, height]])
    }

    /// Area that a loop's beads take.
    fn taken(wall: &WallLoop) -> f64 {
        let next = wall.points.iter().cycle().skip(1);
        wall.points
            .iter()
            .zip(next)
            .map(|((a, bead), (b, other))| {
                (b - a).norm() * f64::midpoint(bead.spacing(), other.spacing())
            })
            .sum()
    }

    #[test]
    fn walls_and_interior_take_the_area_of_the_island() {
        let island = rectangle(20.0, 20.0);
        let walls = walls(&island, &Chart::Plane, 0.2, &PARAMS);
        assert_eq!(walls.groups.len(), 1);
        assert!(walls.thin.is_empty());
        let laid: f64 = walls.groups.iter().flatten().map(taken).sum();
        let missing = island.area() - laid - walls.interior.area();
        // The round flank of the outer bead moves loops 21 µm inwards, which at four corners and
        // two walls leaves 0.14 mm² of 400.
        assert!(missing.abs() < 0.15, "{missing}");
    }

    #[test]
    fn the_outer_centreline_is_half_a_width_inside() {
        let walls = walls(&rectangle(20.0, 10.0), &Chart::Plane, 0.2, &PARAMS);
        let outer = &walls.groups[0][0];
        assert_eq!(outer.depth, 0);
        for p in &outer.positions() {
            let from_side = (p.x.min(20.0 - p.x)).min(p.y.min(10.0 - p.y));
            assert!((from_side - 0.225).abs() < 1e-5);
        }
        let inner = walls.groups[0][1].positions();
        let gap = inner.iter().map(|p| p.x).fold(f64::INFINITY, f64::min) - 0.225;
        assert!((gap - outer.points[0].1.spacing()).abs() < 1e-5, "{gap}");
    }

    #[test]
    fn holes_have_groups_of_their_own() {
        let frame = rectangle(20.0, 20.0).difference(&polygon(&[
            [5.0, 5.0],
            [15.0, 5.0],
            [15.0, 15.0],
            [5.0, 15.0],
        ]));
        let walls = walls(&frame, &Chart::Plane, 0.2, &PARAMS);
        assert_eq!(walls.groups.iter().map(Vec::len).collect::<Vec<_>>(), [2, 2]);
        let sign = |k: usize| area_sign(&walls.groups[k][0].positions());
        assert_eq!(sign(0) * sign(1), -1.0);
    }

    #[test]
    fn thin_places_are_handed_on() {
        // A plate with a fin of 0.6 mm: one wall does not fit in the fin, the plate is untouched.
        let plate = polygon(&[
            [0.0, 0.0],
            [10.0, 0.0],
            [10.0, 4.7],
            [18.0, 4.7],
            [18.0, 5.3],
            [10.0, 5.3],
            [10.0, 10.0],
            [0.0, 10.0],
        ]);
        let walls = walls(&plate, &Chart::Plane, 0.2, &PARAMS);
        let external: Vec<_> =
            walls.thin.iter().filter(|t| t.role == Role::ExternalPerimeter).collect();
        assert_eq!(external.len(), 1);
        let area = external[0].region.area();
        assert!((area - 0.6 * 8.0).abs() < 0.5, "{area}");
        let outer = walls.groups[0][0].positions();
        let reach = outer.iter().map(|p| p.x).fold(0.0, f64::max);
        assert!(reach < 11.5, "the wall ends where the fin begins, not at {reach}");
    }

    #[test]
    fn tight_places_keep_a_closed_wall_and_their_volume() {
        // 0.75 mm hold two outer beads only when they overlap.
        for (width, height) in [(30.0, 0.75), (30.0, 0.8), (12.0, 0.72)] {
            let strip = rectangle(width, height);
            let walls = walls(&strip, &Chart::Plane, 0.2, &PARAMS);
            assert!(walls.thin.is_empty() && walls.interior.is_empty());
            assert_eq!(walls.groups.len(), 1);
            let taken: f64 = walls.groups.iter().flatten().map(taken).sum();
            let ratio = taken / strip.area();
            assert!((ratio - 1.0).abs() < 0.03, "{height}: {ratio}");
        }
        // A neck in an otherwise thick part: the wall runs through it in one.
        let dumbbell = rectangle(10.0, 10.0)
            .union(&polygon(&[[20.0, 0.0], [30.0, 0.0], [30.0, 10.0], [20.0, 10.0]]))
            .union(&polygon(&[[9.0, 4.6], [21.0, 4.6], [21.0, 5.35], [9.0, 5.35]]));
        let walls = walls(&dumbbell, &Chart::Plane, 0.2, &PARAMS);
        assert_eq!(walls.groups.iter().filter(|group| group[0].depth == 0).count(), 1);
        let outer = &walls.groups[0][0];
        let narrow = outer.points.iter().filter(|(p, _)| (12.0..18.0).contains(&p.x));
        assert!(narrow.clone().all(|(_, bead)| bead.width < 0.44));
    }

    #[test]
    fn a_wall_too_thin_for_any_loop_is_all_thin() {
        let walls = walls(&rectangle(20.0, 0.5), &Chart::Plane, 0.2, &PARAMS);
        assert!(walls.groups.is_empty() && walls.interior.is_empty());
        assert!((walls.thin[0].region.area() - 10.0).abs() < 1e-6);
    }
}

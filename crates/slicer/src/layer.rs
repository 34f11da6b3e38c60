//! One layer put together: from its section to toolpaths in the part frame.

use geom::region::{Island, Region};
use nalgebra::Point2;
use rayon::prelude::*;

use crate::adhesion::{AdhesionParams, around};
use crate::bead::Bead;
use crate::infill::{FillLayer, FillLine, InfillParams, fill};
use crate::level::Level;
use crate::skins::{Neighbours, SKIN_TOLERANCE_MM, SkinParams, skins};
use crate::surface::LayerSurface;
use crate::thin::{ThinParams, axes};
use crate::toolpath::{IslandPaths, LayerPaths, LostArea, Role, Station, Toolpath, WallGroup};
use crate::walls::{ThinPlace, WallParams, split_thin, walls};

/// How layers are filled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PathParams {
    /// Walls.
    pub walls: WallParams,
    /// Beads in places too thin for two.
    pub thin: ThinParams,
    /// Solid bottoms and tops.
    pub skins: SkinParams,
    /// Lines inside.
    pub infill: InfillParams,
    /// Loops around the first layer.
    pub adhesion: AdhesionParams,
    /// How far simplified lines may lie from their course, mm.
    pub tolerance: f64,
}

/// What one layer is made of, and a remark on what did not fit.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Filled {
    /// The toolpaths.
    pub paths: LayerPaths,
    /// Loops of skirt and brim that the reach of the machine left out.
    pub adhesion_out_of_reach: usize,
    /// Area of the islands that begin in mid-air, mm².
    pub floating_area: f64,
}

/// Fills the material of one layer.
#[must_use]
pub fn fill_layer(
    level: &Level,
    material: &Region,
    neighbours: &Neighbours<'_>,
    surface: &dyn LayerSurface,
    params: &PathParams,
) -> Filled {
    let lift = Lift { surface, level: *level };
    let islands: Vec<(IslandPaths, LostArea)> = material
        .islands()
        .par_iter()
        .map(|island| fill_island(island, neighbours, &lift, params))
        .collect();
    let mut filled = Filled {
        paths: LayerPaths {
            index: level.index,
            upper: level.upper,
            thickness: level.thickness(),
            ..LayerPaths::default()
        },
        ..Filled::default()
    };
    if level.index > 0 {
        let below = neighbours.below.first();
        let floats = |island: &&Island| below.is_none_or(|below| !rests_on(island, below));
        filled.floating_area = material.filtered(floats).area();
    }
    for (paths, lost) in islands {
        filled.paths.lost.merge(&lost);
        filled.paths.islands.push(paths);
    }
    if level.index == 0 {
        let bead = Bead { width: params.walls.width, thickness: level.thickness() };
        let adhesion = around(material, bead.width, bead.spacing(), &params.adhesion);
        filled.adhesion_out_of_reach = adhesion.out_of_reach;
        filled.paths.adhesion = adhesion
            .loops
            .iter()
            .map(|points| lift.line(points, bead, Role::SkirtBrim, true))
            .collect();
    }
    filled
}

/// Whether an island has anything below it.
fn rests_on(island: &Island, below: &Region) -> bool {
    // Nearly always the first corner decides.
    island.iter().flatten().any(|&p| below.contains(&geom::grid::mm(p)))
        || !Region::from_island(island.clone()).intersection(below).is_empty()
}

fn fill_island(
    island: &Island,
    neighbours: &Neighbours<'_>,
    lift: &Lift<'_>,
    params: &PathParams,
) -> (IslandPaths, LostArea) {
    let outline = Region::from_island(island.clone());
    let thickness = lift.level.thickness();
    let walls = walls(&outline, thickness, &params.walls);
    let solid_bead = Bead { width: params.infill.solid_width, thickness };
    let split = split_thin(&walls.interior, solid_bead.spacing() / 2.0);
    let layer = FillLayer { index: lift.level.index, thickness, tolerance: params.tolerance };
    let interior = split.thick.thinned(SKIN_TOLERANCE_MM);
    let skins = skins(&interior, neighbours, solid_bead.spacing(), &params.skins);
    let filling = fill(&skins, &layer, &params.infill);

    let mut thin = walls.thin;
    let gaps = std::iter::once(split.thin).chain(filling.thin).filter(|gap| !gap.is_empty());
    thin.extend(gaps.map(|region| ThinPlace { region, role: Role::GapFill }));
    let mut lost = LostArea::default();
    let mut fills: Vec<Toolpath> = filling.lines.iter().map(|line| lift.fill(line)).collect();
    for place in &thin {
        fills.extend(single_beads(place, lift, params, &mut lost));
    }
    let groups = walls.groups.iter().map(|group| {
        let loops = group.iter().map(|wall| {
            let role = if wall.depth == 0 { Role::ExternalPerimeter } else { Role::Perimeter };
            let station =
                |(at, bead): &(Point2<f64>, Bead)| Station { at: lift.point(at), bead: *bead };
            let stations = wall.points.iter().map(station).collect();
            Toolpath { role, closed: true, stations }
        });
        WallGroup { loops: loops.collect() }
    });
    (IslandPaths { walls: groups.collect(), outline, fills }, lost)
}

fn single_beads(
    place: &ThinPlace,
    lift: &Lift<'_>,
    params: &PathParams,
    lost: &mut LostArea,
) -> Vec<Toolpath> {
    let thickness = lift.level.thickness();
    let least = match place.role {
        Role::ExternalPerimeter => params.thin.least_width,
        _ => params.thin.least_gap,
    };
    axes(&place.region, least, params.thin.greatest_width, lost)
        .into_iter()
        .map(|axis| {
            let station = |p: crate::thin::AxisPoint| {
                // Between walls the bead takes the whole gap; on its own it must not bulge out of
                // the part.
                let bead = match place.role {
                    Role::ExternalPerimeter => Bead { width: p.width, thickness },
                    _ => Bead::with_spacing(p.width, thickness),
                };
                Station { at: lift.point(&p.at), bead }
            };
            let stations = axis.into_iter().map(station).collect();
            Toolpath { role: place.role, closed: false, stations }
        })
        .collect()
}

/// From the chart of a layer to the part frame.
struct Lift<'a> {
    surface: &'a dyn LayerSurface,
    level: Level,
}

impl Lift<'_> {
    fn point(&self, uv: &Point2<f64>) -> nalgebra::Point3<f64> {
        self.surface.lift(self.level.upper, uv)
    }

    fn line(&self, points: &[Point2<f64>], bead: Bead, role: Role, closed: bool) -> Toolpath {
        let stations = points.iter().map(|p| Station { at: self.point(p), bead }).collect();
        Toolpath { role, closed, stations }
    }

    fn fill(&self, line: &FillLine) -> Toolpath {
        self.line(&line.points, line.bead, line.role, line.closed)
    }
}

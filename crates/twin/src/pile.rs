//! What has been laid so far, as heights over a grid seen from above.
//!
//! A nozzle from above only ever meets the highest material, and a bead rests on the highest that
//! lies under it; so one height for every cell is all that is needed, and the one before the
//! present layer, so that neighbours in a layer do not carry each other. Each knows the piece that made
//! it, whose true shape is kept. Whether a bead rests is asked
//! where the normal of its layer leads down from it: on a slope that is not the place straight below.
//! Cells are [`CELL`] wide and
//! come in tiles, of which only those exist that something was laid on. Part frame, mm.

use geom::lift::Bead;
use nalgebra::{Point2, Point3, Vector3};

use crate::family::Family;

/// Width of a cell, mm: a quarter of a narrow bead.
pub(crate) const CELL: f64 = 0.1;

/// Cells along the side of a tile.
const TILE: usize = 64;

/// Cells along the side of a block, for which a tile knows the greatest height.
const BLOCK: usize = 8;

/// The number that no layer and no stroke has.
const NONE: u32 = u32::MAX;

/// One cell.
#[derive(Debug, Clone, Copy)]
struct Cell {
    /// The height of what was laid, mm.
    top: f32,
    /// The same before its layer began.
    under: f32,
    /// The layer that laid it last.
    layer: u32,
    /// The stroke that laid it last; none where only the side of a bead reaches out.
    stroke: u32,
    /// The pieces whose height `top` and `under` are.
    top_piece: u32,
    under_piece: u32,
    /// Whether they belong to supports.
    top_supports: bool,
    under_supports: bool,
}

impl Cell {
    /// Keeps what was laid before as another layer begins.
    fn shelve(&mut self, layer: u32) {
        (self.under, self.layer) = (self.top, layer);
        self.under_piece = self.top_piece;
        self.under_supports = self.top_supports;
    }
}

const BARE: Cell = Cell {
    top: 0.0,
    under: 0.0,
    layer: NONE,
    stroke: NONE,
    top_piece: NONE,
    under_piece: NONE,
    top_supports: false,
    under_supports: false,
};

#[derive(Debug, Clone)]
struct Tile {
    cells: Vec<Cell>,
    /// The greatest height in each block.
    blocks: [f32; (TILE / BLOCK) * (TILE / BLOCK)],
    greatest: f32,
}

impl Tile {
    fn bare() -> Self {
        Self {
            cells: vec![BARE; TILE * TILE],
            blocks: [0.0; (TILE / BLOCK) * (TILE / BLOCK)],
            greatest: 0.0,
        }
    }
}

/// A short straight piece of a bead.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Piece {
    /// Where the tip of the nozzle starts and ends.
    pub(crate) ends: [Point3<f64>; 2],
    pub(crate) half_width: f64,
    /// Along the normal of the layer.
    pub(crate) thickness: f64,
    pub(crate) family: Family,
    pub(crate) layer: u32,
    /// The number of the stroke that it belongs to.
    pub(crate) stroke: u32,
    /// Whether it belongs to supports.
    pub(crate) supports: bool,
}

impl Piece {
    /// Whether a place of its upper side that lies within its width as seen from above does so along
    /// the layer, too.
    fn reaches(&self, place: &Point3<f64>) -> bool {
        if self.family == Family::Planar {
            return true;
        }
        let [from, to] = self.ends;
        let (along, aside) = (to - from, place - from);
        let square = along.norm_squared();
        let share = if square > 0.0 { aside.dot(&along) / square } else { 0.0 };
        let off = aside - along * share.clamp(0.0, 1.0);
        off.norm_squared() <= self.half_width * self.half_width
    }
}

/// What a piece came to lie on, in cells.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Footing {
    /// That it covers.
    pub(crate) covered: u32,
    /// Where it rests on the bed or on earlier layers.
    pub(crate) resting: u32,
    /// Where another stroke of the same layer lies already.
    pub(crate) taken: u32,
    /// Where its own stroke lies already: under the round end of the piece before.
    pub(crate) own: u32,
    /// How far the ground lies below the bottom where it rests, over all these cells, mm; less where
    /// it rises above.
    pub(crate) lacking: f64,
}

/// Empty space under a cell of a piece.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Opening {
    /// Halfway down the layer below: what is missing there if the place belongs to the part.
    pub(crate) below: Point3<f64>,
    /// How far down the empty space goes, mm.
    pub(crate) depth: f64,
    /// Whether nothing of its own stroke covers the cell yet.
    pub(crate) is_new: bool,
}

impl Footing {
    /// Returns the share that rests on something.
    pub(crate) fn share(&self) -> f64 {
        if self.covered == 0 { 1.0 } else { f64::from(self.resting) / f64::from(self.covered) }
    }

    /// Returns the share of what its own stroke does not cover that another has taken.
    pub(crate) fn taken_share(&self) -> f64 {
        let fresh = self.covered - self.own;
        if fresh == 0 { 0.0 } else { f64::from(self.taken) / f64::from(fresh) }
    }
}

/// The shape of a piece: to 0.01 µm on any bed, and half as large as exactly.
#[derive(Debug, Clone, Copy)]
struct Shape {
    ends: [[f32; 3]; 2],
    /// From its upper to its lower side.
    down: [f32; 3],
    width: f32,
}

impl Shape {
    fn bead(&self) -> Bead {
        let ends = self.ends.map(|end| Point3::from(end.map(f64::from)));
        Bead::new(ends, f64::from(self.width), &Vector3::from(self.down.map(f64::from)))
    }
}

/// A piece that rises above a limit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Rise {
    /// The height of one of its cells above what is allowed there, mm.
    pub(crate) above: f64,
    pub(crate) piece: u32,
    /// The place of that cell.
    pub(crate) at: Point3<f64>,
}

/// What may not be risen above: the underside of something, seen from above.
pub(crate) trait Underside {
    /// The least allowed height anywhere within `radius` of a place, mm; infinite beside it.
    fn lowest(&self, about: &Point2<f64>, radius: f64) -> f64;

    /// The square that holds it: its middle, and half its side, mm.
    fn square(&self) -> (Point2<f64>, f64);
}

/// How far from what it lies on a bead may end and still rest there, as a share of its thickness.
/// Half: below, the bead is squeezed out by half; above, it still touches what sags.
const TOUCHING: f64 = 0.5;

/// How far above supports a bead of the part may end and still be carried by them, mm; and supports
/// above the part. That gap is left so that they come off, and the bead sags onto them.
const LOOSE: f64 = 0.35;

/// The same in thicknesses of the bead, where that is more: supports keep away by whole layers.
const LOOSE_SHARE: f64 = 1.5;

/// From the upper side of a bead to the middle of the layer below, in thicknesses.
pub(crate) const HALFWAY_DOWN: f64 = 1.5;

/// Heights of what was laid. See the [module](self).
#[derive(Debug)]
pub(crate) struct Pile {
    /// Tiles along one side.
    side: usize,
    /// The least corner, the same for x and y.
    corner: f64,
    tiles: Vec<Option<Box<Tile>>>,
    greatest: f64,
    shapes: Vec<Shape>,
    /// Those of the last piece.
    openings: Vec<Opening>,
}

impl Pile {
    /// Returns a bare bed that reaches `reach` mm from the axis.
    pub(crate) fn new(reach: f64) -> Self {
        let tile = CELL * TILE as f64;
        let half = (reach / tile).ceil().max(1.0);
        let side = 2 * half as usize;
        let tiles = vec![None; side * side];
        Self {
            side,
            corner: -half * tile,
            tiles,
            greatest: 0.0,
            shapes: Vec::new(),
            openings: Vec::new(),
        }
    }

    /// Returns the greatest height, mm.
    pub(crate) fn greatest(&self) -> f64 {
        self.greatest
    }

    /// Returns where the last piece came to lie over empty space.
    pub(crate) fn openings(&self) -> &[Opening] {
        &self.openings
    }

    /// Lays a piece, and returns what it came to lie on.
    pub(crate) fn lay(&mut self, piece: &Piece) -> Footing {
        self.openings.clear();
        let [from, to] = piece.ends;
        let down = piece.family.normal(&nalgebra::center(&from, &to)) * -piece.thickness;
        let single = |v: [f64; 3]| v.map(|c| c as f32);
        self.shapes.push(Shape {
            ends: piece.ends.map(|end| single(end.into())),
            down: single(down.into()),
            width: (2.0 * piece.half_width) as f32,
        });
        let along = to.xy() - from.xy();
        let square = along.norm_squared();
        let reach = piece.half_width * piece.half_width;
        let least = from.xy().inf(&to.xy()).map(|c| c - piece.half_width);
        let most = from.xy().sup(&to.xy()).map(|c| c + piece.half_width);
        let mut footing = Footing::default();
        for row in self.index(least.y)..=self.index(most.y) {
            for column in self.index(least.x)..=self.index(most.x) {
                let at = Point2::new(self.middle(column), self.middle(row));
                let from_start = at - from.xy();
                let share = if square > 0.0 { from_start.dot(&along) / square } else { 0.0 };
                let share = share.clamp(0.0, 1.0);
                if (from_start - along * share).norm_squared() > reach {
                    continue;
                }
                let foot = from + (to - from) * share;
                let top = match piece.family {
                    Family::Planar => foot.z,
                    family => family.height(family.level(&foot), at.coords.norm()),
                };
                let top = Point3::new(at.x, at.y, top);
                if top.z.is_finite() && piece.reaches(&top) {
                    let own = footing.own;
                    self.lay_cell([column, row], top.z, piece, &mut footing);
                    let (depth, on_supports) = self.gap_under(&(top + down), piece);
                    let touching = TOUCHING * piece.thickness;
                    let loose = LOOSE.max(LOOSE_SHARE * piece.thickness);
                    if depth <= if on_supports == piece.supports { touching } else { loose } {
                        footing.resting += 1;
                        footing.lacking += depth.clamp(-touching, touching);
                    } else {
                        let below = top + down * HALFWAY_DOWN;
                        let is_new = footing.own == own;
                        self.openings.push(Opening { below, depth, is_new });
                    }
                }
            }
        }
        if piece.family != Family::Planar {
            self.lay_sides(piece, &down);
        }
        footing
    }

    /// Lays the sides of a piece that leans: they run along the normal of its layer, so that the foot of
    /// one side reaches out beside the upper side.
    fn lay_sides(&mut self, piece: &Piece, down: &Vector3<f64>) {
        let [from, to] = piece.ends;
        let along = to - from;
        let Some(aside) = down.cross(&along).try_normalize(f64::MIN_POSITIVE) else { return };
        let count = |length: f64| (2.0 * length / CELL).ceil().max(1.0) as u32;
        let (rows, columns) = (count(down.xy().norm()), count(along.xy().norm()));
        for sign in [1.0, -1.0] {
            let edge = aside * (sign * piece.half_width);
            // Only what leans outwards is seen from above; beyond the axis the layer falls again.
            let beyond_axis = (from + edge).xy().coords.dot(&from.xy().coords) <= 0.0;
            if edge.xy().dot(&down.xy()) <= 0.0 || beyond_axis {
                continue;
            }
            for row in 1..=rows {
                for column in 0..=columns {
                    let share = [row, column].map(f64::from);
                    let share = [share[0] / f64::from(rows), share[1] / f64::from(columns)];
                    self.lay_side(&(from + edge + along * share[1] + down * share[0]), piece);
                }
            }
        }
    }

    /// Raises the cell of a place to its height, without a stroke: neighbours come to lie there.
    fn lay_side(&mut self, at: &Point3<f64>, piece: &Piece) {
        let (column, row) = (self.index(at.x), self.index(at.y));
        let number = (self.shapes.len() - 1) as u32;
        let tile = &mut self.tiles[row / TILE * self.side + column / TILE];
        let tile = tile.get_or_insert_with(|| Box::new(Tile::bare()));
        let (x, y) = (column % TILE, row % TILE);
        let cell = &mut tile.cells[y * TILE + x];
        let height = at.z as f32;
        if height <= cell.top {
            return;
        }
        if cell.layer != piece.layer {
            cell.shelve(piece.layer);
            cell.stroke = NONE;
        }
        (cell.top, cell.top_piece, cell.top_supports) = (height, number, piece.supports);
        let block = &mut tile.blocks[y / BLOCK * (TILE / BLOCK) + x / BLOCK];
        *block = block.max(height);
        tile.greatest = tile.greatest.max(height);
    }

    fn lay_cell(
        &mut self,
        [column, row]: [usize; 2],
        top: f64,
        piece: &Piece,
        footing: &mut Footing,
    ) {
        let tile = &mut self.tiles[row / TILE * self.side + column / TILE];
        let tile = tile.get_or_insert_with(|| Box::new(Tile::bare()));
        let (x, y) = (column % TILE, row % TILE);
        let cell = &mut tile.cells[y * TILE + x];
        footing.covered += 1;
        if cell.layer != piece.layer {
            cell.shelve(piece.layer);
        } else if cell.stroke == piece.stroke {
            footing.own += 1;
        } else if cell.stroke != NONE {
            footing.taken += 1;
        }
        cell.stroke = piece.stroke;
        let height = top as f32;
        if height > cell.top {
            (cell.top, cell.top_piece) = (height, (self.shapes.len() - 1) as u32);
            cell.top_supports = piece.supports;
        }
        let block = &mut tile.blocks[y / BLOCK * (TILE / BLOCK) + x / BLOCK];
        *block = block.max(height);
        tile.greatest = tile.greatest.max(height);
        self.greatest = self.greatest.max(top);
    }

    /// How far below the bottom of a bead the next thing lies, mm; negative where it rises above. And
    /// whether that belongs to supports, or, under supports, to the part: the bed carries both.
    fn gap_under(&self, bottom: &Point3<f64>, piece: &Piece) -> (f64, bool) {
        let (column, row) = (self.index(bottom.x), self.index(bottom.y));
        let tile = &self.tiles[row / TILE * self.side + column / TILE];
        let cell = tile.as_ref().map_or(BARE, |tile| tile.cells[row % TILE * TILE + column % TILE]);
        let (under, supports, by) = if cell.layer == piece.layer {
            (cell.under, cell.under_supports, cell.under_piece)
        } else {
            (cell.top, cell.top_supports, cell.top_piece)
        };
        let on_supports = if by == NONE { piece.supports } else { supports };
        (bottom.z - f64::from(under), on_supports)
    }

    /// Returns the true shape of a piece.
    pub(crate) fn bead(&self, piece: u32) -> Bead {
        self.shapes[piece as usize].bead()
    }

    /// Returns the pieces with a cell that rises above an underside, the highest above it first. With
    /// `layer`, what that layer laid is left out.
    pub(crate) fn rising(&self, under: &impl Underside, layer: Option<u32>) -> Vec<Rise> {
        let mut found = Vec::new();
        let (middle, half) = under.square();
        let tiles = |c: f64| self.index(c) / TILE;
        for row in tiles(middle.y - half)..=tiles(middle.y + half) {
            for column in tiles(middle.x - half)..=tiles(middle.x + half) {
                let Some(tile) = &self.tiles[row * self.side + column] else { continue };
                let origin = [column * TILE, row * TILE];
                if f64::from(tile.greatest) > self.lowest(under, origin, TILE) {
                    self.rising_in_tile(tile, origin, layer, under, &mut found);
                }
            }
        }
        // Of each piece its highest cell only.
        found.sort_by(|a, b| a.piece.cmp(&b.piece).then(b.above.total_cmp(&a.above)));
        found.dedup_by_key(|rise| rise.piece);
        found.sort_by(|a, b| b.above.total_cmp(&a.above).then(a.piece.cmp(&b.piece)));
        found
    }

    fn rising_in_tile(
        &self,
        tile: &Tile,
        origin: [usize; 2],
        layer: Option<u32>,
        under: &impl Underside,
        found: &mut Vec<Rise>,
    ) {
        for (block, &greatest) in tile.blocks.iter().enumerate() {
            let inside = [block % (TILE / BLOCK) * BLOCK, block / (TILE / BLOCK) * BLOCK];
            let from = [origin[0] + inside[0], origin[1] + inside[1]];
            if f64::from(greatest) <= self.lowest(under, from, BLOCK) {
                continue;
            }
            for k in 0..BLOCK * BLOCK {
                let (x, y) = (k % BLOCK, k / BLOCK);
                let cell = &tile.cells[(inside[1] + y) * TILE + inside[0] + x];
                let (height, piece) = if layer == Some(cell.layer) {
                    (cell.under, cell.under_piece)
                } else {
                    (cell.top, cell.top_piece)
                };
                let at = Point2::new(self.middle(from[0] + x), self.middle(from[1] + y));
                let above = f64::from(height) - under.lowest(&at, 0.0);
                if above > 0.0 && piece != NONE {
                    let at = Point3::new(at.x, at.y, f64::from(height));
                    found.push(Rise { above, piece, at });
                }
            }
        }
    }

    /// The least allowed height over a square of cells.
    fn lowest(&self, under: &impl Underside, from: [usize; 2], cells: usize) -> f64 {
        let half = 0.5 * cells as f64 * CELL;
        let middle = |k: usize| self.corner + from[k] as f64 * CELL + half;
        under.lowest(&Point2::new(middle(0), middle(1)), half * std::f64::consts::SQRT_2)
    }

    /// The row or column of a coordinate; the outermost for what lies beyond.
    fn index(&self, c: f64) -> usize {
        (((c - self.corner) / CELL).max(0.0) as usize).min(self.side * TILE - 1)
    }

    fn middle(&self, index: usize) -> f64 {
        self.corner + (index as f64 + 0.5) * CELL
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn piece(y: f64, z: f64, layer: u32, stroke: u32) -> Piece {
        Piece {
            ends: [Point3::new(-5.0, y, z), Point3::new(5.0, y, z)],
            half_width: 0.225,
            thickness: 0.2,
            family: Family::Planar,
            layer,
            stroke,
            supports: false,
        }
    }

    #[test]
    fn beads_rest_on_the_bed_and_on_each_other() {
        let mut pile = Pile::new(50.0);
        let first = pile.lay(&piece(0.0, 0.2, 0, 0));
        assert_eq!((first.share(), first.taken, pile.openings()), (1.0, 0, [].as_slice()));
        let covered = f64::from(first.covered) * CELL * CELL;
        let area = 10.0 * 0.45 + std::f64::consts::PI * 0.225 * 0.225;
        assert!((covered / area - 1.0).abs() < 0.15, "{covered} {area}");
        let second = pile.lay(&piece(0.0, 0.4, 1, 1));
        assert_eq!((second.share(), second.taken_share()), (1.0, 0.0));
        let beside = pile.lay(&piece(0.2, 0.6, 2, 2));
        assert!((beside.share() - 0.55).abs() < 0.12, "{}", beside.share());
        let far = pile.lay(&piece(3.0, 0.6, 2, 3));
        assert_eq!(far.share(), 0.0);
        assert_eq!(pile.openings().len(), far.covered as usize);
        for opening in pile.openings() {
            assert!((opening.depth - 0.4).abs() < 1e-6 && (opening.below.z - 0.3).abs() < 1e-9);
        }
        assert!(pile.openings().iter().all(|opening| opening.is_new));
        // The same line once more covers nothing new.
        pile.lay(&piece(3.0, 0.6, 2, 3));
        assert!(pile.openings().iter().all(|opening| !opening.is_new));
    }

    #[test]
    fn beads_on_a_slope_are_as_wide_as_on_a_plane() {
        // Lines along the contour of a cone, side by side on it: half as far apart from above.
        let family = Family::Conical { slope: 3.0_f64.sqrt() };
        let mut pile = Pile::new(50.0);
        let mut lay = |s: f64, stroke: u32| {
            let at = |y: f64| {
                let r = (30.0 + 0.5 * s).hypot(y);
                Point3::new(30.0 + 0.5 * s, y, family.height(80.0, r))
            };
            let ends = [at(-0.2), at(0.2)];
            pile.lay(&Piece { ends, family, ..piece(0.0, 0.0, 3, stroke) })
        };
        let first = lay(0.0, 0);
        // A disc and a rectangle of 0.4 mm, seen under 60°.
        let area = 0.5 * (0.4 * 0.45 + std::f64::consts::PI * 0.225 * 0.225);
        let covered = f64::from(first.covered) * CELL * CELL;
        assert!((covered / area - 1.0).abs() < 0.2, "{covered} {area}");
        let beside = lay(0.45, 1);
        assert!(beside.taken_share() < 0.2, "{beside:?}");
        assert!(lay(0.0, 2).taken_share() > 0.9);
    }

    #[test]
    fn the_foot_of_a_bead_on_a_slope_carries_what_lies_beside_it() {
        let family = Family::Conical { slope: 1.0 };
        let lay = |pile: &mut Pile, x: f64, layer: u32, stroke: u32| {
            let at = |y: f64| Point3::new(x, y, family.height(30.0, x.hypot(y)));
            let ends = [at(-0.2), at(0.2)];
            pile.lay(&Piece { ends, family, ..piece(0.0, 0.0, layer, stroke) })
        };
        // Cones fall outwards: the upper side ends at x = 19.84 towards the axis, and its foot 0.14 mm
        // farther in and lower.
        let planar = |pile: &mut Pile| {
            let ends = [-0.2, 0.2].map(|y| Point3::new(19.65, y, 10.25));
            pile.lay(&Piece { ends, half_width: 0.1, ..piece(0.0, 0.0, 4, 9) })
        };
        let mut pile = Pile::new(50.0);
        lay(&mut pile, 20.0, 3, 0);
        assert!(planar(&mut pile).share() > 0.3);
        // A neighbour in the layer lies over the foot without being laid twice.
        let mut pile = Pile::new(50.0);
        lay(&mut pile, 20.0, 3, 0);
        let beside = lay(&mut pile, 20.0 - 0.45 / 2.0_f64.sqrt(), 3, 1);
        assert!(beside.taken_share() < 0.2, "{beside:?}");
    }

    #[test]
    fn neighbours_of_a_layer_do_not_carry_each_other() {
        let mut pile = Pile::new(50.0);
        assert_eq!(pile.lay(&piece(0.0, 5.0, 7, 0)).share(), 0.0);
        let again = pile.lay(&piece(0.0, 5.0, 7, 1));
        assert_eq!((again.share(), again.taken_share()), (0.0, 1.0));
        let own = pile.lay(&piece(0.0, 5.0, 7, 1));
        assert_eq!((own.own, own.taken_share()), (own.covered, 0.0));
    }

    #[test]
    fn peaks_are_those_of_a_full_search() {
        let mut pile = Pile::new(50.0);
        pile.lay(&piece(0.0, 0.2, 0, 0));
        pile.lay(&piece(8.0, 3.0, 1, 1));
        let bowl = |radius| Bowl { axis: Point2::new(0.0, 1.0), radius, low: 1.0 };
        let rise = pile.rising(&bowl(10.0), None)[0];
        // The nearest side of the bead at y = 8.
        assert!((rise.above - (3.0 - 1.0 - 0.1 * 6.8)).abs() < 0.02, "{rise:?}");
        assert_eq!(pile.rising(&bowl(10.0), None), [rise]);
        assert_eq!(pile.rising(&bowl(10.0), Some(1)), []);
        assert_eq!(pile.rising(&bowl(6.0), None), []);
        assert_eq!(pile.rising(&Bowl { low: 3.0, ..bowl(10.0) }, None), []);
    }

    /// Rises by a tenth of the distance.
    struct Bowl {
        axis: Point2<f64>,
        radius: f64,
        low: f64,
    }

    impl Underside for Bowl {
        fn lowest(&self, about: &Point2<f64>, radius: f64) -> f64 {
            let distance = ((about - self.axis).norm() - radius).max(0.0);
            if distance <= self.radius { self.low + 0.1 * distance } else { f64::INFINITY }
        }

        fn square(&self) -> (Point2<f64>, f64) {
            (self.axis, self.radius)
        }
    }

    #[test]
    fn a_cone_lies_on_the_cone_below() {
        let family = Family::Conical { slope: 1.0 };
        let mut pile = Pile::new(50.0);
        let step = 0.2 * 2.0_f64.sqrt();
        for layer in 0..3 {
            let level = 20.0 + step * f64::from(layer);
            let at = |x: f64| Point3::new(x, 0.0, family.height(level, x));
            let ends = [at(5.0), at(7.0)];
            let footing = pile.lay(&Piece { ends, family, ..piece(0.0, 0.0, layer, layer) });
            // The lower end of each line leads down to beyond the one below, by a cell.
            let expected = if layer == 0 { 0.0 } else { 0.95 };
            assert!((footing.share() - expected).abs() < 0.05, "{layer}: {}", footing.share());
        }
    }
}

//! Which rings lie in which: islands and their holes.

use crate::region::{Island, Ring};

use super::Windings;
use super::simple::Simple;

/// A ring that bounds what is kept.
struct Kept {
    ring: usize,
    is_outer: bool,
    /// The rings around it.
    around: Vec<usize>,
}

/// Returns the islands of all places whose windings `is_inside` accepts, for rings that neither cross
/// nor touch.
pub(super) fn islands(rings: &[Simple], is_inside: impl Fn(Windings) -> bool) -> Vec<Island> {
    let mut kept: Vec<Kept> = Vec::new();
    for (index, ring) in rings.iter().enumerate() {
        let around: Vec<usize> = (0..rings.len())
            .filter(|&other| {
                other != index
                    && rings[other].bounds.holds(&ring.bounds)
                    && rings[other].holds(ring.points[0])
            })
            .collect();
        let mut windings = Windings::default();
        for &other in &around {
            windings.add(rings[other].weight, rings[other].winding());
        }
        let outside = is_inside(windings);
        windings.add(ring.weight, ring.winding());
        let inside = is_inside(windings);
        if inside != outside {
            kept.push(Kept { ring: index, is_outer: inside, around });
        }
    }
    kept.sort_unstable_by_key(|kept| {
        let least = rings[kept.ring].points[0];
        (least.x, least.y)
    });
    let mut islands: Vec<Island> = Vec::new();
    let mut island_of = vec![usize::MAX; rings.len()];
    for outer in kept.iter().filter(|kept| kept.is_outer) {
        island_of[outer.ring] = islands.len();
        islands.push(vec![oriented(&rings[outer.ring], true)]);
    }
    for hole in kept.iter().filter(|kept| !kept.is_outer) {
        let smallest = hole
            .around
            .iter()
            .filter(|&&ring| island_of[ring] != usize::MAX)
            .min_by(|&&a, &&b| rings[a].area.abs().total_cmp(&rings[b].area.abs()));
        if let Some(&outer) = smallest {
            islands[island_of[outer]].push(oriented(&rings[hole.ring], false));
        }
    }
    islands
}

/// The ring's points as the overlay engine lists them: outer rings counter-clockwise with the least
/// point second, holes clockwise with the least point first.
fn oriented(ring: &Simple, is_outer: bool) -> Ring {
    let mut points = ring.points.clone();
    if (ring.area > 0.0) != is_outer {
        points[1..].reverse();
    }
    if is_outer {
        points.rotate_right(1);
    }
    points
}

//! Makes facets agree which way is out.
//!
//! 1. *Between facets.* Two facets that share an edge must run along it in opposite directions.
//!    From facet to facet over edges that exactly two share, every connected patch gets one
//!    direction: the one that the larger part of its area has in the file. Free facets (those
//!    without a direction in the file) do not vote. Strips with one face (Möbius) cannot agree;
//!    they stay cut where the two ends meet.
//! 2. *Between shells.* A closed shell of negative volume that lies in no other shell is inside
//!    out: it is turned, with every shell inside it, so that a whole file turned inside out comes
//!    back as it was meant. One that lies in another shell is a cavity and stays.

use super::{Joined, Winding, Work};
use crate::inside::{Rays, odd_point};
use crate::measure;
use crate::topology::{Edges, Shell, Solid, runs_up};
use geom::bounding::BoxTree;

/// A volume below this share of area^1.5 is zero up to rounding: shells that cross themselves
/// (a figure of eight) have none, and no wrong side out either.
const NO_VOLUME: f64 = 1e-9;

/// How many points of a shell are tried until one tells what it lies in.
const TRIES: usize = 8;

/// Turns facets until neighbours agree; returns whether any was turned.
pub(super) fn agree(work: &mut Work, edges: &Edges) -> bool {
    let n_facets = work.mesh.triangles.len();
    let mut seen = vec![false; n_facets];
    let mut turned = vec![false; n_facets];
    let mut any = false;
    for start in 0..n_facets {
        if seen[start] {
            continue;
        }
        let patch = walk(work, edges, start, &mut seen, &mut turned);
        let (mut area_kept, mut area_turned) = (0.0, 0.0);
        for &t in &patch {
            if work.windings[t] != Winding::Free {
                let area = measure::area_of(&work.mesh.corners(t as u32));
                *(if turned[t] { &mut area_turned } else { &mut area_kept }) += area;
            }
        }
        let wanted = area_kept >= area_turned;
        for &t in patch.iter().filter(|t| turned[**t] == wanted) {
            any = true;
            work.turn(t);
        }
    }
    any
}

/// The patch of a facet; sets which of its facets run against the first.
fn walk(
    work: &Work,
    edges: &Edges,
    start: usize,
    seen: &mut [bool],
    turned: &mut [bool],
) -> Vec<usize> {
    let mut patch = vec![start];
    seen[start] = true;
    let mut next = 0;
    while let Some(&t) = patch.get(next) {
        next += 1;
        // In an order that turning a facet does not change: a strip with one face is then cut at
        // the same place again.
        let mut own = edges.of_triangles()[t];
        own.sort_unstable();
        for edge in own {
            let Some((first, Some(second))) = edges.users(edge) else { continue };
            let other = if first as usize / 3 == t { second } else { first } as usize / 3;
            if !seen[other] {
                seen[other] = true;
                let against = runs_up(&work.mesh, first) == runs_up(&work.mesh, second);
                turned[other] = turned[t] ^ against;
                patch.push(other);
            }
        }
    }
    patch
}

/// Turns shells that are inside out; returns whether any was.
///
/// Where more than two facets share an edge, turning some changes which of them belong together,
/// and so what the shells are. A turn that does not leave fewer shells inside out, or opens
/// sides, is taken back: in a tangle it would lead to the next, without end.
pub(super) fn turn_outwards(joined: Joined) -> (Joined, bool) {
    let mut turn = inside_out(&joined.solid);
    let n_roots = turn.iter().filter(|turn| **turn).count();
    if n_roots == 0 {
        return (joined, false);
    }
    turn_contents(&joined.solid, &mut turn);
    let open_sides = joined.solid.open_sides();
    let facets: Vec<usize> = (0..)
        .zip(joined.solid.shell_of())
        .filter(|(_, shell)| turn[**shell as usize])
        .map(|(t, _)| t)
        .collect();
    let turn_all = |work: &mut Work| facets.iter().for_each(|t| work.turn(*t));
    let turned = joined.changed(turn_all);
    let n_left = inside_out(&turned.solid).iter().filter(|turn| **turn).count();
    if n_left < n_roots && turned.solid.open_sides() <= open_sides {
        (turned, true)
    } else {
        (turned.changed(turn_all), false)
    }
}

/// Which shells are inside out: of negative volume, and in no other shell.
fn inside_out(solid: &Solid) -> Vec<bool> {
    let shells = solid.shells();
    let negative: Vec<u32> =
        (0..).zip(shells).filter(|(_, s)| is_negative(s)).map(|(i, _)| i).collect();
    let mut inside_out = vec![false; shells.len()];
    if negative.is_empty() {
        return inside_out;
    }
    let rays = Rays::new(solid, 2 * negative.len(), |s| shells[s as usize].is_closed());
    for (shell, samples) in samples(solid, &negative) {
        inside_out[shell as usize] = containers(solid, &rays, shell, &samples).is_empty();
    }
    inside_out
}

fn is_negative(shell: &Shell) -> bool {
    shell.is_closed() && shell.volume_mm3 < -NO_VOLUME * shell.area_mm2.powf(1.5)
}

/// The shells that a shell lies in, seen from some facets of it; none when no facet can tell.
fn containers(solid: &Solid, rays: &Rays<'_>, shell: u32, samples: &[u32]) -> Vec<u32> {
    let found = samples.iter().find_map(|t| {
        let p = odd_point(&solid.mesh().corners(*t));
        rays.windings(&p, shell, 0.0)
    });
    found.unwrap_or_default().into_iter().map(|(container, _)| container).collect()
}

/// The first facets of some shells (ascending).
fn samples(solid: &Solid, shells: &[u32]) -> Vec<(u32, Vec<u32>)> {
    let mut samples: Vec<(u32, Vec<u32>)> = shells.iter().map(|s| (*s, Vec::new())).collect();
    for (t, shell) in (0..).zip(solid.shell_of()) {
        if let Ok(i) = shells.binary_search(shell)
            && samples[i].1.len() < TRIES
        {
            samples[i].1.push(t);
        }
    }
    samples
}

/// Adds the shells inside those that are turned.
fn turn_contents(solid: &Solid, turn: &mut [bool]) {
    let is_root = turn.to_vec();
    let roots = (0..turn.len()).filter(|s| is_root[*s]);
    let tree = BoxTree::new(roots.map(|s| solid.shells()[s].bounds).collect());
    let is_near = |s: &u32| {
        !is_root[*s as usize] && !tree.meeting(&solid.shells()[*s as usize].bounds).is_empty()
    };
    let inner: Vec<u32> = (0..turn.len() as u32).filter(is_near).collect();
    let rays = Rays::new(solid, 2 * inner.len(), |s| is_root[s as usize]);
    for (shell, samples) in samples(solid, &inner) {
        turn[shell as usize] = !containers(solid, &rays, shell, &samples).is_empty();
    }
}

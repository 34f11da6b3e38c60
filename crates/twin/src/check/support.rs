//! Does every bead rest on something?
//!
//! Beads are looked at in pieces of at most [`PIECE`]; a piece is carried when at least
//! [`LEAST_SHARE`] of its width and length rests on the bed or on earlier layers (see
//! `pile`). Pieces in a row that are not carried are a *gap*:
//!
//! * a gap shorter than [`SHORTEST`], of supports than [`SHORTEST_OF_SUPPORTS`], is nothing;
//! * a gap with carried ends is a bridge: any line over [`BRIDGE_ANY`], a straight one over
//!   [`BRIDGE`];
//! * all others hang, and those without a carried begin start in mid-air.
//!
//! Where the place below belongs to the part, a gap lies over the openings of sparse infill, and is
//! summed and not found (whether a part that is meant to be solid has holes is for
//! [`crate::check::coverage`] to say); without a mesh only walls, skins and gap fill are judged.
//!
//! The part rests on supports, and these on the part, over the gap that parts them, too.
//!
//! A closed line has no begin: what is open at both its ends is one gap. mm, part frame.

use nalgebra::Point3;

use crate::finding::{Findings, Place};
use crate::pile::Footing;

/// The name of this check.
pub const NAME: &str = "support";

/// Beads are looked at in pieces of at most this length, mm: about a bead's width.
pub const PIECE: f64 = 0.5;

/// The share of a piece that carries it. A third is an overhang of 56° with beads of 0.45 mm in
/// layers of 0.2 mm: what prints without drooping.
pub const LEAST_SHARE: f64 = 1.0 / 3.0;

/// Shorter gaps are nothing, mm: two beads' width, which the bead spans by its own stiffness.
pub const SHORTEST: f64 = 1.0;

/// The same for supports, mm: what of their dense layers reaches beyond the lines of a column, which
/// are so far apart, sags by a fraction of a bead and carries all the same.
pub const SHORTEST_OF_SUPPORTS: f64 = 3.0;

/// Longest gap that a bead of any shape spans, mm: the openings of sparse infill.
pub const BRIDGE_ANY: f64 = 5.0;

/// Longest gap that a straight bead spans, mm.
pub const BRIDGE: f64 = 20.0;

/// A bead is straight when its ends are no nearer than this share of its length.
const STRAIGHT: f64 = 0.97;

/// Ends of a line nearer than this are one place, mm: a bead's width.
const CLOSED: f64 = 0.5;

/// What came of it over a whole program. mm.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Support {
    /// Length of all beads that were looked at.
    pub laid: f64,
    /// Length of the pieces that are carried.
    pub carried: f64,
    /// Length of the pieces over sparse infill.
    pub over_infill: f64,
    /// Length of the bridges.
    pub bridged: f64,
    /// Length of what hangs.
    pub hanging: f64,
    /// Beads that hang.
    pub hanging_beads: usize,
    /// Those of them that start in mid-air.
    pub in_mid_air: usize,
}

/// A piece of a bead as this check sees it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Step {
    pub(crate) line: usize,
    pub(crate) layer: Option<usize>,
    pub(crate) ends: [Point3<f64>; 2],
    pub(crate) footing: Footing,
    /// Whether the place below belongs to the part.
    pub(crate) is_inside: bool,
    /// Whether the bead is one of supports itself.
    pub(crate) is_support: bool,
}

/// Follows beads from piece to piece.
#[derive(Debug, Default)]
pub(crate) struct Follow {
    sums: Support,
    /// The bead that is being laid: its begin, and whether any piece was carried.
    begin: Option<Point3<f64>>,
    end: Point3<f64>,
    was_carried: bool,
    /// The gap that the bead began with, once it has ended.
    first: Option<Gap>,
    gap: Option<Gap>,
}

#[derive(Debug, Clone, Copy)]
struct Gap {
    place: Place,
    from: Point3<f64>,
    to: Point3<f64>,
    length: f64,
    /// Shorter gaps are nothing, mm.
    shortest: f64,
    /// Whether the pieces before and after are carried.
    anchors: [bool; 2],
}

impl Follow {
    /// A bead goes on by a piece.
    pub(crate) fn piece(&mut self, step: &Step, findings: &mut Findings) {
        let [from, to] = step.ends;
        let length = (to - from).norm();
        self.begin.get_or_insert(from);
        self.end = to;
        self.sums.laid += length;
        let is_carried = step.footing.share() >= LEAST_SHARE;
        if is_carried || step.is_inside {
            *(if is_carried { &mut self.sums.carried } else { &mut self.sums.over_infill }) +=
                length;
            self.close(true, findings);
            self.was_carried = true;
            return;
        }
        let anchors = [self.was_carried, false];
        let place = Place { line: step.line, layer: step.layer, at: Some(from) };
        let shortest = if step.is_support { SHORTEST_OF_SUPPORTS } else { SHORTEST };
        let fresh = Gap { place, from, to, length: 0.0, shortest, anchors };
        let gap = self.gap.get_or_insert(fresh);
        gap.length += length;
        gap.to = to;
    }

    /// The bead ends.
    pub(crate) fn end(&mut self, findings: &mut Findings) {
        let is_closed = self.begin.is_some_and(|begin| (begin - self.end).norm() < CLOSED);
        match (self.first.take(), self.gap.take()) {
            (Some(first), Some(last)) if is_closed => {
                let whole = Gap {
                    length: last.length + first.length,
                    to: first.to,
                    anchors: [last.anchors[0], first.anchors[1]],
                    ..last
                };
                self.judge(&whole, findings);
            }
            (Some(mut first), last) => {
                // A closed line that ends carried began carried.
                first.anchors[0] |= is_closed && last.is_none();
                self.judge(&first, findings);
                last.into_iter().for_each(|gap| self.judge(&gap, findings));
            }
            (None, Some(mut last)) => {
                last.anchors[1] |= is_closed && self.was_carried;
                self.judge(&last, findings);
            }
            (None, None) => {}
        }
        self.begin = None;
        self.was_carried = false;
    }

    /// Returns the sums so far.
    pub(crate) fn sums(&self) -> Support {
        self.sums
    }

    fn close(&mut self, carried: bool, findings: &mut Findings) {
        let Some(mut gap) = self.gap.take() else { return };
        gap.anchors[1] = carried;
        if gap.anchors[0] {
            self.judge(&gap, findings);
        } else {
            self.first = Some(gap);
        }
    }

    fn judge(&mut self, gap: &Gap, findings: &mut Findings) {
        let Gap { length, shortest, anchors, .. } = *gap;
        if length < shortest {
            return;
        }
        let is_straight = (gap.to - gap.from).norm() >= STRAIGHT * length;
        let span = if is_straight { BRIDGE } else { BRIDGE_ANY };
        if anchors == [true, true] && length <= span {
            self.sums.bridged += length;
            return;
        }
        self.sums.hanging += length;
        self.sums.hanging_beads += 1;
        self.sums.in_mid_air += usize::from(!anchors[0]);
        let limit = if anchors == [true, true] { span } else { shortest };
        findings.warning(NAME, gap.place, (length, limit), || match anchors {
            [false, _] => format!("a bead begins in mid-air and hangs for {length:.1} mm"),
            [true, false] => format!("a bead ends in mid-air, {length:.1} mm of it hang"),
            [true, true] => format!("{length:.1} mm of a bead hang, at most {span} mm bridge"),
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn footing(carried: bool) -> Footing {
        Footing { covered: 10, resting: if carried { 10 } else { 0 }, ..Footing::default() }
    }

    /// A bead of pieces of 0.5 mm along x, each carried or not; bent back at the end when closed.
    fn found(pattern: &str, closed: bool) -> (Vec<String>, Support) {
        let (mut follow, mut findings) = (Follow::default(), Findings::default());
        let count = pattern.len() as f64;
        let at = |k: usize| {
            let turn = std::f64::consts::TAU * k as f64 / count;
            if closed {
                let radius = 0.5 * count / std::f64::consts::TAU;
                Point3::new(radius * turn.cos(), radius * turn.sin(), 1.0)
            } else {
                Point3::new(0.5 * k as f64, 0.0, 1.0)
            }
        };
        for (k, c) in pattern.chars().enumerate() {
            let ends = [at(k), at(k + 1)];
            let step = Step {
                line: k + 1,
                layer: Some(4),
                ends,
                footing: footing(c == '='),
                is_inside: c == 'i',
                is_support: false,
            };
            follow.piece(&step, &mut findings);
        }
        follow.end(&mut findings);
        let messages = findings.kept().iter().map(|finding| finding.message.clone()).collect();
        (messages, follow.sums())
    }

    #[test]
    fn carried_beads_and_bridges_are_sound() {
        for pattern in
            ["====", "iiiiiiii", "=iiiii--iiii=", "=-=", "==--------==", "-=====", "=====-"]
        {
            assert_eq!(found(pattern, false).0, Vec::<String>::new(), "{pattern}");
        }
        let (_, sums) = found("==--------==", false);
        assert_eq!((sums.laid, sums.carried, sums.bridged, sums.hanging), (6.0, 2.0, 4.0, 0.0));
        let long = format!("={}=", "-".repeat(39));
        assert!(found(&long, false).0.is_empty());
    }

    #[test]
    fn what_hangs_is_named() {
        let (messages, sums) = found("----==", false);
        assert!(messages[0].starts_with("a bead begins in mid-air and hangs for 2.0 mm (line 1,"));
        assert_eq!((sums.hanging, sums.hanging_beads, sums.in_mid_air), (2.0, 1, 1));
        assert!(found("==----", false).0[0].starts_with("a bead ends in mid-air, 2.0 mm"));
        assert!(found("------", false).0[0].starts_with("a bead begins in mid-air"));
        let long = format!("={}=", "-".repeat(41));
        assert!(found(&long, false).0[0].starts_with("20.5 mm of a bead hang"));
        assert_eq!(found("----==----", false).0.len(), 2);
    }

    #[test]
    fn a_closed_line_has_no_begin() {
        // 3 mm over the seam of a loop: a bridge.
        assert!(found("---========---", true).0.is_empty());
        assert!(found("----=======", true).0.is_empty());
        assert!(found("=======----", true).0.is_empty());
        let (messages, sums) = found("------------========------------", true);
        assert_eq!((messages.len(), sums.in_mid_air), (1, 0));
        // Chords of a circle of 16 mm.
        assert!((sums.hanging - 12.0).abs() < 0.03, "{}", sums.hanging);
        assert_eq!(found(&"-".repeat(40), true).1.in_mid_air, 1);
    }
}

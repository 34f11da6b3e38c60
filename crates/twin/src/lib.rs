//! The independent witness: reads the emitted text again and proves it on a model of the machine.
//!
//! Nothing here knows how a program was made. What is judged is the text, with the printer's
//! profile and the mesh in the frame of the part as the only other evidence.
//!
//! In reading order: [`curve`] is the path of the nozzle over the part during one move, as
//! forward kinematics gives it; [`segment`] is one move with all that is known of it; [`replay`]
//! makes segments out of lines; [`rounding`] says how far the last places of the text can bend
//! what is measured; [`family`] knows the surfaces of layers; [`section`] cuts the mesh, [`columns`]
//! tells its inside, [`nearest`] how far away its surface is. The checks, one concept each, are in [`check`],
//! what they find in [`finding`], the sums of a program in [`totals`]; [`verify`] runs it all over
//! a program. [`form`] compares the part with the one that a misaligned machine would make of the same
//! program; [`picture`] draws what was replayed, so that a picture cannot lie. [`steps`] counts the pulses of its
//! motors, [`motor`] is a model of one. [`magnets`] is a machine with a sensor, for trying out a
//! calibration.
//!
//! Lengths are mm, angles radians, times seconds, temperatures degrees Celsius. Frames: *Part*
//! turns with the bed, *Machine* does not; both as in [`machine::kinematics`].

mod arc;
pub mod check;
pub mod columns;
pub mod curve;
pub mod family;
pub mod finding;
pub mod form;
pub mod magnets;
pub mod motor;
pub mod nearest;
pub mod picture;
mod pile;
pub mod posed;
pub mod ramps;
pub mod replay;
pub mod rounding;
#[cfg(test)]
mod sample;
pub mod section;
pub mod segment;
pub mod steps;
pub mod thorough;
pub mod totals;
pub mod verify;

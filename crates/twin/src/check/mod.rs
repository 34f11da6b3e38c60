//! The checks, one concept each.
//!
//! A check has a `NAME`, under which its findings appear, and is shown every segment, layer or
//! temperature of a program in order. It keeps a few numbers, never the program. What it measures
//! is compared with the printer's profile after allowing for [rounding](crate::rounding); a value
//! that is not a number is always a finding.
//!
//! On the text: [`text`], [`modes`], [`declared`]. On the machine: [`reach`], [`axis`], [`speed`],
//! [`acceleration`], [`mod@head`], [`heat`]. On the part: [`continuity`], [`surface`],
//! [`flow`], [`volume`], [`height`], [`deposit`]. On what lies below and around, where a full proof is
//! asked for: [`support`], [`overlap`], [`coverage`], [`clearance`].

pub mod acceleration;
pub mod axis;
pub mod clearance;
pub mod continuity;
pub mod coverage;
pub mod declared;
pub mod deposit;
pub mod flow;
pub mod head;
pub mod heat;
pub mod height;
pub mod modes;
pub mod overlap;
pub mod reach;
pub mod speed;
pub mod support;
pub mod surface;
pub mod text;
pub mod volume;

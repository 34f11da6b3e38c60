//! The witness as a whole, on programs written as text.

mod closed_form;
mod limits;
mod mutation;
mod noise;
mod program;
mod round_trip;

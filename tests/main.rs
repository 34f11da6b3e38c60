//! What users rely on, tested from outside: the rules of the house, the command line, and the
//! properties of finished programs.
//!
//! Programs are judged here by a reader of their own ([`program`]), which shares no code with the
//! crates that write or check them.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod arcs;
mod batch;
mod budgets;
mod bundled;
mod cli;
mod comb;
mod comparison;
mod corpus;
mod corpus_made;
mod curve;
mod curved;
mod curved_walls;
mod environment;
mod golden;
mod habits;
mod holes;
mod house;
mod interrupt;
mod lens;
mod limits;
mod models;
mod motion;
mod motor;
mod mutants;
mod names;
mod objects;
mod outputs;
mod preview;
mod program;
mod quality;
mod ranges;
mod relief;
mod rotation;
mod roundtrip;
mod run;
mod seam;
mod send;
mod send_faults;
mod settings;
mod shared;
mod slice;
mod steps;
mod supports;
mod sweep;
mod text;
mod threads;
mod thumbnail;
mod tilt;
mod time;
mod twins;
mod verify;
mod volume;
mod walls;

//! Programs as text: writing, reading, and the words of each firmware.

mod correction;
pub mod dialect;
mod emit;
pub mod label;
pub mod marlin;
mod number;
mod parse;
pub mod posed;
pub mod speed_word;

pub use dialect::Dialect;
pub use emit::{ELAPSED, Emitter, LEAST_FEED, MOST_COLUMNS, printable};
pub use number::decimal;
pub use parse::{Code, Command, Line, SyntaxError, parse_line};

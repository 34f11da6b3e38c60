//! Values of settings by name.

use super::key::{Key, Value};
use super::merge::Settings;

/// Values by name. A name that is not in the table, or of another kind, is a mistake of ours that
/// the first test of every build finds.
pub(super) struct Lookup<'a>(pub(super) &'a Settings);

impl Lookup<'_> {
    fn value(&self, name: &str) -> &Value {
        self.0.get(Key::by_name(name).expect("names are in the table")).0
    }

    pub(super) fn number(&self, name: &str) -> f64 {
        match self.value(name) {
            Value::Number(number) => *number,
            other => unreachable!("{name} is a number, not {other}"),
        }
    }

    pub(super) fn whole(&self, name: &str) -> i64 {
        match self.value(name) {
            Value::Count(count) => *count,
            other => unreachable!("{name} is a count, not {other}"),
        }
    }

    pub(super) fn count(&self, name: &str) -> usize {
        match self.value(name) {
            Value::Count(count) => usize::try_from(*count).expect("counts are not negative"),
            other => unreachable!("{name} is a count, not {other}"),
        }
    }

    pub(super) fn switch(&self, name: &str) -> bool {
        match self.value(name) {
            Value::Switch(switch) => *switch,
            other => unreachable!("{name} is a switch, not {other}"),
        }
    }

    pub(super) fn text(&self, name: &str) -> &str {
        match self.value(name) {
            Value::Text(text) => text,
            other => unreachable!("{name} is a text, not {other}"),
        }
    }
}

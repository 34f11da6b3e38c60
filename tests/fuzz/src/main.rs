//! The fuzzer of all doors: linking what is counted takes long, so that there is one of it.

#![no_main]

use std::sync::OnceLock;

/// Feeds the door that `RHUMB_DOOR` names.
fn door() -> fn(&[u8]) {
    static DOOR: OnceLock<fn(&[u8])> = OnceLock::new();
    *DOOR.get_or_init(|| {
        let name = std::env::var("RHUMB_DOOR").expect("RHUMB_DOOR names a door");
        rhumb_fuzz::door(&name).expect("there is such a door")
    })
}

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| door()(bytes));

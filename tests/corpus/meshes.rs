//! Meshes: STL files and, as far as they are read, 3MF archives.

use serde_json::Value;

use super::{Corpus, MACHINE, Wanted, end, faults, leftovers, limited, none, texts};
use crate::run::{Ran, Scratch, say};

/// How often what goes wrong with a slicer went wrong: the first column of the table in `docs/corpus.md`.
#[derive(Debug, Default)]
struct Column {
    crashes: usize,
    over_its_time: usize,
    sound_refused: usize,
    broken_printed: usize,
}

impl Column {
    fn add(&mut self, case: &Value, ran: &Ran) {
        const KILLED_BY_LIMIT: i32 = 128 + 9;
        const BUG: i32 = 70;
        let must_fail = case["outcome"] == "error" && !texts(case, "also").contains(&end(ran));
        match ran.code {
            Some(KILLED_BY_LIMIT) => self.over_its_time += 1,
            Some(BUG) | None => self.crashes += 1,
            Some(code) if code > 128 => self.crashes += 1,
            Some(0 | 1) => self.broken_printed += usize::from(must_fail),
            Some(_) => self.sound_refused += usize::from(case["outcome"] != "error"),
        }
    }
}

#[test]
fn every_mesh_ends_as_expected() {
    let Some(corpus) = Corpus::get() else { return };
    let (mut found, mut n_cases, mut column) = (Vec::new(), 0, Column::default());
    for case in corpus.cases(&["mesh", "extra"]) {
        let (id, file) = corpus.file(case);
        n_cases += 1;
        let scratch = Scratch::new();
        let mut arguments = vec!["slice", file.to_str().unwrap(), "-q", "-o", "out.gcode"];
        arguments.extend(["--orient", "keep", "--threads", "2"]);
        arguments.extend(MACHINE);
        let ran = limited(&scratch, case, &arguments);
        column.add(case, &ran);
        // What is awkward and printed all the same may want a look.
        let wants_look =
            ran.code == Some(1) && case["outcome"] != "ok" && case["outcome"] != "error";
        if !wants_look {
            found.extend(faults(case, &ran));
        }
        found.extend(leftovers(id, &ran, &scratch));
        if let Some(volume) = case["facts"]["volume_mm3_union"].as_f64()
            && matches!(ran.code, Some(0 | 1))
        {
            let text = std::fs::read_to_string(scratch.path("out.gcode")).unwrap();
            let laid: f64 = crate::program::motions(&text)
                .iter()
                .filter(|motion| motion.lays() && motion.role != "Skirt/Brim")
                .map(crate::program::Motion::volume)
                .sum();
            // The infill is sparse: no more than all of it, and no less than walls and skins.
            if !(0.05 * volume..=1.02 * volume).contains(&laid) {
                found.push(format!("{id} lays {laid} of {volume} mm³"));
            }
        }
    }
    say(&format!("{n_cases} meshes: {column:?}"));
    let least = match Wanted::get() {
        Wanted::Quick => 161,
        Wanted::Slow => 4,
        Wanted::All => 165,
    };
    assert!(n_cases >= least, "{n_cases} are not the corpus");
    none(&found, n_cases);
}

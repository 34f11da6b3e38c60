//! Meshes: STL files and, as far as they are read, 3MF archives.

use super::{Corpus, MACHINE, faults, leftovers, limited, none, wants_all};
use crate::run::Scratch;

/// Printable or not, these take longer than they should: thousands of parts too small for a bead, and
/// hundreds of shells within each other. They run with the large ones.
const SLOW: [&str; 2] = ["stl/shells_10k", "stl/concentric_250"];

#[test]
fn every_mesh_ends_as_expected() {
    let Some(corpus) = Corpus::get() else { return };
    let (mut found, mut n_cases) = (Vec::new(), 0);
    for case in corpus.cases(&["mesh", "extra"]) {
        let (id, file) = corpus.file(case);
        n_cases += 1;
        if SLOW.contains(&id) && !wants_all() {
            continue;
        }
        let scratch = Scratch::new();
        let mut arguments = vec!["slice", file.to_str().unwrap(), "-q", "-o", "out.gcode"];
        arguments.extend(["--orient", "keep", "--threads", "2"]);
        arguments.extend(MACHINE);
        let ran = limited(&scratch, case, &arguments);
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
    assert!(n_cases >= if wants_all() { 165 } else { 163 }, "{n_cases} are not the corpus");
    none(&found, n_cases);
}

//! The same bytes for any number of threads.

use std::process::Stdio;

use crate::run::{Scratch, model};

#[test]
fn threads_change_nothing() {
    let scratch = Scratch::new();
    for name in ["gear", "vase", "steps"] {
        let file = model(name);
        let run = |arguments: &[&str], variable: Option<&str>| {
            let mut all = vec!["slice", file.to_str().unwrap(), "-q", "-o", "-"];
            all.extend(["--set", "layer_height_mm=0.3"]);
            all.extend(arguments);
            let mut command = scratch.rhumb(&all);
            if let Some(count) = variable {
                command.env("RAYON_NUM_THREADS", count);
            }
            let output = command.stderr(Stdio::inherit()).output().unwrap();
            assert_eq!(output.status.code(), Some(0));
            output.stdout
        };
        let one = run(&["--threads", "1"], None);
        assert!(!one.is_empty());
        assert!(run(&["--threads", "2"], None) == one, "{name}: 2 threads");
        assert!(run(&["--threads", "7"], None) == one, "{name}: 7 threads");
        assert!(run(&[], Some("1")) == one, "{name}: 1 thread of the library");
        assert!(run(&[], Some("2")) == one, "{name}: 2 threads of the library");
    }
}

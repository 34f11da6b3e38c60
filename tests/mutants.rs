//! Sound programs on planes, cones and spheres, each damaged in the ways in which programs break, in
//! several places: every damage is found, and by a check that watches over what is damaged.

use crate::run::{Scratch, model};

/// A program, and where in it damage is looked for.
struct Sound {
    scratch: Scratch,
    name: &'static str,
    lines: Vec<String>,
}

const FAMILIES: [(&str, &[&str]); 3] = [
    ("planar", &["--layers=planar"]),
    ("conical", &["--layers=conical", "--cone-angle=30"]),
    ("spherical", &["--layers=spherical", "--sphere-centre=-40"]),
];

/// Seeds of the places that are damaged.
const SEEDS: [u64; 3] = [1, 2, 3];

impl Sound {
    fn new((name, layers): (&'static str, &[&str])) -> Self {
        let scratch = Scratch::new();
        let file = model("gear");
        let mut all = vec!["slice", file.to_str().unwrap(), "-q", "--no-verify", "--scale=0.3"];
        all.extend(["-o", "made.gcode", "--export-placed", "placed.stl"]);
        all.extend(layers);
        scratch.run(&all).expect(0);
        let text = std::fs::read_to_string(scratch.path("made.gcode")).unwrap();
        Self { scratch, name, lines: text.lines().map(str::to_owned).collect() }
    }

    /// The checks that find something.
    fn found(&self, lines: &[String], proof: &str) -> Vec<String> {
        self.scratch.file("judged.gcode", lines.join("\n") + "\n");
        let all = ["verify", "judged.gcode", "--model", "placed.stl", "--json", "--proof", proof];
        let verdict: serde_json::Value = serde_json::from_str(&self.scratch.run(&all).out).unwrap();
        let findings = verdict["verify"]["findings"].as_array().unwrap();
        findings.iter().map(|found| found["check"].as_str().unwrap().to_owned()).collect()
    }
}

/// Where damage may be done, and a number that no two damages share.
struct Places<'a> {
    lines: &'a [String],
    seed: u64,
}

impl Places<'_> {
    /// A line among those for which `is_meant`, within the layers.
    fn one(&self, is_meant: impl Fn(usize) -> bool) -> usize {
        let first = self.lines.iter().position(|line| line == ";LAYER_CHANGE").unwrap();
        let last = self.lines.iter().rposition(|line| line == ";LAYER_CHANGE").unwrap();
        let meant: Vec<usize> = (first..last).filter(|&at| is_meant(at)).collect();
        let mixed = self.seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 33;
        meant[mixed as usize % meant.len()]
    }

    /// Whether a line lays material, and not at the axis, where lines that go round it are not judged.
    fn lays(&self, at: usize) -> bool {
        let line = &self.lines[at];
        let rail = number(line, 'R').unwrap_or(0.0).abs();
        number(line, 'E').is_some_and(|filament| filament > 0.002) && rail > 2.0
    }

    fn bead(&self) -> usize {
        self.one(|at| self.lays(at))
    }

    /// The lines of a layer.
    fn layer(&self) -> std::ops::Range<usize> {
        let starts: Vec<usize> =
            (0..self.lines.len()).filter(|&at| self.lines[at] == ";LAYER_CHANGE").collect();
        let number = 1 + self.seed as usize * (starts.len() - 3) / 5;
        starts[number]..starts[number + 1]
    }
}

/// The number of a word of a move.
fn number(line: &str, letter: char) -> Option<f64> {
    let mut words = line.strip_prefix("G1 ")?.split(' ');
    words.find_map(|word| word.strip_prefix(letter)).and_then(|number| number.parse().ok())
}

/// Changes the number of a word of a move, if it has one.
fn change(line: &mut String, letter: char, change: impl Fn(f64) -> f64) {
    let Some(was) = number(line, letter) else { return };
    let is = (change(was) * 1e5).round() / 1e5;
    let words = line.split(' ').map(|word| {
        if word.starts_with(letter) { format!("{letter}{is}") } else { word.to_owned() }
    });
    *line = words.collect::<Vec<_>>().join(" ");
}

/// What is done, the checks of which one at least must find it, and how.
type Damage = (&'static str, &'static [&'static str], fn(&mut Vec<String>, &Places<'_>));

const DAMAGES: &[Damage] = &[
    ("a bead is missing", &["flow", "declared"], |lines, places| {
        lines.remove(places.bead());
    }),
    ("a travel is missing", &["flow", "deposit", "surface", "continuity"], |lines, places| {
        // The last before material is laid again.
        let at = places.one(|at| {
            let next = number(&places.lines[at + 1], 'E').unwrap_or(0.0) > 0.0;
            number(&places.lines[at], 'R').is_some()
                && number(&places.lines[at], 'E').is_none()
                && next
                && places.lines[at].starts_with("G1 R")
        });
        lines.remove(at);
    }),
    (
        "two beads are swapped",
        &["flow", "continuity", "deposit", "acceleration"],
        |lines, places| {
            let one = places.bead();
            let other = (one + 2..).find(|&at| places.lays(at)).unwrap();
            lines.swap(one, other);
        },
    ),
    ("a layer lies 50 µm too high", &["surface"], |lines, places| {
        for line in &mut lines[places.layer()] {
            change(line, 'Z', |z| z + 0.05);
        }
    }),
    ("a move is too fast", &["speed", "acceleration"], |lines, places| {
        let at = places.bead();
        change(&mut lines[at], 'F', |_| 30_000.0);
        if number(&lines[at], 'F').is_none() {
            lines[at].push_str(" F30000");
        }
    }),
    ("more is melted than can be", &["flow"], |lines, places| {
        let at = places.bead();
        change(&mut lines[at], 'E', |filament| filament * 20.0);
    }),
    ("a retraction is missing", &["continuity", "declared"], |lines, places| {
        let is_drawn = |at: usize| {
            let is_still = number(&places.lines[at], 'R').is_none();
            is_still && number(&places.lines[at], 'E').is_some_and(|filament| filament < -0.1)
        };
        lines.remove(places.one(is_drawn));
    }),
    ("a turn is wrapped", &["continuity"], |lines, places| {
        change(&mut lines[places.bead()], 'T', |turn| turn - 360.0);
    }),
    ("all lines feed 5 % more", &["flow", "volume", "declared"], |lines, _| {
        for line in lines.iter_mut().filter(|line| number(line, 'R').is_some()) {
            change(line, 'E', |filament| filament * 1.05);
        }
    }),
    ("a bead is lowered into the part", &["surface"], |lines, places| {
        let at = places.bead();
        let lower = |z: f64| (z - 0.3).max(0.05);
        if number(&lines[at], 'Z').is_some() {
            change(&mut lines[at], 'Z', lower);
        } else {
            let z = lines[..at].iter().rev().find_map(|line| number(line, 'Z')).unwrap();
            lines[at].push_str(&format!(" Z{:.3}", lower(z)));
        }
    }),
];

/// Damage to whole layers that agrees with itself: what the program says of its layers and of its
/// filament is made true again, so that only what is laid can tell.
const HONEST: &[Damage] = &[
    ("walls lie 0.1 mm farther out", &["deposit", "surface"], |lines, places| {
        for (at, role) in places.roles() {
            // Not those around the bore.
            if role == "External perimeter" && places.lays(at) {
                change(&mut lines[at], 'R', |r| if r > 3.0 { r + 0.1 } else { r });
            }
        }
    }),
    ("outer walls are not laid", &["coverage"], |lines, places| {
        drop_filament(lines, places, |role| role == "External perimeter");
    }),
    ("all but outer walls is not laid", &["coverage"], |lines, places| {
        drop_filament(lines, places, |role| role != "External perimeter");
    }),
    ("a layer is lifted by 0.1 mm, and says so", &["surface", "coverage"], |lines, places| {
        for at in places.layer() {
            change(&mut lines[at], 'Z', |z| z + 0.1);
            if let Some(top) = lines[at].strip_prefix(";Z:").and_then(|z| z.parse::<f64>().ok()) {
                lines[at] = format!(";Z:{:.3}", top + 0.1);
            }
        }
    }),
    ("long beads get twice their filament", &["flow"], |lines, places| {
        for at in places.layer() {
            change(
                &mut lines[at],
                'E',
                |filament| if filament > 0.01 { 2.0 * filament } else { filament },
            );
        }
    }),
];

impl Places<'_> {
    /// The moves of the layer, each with what it is for.
    fn roles(&self) -> Vec<(usize, &str)> {
        let mut role = "";
        let mut found = Vec::new();
        for at in self.layer() {
            role = self.lines[at].strip_prefix(";TYPE:").unwrap_or(role);
            found.push((at, role));
        }
        found
    }
}

/// Takes the filament from the moves of a layer that are for a role.
fn drop_filament(lines: &mut [String], places: &Places<'_>, is_meant: fn(&str) -> bool) {
    for (at, role) in places.roles() {
        let lays = number(&lines[at], 'R').is_some() && number(&lines[at], 'E').is_some();
        if is_meant(role) && lays {
            let words = lines[at].split(' ').filter(|word| !word.starts_with('E'));
            lines[at] = words.collect::<Vec<_>>().join(" ");
        }
    }
}

/// Makes what a program says of its filament true.
fn declare(lines: &mut [String]) {
    let fed: f64 = lines.iter().filter_map(|line| number(line, 'E')).sum();
    for line in lines.iter_mut().filter(|line| line.starts_with("; filament used [mm]")) {
        *line = format!("; filament used [mm] = {fed:.5}");
    }
}

#[test]
fn damage_that_agrees_with_itself_is_found_too() {
    let mut missed = Vec::new();
    for (name, layers) in FAMILIES {
        let solid: Vec<&str> = layers.iter().copied().chain(["--set=fill_density=100%"]).collect();
        let sound = Sound::new((name, &solid));
        assert_eq!(sound.found(&sound.lines, "full"), Vec::<String>::new(), "{name}");
        for (what, checks, damage) in HONEST {
            // High enough for cones, which begin as a tip, to have walls and lines in the layer.
            for seed in [2, 3] {
                let mut lines = sound.lines.clone();
                damage(&mut lines, &Places { lines: &sound.lines, seed });
                assert!(lines != sound.lines, "{what} changes nothing");
                declare(&mut lines);
                let found = sound.found(&lines, "full");
                if !found.iter().any(|found| checks.contains(&found.as_str())) {
                    missed.push(format!("{name}, {what}, seed {seed}: {found:?}"));
                }
            }
        }
    }
    assert!(missed.is_empty(), "{}", missed.join("\n"));
}

#[test]
fn every_damage_is_found_on_planes_cones_and_spheres() {
    let mut missed = Vec::new();
    for family in FAMILIES {
        let sound = Sound::new(family);
        assert_eq!(sound.found(&sound.lines, "full"), Vec::<String>::new(), "{}", sound.name);
        for (what, checks, damage) in DAMAGES {
            for seed in SEEDS {
                let mut lines = sound.lines.clone();
                damage(&mut lines, &Places { lines: &sound.lines, seed });
                assert!(lines != sound.lines, "{what} changes nothing");
                let found = sound.found(&lines, "quick");
                if !found.iter().any(|found| checks.contains(&found.as_str())) {
                    missed.push(format!("{}, {what}, seed {seed}: {found:?}", sound.name));
                }
            }
        }
    }
    assert!(missed.is_empty(), "{}", missed.join("\n"));
}

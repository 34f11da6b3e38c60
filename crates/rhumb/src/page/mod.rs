//! A program as one page for a browser.
//!
//! The page holds its data, its scripts and the parts of three.js that it draws with; it asks no
//! network for anything and works from a disk. What it shows comes from the text of the program,
//! move by move ([`columns`]). The scripts are beside this file; each says what it does.

pub mod columns;

use std::io::{Read, Write};

use flate2::Compression;
use flate2::read::GzDecoder;
use flate2::write::ZlibEncoder;
use machine::program::Role;
use serde_json::{Value, json};
use twin::picture::role_colour;

use crate::base64;
use crate::failure::Failure;
use crate::report::Finding;
use columns::Columns;

/// What is known of a program besides its moves.
#[derive(Debug, Clone, Copy)]
pub struct About<'a> {
    /// What to call it.
    pub name: &'a str,
    /// The words it is written in, for people.
    pub dialect: &'a str,
    /// Where the rotation axis is in the part, mm; `None` for the middle of what is printed.
    pub axis: Option<[f64; 2]>,
    /// Cross-section of the filament, mm².
    pub filament_area: f64,
    /// Grams in a mm³ of filament, when known.
    pub density_g_per_mm3: Option<f64>,
    /// Bore of the nozzle, mm: beads that say no width are drawn as wide.
    pub nozzle: f64,
    /// What the twin found; `None` when it was not asked.
    pub findings: Option<&'a [Finding]>,
}

const PAGE: &str = include_str!("page.html");
const STYLE: &str = include_str!("page.css");
const SCRIPTS: [&str; 6] = [
    include_str!("data.js"),
    include_str!("colours.js"),
    include_str!("scene.js"),
    include_str!("pick.js"),
    include_str!("ui.js"),
    include_str!("main.js"),
];

/// three.js, MIT licence: see `vendor/`.
const THREE: &[u8] = include_bytes!("vendor/three.min.js.gz");
const THREE_LICENCE: &str = include_str!("vendor/three.LICENSE");

/// Returns the page.
///
/// # Errors
///
/// None that memory does not have.
pub fn page(about: &About<'_>, columns: &Columns) -> Result<String, Failure> {
    let failed = |error: std::io::Error| Failure::new("Bug", format!("page: {error}"));
    let mut three = format!("/*\n{}*/\n", THREE_LICENCE.replace("*/", "* /"));
    GzDecoder::new(THREE).read_to_string(&mut three).map_err(failed)?;
    let mut packed = ZlibEncoder::new(Vec::new(), Compression::new(6));
    packed.write_all(&columns.bytes()).map_err(failed)?;
    let data = base64::encode(&packed.finish().map_err(failed)?);
    let program = program(about, columns).to_string().replace('<', "\\u003c");
    Ok(filled(&[
        ("title", &escaped(about.name)),
        ("style", STYLE),
        ("three", &three),
        ("program", &program),
        ("columns", &data),
        ("scripts", &SCRIPTS.join("\n")),
    ]))
}

/// The page with its places filled; what is filled in is not searched for places.
fn filled(parts: &[(&str, &str)]) -> String {
    let mut page =
        String::with_capacity(parts.iter().map(|part| part.1.len()).sum::<usize>() + PAGE.len());
    let mut rest = PAGE;
    while let Some((before, after)) = rest.split_once("{{") {
        page.push_str(before);
        let Some((name, after)) = after.split_once("}}") else { break };
        let part = parts.iter().find(|part| part.0 == name);
        page.push_str(part.map_or("", |part| part.1.trim_end()));
        rest = after;
    }
    page.push_str(rest);
    page
}

fn program(about: &About<'_>, columns: &Columns) -> Value {
    let mut program = columns.description();
    let roles: Vec<Value> = Role::ALL
        .iter()
        .map(|role| json!({"label": role.label(), "colour": role_colour(*role)}))
        .collect();
    program["name"] = json!(about.name);
    program["dialect"] = json!(about.dialect);
    program["axis"] = json!(about.axis);
    program["roles"] = json!(roles);
    program["filamentArea"] = json!(about.filament_area);
    program["density"] = json!(about.density_g_per_mm3);
    program["nozzle"] = json!(about.nozzle);
    program["judged"] = json!(about.findings.is_some());
    program["findings"] = json!(about.findings.unwrap_or_default());
    program
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::{Job, Settings};

    #[test]
    fn a_name_cannot_leave_its_place() {
        let job = Job::resolve(&Settings::defaults()).unwrap();
        let about = About {
            name: "</script><b>{{three}}.gcode",
            dialect: "polar",
            axis: None,
            filament_area: 2.4,
            density_g_per_mm3: None,
            nozzle: 0.4,
            findings: None,
        };
        let page = page(&about, &Columns::new(&job.printer)).unwrap();
        assert!(!page.contains("</script><b>"));
        assert!(page.contains("<title>&lt;/script&gt;&lt;b&gt;{{three}}.gcode</title>"));
        assert_eq!(page.matches("<script").count(), page.matches("</script>").count());
        // Nothing is fetched from anywhere.
        for word in ["src=\"", "href=\"http", "@import", "url("] {
            let outside =
                page.split("</script>").filter(|part| !part.contains("THREE=")).collect::<String>();
            assert!(!outside.contains(word), "{word}");
        }
    }

    #[test]
    fn three_js_comes_with_its_licence() {
        let job = Job::resolve(&Settings::defaults()).unwrap();
        let about = About {
            name: "a",
            dialect: "polar",
            axis: Some([0.0, 0.0]),
            filament_area: 2.4,
            density_g_per_mm3: Some(0.001_24),
            nozzle: 0.4,
            findings: Some(&[]),
        };
        let page = page(&about, &Columns::new(&job.printer)).unwrap();
        assert!(page.contains("three.js authors") && page.contains("The MIT License"));
        assert!(page.len() < 1_000_000, "{}", page.len());
    }
}

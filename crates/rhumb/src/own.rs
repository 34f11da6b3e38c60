//! Settings that one of several models has alone: what the user gives with `--object`, and, where
//! asked for, what a 3MF holds for single objects.
//!
//! A model alone may have its own walls, skins, infill and moved outlines. What all models of a print
//! share, layers, supports, speeds, temperatures, stays that of the print.

use std::collections::BTreeMap;

use mesh::model::{OwnSettings, Slicer};
use slicer::layer::PathParams;

use crate::failure::Failure;
use crate::report::Warning;
use crate::settings::prusa::{self, Imported};
use crate::settings::{Job, Settings, orca};

/// How one model is filled other than the rest.
#[derive(Debug, Clone, PartialEq)]
pub struct Own {
    /// Which model it is, counted from 0 in the order of the command line; the objects of a 3MF are
    /// models each.
    pub model: usize,
    /// How it is filled.
    pub paths: PathParams,
    /// What was set, `KEY=VALUE`.
    pub said: Vec<String>,
}

/// Reads what the user wants of single models, `N:KEY=VALUE`; whether there are so many models is known
/// once their files are read ([`check_numbers`]).
///
/// # Errors
///
/// `Usage`, what is wrong with a key or a value, or `ConfigConflict` where it concerns the whole print.
pub fn asked(texts: &[String], settings: &Settings) -> Result<Vec<Own>, Failure> {
    let mut each: BTreeMap<usize, Vec<String>> = BTreeMap::new();
    for text in texts {
        let wrong = || Failure::new("Usage", format!("--object {text:?} is not N:KEY=VALUE"));
        let (number, pair) = text.split_once(':').ok_or_else(wrong)?;
        let number: usize = number.trim().parse().map_err(|_| wrong())?;
        if number == 0 {
            let what = format!("--object {text:?}: models are counted from 1");
            return Err(Failure::new("Usage", what));
        }
        each.entry(number - 1).or_default().push(pair.to_owned());
    }
    each.into_iter().map(|(model, said)| resolved(model, said, settings)).collect()
}

/// Checks that there are the models that settings are for.
///
/// # Errors
///
/// `Usage`.
pub fn check_numbers(own: &[Own], models: usize) -> Result<(), Failure> {
    match own.iter().find(|own| own.model >= models) {
        Some(own) => {
            let what = format!("--object {}: there are models 1 to {models}", own.model + 1);
            Err(Failure::new("Usage", what))
        }
        None => Ok(()),
    }
}

/// The settings of a model that has some of its own.
fn resolved(model: usize, said: Vec<String>, settings: &Settings) -> Result<Own, Failure> {
    let mut own = settings.clone();
    said.iter().try_for_each(|pair| own.set(pair))?;
    let (own, common) = (Job::resolve(&own)?, Job::resolve(settings)?);
    let paths = own.paths;
    // What does not lie in an object alone is the same for all.
    let same = PathParams {
        adhesion: common.paths.adhesion,
        first_layer: common.paths.first_layer,
        vase: common.paths.vase,
        tolerance: common.paths.tolerance,
        ..paths
    };
    if same != paths || (Job { paths: common.paths, ..own }) != common {
        let what = format!("--object {}: {} concern the whole print", model + 1, said.join(", "));
        return Err(Failure::new("ConfigConflict", what)
            .hint("a model alone may have its own walls, skins, infill and moved outlines"));
    }
    Ok(Own { model, paths, said })
}

/// An object of a file with settings of its own.
pub(crate) struct Configured<'a> {
    /// Which model it is.
    pub(crate) model: usize,
    /// What it is called.
    pub(crate) name: &'a str,
    /// What its file says.
    pub(crate) settings: &'a OwnSettings,
}

/// Takes over what files say of single objects, as far as there are such settings here and they can be
/// those of one object; what the user asked for of the same model comes after. What is not taken over
/// is told.
///
/// # Errors
///
/// `ConfigConflict` where what the user asked for does not go together with what the file says.
pub(crate) fn with_those_of_files(
    asked: &[Own],
    objects: &[Configured<'_>],
    settings: &Settings,
) -> Result<(Vec<Own>, Vec<Warning>), Failure> {
    let mut each: BTreeMap<usize, Own> = asked.iter().map(|own| (own.model, own.clone())).collect();
    let mut warnings = Vec::new();
    for object in objects {
        let (mut said, left) = taken(object, settings);
        if !left.is_empty() {
            let message = format!(
                "object {} ({}): settings that are not taken over: {}",
                object.model + 1,
                object.name,
                left.join(", ")
            );
            warnings.push(Warning { code: "ObjectSettingsLeft".to_owned(), message });
        }
        said.extend(each.remove(&object.model).map_or_else(Vec::new, |own| own.said));
        if !said.is_empty() {
            each.insert(object.model, resolved(object.model, said, settings)?);
        }
    }
    Ok((each.into_values().collect(), warnings))
}

/// What can be taken over of an object's settings, and what not.
fn taken(object: &Configured<'_>, settings: &Settings) -> (Vec<String>, Vec<String>) {
    let keys = || object.settings.pairs.iter().map(|(key, _)| shown(key)).collect();
    let Ok(imported) = imported(object.settings) else { return (Vec::new(), keys()) };
    let refused = imported.refused.iter().map(|(key, ..)| shown(key));
    let mut left: Vec<String> = refused.chain(imported.unknown.iter().map(|k| shown(k))).collect();
    let mut said = Vec::new();
    for (key, value) in &imported.taken {
        let pair = format!("{}={value}", key.name);
        let so_far = [&said[..], std::slice::from_ref(&pair)].concat();
        match resolved(object.model, so_far, settings) {
            Ok(_) => said.push(pair),
            Err(_) => left.push(key.program_name.to_owned()),
        }
    }
    (said, left)
}

/// A key of a file, for people.
fn shown(key: &str) -> String {
    key.chars().filter(|c| !c.is_control()).take(60).collect()
}

fn imported(own: &OwnSettings) -> Result<Imported, Failure> {
    const NAME: &str = "the settings of an object";
    match own.slicer {
        Slicer::Prusa => {
            // What has a line of its own is none of these settings.
            let is_line = |text: &str| !text.contains(['\n', '\r']);
            let lines = own.pairs.iter().filter(|(key, value)| is_line(key) && is_line(value));
            let text: String = lines.map(|(key, value)| format!("{key} = {value}\n")).collect();
            prusa::read(text.as_bytes(), NAME)
        }
        Slicer::Orca => {
            let pairs = own.pairs.iter().map(|(key, value)| (key.clone(), value.clone().into()));
            let json = serde_json::Value::Object(pairs.collect());
            orca::read(json.to_string().as_bytes(), NAME)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(slicer: Slicer, pairs: &[(&str, &str)]) -> (Vec<String>, Vec<String>) {
        let pairs = pairs.iter().map(|(k, v)| ((*k).to_owned(), (*v).to_owned())).collect();
        let settings = OwnSettings { slicer, pairs };
        taken(&Configured { model: 0, name: "a", settings: &settings }, &Settings::defaults())
    }

    #[test]
    fn what_an_object_alone_can_have_is_taken_over() {
        let (taken, left) = said(
            Slicer::Prusa,
            &[
                ("perimeters", "4"),
                ("fill_density", "40%"),
                ("layer_height", "0.1"),
                ("extruder", "2"),
                ("fill_pattern", "no such"),
                ("top_solid_layers", "7\nperimeters = 9"),
            ],
        );
        assert_eq!(taken, ["perimeters=4", "fill_density=0.4"]);
        assert_eq!(left, ["fill_pattern", "extruder", "layer_height"]);
        let (taken, left) = said(Slicer::Orca, &[("wall_loops", "5"), ("brim_width", "3")]);
        assert_eq!(taken, ["perimeters=5"]);
        assert_eq!(left, ["brim_width"]);
        assert_eq!(said(Slicer::Orca, &[("odd", "5")]), (vec![], vec!["odd".to_owned()]));
    }

    #[test]
    fn what_the_user_asks_for_comes_after_the_file() {
        let settings = Settings::defaults();
        let asked = asked(&["1:perimeters=3".into(), "3:perimeters=1".into()], &settings).unwrap();
        let pairs = vec![("perimeters".into(), "5".into()), ("fill_density".into(), "50%".into())];
        let own = OwnSettings { slicer: Slicer::Prusa, pairs };
        let objects = [0, 1].map(|model| Configured { model, name: "wheel", settings: &own });
        let (all, warnings) = with_those_of_files(&asked, &objects, &settings).unwrap();
        assert!(warnings.is_empty());
        let walls: Vec<_> = all.iter().map(|own| (own.model, own.paths.walls.count)).collect();
        assert_eq!(walls, [(0, 3), (1, 5), (2, 1)]);
        assert_eq!(check_numbers(&all, 3), Ok(()));
        assert_eq!(check_numbers(&all, 2).unwrap_err().class(), "Usage");
    }
}

//! Which lines belong to which of several objects, so that a print server can leave one out.

use nalgebra::Point2;

use super::emit::{MOST_COLUMNS, printable};
use super::number::decimal;

/// How a firmware, or a print server that reads along, is told of objects.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LabelWords {
    /// Klipper's `EXCLUDE_OBJECT_DEFINE`, `_START` and `_END`.
    ExcludeObject,
    /// `M486` of Marlin and `RepRapFirmware`.
    M486,
    /// The comments that `OctoPrint`'s cancel plug-in reads.
    Comments,
}

/// Several objects, by name, and how they are told.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Labels {
    words: LabelWords,
    names: Vec<String>,
}

/// Longest name of an object: its definition still has room for a place.
const LONGEST_NAME: usize = 32;

impl Labels {
    /// Returns labels of objects; their names are made such that any firmware takes them, and no two
    /// are the same.
    #[must_use]
    pub fn new<'a>(words: LabelWords, names: impl IntoIterator<Item = &'a str>) -> Self {
        let plain = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
        let name = |(k, name): (usize, &str)| {
            let count = (k + 1).to_string();
            let room = LONGEST_NAME - count.len() - 1;
            let name: String = name.chars().map(plain).take(room).collect();
            format!("{name}_{count}")
        };
        Self { words, names: names.into_iter().enumerate().map(name).collect() }
    }

    /// Returns the lines that say, before the print, which objects there are; `outlines` (mm) are
    /// theirs in the coordinates of the program.
    #[must_use]
    pub fn definitions(&self, outlines: &[Vec<Point2<f64>>]) -> Vec<String> {
        match self.words {
            LabelWords::ExcludeObject => {
                let define = |(name, outline): (&String, &Vec<_>)| exclude_define(name, outline);
                self.names.iter().zip(outlines).map(define).collect()
            }
            LabelWords::M486 => {
                let mut lines = vec![format!("M486 T{}", self.names.len())];
                let names = self.names.iter().enumerate();
                lines.extend(names.map(|(k, name)| format!("; object {k} = {name}")));
                lines
            }
            LabelWords::Comments => Vec::new(),
        }
    }

    /// Returns the line before what belongs to an object.
    #[must_use]
    pub fn begin(&self, object: usize) -> String {
        match self.words {
            LabelWords::ExcludeObject => format!("EXCLUDE_OBJECT_START NAME={}", self.name(object)),
            LabelWords::M486 => format!("M486 S{object}"),
            LabelWords::Comments => {
                format!("; printing object {} id:{object} copy 0", self.name(object))
            }
        }
    }

    /// Returns the line after it.
    #[must_use]
    pub fn end(&self, object: usize) -> String {
        match self.words {
            LabelWords::ExcludeObject => format!("EXCLUDE_OBJECT_END NAME={}", self.name(object)),
            LabelWords::M486 => "M486 S-1".to_owned(),
            LabelWords::Comments => {
                format!("; stop printing object {} id:{object} copy 0", self.name(object))
            }
        }
    }

    fn name(&self, object: usize) -> &str {
        self.names.get(object).map_or("", String::as_str)
    }
}

/// Centre and, where the line has room for it, the box around an object.
fn exclude_define(name: &str, outline: &[Point2<f64>]) -> String {
    let mut line = format!("EXCLUDE_OBJECT_DEFINE NAME={}", printable(name));
    let axis = |k: usize| outline.iter().map(move |p| p[k]);
    let least = [0, 1].map(|k| axis(k).fold(f64::INFINITY, f64::min));
    let most = [0, 1].map(|k| axis(k).fold(f64::NEG_INFINITY, f64::max));
    if least[0] > most[0] {
        return line;
    }
    let middle = [0, 1].map(|k| decimal(f64::midpoint(least[k], most[k]), 1));
    line += &format!(" CENTER={},{}", middle[0], middle[1]);
    let (low, high) = (least.map(f64::floor), most.map(f64::ceil));
    let corners = [[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]];
    let corners = corners.map(|[x, y]| format!("[{},{}]", decimal(x, 0), decimal(y, 0)));
    let polygon = format!(" POLYGON=[{}]", corners.join(","));
    if line.len() + polygon.len() <= MOST_COLUMNS {
        line += &polygon;
    }
    line
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn objects_are_told_as_each_server_reads_them() {
        let square =
            [[-5.0, -5.0], [5.0, -5.0], [5.0, 5.0], [-5.0, 5.0]].map(Point2::from).to_vec();
        let long = "a part; with\na name that goes on and on and on";
        let names = ["cube", "cube", long];
        let klipper = Labels::new(LabelWords::ExcludeObject, names);
        let lines = klipper.definitions(&[square.clone(), square.clone(), square]);
        assert_eq!(
            lines[0],
            "EXCLUDE_OBJECT_DEFINE NAME=cube_1 CENTER=0,0 POLYGON=[[-5,-5],[5,-5],[5,5],[-5,5]]"
        );
        assert!(lines[1].contains("NAME=cube_2 "));
        assert!(lines.iter().all(|line| line.len() <= MOST_COLUMNS && line.contains("CENTER=")));
        assert_eq!(klipper.begin(1), "EXCLUDE_OBJECT_START NAME=cube_2");
        assert_eq!(klipper.end(1), "EXCLUDE_OBJECT_END NAME=cube_2");
        let marlin = Labels::new(LabelWords::M486, names);
        assert_eq!(marlin.definitions(&[])[0], "M486 T3");
        assert_eq!([marlin.begin(2), marlin.end(2)], ["M486 S2", "M486 S-1"]);
        let comments = Labels::new(LabelWords::Comments, names);
        assert_eq!(comments.begin(0), "; printing object cube_1 id:0 copy 0");
    }
}

//! Ranges of heights, each with layers of its own: `planar:0-8,blend:8-14,conical:14-`.
//!
//! Ranges stand in the order in which they are printed, with a comma between them. A range is the word
//! for its layers and, after a colon, where it begins and ends, mm above the bed. An end that the next
//! range tells may be left out, and so may the end of the last one, which then goes up to the top of the
//! part. A `blend` without heights is as low as the limits of a layer's thickness allow.

use std::fmt;

/// What the layers of a range follow.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Word {
    /// Planes.
    Planar,
    /// From planes to the curved layers of the next range, or from those of the one before to planes.
    Blend,
    /// Cones.
    Conical,
    /// Spheres.
    Spherical,
    /// Caps of a sphere.
    Caps,
}

impl Word {
    const ALL: [(&'static str, Self); 5] = [
        ("planar", Self::Planar),
        ("blend", Self::Blend),
        ("conical", Self::Conical),
        ("spherical", Self::Spherical),
        ("caps", Self::Caps),
    ];

    /// Returns how users write it.
    #[must_use]
    pub fn text(self) -> &'static str {
        Self::ALL.iter().find(|(_, word)| *word == self).map_or("", |(text, _)| text)
    }

    fn is_curved(self) -> bool {
        !matches!(self, Self::Planar | Self::Blend)
    }
}

/// A range of heights, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Range {
    /// Its layers.
    pub word: Word,
    /// Where it begins; `None` where a blend of no given height ends.
    pub from: Option<f64>,
    /// Where it ends; `None` for the top of the part, and for a blend of no given height.
    pub to: Option<f64>,
}

/// Returns whether a value of `layers` tells ranges rather than one surface for the whole part.
#[must_use]
pub fn is_ranges(text: &str) -> bool {
    text.contains([':', ','])
}

/// Reads ranges.
///
/// # Errors
///
/// What is wrong, and with which range.
pub fn parse(text: &str) -> Result<Vec<Range>, String> {
    let mut ranges = text.split(',').map(range).collect::<Result<Vec<_>, _>>()?;
    join(&mut ranges)?;
    check_order(&ranges)?;
    Ok(ranges)
}

/// Writes a height: one that was left out is a blank.
fn shown(height: Option<f64>) -> String {
    height.map(|height| height.to_string()).unwrap_or_default()
}

impl fmt::Display for Range {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.word.text())?;
        if self.from.is_some() || self.to.is_some() {
            write!(f, ":{}-{}", shown(self.from), shown(self.to))?;
        }
        Ok(())
    }
}

fn range(text: &str) -> Result<Range, String> {
    let text = text.trim();
    let (word, heights) = match text.split_once(':') {
        Some((word, heights)) => (word.trim(), Some(heights.trim())),
        None => (text, None),
    };
    let known = Word::ALL.iter().find(|(known, _)| *known == word);
    let Some(&(_, word)) = known else {
        let shown: String = word.chars().take(40).collect();
        let words: Vec<&str> = Word::ALL.iter().map(|(text, _)| *text).collect();
        return Err(format!("{shown:?} is no kind of layers for a range: {}", words.join(", ")));
    };
    let Some(heights) = heights else { return Ok(Range { word, from: None, to: None }) };
    let Some((from, to)) = heights.split_once('-') else {
        return Err(format!("{text:?} wants FROM-TO in mm after the colon, such as 8-14, or 14-"));
    };
    let (from, to) = (height(from, text)?, height(to, text)?);
    if let (Some(from), Some(to)) = (from, to)
        && from >= to
    {
        return Err(format!("{text:?} ends where it begins or below: give the lower height first"));
    }
    Ok(Range { word, from, to })
}

fn height(text: &str, range: &str) -> Result<Option<f64>, String> {
    /// Higher than any printer.
    const MOST_MM: f64 = 1e5;
    let text = text.trim();
    let number = text.strip_suffix("mm").unwrap_or(text).trim();
    if text.is_empty() {
        return Ok(None);
    }
    let is_plain = number.bytes().all(|c| c.is_ascii_digit() || c == b'.');
    let height = number.parse::<f64>().ok().filter(|height| is_plain && *height <= MOST_MM);
    height.map(Some).ok_or_else(|| {
        let shown: String = text.chars().take(40).collect();
        format!("{shown:?} in {range:?} is no height: write mm above the bed, such as 8 or 8.5mm")
    })
}

/// Fills in heights that a neighbour tells, and refuses gaps and overlaps.
fn join(ranges: &mut [Range]) -> Result<(), String> {
    let first = &mut ranges[0];
    if first.from.is_some_and(|from| from > 0.0) {
        return Err(format!("nothing is printed below {first}: the first range begins at 0"));
    }
    first.from = Some(0.0);
    for k in 1..ranges.len() {
        let [below, above] = [ranges[k - 1], ranges[k]];
        let between = match (below.to, above.from) {
            (Some(to), Some(from)) if to < from => {
                return Err(format!(
                    "between {below} and {above} nothing is printed from {to} to {from} mm: let \
                     the one begin where the other ends"
                ));
            }
            (Some(to), Some(from)) if to > from => {
                return Err(format!(
                    "{below} and {above} overlap from {from} to {to} mm: let the one begin where \
                     the other ends"
                ));
            }
            (to, from) => to.or(from),
        };
        let is_open_blend = below.word == Word::Blend && above.word.is_curved();
        if between.is_none() && !is_open_blend {
            return Err(format!(
                "where {below} ends and {above} begins is not said: give a height, such as \
                 {}:-8,{}:8-",
                below.word.text(),
                above.word.text()
            ));
        }
        ranges[k - 1].to = between;
        ranges[k].from = between;
        if let (Some(from), Some(to)) = (ranges[k - 1].from, between)
            && from >= to
        {
            return Err(format!("{} ends where it begins or below", ranges[k - 1]));
        }
    }
    Ok(())
}

/// Refuses neighbours that cannot lie on each other.
fn check_order(ranges: &[Range]) -> Result<(), String> {
    for (k, range) in ranges.iter().enumerate() {
        let below = k.checked_sub(1).map(|k| ranges[k]);
        let above = ranges.get(k + 1);
        let is = |range: Option<&Range>, wanted: fn(Word) -> bool| {
            range.is_some_and(|range| wanted(range.word))
        };
        let planar = |word: Word| word == Word::Planar;
        if range.word == Word::Blend {
            let rises = is(below.as_ref(), planar) && is(above, Word::is_curved);
            let falls = is(below.as_ref(), Word::is_curved) && is(above, planar);
            if !(rises || falls) {
                return Err(format!(
                    "{range} has nothing to lead from or to: a blend lies between a planar range \
                     and a conical, spherical or caps range"
                ));
            }
        } else if let Some(below) =
            below.filter(|below| range.word.is_curved() && below.word.is_curved())
        {
            return Err(format!(
                "{range} cannot lie on {below}: put a planar range, or blend, planar, blend, \
                 between them"
            ));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(text: &str) -> String {
        let ranges = parse(text).unwrap();
        ranges.iter().map(ToString::to_string).collect::<Vec<_>>().join(",")
    }

    #[test]
    fn heights_may_be_left_out_where_a_neighbour_tells_them() {
        let whole = "planar:0-8,blend:8-14,conical:14-";
        assert_eq!(told(whole), whole);
        assert_eq!(told(" planar:-8mm, blend:-14 , conical"), whole);
        assert_eq!(told("planar,blend:8-14,conical:14-"), whole);
        assert_eq!(told("planar:0-8,blend,spherical"), "planar:0-8,blend:8-,spherical");
        assert_eq!(told("planar:-3,conical:3-9.5,planar"), "planar:0-3,conical:3-9.5,planar:9.5-");
        assert_eq!(told("caps:0-9,blend:-12,planar"), "caps:0-9,blend:9-12,planar:12-");
        assert_eq!(told("planar:0-8,planar:8-"), "planar:0-8,planar:8-");
    }

    #[test]
    fn what_is_wrong_is_said() {
        for (text, wanted) in [
            ("planar:0-8,conical:9-", "nothing is printed from 8 to 9 mm"),
            ("planar:0-8,conical:7-", "overlap from 7 to 8 mm"),
            ("planar:2-8,conical:8-", "begins at 0"),
            ("planar:0-8cm,conical", "\"8cm\" in"),
            ("planar:0-8,wavy:8-", "\"wavy\" is no kind of layers"),
            ("planar:8,conical", "wants FROM-TO"),
            ("planar:8-2,conical", "ends where it begins"),
            ("planar:0--8,conical", "is no height"),
            ("planar:0-nan,conical", "is no height"),
            ("planar:0-1e3,conical", "is no height"),
            ("planar,conical", "is not said"),
            ("planar:0-8,blend:8-4,conical", "ends where it begins"),
            ("blend:0-8,conical", "nothing to lead from"),
            ("planar:0-8,blend:8-14", "nothing to lead from or to"),
            ("planar:0-8,blend:8-14,planar:14-", "nothing to lead from or to"),
            ("conical:0-8,spherical:8-", "cannot lie on"),
            ("conical:0-8,blend,planar", "is not said"),
            ("planar:0-8,", "\"\" is no kind"),
            ("conical:0-8,planar:8-4,caps", "ends where it begins"),
        ] {
            let error = parse(text).unwrap_err();
            assert!(error.contains(wanted), "{text}: {error}");
        }
    }
}

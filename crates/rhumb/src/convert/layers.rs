//! Layers of sources that number them and do not say where they lie, as Cura does (`;LAYER:7`).
//!
//! Viewers and print servers, and the proof of the program, want to know height and thickness. Both
//! are known when the first line of the layer is laid.

use machine::program::Layer;

use super::batch::Between;

/// Follows the layers of a source.
#[derive(Debug, Default)]
pub(super) struct Layers {
    /// Whether the source announces layers as we do, or nearly.
    is_told: bool,
    count: usize,
    /// Height of the layer before, mm.
    last: f64,
    /// Highest so far, mm.
    top: f64,
    /// Where the present layer is announced, until its height is known.
    open: Option<usize>,
}

impl Layers {
    /// Looks at a comment that comes before a stroke; returns whether it took its place.
    pub(super) fn comment(
        &mut self,
        comment: &str,
        stroke: usize,
        between: &mut Vec<(usize, Between)>,
    ) -> bool {
        self.is_told |= comment == "LAYER_CHANGE";
        let is_number = |number: &str| number.trim().parse::<i64>().is_ok();
        if self.is_told || !comment.strip_prefix("LAYER:").is_some_and(is_number) {
            return false;
        }
        self.open = Some(between.len());
        between.push((stroke, Between::Comment(comment.to_owned())));
        true
    }

    /// Material is laid at a height, mm.
    pub(super) fn laid(&mut self, z: f64, between: &mut [(usize, Between)]) {
        let Some(place) = self.open.take() else { return };
        let thickness = z - self.last;
        // Where one part after the other is printed, the next begins at the bed again.
        let height = if thickness > 0.0 { thickness } else { z };
        self.top = self.top.max(z);
        if let Some((_, announced)) = between.get_mut(place) {
            *announced = Between::Layer(Layer { index: self.count, top: self.top, height });
            self.count += 1;
            self.last = z;
        }
    }

    /// Whether the height of the present layer is still to be found out.
    pub(super) fn is_open(&self) -> bool {
        self.open.is_some()
    }

    /// The batch ends: what was not found out stays as it was.
    pub(super) fn give_up(&mut self) {
        self.open = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn told(source: &[(&str, f64)]) -> Vec<String> {
        let (mut layers, mut between) = (Layers::default(), Vec::new());
        for (comment, z) in source {
            layers.comment(comment, 0, &mut between);
            layers.laid(*z, &mut between);
        }
        let text = |(_, between): (usize, Between)| match between {
            Between::Layer(layer) => {
                format!("{} {:.2} {:.2}", layer.index, layer.top, layer.height)
            }
            other => format!("{other:?}"),
        };
        between.into_iter().map(text).collect()
    }

    #[test]
    fn numbers_become_layers_with_a_height() {
        let cura = [("LAYER:-2", 0.3), ("LAYER:-1", 0.5), ("LAYER:0", 0.7), ("LAYER:1", 0.9)];
        assert_eq!(told(&cura), ["0 0.30 0.30", "1 0.50 0.20", "2 0.70 0.20", "3 0.90 0.20"]);
        let one_by_one = [("LAYER:0", 0.3), ("LAYER:1", 0.5), ("LAYER:0", 0.3)];
        assert_eq!(told(&one_by_one), ["0 0.30 0.30", "1 0.50 0.20", "2 0.50 0.30"]);
        assert!(told(&[("LAYER_CHANGE", 0.2), ("LAYER:0", 0.2)]).is_empty());
        assert!(told(&[("LAYER_COUNT:5", 0.2), ("TYPE:FILL", 0.2)]).is_empty());
    }
}

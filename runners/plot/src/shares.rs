//! A table of shares as colours.

use kuva::prelude::{ColorMap, Heatmap, Plot};

use crate::Error;
use crate::curves::layout;

/// The share of every pair of places as a colour: rows are where a step starts, columns where it
/// leads.
#[derive(Clone, Copy, Debug)]
pub struct ShareTable<'a> {
    /// The title, above the table.
    pub title: &'a str,
    /// The names of the places.
    pub names: &'a [String],
    /// A row for every place, with a column for every place and a last one for the source. Negative
    /// shares are drawn as 0.
    pub shares: &'a [Vec<f64>],
}

impl ShareTable<'_> {
    /// The text of an SVG file.
    pub fn svg(&self) -> Result<String, Error> {
        if self.shares.is_empty() {
            return Err(Error::NothingToDraw);
        }
        let percent = |share: &f64| 100.0 * share.max(0.0);
        let rows = self
            .shares
            .iter()
            .rev()
            .map(|row| row.iter().map(percent).collect::<Vec<_>>());
        let heat = Heatmap::new()
            .with_data(rows.collect::<Vec<_>>())
            .with_color_map(ColorMap::Viridis)
            .with_legend("%");
        let plots = vec![Plot::Heatmap(heat)];
        let mut columns = self.names.to_vec();
        columns.push("source".to_owned());
        let layout = layout(&plots, self.title, "into", "from")
            .with_x_categories(columns)
            .with_y_categories(self.names.to_vec())
            .with_x_tick_rotate(-45.0);
        Ok(kuva::render_to_svg(plots, layout))
    }
}

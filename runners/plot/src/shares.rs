//! A table of shares as colours.

use kuva::prelude::{ColorMap, Heatmap, Plot};
use kuva::render::render::render_multiple;

use crate::curves::layout;
use crate::{Error, Figure};

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
    /// The figure.
    ///
    /// # Errors
    /// [`Error::NothingToDraw`]: there are no places.
    pub fn draw(&self) -> Result<Figure, Error> {
        if self.shares.is_empty() {
            return Err(Error::NothingToDraw);
        }
        let percent = |share: &f64| 100.0 * share.max(0.0);
        let row = |row: &Vec<f64>| row.iter().map(percent).collect();
        let rows: Vec<Vec<f64>> = self.shares.iter().rev().map(row).collect();
        let heat = Heatmap::new()
            .with_data(rows)
            .with_color_map(ColorMap::Viridis)
            .with_legend("%");
        let plots = vec![Plot::Heatmap(heat)];
        let columns = [self.names, &["source".to_owned()]].concat();
        let layout = layout(&plots, self.title, "into", "from")
            .with_x_categories(columns)
            .with_y_categories(self.names.to_vec())
            .with_x_tick_rotate(-45.0);
        Ok(render_multiple(plots, layout).into())
    }
}

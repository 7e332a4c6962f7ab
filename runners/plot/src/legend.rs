//! The scale of colours beside a picture.

use kuva::render::color::Color;
use kuva::render::render::TextAnchor;

use crate::page::{Page, Place, width_of};
use crate::scale::{Scale, kelvin, ticks};

/// A scale of colours, its numbers, and what they are of.
pub(crate) struct Legend<'a> {
    pub(crate) scale: Scale,
    pub(crate) title: &'a str,
    /// σ, if temperatures stand beside the numbers.
    pub(crate) stefan_boltzmann: Option<f64>,
    /// The size of the text.
    pub(crate) size: f64,
    /// The height of the picture.
    pub(crate) height: f64,
}

impl Legend<'_> {
    /// The scale beside the panels; returns where it ends.
    pub(crate) fn draw(&self, [left, top]: Place, page: &mut Page) -> f64 {
        let (size, scale) = (self.size, self.scale);
        let (small, bar) = (0.85 * size, 1.2 * size);
        let top = top + 2.2 * size;
        let height = (self.height - 2.2 * size).max(6.0 * size);
        let place = |value: f64| top + (1.0 - scale.part(value)) * height;
        let mut x = left;
        if let Some(sigma) = self.stefan_boltzmann {
            // σT⁴ = u: what a black body at T would send out.
            let [low, high] = [scale.low(), scale.high()].map(|u| kelvin(u, sigma));
            let (mut last, mut own) = (f64::INFINITY, Vec::new());
            // The upper half: the fourth power crowds what is below it.
            for t in ticks(low.max(0.5 * high), high, false) {
                let y = place(sigma * t.powi(4));
                if last - y > 1.1 * small {
                    own.push((y, t.to_string()));
                    last = y;
                }
            }
            let wide = own.iter().map(|(_, label)| width_of(label, small));
            x += wide.fold(width_of("12", small), f64::max) + 0.5 * size;
            for (y, label) in own {
                page.tick([x - 0.3 * size, y], [x, y]);
                let at = [x - 0.45 * size, y + 0.35 * small];
                page.text(&label, at, small, TextAnchor::End);
            }
            let at = [x - 0.45 * size, top - 0.9 * size];
            page.text("K", at, small, TextAnchor::End);
        }
        // As many steps as the eye can tell apart, and each a little into the next.
        let steps = height.ceil();
        for k in (0..steps as u32).map(f64::from) {
            let [from, to] = [k, k + 1.0].map(|k| top + k / steps * height);
            let [r, g, b] = scale.colour(scale.at(1.0 - (k + 0.5) / steps));
            let end = (to + 0.5).min(top + height);
            page.rectangle([[x, from], [x + bar, end]], Color::Rgb(r, g, b), 1.0);
        }
        let beside = x + bar + 0.45 * size;
        page.text(
            self.title,
            [beside, top - 0.9 * size],
            small,
            TextAnchor::Start,
        );
        let mut wide = width_of(self.title, small);
        let values = scale.ticks();
        let step = match values[..] {
            [a, b, ..] => b - a,
            _ => scale.high(),
        };
        let decimals = (-(step * 1.000_001).log10().floor()).clamp(0.0, 9.0) as usize;
        for value in values {
            let label = if value >= 1e6 || (step < 1e-4 && value > 0.0) {
                format!("{value:.1e}")
            } else if scale.is_log() {
                format!("{value}")
            } else {
                format!("{value:.decimals$}")
            };
            let y = place(value);
            page.tick([x + bar, y], [x + bar + 0.3 * size, y]);
            page.text(&label, [beside, y + 0.35 * small], small, TextAnchor::Start);
            wide = wide.max(width_of(&label, small));
        }
        beside + wide
    }
}

//! The scale of colours beside a picture.

use kuva::render::color::Color;
use kuva::render::render::{Primitive, TextAnchor};

use crate::picture::{CHARACTER, text, text_start, tick};
use crate::scale::{Scale, ticks};

/// A scale of colours, its numbers, and what they are of.
pub(crate) struct Legend<'a> {
    pub(crate) scale: Scale,
    pub(crate) title: &'a str,
    /// σ, if temperatures stand beside the numbers.
    pub(crate) stefan_boltzmann: Option<f64>,
    /// The size of the text.
    pub(crate) size: f64,
    /// The height of the picture.
    pub(crate) height: usize,
}

impl Legend<'_> {
    /// The scale beside the panels; returns where it ends.
    pub(crate) fn draw(&self, [left, top]: [f64; 2], out: &mut Vec<Primitive>) -> f64 {
        let size = self.size;
        let small = 0.85 * size;
        let (top, bar) = (top + 2.2 * size, 1.2 * size);
        let height = (self.height as f64 - 2.2 * size).max(6.0 * size);
        let values = self.scale.ticks();
        let decimals = |step: f64| (-step.log10().floor()).clamp(0.0, 9.0) as usize;
        let step = match values.as_slice() {
            [a, b, ..] => b - a,
            _ => self.scale.high(),
        };
        let label = |value: f64| {
            if value >= 1e6 || (step < 1e-4 && value > 0.0) {
                format!("{value:.1e}")
            } else if self.scale.is_log() {
                format!("{value}")
            } else {
                format!("{value:.*}", decimals(step * 1.000_001))
            }
        };
        let mut marks: Vec<(f64, String)> = values.iter().map(|&v| (v, label(v))).collect();
        let mut x = left;
        if let Some(sigma) = self.stefan_boltzmann {
            // σT⁴ = u: what a black body at T would send out.
            let kelvin = |u: f64| (u.max(0.0) / sigma).powf(0.25);
            let (low, high) = (kelvin(self.scale.at(0.0)), kelvin(self.scale.high()));
            let mut last = f64::INFINITY;
            let (mut widest, mut own) = (2, Vec::new());
            // The upper half: the fourth power crowds what is below it.
            for t in ticks(low.max(0.5 * high), high, false) {
                let part = self.scale.part(sigma * t.powi(4));
                let y = top + (1.0 - part) * height;
                if last - y > 1.1 * small {
                    let label = format!("{t}");
                    widest = widest.max(label.len());
                    own.push((y, label));
                    last = y;
                }
            }
            x += CHARACTER * small * widest as f64 + 0.5 * size;
            for (y, label) in own {
                out.push(tick([x - 0.3 * size, y], [x, y]));
                let at = [x - 0.45 * size, y + 0.35 * small];
                out.push(text(&label, at, small, TextAnchor::End));
            }
            let at = [x - 0.45 * size, top - 0.9 * size];
            out.push(text("K", at, small, TextAnchor::End));
        }
        // As many steps as the eye can tell apart, and each a little into the next.
        let steps = height.ceil();
        for k in 0..steps as u32 {
            let [from, to] = [f64::from(k), f64::from(k + 1)].map(|k| top + k / steps * height);
            let value = self.scale.at(1.0 - (f64::from(k) + 0.5) / steps);
            let [r, g, b] = self.scale.colour(value);
            out.push(Primitive::Rect {
                x,
                y: from,
                width: bar,
                height: (to - from + 0.5).min(top + height - from),
                fill: Color::Rgb(r, g, b),
                stroke: None,
                stroke_width: None,
                opacity: None,
            });
        }
        let title = self.title;
        out.push(text_start(
            title,
            [x + bar + 0.45 * size, top - 0.9 * size],
            small,
        ));
        let mut widest = title.chars().count();
        for (value, label) in marks.drain(..) {
            let y = top + (1.0 - self.scale.part(value)) * height;
            out.push(tick([x + bar, y], [x + bar + 0.3 * size, y]));
            widest = widest.max(label.len());
            out.push(text_start(
                &label,
                [x + bar + 0.45 * size, y + 0.35 * small],
                small,
            ));
        }
        x + bar + 0.45 * size + CHARACTER * small * widest as f64
    }
}

//! What two polygons exchange that see each other in part.

use alloc::vec::Vec;

use fredholm_core::Real;
use fredholm_surfaces::space::{Vector, centroid, dot, norm, sub};

use crate::bodies::Body;
use crate::clear::{self, Amount, Sheet};
use crate::clip::keep;
use crate::edges;
use crate::occluders::{Occluder, Occluders};
use crate::points::{Buffers, Points};
use crate::rules::{Rules, area, radius};
use crate::shaft::Shaft;
use crate::silhouette::{Hiding, View};

/// The share of the error that may be of what would be if nothing were between.
const CLEAR: f64 = 1e-3;

/// What contours take in comparison with a point past one screen, measured: in proportion to the number of polygons between for places
/// along their edges, and to its cube for what hides what past them.
const ALONG: f64 = 400.0;
const PAST: f64 = 0.2;

/// The most points of a pair.
const MOST: f64 = 400_000.0;

/// The number of points past so many screens that take as long as contours past so many polygons.
fn points_for(polygons: usize, screens: usize) -> usize {
    let (n, m) = (polygons as f64, screens as f64);
    let contours = n * (ALONG + PAST * n * n);
    (contours / (1.0 + 0.5 * m)).min(MOST) as usize
}

/// What a pair takes, in points past one screen, with so many polygons between: by points if a few reach the error, else by contours.
pub(crate) fn work(polygons: usize, clear: f64, error: f64) -> f64 {
    let n = polygons as f64;
    let points = 4.0 * (1.0 + 2.0 * Real::sqrt(clear / error)) * (1.0 + 0.5 * n);
    points.min(n * (ALONG + PAST * n * n))
}

/// The error that is allowed, in the unit of area, and what is known of the scene.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Wanted<'a> {
    pub(crate) error: f64,
    pub(crate) occluders: &'a Occluders,
    pub(crate) rules: &'a Rules,
}

/// A_1 F_12 of two polygons with these occluders between them, to `error`. The second may be at infinity.
pub(crate) fn exchange(
    (a, b): (Sheet<'_>, Sheet<'_>),
    between: &[&Occluder],
    fronts: bool,
    Wanted {
        error,
        occluders,
        rules,
    }: Wanted<'_>,
    shaft: &Shaft,
    buffers: &mut Buffers,
) -> Amount {
    let size = |s: Sheet<'_>| radius(s.points, centroid(s.points));
    let swap = !b.far && size(b) < size(a);
    let pair = if swap { (b, a) } else { (a, b) };
    let points = Points::new(
        if b.far { pair } else { (pair.1, pair.0) },
        between,
        // The first one sees them from the front, and that is the outer one if they were swapped.
        fronts.then_some(swap),
        occluders,
        rules,
        shaft.slack(),
    );
    let most = points_for(between.len(), points.screens());
    if let Some(amount) = points.exchange(error, most, true, shaft.slack(), buffers) {
        return amount;
    }
    // Bodies in front of both hide what their outlines do.
    let slack = shaft.slack();
    let is_whole = |body: &Body| {
        let is_out = |sheet: Sheet<'_>| body.is_before(sheet, slack);
        body.is_apart(pair.0.points, slack) && is_out(pair.0) && is_out(pair.1)
    };
    let between = between.iter().filter_map(|occluder| {
        let mut points = screen(occluder, pair, slack)?;
        // What is seen from the front is said of the first.
        if swap {
            points.reverse();
        }
        let body = occluder
            .body
            .filter(|_| points.len() == occluder.points.len());
        let body = body.filter(|&body| occluders.body(body).is_some_and(is_whole));
        Some(Hiding { points, body })
    });
    let screens: Vec<Hiding> = between.collect();
    let clear = CLEAR * error;
    let all = clear::exchange(a, b, clear / area(pair.1.points), rules);
    let middle = centroid(a.points);
    let width = if b.far {
        let far = screens.iter().map(|screen| radius(&screen.points, middle));
        far.fold(size(a), Real::max)
    } else {
        size(a) + size(b) + norm(sub(middle, centroid(b.points)))
    };
    let mut view = View::new(pair, &screens, fronts, shaft, width, occluders);
    let mut amount = edges::difference(&mut view, error, rules);
    amount.error += clear + all.error;
    amount.value += all.value;
    // Where contours do not reach it, points may come nearer.
    if amount.error > 10.0 * error
        && let Some(own) = points.exchange(error, MOST as usize / 10, false, shaft.slack(), buffers)
        && own.error < amount.error
    {
        return own;
    }
    // What may be nothing is nothing: most such pairs are hidden from each other by several polygons together.
    if !(amount.value > amount.error) {
        amount.value = 0.0;
    }
    amount
}

/// The part of an occluder that is in front of both polygons.
fn screen(
    occluder: &Occluder,
    pair: (Sheet<'_>, Sheet<'_>),
    slack: f64,
) -> Option<Vec<Vector<f64>>> {
    let mut rest = occluder.points.clone();
    for sheet in [pair.0, pair.1].into_iter().filter(|sheet| !sheet.far) {
        let first = sheet.points.first().copied().unwrap_or_default();
        rest = keep(&rest, |p| dot(sheet.normal, sub(p, first)), slack);
    }
    let size = radius(&rest, rest.first().copied().unwrap_or_default());
    (rest.len() >= 3 && area(&rest) > slack * size).then_some(rest)
}

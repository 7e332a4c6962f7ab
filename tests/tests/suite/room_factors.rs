//! Form factors of rooms against published ones.

use fredholm_factors::room_factors;
use fredholm_tests::room::{Drawing, published, scenes};

fn table(drawing: &Drawing) -> (Vec<f64>, usize, Vec<f64>) {
    let scene = drawing
        .scene::<f64>()
        .unwrap_or_else(|e| panic!("{}: {e}", drawing.name));
    let n = scene.surfaces();
    let lengths = (0..n).map(|s| scene.length(s).unwrap()).collect();
    (room_factors(&scene).unwrap(), n, lengths)
}

fn close(found: f64, expected: f64, allowed: f64) {
    let difference = (found - expected).abs();
    assert!(
        difference <= allowed,
        "{found:.12} for {expected:.12}: {difference:e}"
    );
}

#[test]
fn rows_sum_to_one_and_exchange_is_reciprocal() {
    for drawing in scenes() {
        let (table, n, lengths) = table(&drawing);
        for i in 0..n {
            let sum: f64 = table[i * n..][..n].iter().sum();
            close(sum, 1.0, 1e-12);
            for j in 0..n {
                let [there, back] = [lengths[i] * table[i * n + j], lengths[j] * table[j * n + i]];
                assert!(
                    (there - back).abs() < 1e-12,
                    "{}: {i} {j} {there:.15} {back:.15}",
                    drawing.name
                );
            }
        }
    }
}

#[test]
fn published_tables() {
    for published in published() {
        let (table, n, _) = table(&published.drawing);
        let row = &table[published.row * n..];
        for (found, expected) in row.iter().zip(&published.factors) {
            close(*found, *expected, published.accuracy);
        }
    }
}

/// Howell's catalogue: open scenes of two plates.
#[test]
fn plates_wedge_and_corner() {
    let open = |drawing: Drawing| {
        let drawing = Drawing {
            open: true,
            ..drawing
        };
        table(&drawing).0[1]
    };
    for h in [0.1_f64, 1.0, 3.0] {
        let plates = Drawing::new("plates")
            .line(&[[0.0, 0.0], [1.0, 0.0]], 0.5, 0.0)
            .line(&[[1.0, h], [0.0, h]], 0.5, 0.0);
        close(open(plates), (1.0 + h * h).sqrt() - h, 1e-12);
        let corner = Drawing::new("corner")
            .line(&[[0.0, 0.0], [1.0, 0.0]], 0.5, 0.0)
            .line(&[[0.0, h], [0.0, 0.0]], 0.5, 0.0);
        close(open(corner), 0.5 * (1.0 + h - (1.0 + h * h).sqrt()), 1e-12);
        let alpha = h.min(2.0);
        let wedge = Drawing::new("wedge")
            .line(&[[0.0, 0.0], [1.0, 0.0]], 0.5, 0.0)
            .line(&[[alpha.cos(), alpha.sin()], [0.0, 0.0]], 0.5, 0.0);
        close(open(wedge), 1.0 - (0.5 * alpha).sin(), 1e-12);
    }
}

/// 36 walls round a room with 16 obstacles, 100 surfaces: `cargo test --release` prints the time.
#[test]
fn a_hundred_surfaces() {
    let mut drawing = Drawing::new("a hundred surfaces");
    let corners = [[0.0, 0.0], [9.0, 0.0], [9.0, 9.0], [0.0, 9.0], [0.0, 0.0]];
    for side in corners.windows(2) {
        let at = |k: usize| {
            let t = k as f64 / 9.0;
            [0, 1].map(|c| side[0][c] + t * (side[1][c] - side[0][c]))
        };
        for k in 0..9 {
            drawing = drawing.line(&[at(k), at(k + 1)], 0.5, 0.0);
        }
    }
    for k in 0..16_u32 {
        let [x, y] = [k % 4, k / 4].map(|c| 1.2 + 2.2 * f64::from(c));
        let corner = |q: u32| {
            let angle = f64::from(k) - f64::from(q) * core::f64::consts::FRAC_PI_2;
            [x + 0.5 * angle.cos(), y + 0.5 * angle.sin()]
        };
        for q in 0..4 {
            drawing = drawing.line(&[corner(q), corner((q + 1) % 4)], 0.5, 0.0);
        }
    }
    let start = std::time::Instant::now();
    let (table, n, lengths) = table(&drawing);
    println!("{n} surfaces: {:.3} s", start.elapsed().as_secs_f64());
    assert_eq!(n, 100);
    let mut worst = 0.0_f64;
    for i in 0..n {
        close(table[i * n..][..n].iter().sum::<f64>(), 1.0, 1e-12);
        for j in 0..n {
            let there = lengths[i] * table[i * n + j];
            worst = worst.max((there - lengths[j] * table[j * n + i]).abs());
        }
    }
    println!("exchange there and back differs by {worst:.1e}");
    assert!(worst < 1e-12);
}

//! Times.
use fredholm_scene::*;
use std::time::Instant;
fn cube(m: usize) -> Vec<Vec<Polygon>> {
    let cut = |s: shapes::Shape, n: usize| -> Vec<Vec<Polygon>> {
        s.surfaces
            .iter()
            .map(|s| {
                s.iter()
                    .flat_map(|p| match p {
                        Polygon::Quad(c) => shapes::grid(*c, n),
                        _ => vec![*p],
                    })
                    .collect()
            })
            .collect()
    };
    let mut all = cut(shapes::room([0.0; 3], [1.0; 3]), m);
    all.extend(cut(shapes::block([0.25; 3], [0.75; 3]), m / 2));
    all
}
fn main() {
    for arg in std::env::args().skip(1) {
        let (m, e) = arg.split_once(':').unwrap();
        let s = cube(m.parse().unwrap());
        let surfaces: Vec<_> = s
            .iter()
            .map(|p| Surface {
                polygons: p,
                materials: &[Material::BLACK],
            })
            .collect();
        let t = Instant::now();
        let scene = Scene::new::<f64>(&surfaces, Enclosure::Closed).unwrap();
        let build = t.elapsed();
        let t = Instant::now();
        let f = factors(&scene, e.parse().unwrap()).unwrap();
        let sums = f.row_sums();
        let worst = sums.iter().map(|s| (s - 1.0).abs()).fold(0.0, f64::max);
        println!(
            "{} faces, build {:?}, factors {:?}, pairs {}, partial {}, row sums {worst:e}, estimated {:e}",
            scene.faces().len(),
            build,
            t.elapsed(),
            f.pairs(),
            f.partial(),
            f.error()
        );
    }
}

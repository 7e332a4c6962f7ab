//! What neighbour equations gain in four rooms, with pairs of cells and with rays in their place: nanoseconds a state of plain
//! walks, microseconds a walk, standard deviations, and √(variance × time), of the mean over all walls.
//!
//! `cargo run --release -p fredholm-room --features alloc --example room_gain -- SCENES UNKNOWNS DEGREES GRADINGS`, each one or more
//! values with commas: `furnished,doorway,furnace,facet 100,1000,5000 0,2,4 3`. The grading of a degree is called `default`.
//!
//! Times are those of the processor where Linux tells them, the least of a few runs.

use std::time::Instant;

use fredholm_core::{Batch, Goal, Goals, Job, Neighbour, NoNeighbour, WalkOptions};
use fredholm_room::{
    Choice, CoarseSolution, Enclosure, Grading, Material, Matrix, MeanOver, Mesh, Point, RaySetup,
    Room, RoomPairs, Scene, Shadows, Surface, Tables, VisibilityTable, min_mass_ratio,
};

type Failed = Box<dyn core::error::Error>;

/// Walks of which √Var is taken.
const WALKS: u64 = 40_000;
/// The most unknowns with pairs, whose tables grow like their square.
const MOST_WITH_PAIRS: usize = 6000;
/// The unknowns of the solution from which v follows without pairs.
const COARSE: usize = 1000;
/// Runs that are timed, and seconds of one.
const RUNS: u64 = 3;
const SECONDS: f64 = 0.1;

/// Vertices, reflectance, emission.
type Line = (Vec<[f64; 2]>, f64, f64);

/// The rooms of the files in `examples/`.
fn lines(name: &str) -> Result<Vec<Line>, Failed> {
    let both = |a, b, rho| [(vec![a, b], rho, 0.0), (vec![b, a], rho, 0.0)];
    Ok(match name {
        "furnished" => {
            let outline = vec![[0.0, 0.0], [3.4, 0.0], [3.4, 1.8], [4.0, 1.8], [4.0, 2.5]];
            let table = vec![[1.2, 0.7], [1.2, 0.75], [2.2, 0.75], [2.2, 0.7], [1.2, 0.7]];
            let seat = vec![
                [2.6, 0.4],
                [2.55, 0.43],
                [2.6, 0.46],
                [3.0, 0.46],
                [3.0, 0.4],
                [2.6, 0.4],
            ];
            let mut lines = vec![
                (outline, 0.5, 0.0),
                (vec![[4.0, 2.5], [2.4, 2.5]], 0.7, 0.0),
                (vec![[2.4, 2.5], [1.6, 2.5]], 0.1, 1.0),
                (vec![[1.6, 2.5], [0.0, 2.5]], 0.7, 0.0),
                (vec![[0.0, 2.5], [0.0, 0.0]], 0.6, 0.0),
                (table, 0.3, 0.0),
                (seat, 0.4, 0.0),
            ];
            lines.extend(both([0.3, 0.2], [0.7, 1.3], 0.5));
            lines.extend(both([0.0, 1.9], [0.35, 2.0], 0.2));
            lines
        }
        "doorway" => {
            let mut lines = vec![
                (vec![[0.0, 0.0], [1.9, 0.0]], 0.6, 0.0),
                (
                    vec![[2.1, 0.0], [4.0, 0.0], [4.0, 2.0], [0.0, 2.0]],
                    0.6,
                    0.0,
                ),
                (vec![[0.0, 2.0], [0.0, 0.0]], 0.4, 1.0),
                (
                    vec![[1.9, 0.0], [1.9, 0.7], [2.1, 0.7], [2.1, 0.0]],
                    0.5,
                    0.0,
                ),
            ];
            lines.extend(both([2.0, 1.2], [2.0, 2.0], 0.5));
            lines
        }
        "furnace" => {
            let mut lines = vec![
                (vec![[0.0, 0.0], [3.0, 0.0]], 0.2, 1.0),
                (vec![[3.0, 0.0], [3.0, 1.2]], 0.4, 0.3),
                (vec![[3.0, 1.2], [1.5, 1.8], [0.0, 1.2]], 0.4, 0.2),
                (vec![[0.0, 1.2], [0.0, 0.0]], 0.4, 0.3),
            ];
            for x in [0.7, 1.8] {
                let billet = vec![[x, 0.5], [x, 0.9], [x + 0.4, 0.9], [x + 0.4, 0.5], [x, 0.5]];
                lines.push((billet, 0.1, 0.05));
            }
            lines
        }
        // FACET (UCID-19887, 1983): the unit square with two baffles.
        "facet" => {
            let points = [
                [0.0, 0.0],
                [0.0, 0.5],
                [0.4, 0.5],
                [0.0, 1.0],
                [1.0, 1.0],
                [1.0, 0.5],
                [0.6, 0.5],
                [1.0, 0.0],
                [0.65, 0.0],
                [0.35, 0.0],
            ];
            let surfaces = [
                [2, 1],
                [3, 2],
                [2, 3],
                [4, 2],
                [5, 4],
                [6, 5],
                [7, 6],
                [6, 7],
                [8, 6],
                [9, 8],
                [10, 9],
                [1, 10],
            ];
            let line = |(s, [a, b]): (usize, [usize; 2])| {
                let emission = if s == 4 { 1.0 } else { 0.0 };
                (
                    vec![points[a - 1], points[b - 1]],
                    0.2 + 0.05 * s as f64,
                    emission,
                )
            };
            surfaces.into_iter().enumerate().map(line).collect()
        }
        _ => return Err("the scenes are furnished, doorway, furnace and facet".into()),
    })
}

fn scene(name: &str) -> Result<Scene, Failed> {
    let lines = lines(name)?;
    let materials: Vec<[Material; 1]> = lines
        .iter()
        .map(|&(_, reflectance, emission)| {
            [Material {
                reflectance,
                emission,
            }]
        })
        .collect();
    let surfaces: Vec<Surface<'_>> = lines
        .iter()
        .zip(&materials)
        .map(|((points, ..), materials)| Surface { points, materials })
        .collect();
    Ok(Scene::new::<f64>(&surfaces, Enclosure::Closed)?)
}

/// Seconds that this thread took of a processor; those of a clock where the system does not tell.
fn seconds(start: Instant) -> f64 {
    let told = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
    let nanoseconds = told.and_then(|text| text.split(' ').next()?.parse::<f64>().ok());
    nanoseconds.map_or_else(|| start.elapsed().as_secs_f64(), |ns| 1e-9 * ns)
}

/// A neighbour equation of any kind.
type AnyNeighbour<'a> = dyn Neighbour<Scalar = f64, Point = Point<f64>, Value = f64> + Sync + 'a;

/// The room of one line of arguments.
struct Case<'c, 'a> {
    name: &'c str,
    /// The degree, the unknowns and the grading.
    head: String,
    room: &'c Room<'a, f64>,
    start: Instant,
}

impl Case<'_, '_> {
    /// Walks of the mean over all walls: a line of the table.
    fn measure(
        &self,
        pairs: &str,
        neighbour: &AnyNeighbour<'_>,
        v: Option<&[f64]>,
        set_up: f64,
    ) -> Result<(), Failed> {
        let mean = MeanOver::everything(self.room);
        let value = v.map_or(0.0, |v| mean.of(v));
        let goals = [Goal::new(mean, Some(value))];
        let job = Goals::new(self.room, neighbour, &goals, WalkOptions::default());
        let timed = |walks: u64| {
            let before = seconds(self.start);
            let mut batch = Batch::new(0, walks, walks);
            job.run(0, core::slice::from_mut(&mut batch), u64::MAX)?;
            Ok::<_, Failed>((*batch.statistics(), seconds(self.start) - before))
        };
        let (statistics, first) = timed(WALKS)?;
        let (mut walk, mut state) = (f64::INFINITY, f64::INFINITY);
        let walks = (SECONDS / first.max(1e-4) * WALKS as f64).max(100.0) as u64;
        for _ in 0..RUNS {
            let (statistics, own) = timed(walks)?;
            walk = walk.min(own / walks as f64);
            state = state.min(own / statistics.states() as f64);
        }
        let [plain, best] = [statistics.plain(), statistics.preconditioned()]
            .map(|estimate| estimate.std_dev.unwrap_or(f64::NAN));
        let (state, own) = (1e9 * state, 1e6 * walk);
        println!(
            "{:9} {} {pairs:10} {state:6.1} ns/state {own:7.3} µs/walk √Var {best:.3e}, {:8.1} below plain, \
             {:.3e} in a second; set-up {set_up:.2} s",
            self.name,
            self.head,
            plain / best,
            best * walk.sqrt()
        );
        Ok(())
    }
}

/// Prints a line for every neighbour equation of B functions on a cell.
fn degree<const B: usize>(
    name: &str,
    unknowns: usize,
    exponent: Option<f64>,
) -> Result<(), Failed> {
    let scene = scene(name)?;
    let mut grading = Grading::of_degree(B - 1);
    grading.exponent = exponent.unwrap_or(grading.exponent);
    let mesh = Mesh::new::<f64>(&scene, unknowns / B, grading)?;
    let start = Instant::now();
    let timed = |since: f64| seconds(start) - since;
    let begin = seconds(start);
    let matrix = (unknowns <= MOST_WITH_PAIRS)
        .then(|| Matrix::with_functions(&scene, &mesh, min_mass_ratio(B - 1), B))
        .transpose()?;
    let matrix_time = timed(begin);
    let tables = Tables::<f64>::new(&scene, &mesh);
    let views = matrix
        .as_ref()
        .map_or(VisibilityTable::none(), Matrix::views);
    let room = &tables.room(views);
    let case = Case {
        name,
        head: format!("{} {:7} {:4}", B - 1, mesh.len() * B, grading.exponent),
        room,
        start,
    };
    case.measure("plain", &NoNeighbour::new(room), None, 0.0)?;
    let begin = seconds(start);
    let coarse = CoarseSolution::new(&scene, COARSE)?;
    let mut from_few = vec![0.0; mesh.len() * B];
    for (cell, own) in from_few.chunks_exact_mut(B).enumerate() {
        coarse.step::<_, B>(room, cell, own);
    }
    let few_time = timed(begin);
    if let Some(matrix) = &matrix {
        let begin = seconds(start);
        let mut solution = matrix.solve(&scene, &mesh, 1e-14, 1000)?;
        let mut set_up = matrix_time + timed(begin);
        // As the program does.
        if B > 2 {
            solution.v.clone_from(&from_few);
            set_up = matrix_time + few_time;
        }
        let coefficients = matrix.coefficients();
        for choice in [Choice::Default, Choice::Pointwise] {
            let vectors = solution.for_walks(&coefficients, RoomPairs { views, choice })?;
            let neighbour = vectors.with_pointwise::<_, _, B>(room, &coefficients)?;
            let pairs = format!("{choice:?}").to_lowercase();
            case.measure(&pairs, &neighbour, Some(&solution.v), set_up)?;
        }
    }
    let begin = seconds(start);
    let shadows = Shadows::new(&scene);
    let setup = RaySetup::<_, B>::new(room, &from_few)?.with_shadows(&shadows);
    let rays = setup.tables()?;
    let set_up = few_time + timed(begin);
    let neighbour = rays.neighbour::<_, B>(room, &from_few)?;
    case.measure("rays", &neighbour, Some(&from_few), set_up)
}

fn main() -> Result<(), Failed> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [scenes, unknowns, degrees, gradings] = arguments.as_slice() else {
        return Err("give scenes, numbers of unknowns, degrees and gradings".into());
    };
    for name in scenes.split(',') {
        for degree in degrees.split(',') {
            for grading in gradings.split(',') {
                for unknowns in unknowns.split(',') {
                    let (unknowns, grading) = (unknowns.parse()?, grading.parse().ok());
                    match degree {
                        "0" => self::degree::<1>(name, unknowns, grading)?,
                        "1" => self::degree::<2>(name, unknowns, grading)?,
                        "2" => self::degree::<3>(name, unknowns, grading)?,
                        "3" => self::degree::<4>(name, unknowns, grading)?,
                        "4" => self::degree::<5>(name, unknowns, grading)?,
                        _ => return Err("degrees go from 0 to 4".into()),
                    }
                }
            }
        }
    }
    // The most memory that it ever had, where Linux tells it.
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let most = status.lines().find(|line| line.starts_with("VmHWM"));
    if let Some(most) = most {
        println!("{most}");
    }
    Ok(())
}

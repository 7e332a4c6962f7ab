//! Files of solved systems.

use std::path::Path;
use std::sync::LazyLock;

use fredholm::circle::{Emission, Harmonic};
use fredholm::model::{Request, Wanted};
use fredholm::room::{Material, Surfaces};
use fredholm::sphere::Parameters;
use fredholm::systems::SavedSystem;
use fredholm::{
    CircleModel, CubeModel, Goal, Model, RoomModel, Scalar, Settings, SphereModel, System,
};
use fredholm_core::Batch;
use fredholm_file::parts::SystemContent;

use crate::container::mended;
use crate::memory::Bound;

/// What reading takes: the smallest named values become two texts each, in lists that grow to twice their size.
const MEMORY: Bound = Bound {
    each: 128,
    besides: 64 << 10,
};

/// An equation of every kind, and its cells.
static MODELS: LazyLock<Vec<(Box<dyn Model>, Settings)>> = LazyLock::new(|| {
    let wave = Harmonic {
        constant: 5.0,
        amplitude: 1.0,
        frequency: 5,
    };
    let wall = Material {
        reflectance: 0.5,
        emission: 1.0,
    };
    let haze = Parameters {
        albedo: 0.7,
        asymmetry: 0.2,
        emission: [1.0, 0.3, 0.2, 0.1],
        forward: 0.0,
    };
    let square = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0], [0.0, 0.0]];
    let room = RoomModel::new(Surfaces::default().with("all", &square, wall), Scalar::F64);
    let factor = |_: usize, x: f64, y: f64| 0.5 + 0.1 * x * y;
    let models: [(Box<dyn Model>, usize, usize); 5] = [
        (
            Box::new(CircleModel::new(vec![0.5], Emission::Harmonic(wave))),
            4,
            1,
        ),
        (
            Box::new(CubeModel::from_fn::<1>(|x, y| 0.5 * x[0] * y[0], |x| x[0])),
            3,
            0,
        ),
        (
            Box::new(CubeModel::from_factors::<2>(factor, |x| x[0])),
            2,
            1,
        ),
        (Box::new(room.expect("a square is a room")), 4, 0),
        (Box::new(SphereModel::new(haze)), 2, 0),
    ];
    let with = |(model, cells, degree)| {
        let settings = Settings {
            cells: Some(cells),
            degree: Some(degree),
            ..Settings::default()
        };
        (model, settings)
    };
    models.into_iter().map(with).collect()
});

/// A model of every kind of system, with its settings.
#[must_use]
pub fn models() -> &'static [(Box<dyn Model>, Settings)] {
    &MODELS
}

/// A good file of every kind of system.
///
/// # Panics
/// Never: these systems are solved.
#[must_use]
pub fn good_systems() -> Vec<Vec<u8>> {
    let file = |(model, settings): &(Box<dyn Model>, Settings)| {
        let cells = model
            .partition(&settings.discretisation())
            .expect("few cells");
        let system = cells.solve().expect("a solution");
        let content = SystemContent {
            of: vec![("kind".to_owned(), model.about().kind.to_owned())],
            saved: system.saved().expect("numbers"),
        };
        let mut bytes = Vec::new();
        content.write(&mut bytes).expect("room for some bytes");
        bytes
    };
    MODELS.iter().map(file).collect()
}

/// Reads a file of a solved system, and makes the system of it, of every kind that it fits.
///
/// # Panics
/// If that takes more memory than it may, if a refusal does not name the file, if what is read is written otherwise, or if
/// walks that follow such a system do more than fail.
pub fn system(bytes: &[u8]) {
    let path = Path::new("a.system");
    match MEMORY.holds(bytes.len(), || SystemContent::read(path, bytes)) {
        Err(error) => {
            let text = error.to_string();
            assert!(
                text.starts_with("a.system: ") && !text.contains(char::is_control),
                "{text:?}"
            );
        }
        Ok(content) => {
            let mut written = Vec::new();
            // Numbers that are none are not written.
            if content.write(&mut written).is_ok() && is_finite(&content.saved) {
                let again = SystemContent::read(path, &written).expect("it was written");
                assert_eq!(again.of, content.of);
                assert_eq!(numbers(&again.saved), numbers(&content.saved));
            }
            for model in MODELS.iter() {
                restore(model, &content.saved);
            }
        }
    }
}

/// Makes the system of a model's cells of these numbers, and walks once.
fn restore((model, settings): &(Box<dyn Model>, Settings), saved: &SavedSystem<'_>) {
    let cells = model
        .partition(&settings.discretisation())
        .expect("few cells");
    let Ok(system) = cells.restore(saved.clone()) else {
        return;
    };
    let again = system.saved().expect("numbers");
    assert_eq!(numbers(&again), numbers(saved));
    walk(&**model, settings, &*system);
}

fn walk(model: &dyn Model, settings: &Settings, system: &dyn System) {
    let goals = [Goal::new("mean", model.whole())];
    let request = Request {
        goals: &goals,
        walk: &settings.walk_options(),
        wanted: Wanted::U,
    };
    // Numbers of any size may overflow: that is an error of the walk.
    let _ = system.job(&request, &mut |prepared| {
        let mut batch = [Batch::new(0, 1, 1)];
        let _ = prepared.job.run(0, &mut batch, 1);
        Ok(())
    });
}

fn is_finite(saved: &SavedSystem<'_>) -> bool {
    saved.solution.convergence.residual.is_finite() && saved.solution.radius_bound.is_finite()
}

/// All numbers, as bits.
fn numbers(saved: &SavedSystem<'_>) -> (Vec<u64>, Vec<u64>, u32, [u64; 2]) {
    let bits = |numbers: &[f64]| numbers.iter().map(|x| x.to_bits()).collect();
    let solution = &saved.solution;
    let (convergence, bound) = (solution.convergence, solution.radius_bound);
    (
        bits(&solution.v),
        bits(&saved.coefficients),
        convergence.sweeps,
        [convergence.residual.to_bits(), bound.to_bits()],
    )
}

/// As [`system`], with the checksum and the length of the head mended, so that what is behind them is met.
///
/// # Panics
/// As [`system`].
pub fn system_with_checksum(bytes: &[u8]) {
    // The head ends with the first bracket that does, if there is one.
    let end = |head: &[u8]| head.windows(2).position(|two| two == b"]}");
    if let Some(mended) = mended(bytes, b"fredholm system 2      \n", end) {
        system(&mended);
    }
}

/// The numbers of a good system of every kind.
static GOOD: LazyLock<Vec<SavedSystem<'static>>> = LazyLock::new(|| {
    let owned = |bytes: Vec<u8>| {
        let content = SystemContent::read(Path::new("good"), &bytes).expect("a good system");
        content.saved.into_owned()
    };
    good_systems().into_iter().map(owned).collect()
});

/// Makes a system of good numbers that the bytes change, behind one that says of which kind, and walks once.
///
/// # Panics
/// If the walk does more than fail.
pub fn system_of_numbers(bytes: &[u8]) {
    let Some((&kind, changes)) = bytes.split_first() else {
        return;
    };
    let kind = usize::from(kind) % MODELS.len();
    let mut saved = GOOD[kind].clone();
    let mut changes = changes.iter().copied();
    let solution = saved.solution.to_mut();
    let bound = core::iter::once(&mut solution.radius_bound);
    let numbers = bound
        .chain(&mut solution.v)
        .chain(saved.coefficients.to_mut());
    for number in numbers {
        let bits = [(); 8].map(|()| changes.next().unwrap_or(0));
        *number = f64::from_bits(number.to_bits() ^ u64::from_be_bytes(bits));
    }
    restore(&MODELS[kind], &saved);
}

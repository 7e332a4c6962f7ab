//! What every kind of equation can do: the matrix of capabilities and kinds, tried out and printed. An empty cell has a reason of
//! mathematics, or it is counted.

use fredholm::channels::{ChannelModels, ChannelNames, Colours};
use fredholm::circle::Emission;
use fredholm::room::{Material, Surfaces};
use fredholm::scene::{Enclosure, NamedSurface, shapes};
use fredholm::sphere::Parameters;
use fredholm::tube::Parameters as TubeParameters;
use fredholm::{
    CircleModel, CubeModel, CustomModel, Method, Model, Pairs, Region, RoomModel, Scalar,
    SceneModel, Sequence, Solver, SphereModel, TubeModel,
};

use crate::common::Line;

/// A kind, by its name, and an equation of it in two channels.
struct Kind {
    name: &'static str,
    model: Box<dyn Model>,
    channels: Box<dyn Model>,
}

/// A kind whose channels are equations of their own.
fn kind<M: Model + 'static>(name: &'static str, model: impl Fn() -> M) -> Kind {
    let channels = ChannelModels::new(["a", "b"], [model(), model()]).unwrap();
    Kind {
        name,
        model: Box::new(model()),
        channels: Box::new(channels),
    }
}

fn kinds() -> [Kind; 7] {
    let own = Line::new(|x: f64, y: f64| 0.5 * x * y, |x: f64| x, 1);
    let wall = |reflectance, emission| Material {
        reflectance,
        emission,
    };
    let room = Surfaces::default()
        .with("floor", &[[0.0, 0.0], [2.0, 0.0]], wall(0.5, 0.0))
        .with("right", &[[2.0, 0.0], [2.0, 1.0]], wall(0.2, 1.0))
        .with("ceiling", &[[2.0, 1.0], [0.0, 1.0]], wall(0.7, 0.0))
        .with("left", &[[0.0, 1.0], [0.0, 0.0]], wall(0.3, 0.0));
    let two = || ChannelNames::new(["a", "b"].map(str::to_owned).to_vec());
    let walls = [[0.5, 0.0], [0.2, 1.0], [0.7, 0.0], [0.3, 0.0]];
    let colours = Colours {
        names: two(),
        materials: walls
            .map(|[own, light]| vec![vec![wall(own, light); 2]])
            .to_vec(),
    };
    let room = || RoomModel::new(room.clone(), Scalar::F64).unwrap();
    let rooms = Kind {
        name: "room",
        model: Box::new(room()),
        channels: Box::new(room().with_colours(colours).unwrap()),
    };
    let names = ["floor", "ceiling", "front", "back", "left", "right"];
    let polygons = shapes::room([0.0; 3], [2.0, 1.0, 1.0]).surfaces;
    let light = |name| if name == "ceiling" { 1.0 } else { 0.0 };
    let surfaces = polygons.into_iter().zip(names);
    let surfaces: Vec<NamedSurface> = surfaces
        .map(|(polygons, name)| NamedSurface {
            name: name.to_owned(),
            polygons,
            material: wall(0.5, light(name)),
        })
        .collect();
    let colours = Colours {
        names: two(),
        materials: names
            .map(|name| vec![vec![wall(0.5, light(name)); 2]])
            .to_vec(),
    };
    let scene = || SceneModel::new(surfaces.clone(), Enclosure::Closed, Scalar::F64).unwrap();
    let scenes = Kind {
        name: "scene",
        model: Box::new(scene()),
        channels: Box::new(scene().with_colours(colours).unwrap()),
    };
    let sphere = Parameters {
        albedo: 0.6,
        asymmetry: 0.3,
        emission: [1.0, 0.2, 0.1, 0.5],
        forward: 0.2,
    };
    let tube = TubeParameters {
        length: 2.0,
        reflectance: 0.8,
        emission: 0.0,
        ends: [1.0, 0.0],
    };
    [
        kind("circle", || {
            CircleModel::new(vec![0.3, 0.7], Emission::Arcs(vec![1.0, 0.0]))
        }),
        kind("cube", || {
            CubeModel::on_interval([0.0, 1.0], |x, y| 0.5 * x * y, |x| x)
        }),
        rooms,
        scenes,
        kind("sphere", move || SphereModel::new(sphere)),
        kind("tube", move || TubeModel::new(tube)),
        kind("own", move || CustomModel::from_kernel(own.clone())),
    ]
}

/// Whether a solver does what is asked.
type Does = fn(&dyn Model) -> bool;

/// A model whose cells are few, of degree 0, with the mean as a goal.
fn open(model: &dyn Model) -> Solver<'_> {
    let solver = Solver::new(model).mean();
    solver.cells(cells(model)).degree(0).walks(500)
}

/// A model of which nothing is left to be chosen by pilots.
fn few(model: &dyn Model) -> Solver<'_> {
    open(model).pairs(Pairs::Default)
}

/// Few cells, but not the fewest.
fn cells(model: &dyn Model) -> usize {
    let settings = fredholm::Settings::default().discretisation();
    let cells = model.levels(&settings).into_iter().nth(1);
    cells.unwrap_or(24)
}

/// A point: the middle one of a spread of points or, where a kind has none, one of the floor.
fn point(model: &dyn Model) -> Region {
    let all = model.spread(9.0);
    let floor = Region::Spot(0, [0.5, 0.3, 0.0]);
    all.get(all.len() / 2).cloned().unwrap_or(floor)
}

const CAPABILITIES: [(&str, Does); 21] = [
    ("means", |model| few(model).solve().is_ok()),
    ("points", |model| {
        few(model).goal("u", point(model)).solve().is_ok()
    }),
    ("single precision", |model| {
        few(model).scalar(Scalar::F32).solve().is_ok()
    }),
    ("degrees above 0", |model| {
        few(model).degree(1).solve().is_ok()
    }),
    ("choice of what is open", |model| {
        Solver::new(model).mean().solve_to(1e-2).is_ok()
    }),
    ("global estimate of means", |model| {
        few(model).whole().is_ok()
    }),
    ("global estimate of points", |model| {
        let values = few(model).method(Method::Walks);
        values
            .whole()
            .is_ok_and(|whole| whole.functional(&point(model)).is_ok())
    }),
    ("bands", |model| {
        let whole = few(model).whole();
        whole.is_ok_and(|whole| whole.summary().largest_std_error.is_some())
    }),
    ("predicted variances", |model| {
        few(model).method(Method::Walks).diagnose_in(100).is_ok()
    }),
    ("sweeps", |model| {
        let settings = fredholm::Settings::default().discretisation();
        let levels: Vec<usize> = model.levels(&settings).into_iter().take(2).collect();
        few(model).sweep(&levels, 500).is_ok()
    }),
    ("constant absorption", |model| {
        few(model).absorption(0.2).solve().is_ok()
    }),
    ("the paper's method", |model| {
        open(model).method(Method::Paper).solve().is_ok()
    }),
    ("all pairs pointwise", |model| {
        few(model)
            .method(Method::Walks)
            .pairs(Pairs::Pointwise)
            .solve()
            .is_ok()
    }),
    ("Sobol' points", |model| {
        few(model).sequence(Sequence::Sobol).solve().is_ok()
    }),
    (CHANNELS, |model| {
        let report = few(model).solve();
        report.is_ok_and(|report| report.goals.len() == model.channels().len())
    }),
    ("adjoint", |model| few(model).adjoint(true).solve().is_ok()),
    ("last step", |model| {
        few(model).last_step(true).solve().is_ok()
    }),
    ("lift", |model| open(model).lift(2).solve().is_ok()),
    ("saved systems", |model| {
        let cut = fredholm::Settings::default().discretisation();
        let system = model
            .partition(&cut.on(cells(model)))
            .and_then(|cut| cut.solve());
        system.is_ok_and(|system| system.saved().is_some())
    }),
    ("device tables", |model| {
        let cut = fredholm::Settings::default().discretisation();
        let system = model
            .partition(&cut.on(cells(model)))
            .and_then(|cut| cut.solve());
        system.is_ok_and(|system| system.tables(Pairs::Default).is_ok())
    }),
    ("resolvent walks", |model| {
        Solver::new(model)
            .mean()
            .method(Method::Resolvent)
            .solve_to(1e-2)
            .is_ok()
    }),
];

/// The capability that equations in several channels are asked for.
const CHANNELS: &str = "channels";

/// Why a cell is empty: capability, kind, reason.
const REASONS: [(&str, &str, &str); 20] = [
    (
        "single precision",
        "own",
        "its owner gives it, by `with_f32`",
    ),
    ("degrees above 0", "sphere", MOMENTS),
    (
        "degrees above 0",
        "tube",
        "closed forms of ∫ p ψ ψ lose their digits in small cells; resolvent walks need none",
    ),
    ("global estimate of points", "scene", SEEN),
    (
        "the paper's method",
        "scene",
        "it takes exact factors behind obstacles as the moments of pairs",
    ),
    ("all pairs pointwise", "cube", INTEGRALS),
    ("all pairs pointwise", "sphere", INTEGRALS),
    ("all pairs pointwise", "own", INTEGRALS),
    ("Sobol' points", "room", SEEN),
    ("Sobol' points", "scene", SEEN),
    (
        "last step",
        "cube",
        "F is a function all over the space; resolvent walks take its points where it is large",
    ),
    ("last step", "sphere", "all of the sphere emits, smoothly"),
    (
        "last step",
        "tube",
        "its lights are its ends, whose part of every state is in F in closed form",
    ),
    (
        "last step",
        "own",
        "its owner says where its light is, by `with_lights`",
    ),
    ("lift", "room", SEEN),
    (
        "lift",
        "sphere",
        "parameters of cells have square roots at the poles, so that no rule over cells is exact up to rounding",
    ),
    ("lift", "scene", SEEN),
    (
        "device tables",
        "circle",
        "a device computes its closed forms by itself",
    ),
    (
        "resolvent walks",
        "room",
        "K jumps where walls hide each other, and rays follow these jumps",
    ),
    (
        "resolvent walks",
        "scene",
        "K jumps where walls hide each other, and rays follow these jumps",
    ),
];
const MOMENTS: &str = "∫ p ψ ψ has no closed form there; resolvent walks need none";
const SEEN: &str = "what a point sees jumps from place to place, so that no rule over cells is exact and no sequence gains";
const INTEGRALS: &str = "∫ K over a cell has no closed form";

#[test]
fn every_kind_has_every_capability() {
    let kinds = kinds();
    let head: Vec<&str> = kinds.iter().map(|kind| kind.name).collect();
    println!("{:28}{}", "", head.map_row());
    let mut empty = Vec::new();
    for (capability, does) in CAPABILITIES {
        let of = |kind: &Kind| match capability {
            CHANNELS => does(&*kind.channels),
            _ => does(&*kind.model),
        };
        let row: Vec<bool> = kinds.iter().map(of).collect();
        let marks: Vec<&str> = row.iter().map(|has| if *has { "x" } else { "-" }).collect();
        println!("{capability:28}{}", marks.map_row());
        let missing = kinds.iter().zip(&row).filter(|(_, has)| !**has);
        empty.extend(missing.map(|(kind, _)| (capability, kind.name)));
    }
    for (capability, kind) in &empty {
        let reason = REASONS
            .iter()
            .find(|reason| (&reason.0, &reason.1) == (capability, kind));
        println!(
            "{kind}, {capability}: {}",
            reason.map_or("?", |reason| reason.2)
        );
    }
    assert!(empty.len() <= 20, "{} cells are empty", empty.len());
    let unexplained: Vec<_> = empty
        .iter()
        .filter(|cell| !REASONS.iter().any(|reason| (reason.0, reason.1) == **cell))
        .collect();
    assert!(unexplained.is_empty(), "{unexplained:?}");
    // No reason is of a cell that is not empty.
    assert_eq!(empty.len(), REASONS.len());
}

/// Words of a row, in columns.
trait Row {
    fn map_row(&self) -> String;
}

impl Row for Vec<&str> {
    fn map_row(&self) -> String {
        self.iter().map(|word| format!("{word:>8}")).collect()
    }
}

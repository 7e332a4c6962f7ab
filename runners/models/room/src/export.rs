//! The tables of a room for a device.

use core::fmt::Debug;

use fredholm_core::Real;
use fredholm_embedded::{Number, TableBuilder};
use fredholm_room::{Choice, RayControl, Scene, Share};

use super::system::Setup;
use fredholm_model::Error;
use fredholm_model::device::{PairRule, add_dense, bytes};

/// The tables of a room.
pub(super) fn room<F: Real + Number>(
    setup: &Setup<'_, F>,
    scene: &Scene,
) -> Result<TableBuilder, Error> {
    let mut tables = TableBuilder::new("room");
    let geometry = setup.tables.geometry();
    tables.numbers("absorb", &[setup.absorption]);
    tables.numbers("open", &[u32::from(geometry.is_open())]);
    add::<F, _>(&mut tables, ["walls", "Wall"], geometry.walls(), |wall| {
        [
            bytes(wall.ends.as_flattened()),
            bytes(&wall.vertices),
            bytes(&wall.tangent),
            bytes(&[wall.length, wall.reflectance, wall.emission]),
        ]
        .concat()
    });
    add::<F, _>(
        &mut tables,
        ["strips", "Strip"],
        geometry.strips(),
        |strip| {
            let numbers = [strip.vertices, strip.walls];
            [
                bytes(strip.places.as_flattened()),
                bytes(numbers.as_flattened()),
            ]
            .concat()
        },
    );
    add::<F, _>(&mut tables, ["nodes", "Node"], geometry.nodes(), |node| {
        let [low, high] = node.links;
        let numbers = [node.first, node.count, low, high];
        [bytes(&node.centre), bytes(&node.half), bytes(&numbers)].concat()
    });
    let (edges, walls, first) = setup.tables.cells().tables();
    add::<F, _>(&mut tables, ["edges", "Edge"], edges, |edge| {
        [bytes(&[edge.along]), bytes(&edge.position)].concat()
    });
    tables.numbers("cells", walls);
    tables.numbers("first", first);
    tables.numbers("lengths", setup.tables.lengths());
    let mut surfaces = vec![0];
    for surface in 0..scene.surfaces() {
        let walls = scene.walls_of(surface)?;
        surfaces.push(walls.end as u32);
    }
    tables.numbers("surfaces", &surfaces);
    if let Some(rays) = &setup.rays {
        tables.numbers("degree", &[setup.system.cut.cut.degree as u32]);
        tables.numbers("v", &setup.v);
        add_rays(&mut tables, &rays.control());
        PairRule::Rays.add_to(&mut tables);
        return Ok(tables);
    }
    let matrix = setup.system.matrix()?;
    tables.numbers("views", matrix.views().table());
    tables.numbers("degree", &[matrix.functions() as u32 - 1]);
    add_dense::<F>(&mut tables, matrix.entries(), matrix.functions());
    tables.numbers("v", &setup.v);
    tables.numbers("source", &setup.g);
    let rule = match setup.choice {
        Choice::Paper => PairRule::RestOut,
        Choice::Default => PairRule::RestPointwise,
        Choice::Pointwise => PairRule::Pointwise,
    };
    rule.add_to(&mut tables);
    Ok(tables)
}

/// What walks without pairs take from.
fn add_rays<F: Real + Number>(tables: &mut TableBuilder, rays: &RayControl<'_, F>) {
    tables.numbers("rayfirst", rays.first);
    add::<F, _>(tables, ["stretch", "Stretch"], rays.stretches, |stretch| {
        [
            bytes(&[stretch.from]),
            bytes(&[stretch.interval, stretch.ray_box]),
            bytes(&stretch.near),
            bytes(&stretch.integral),
        ]
        .concat()
    });
    add::<F, _>(
        tables,
        ["interval", "Interval"],
        rays.intervals,
        |interval| {
            [
                bytes(&interval.end),
                bytes(&interval.mean),
                bytes(&interval.integral),
            ]
            .concat()
        },
    );
    add::<F, _>(tables, ["boxes", "RayBox"], rays.boxes, |ray_box| {
        [
            bytes(&[ray_box.from, ray_box.width]),
            bytes(&ray_box.control),
        ]
        .concat()
    });
    let shares = rays.shares.iter().map(|share| {
        let own = [bytes(&[share.sum]), bytes(&[share.interval])].concat();
        (own, format!("fredholm_room::{share:?}"))
    });
    tables.records("shares", "fredholm_room::Share", size_of::<Share>(), shares);
}

/// Records of a room, whose fields are public: what `Debug` writes is Rust.
fn add<F: Number, R: Debug>(
    tables: &mut TableBuilder,
    [name, kind]: [&'static str; 2],
    records: &[R],
    bytes: impl Fn(&R) -> Vec<u8>,
) {
    tables.records(
        name,
        &format!("fredholm_room::{kind}<{}>", F::NAME),
        size_of::<R>(),
        records
            .iter()
            .map(|record| (bytes(record), format!("fredholm_room::{record:?}"))),
    );
}

//! The tables of a room for a device.

use fredholm_core::Real;
use fredholm_embedded::{Number, TableBuilder};
use fredholm_model::Error;
use fredholm_model::device::PairRule;
use fredholm_room::Tables;

use crate::system::RoomSystem;

/// The tables of a room in one channel.
pub(crate) fn room<F: Real + Number>(system: &RoomSystem<'_>) -> Result<TableBuilder, Error> {
    let scene = &system.cut.model.scene;
    let own = Tables::<F>::new(scene, &system.cut.mesh);
    let (v, rays) = system.ray_tables::<F>()?;
    let geometry = own.geometry();
    let mut tables = TableBuilder::new("room");
    tables.numbers("open", &[u32::from(geometry.is_open())]);
    tables.records("walls", geometry.walls(), |wall, to| {
        to.add(wall.ends.as_flattened());
        to.add(&wall.vertices);
        to.add(&wall.tangent);
        to.add(&[wall.length, wall.reflectance, wall.emission]);
    });
    tables.records("strips", geometry.strips(), |strip, to| {
        to.add(strip.places.as_flattened());
        to.add([strip.vertices, strip.walls].as_flattened());
    });
    tables.records("nodes", geometry.nodes(), |node, to| {
        let [low, high] = node.links;
        to.add(&node.centre);
        to.add(&node.half);
        to.add(&[node.first, node.count, low, high]);
    });
    let cells = own.partition().tables();
    tables.records("edges", cells.edges, |edge, to| {
        to.add(&[edge.along]);
        to.add(&edge.position);
    });
    tables.numbers("cells", cells.walls);
    tables.numbers("first", cells.first);
    tables.numbers("lengths", own.lengths());
    let mut surfaces = vec![0];
    for surface in 0..scene.surfaces() {
        surfaces.push(scene.walls_of(surface)?.end as u32);
    }
    tables.numbers("surfaces", &surfaces);
    tables.numbers("degree", &[system.cut.cut.degree as u32]);
    tables.numbers("v", &v);
    let rays = rays.control();
    tables.numbers("rayfirst", rays.first);
    tables.records("stretch", rays.stretches, |stretch, to| {
        to.add(&[stretch.from]);
        to.add(&[stretch.interval, stretch.ray_box]);
        to.add(&stretch.near);
    });
    tables.numbers("integral", rays.integrals);
    tables.numbers("interval", rays.intervals);
    tables.numbers("boxes", rays.boxes);
    tables.records("shares", rays.shares, |share, to| {
        to.add(&[share.sum]);
        to.add(&[share.interval]);
    });
    PairRule::Rays.add_to(&mut tables);
    Ok(tables)
}

//! The tables of a scene for a device.

use core::fmt::Debug;

use fredholm_core::{LastStep, Real};
use fredholm_embedded::{Number, TableBuilder};
use fredholm_model::device::{PairRule, bytes};
use fredholm_model::{Error, Region, Subject};
use fredholm_scene::Scene;

use crate::of_degree;
use crate::partition::WalkTables;
use crate::regions::Place;
use crate::system::{SceneSystem, best_rays, mean};

/// The tables of a scene.
pub(crate) fn scene<F: Real + Number>(
    system: &SceneSystem<'_>,
    absorption: f64,
) -> Result<TableBuilder, Error> {
    let (scene, cut) = (system.model.scene(), &*system.cut);
    check(scene)?;
    let walks = WalkTables::<F>::new(scene, cut)?;
    let radiosity = walks.radiosity(cut, absorption)?;
    let mut tables = TableBuilder::new("scene");
    let geometry = radiosity.geometry();
    tables.numbers("absorb", &[absorption]);
    tables.numbers("open", &[u32::from(geometry.is_open())]);
    add::<F, _>(&mut tables, ["faces", "Face"], geometry.faces(), |face| {
        [
            bytes(face.corners.as_flattened()),
            bytes(&face.vertices),
            bytes(&[face.count, face.plane]),
            bytes(&face.normal),
            bytes(&[face.area, face.reflectance, face.emission]),
        ]
        .concat()
    });
    let triangles = geometry.triangles();
    add::<F, _>(
        &mut tables,
        ["triangle", "Triangle"],
        triangles,
        |triangle| {
            let numbers = [triangle.face, triangle.plane];
            [bytes(triangle.axes.as_flattened()), bytes(&numbers)].concat()
        },
    );
    add::<F, _>(&mut tables, ["nodes", "Node"], geometry.nodes(), |node| {
        let numbers = [node.first, node.count];
        [bytes(&node.low), bytes(&node.high), bytes(&numbers)].concat()
    });
    let (sides, patches, lights) = walks.cells.tables();
    add::<F, _>(&mut tables, ["sides", "Side"], sides, |side| {
        [
            bytes(side.tangents.as_flattened()),
            bytes(&[side.patch, side.patches]),
            bytes(&[side.emission]),
        ]
        .concat()
    });
    add::<F, _>(&mut tables, ["patches", "FacePatch"], patches, |patch| {
        let [m, n] = patch.intervals;
        [
            bytes(&patch.origin),
            bytes(patch.spans.as_flattened()),
            bytes(patch.duals.as_flattened()),
            bytes(&[m, n, patch.first, patch.triangle]),
        ]
        .concat()
    });
    tables.numbers("lights", lights);
    tables.numbers("shares", &cut.shares);
    add_surfaces(&mut tables, system, &walks, absorption)?;
    let vectors = system.solution.for_walks::<F>()?;
    let control = vectors.tables();
    let last = LastStep(&radiosity);
    let rays = of_degree!(cut.degree, B => best_rays::<F, B>(&vectors, &last)?);
    tables.numbers("degree", &[cut.degree as u32]);
    tables.numbers("v", control.v);
    tables.numbers("control", control.control);
    tables.numbers("integral", control.integral);
    tables.numbers("events", control.events);
    tables.numbers("ofevents", control.of_events);
    tables.numbers("rays", &[control.per_axis, rays.get()]);
    PairRule::Rays.add_to(&mut tables);
    Ok(tables)
}

/// What a device does not know is refused.
fn check(scene: &Scene) -> Result<(), Error> {
    if scene.sky().is_none() && scene.beams().is_empty() {
        return Ok(());
    }
    Err(Error::Option {
        subject: Subject::Problem,
        message: "device tables of a scene have the light of its surfaces alone: leave `sky` and `light` out".to_owned(),
    })
}

/// The faces of every surface, and of its mean what is known before any walk.
fn add_surfaces<F: Real + Number>(
    tables: &mut TableBuilder,
    system: &SceneSystem<'_>,
    walks: &WalkTables<F>,
    absorption: f64,
) -> Result<(), Error> {
    let (scene, cut) = (system.model.scene(), &*system.cut);
    let (radiosity, wide) = (
        walks.radiosity(cut, absorption)?,
        cut.radiosity(absorption)?,
    );
    let vectors = system.solution.for_walks::<F>()?;
    let v: Vec<f64> = vectors.v().iter().map(|v| v.to_f64()).collect();
    let (mut surfaces, mut numbers) = (vec![0_u32], Vec::<u32>::new());
    let (mut ends, mut known, mut means) = (Vec::<F>::new(), Vec::new(), Vec::new());
    for surface in 0..system.model.names().len() {
        let place = Place::new(scene, &Region::Part(surface))?;
        let Place::Faces(faces) = &place else {
            return Err(Error::Internal("the mean over a surface is one over faces"));
        };
        let own = place.known(&radiosity);
        known.push(own);
        means.push(own + mean(&wide, faces, &v));
        ends.append(&mut place.areas(&radiosity)?);
        numbers.extend(faces);
        surfaces.push(numbers.len() as u32);
    }
    tables.numbers("surfaces", &surfaces);
    tables.numbers("numbers", &numbers);
    tables.numbers("ends", &ends);
    tables.numbers("known", &known);
    tables.numbers("means", &means);
    Ok(())
}

/// Records of a scene, whose fields are public: what `Debug` writes is Rust.
fn add<F: Number, R: Debug>(
    tables: &mut TableBuilder,
    [name, kind]: [&'static str; 2],
    records: &[R],
    bytes: impl Fn(&R) -> Vec<u8>,
) {
    tables.records(
        name,
        &format!("fredholm_scene::{kind}<{}>", F::NAME),
        size_of::<R>(),
        records
            .iter()
            .map(|record| (bytes(record), format!("fredholm_scene::{record:?}"))),
    );
}

//! A scene from its tables: everything is read where it lies.

use fredholm_core::Real;
use fredholm_core::sampled::Sampled;
use fredholm_embedded::Tables;
use fredholm_embedded::zerocopy::{FromBytes, Immutable};
use fredholm_scene::{CellTables, Geometry, Mean, Radiosity};

/// The equation. `None`: the tables are of another scene, or refused.
pub(crate) fn radiosity<'a, F>(tables: &Tables<'a>) -> Option<Radiosity<'a, F>>
where
    F: Real + FromBytes + Immutable,
{
    let is_open = *tables.one::<u32>("open").ok()? != 0;
    let (faces, triangles) = (tables.get("faces").ok()?, tables.get("triangle").ok()?);
    let nodes = tables.get("nodes").ok()?;
    let geometry = Geometry::new(faces, triangles, nodes, is_open).ok()?;
    let cells = CellTables {
        sides: tables.get("sides").ok()?,
        patches: tables.get("patches").ok()?,
        lights: tables.get("lights").ok()?,
        beams: &[],
        sky_bands: &[],
        sky_emissions: &[],
    };
    let radiosity = Radiosity::of_tables(geometry, cells).ok()?;
    radiosity
        .with_visible_shares(tables.get("shares").ok()?)
        .ok()
}

/// The neighbour equation from steps with B functions on a cell.
pub(crate) fn neighbour<'s, 'a, F, const B: usize>(
    tables: &Tables<'a>,
    radiosity: &'s Radiosity<'a, F>,
) -> Option<Sampled<'s, Radiosity<'a, F>, 2, B, Radiosity<'a, F>>>
where
    'a: 's,
    F: Real + FromBytes + Immutable,
{
    let (control, rays) = tables.step_control().ok()?;
    Sampled::with_events(radiosity, radiosity, control, rays).ok()
}

/// The mean over a surface, numbered from 0.
pub(crate) fn mean_over<'a, F>(
    tables: &Tables<'a>,
    radiosity: &Radiosity<'a, F>,
    surface: usize,
) -> Option<Mean<'a, F>>
where
    F: Real + FromBytes + Immutable,
{
    let [from, to, ..] = *tables.get::<u32>("surfaces").ok()?.get(surface..)? else {
        return None;
    };
    let own = from as usize..to as usize;
    let faces = tables.get("numbers").ok()?.get(own.clone())?;
    let ends = tables.get("ends").ok()?.get(own)?;
    Mean::new(radiosity.geometry(), faces, ends).ok()
}

//! A scene from the arrays that `fredholm export` writes, where they lie.

use core::num::NonZeroU32;

use fredholm_core::Real;
use fredholm_core::sampled::{Sampled, StepControl};
use fredholm_embedded::Table;
use fredholm_embedded::zerocopy::{FromBytes, Immutable};
use fredholm_scene::{Face, FacePatch, Geometry, Mean, Node, Radiosity, Side, Triangle};

/// What `pairs` is in tables of scenes: all have h = k.
const RAYS: u32 = 4;

/// The arrays of a scene: constants, or slices of a table.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SceneTable<'a, F> {
    /// q0.
    pub(crate) absorb: f64,
    /// 1 where light may leave.
    pub(crate) open: u32,
    /// The polygons.
    pub(crate) faces: &'a [Face<F>],
    /// The polygons as rays see them.
    pub(crate) triangles: &'a [Triangle<F>],
    /// The hierarchy over them.
    pub(crate) nodes: &'a [Node<F>],
    /// Frames for directions, a face each.
    pub(crate) sides: &'a [Side<F>],
    /// The cells of faces.
    pub(crate) patches: &'a [FacePatch<F>],
    /// The faces to which the last step leads.
    pub(crate) lights: &'a [u32],
    /// What of each light each cell sees.
    pub(crate) shares: &'a [u8],
    /// Where in `numbers` the faces of every surface begin, and the last ones end.
    pub(crate) surfaces: &'a [u32],
    /// The numbers of faces, surface by surface.
    pub(crate) numbers: &'a [u32],
    /// The area of each of them with all before it on the surface.
    pub(crate) ends: &'a [F],
    /// What is known of the mean over every surface.
    pub(crate) known: &'a [f64],
    /// (v, Φ) of the mean over every surface, with what is known.
    pub(crate) means: &'a [f64],
    /// The degree of polynomials on a cell.
    pub(crate) degree: u32,
    /// The solution.
    pub(crate) v: &'a [F],
    /// The control variate c.
    pub(crate) control: &'a [F],
    /// Its integral.
    pub(crate) integral: &'a [F],
    /// The faces that it knows, cell by cell.
    pub(crate) events: &'a [u32],
    /// What it has for them.
    pub(crate) of_events: &'a [F],
    /// Boxes of directions along an axis, and rays of a score.
    pub(crate) rays: &'a [u32],
    /// What is done with the pairs.
    pub(crate) pairs: u32,
}

impl<'a, F: Real> SceneTable<'a, F> {
    /// Of a table that `fredholm export -o FILE.bin` wrote.
    pub(crate) fn read(table: &Table<'a>) -> Option<Self>
    where
        F: FromBytes + Immutable,
    {
        Some(Self {
            absorb: table.one("absorb").ok()?,
            open: table.one("open").ok()?,
            faces: table.slice("faces").ok()?,
            triangles: table.slice("triangle").ok()?,
            nodes: table.slice("nodes").ok()?,
            sides: table.slice("sides").ok()?,
            patches: table.slice("patches").ok()?,
            lights: table.slice("lights").ok()?,
            shares: table.slice("shares").ok()?,
            surfaces: table.slice("surfaces").ok()?,
            numbers: table.slice("numbers").ok()?,
            ends: table.slice("ends").ok()?,
            known: table.slice("known").ok()?,
            means: table.slice("means").ok()?,
            degree: table.one("degree").ok()?,
            v: table.slice("v").ok()?,
            control: table.slice("control").ok()?,
            integral: table.slice("integral").ok()?,
            events: table.slice("events").ok()?,
            of_events: table.slice("ofevents").ok()?,
            rays: table.slice("rays").ok()?,
            pairs: table.one("pairs").ok()?,
        })
    }

    /// The equation.
    pub(crate) fn radiosity(&self) -> Option<Radiosity<'a, F>> {
        let open = match self.open {
            0 => false,
            1 => true,
            _ => return None,
        };
        let geometry = Geometry::new(self.faces, self.triangles, self.nodes, open).ok()?;
        let tables = (self.sides, self.patches, self.lights);
        let radiosity = Radiosity::of_tables(geometry, tables, self.absorb).ok()?;
        radiosity.with_visible_shares(self.shares).ok()
    }

    /// The neighbour equation with B functions on a cell, if the table is of that degree.
    #[allow(
        clippy::type_complexity,
        reason = "the type says what a program borrows"
    )]
    pub(crate) fn neighbour<'s, const B: usize>(
        &self,
        radiosity: &'s Radiosity<'a, F>,
    ) -> Option<Sampled<'s, F, Radiosity<'a, F>, 2, B, Radiosity<'a, F>>>
    where
        'a: 's,
    {
        let functions = (self.degree + 1) * (self.degree + 2) / 2;
        let &[per_axis, rays] = self.rays else {
            return None;
        };
        if (self.pairs, functions as usize) != (RAYS, B) {
            return None;
        }
        let tables = StepControl {
            v: self.v,
            control: self.control,
            integral: self.integral,
            per_axis,
            events: self.events,
            of_events: self.of_events,
        };
        Sampled::with_events((radiosity, radiosity), tables, NonZeroU32::new(rays)?).ok()
    }

    /// The mean over a surface, numbered from 0.
    pub(crate) fn mean_over(
        &self,
        radiosity: &Radiosity<'a, F>,
        surface: usize,
    ) -> Option<Mean<'a, F>> {
        let [from, to, ..] = *self.surfaces.get(surface..)? else {
            return None;
        };
        let own = from as usize..to as usize;
        let (faces, ends) = (self.numbers.get(own.clone())?, self.ends.get(own)?);
        Mean::new(radiosity.geometry(), faces, ends).ok()
    }
}

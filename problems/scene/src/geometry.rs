//! Faces, the hierarchy over their triangles, and the tables of both.

use fredholm_core::Real;
#[cfg(feature = "alloc")]
use fredholm_surfaces::leaves;
use fredholm_surfaces::{DEPTH, Material, TreeNode, is_tree};
use num_traits::{one, zero};

use crate::SceneError;
use crate::vector::Vector;
#[cfg(feature = "alloc")]
use crate::vector::{dot, sub};

/// A triangle or planar convex quadrilateral. Its active side is the one from which its vertices
/// are seen counter-clockwise.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "zerocopy", derive(zerocopy::FromBytes, zerocopy::Immutable))]
#[repr(C)]
pub struct Face<F> {
    /// The vertices; a triangle has its first one again in the last place.
    pub corners: [[F; 3]; 4],
    /// The numbers of the vertices: faces that meet have numbers in common.
    pub vertices: [u32; 4],
    /// The number of vertices: 3 or 4.
    pub count: u32,
    /// The number of its plane: faces in one plane that touch have it in common.
    pub plane: u32,
    /// The unit vector to the active side.
    pub normal: [F; 3],
    /// The area.
    pub area: F,
    /// ρ, the reflectance.
    pub reflectance: F,
    /// F, the emission.
    pub emission: F,
}

impl<F: Real> Face<F> {
    /// The vertices, three or four.
    #[inline]
    #[must_use]
    pub fn polygon(&self) -> &[[F; 3]] {
        let all = self.corners.as_slice();
        all.get(..self.count as usize).unwrap_or(all)
    }

    /// The material.
    #[must_use]
    pub fn material(&self) -> Material {
        Material {
            reflectance: self.reflectance.to_f64(),
            emission: self.emission.to_f64(),
        }
    }

    /// The distance of `point` from the plane of the face, positive on the active side.
    #[cfg(feature = "alloc")]
    #[inline(always)]
    pub(crate) fn height(&self, point: Vector<F>) -> F {
        dot(self.normal, sub(point, self.corners[0]))
    }

    /// The mean of the vertices.
    pub(crate) fn middle(&self) -> Vector<F> {
        let mut sum = [zero::<F>(); 3];
        for p in self.polygon() {
            sum = [sum[0] + p[0], sum[1] + p[1], sum[2] + p[2]];
        }
        let per = one::<F>() / F::from_u32(self.count);
        [sum[0] * per, sum[1] * per, sum[2] * per]
    }
}

/// How a scene repeats: along every axis with a length above 0 it comes again and again, and lies in its first cell, which begins at `low`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Period<F> {
    pub(crate) lengths: [F; 3],
    pub(crate) low: [F; 3],
}

/// What faces do with the light of the sun, besides what they do with heat.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Sunlight<'a, F> {
    /// α of every face, the part of it that is absorbed.
    pub(crate) absorptances: &'a [F],
    /// Whether the sky gives sunlight, and no heat.
    pub(crate) of_sky: bool,
}

/// A piece of a face as rays see it, in the order of the hierarchy's leaves.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "zerocopy", derive(zerocopy::FromBytes, zerocopy::Immutable))]
#[repr(C)]
pub struct Triangle<F> {
    /// The first, second and third coordinates of its three vertices.
    pub axes: [[F; 3]; 3],
    /// The number of the face.
    pub face: u32,
    /// The number of the face's plane.
    pub plane: u32,
}

/// A box of the hierarchy, widened so that no rounding error of a test makes a ray miss a triangle
/// in it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "zerocopy", derive(zerocopy::FromBytes, zerocopy::Immutable))]
#[repr(C)]
pub struct Node<F> {
    /// The lowest coordinates.
    pub low: [F; 3],
    /// The highest coordinates.
    pub high: [F; 3],
    /// A leaf's first triangle, otherwise the first of two children, which stand side by side.
    pub first: u32,
    /// The number of a leaf's triangles, 0 for other nodes.
    pub count: u32,
}

impl<F> TreeNode for Node<F> {
    fn first(&self) -> u32 {
        self.first
    }

    fn count(&self) -> u32 {
        self.count
    }
}

/// The geometry of a scene: borrowed tables, all in one scalar.
#[derive(Clone, Copy, Debug)]
pub struct Geometry<'a, F> {
    faces: &'a [Face<F>],
    triangles: &'a [Triangle<F>],
    nodes: &'a [Node<F>],
    open: bool,
    /// ρ_s of every face; none if all are 0.
    specular: &'a [F],
    /// The periods with which it repeats, if it does.
    pub(crate) period: Option<Period<F>>,
    /// What faces do with sunlight, if that is told apart.
    pub(crate) sunlight: Option<Sunlight<'a, F>>,
}

impl<'a, F: Real> Geometry<'a, F> {
    /// Geometry of tables that were made elsewhere, for instance kept as constants of a program.
    /// `open` says whether light may leave.
    ///
    /// What cannot be is refused; whether the numbers are right is not looked at.
    ///
    /// # Errors
    /// [`SceneError::Tables`]: a number in them leads nowhere, a triangle is not in its face's
    /// plane, a material is none, or the hierarchy is no tree of at most 60 levels in which
    /// children follow their parents.
    pub fn new(
        faces: &'a [Face<F>],
        triangles: &'a [Triangle<F>],
        nodes: &'a [Node<F>],
        open: bool,
    ) -> Result<Self, SceneError> {
        let possible = zero::<F>()..=one::<F>();
        let faces_stand = faces.iter().all(|f| {
            matches!(f.count, 3 | 4)
                && possible.contains(&f.reflectance)
                && f.emission.is_finite()
                && f.area > zero()
        });
        let triangles_lead = triangles.iter().all(|t| {
            let face = faces.get(t.face as usize);
            face.is_some_and(|f| f.plane == t.plane)
        });
        let leads = |leaf: &Node<F>| (leaf.first + leaf.count) as usize <= triangles.len();
        if faces_stand && triangles_lead && is_tree(nodes, DEPTH, leads) {
            Ok(Self::made(faces, triangles, nodes, open))
        } else {
            Err(SceneError::Tables)
        }
    }

    /// Tables that this crate made.
    pub(crate) const fn made(
        faces: &'a [Face<F>],
        triangles: &'a [Triangle<F>],
        nodes: &'a [Node<F>],
        open: bool,
    ) -> Self {
        Self {
            faces,
            triangles,
            nodes,
            open,
            specular: &[],
            period: None,
            sunlight: None,
        }
    }

    /// These faces, which do other things with sunlight than with heat.
    #[cfg(feature = "alloc")]
    pub(crate) const fn with_sunlight(self, sunlight: Option<Sunlight<'a, F>>) -> Self {
        Self { sunlight, ..self }
    }

    /// These faces, which repeat.
    #[cfg(feature = "alloc")]
    pub(crate) const fn with_period(self, period: Option<Period<F>>) -> Self {
        Self { period, ..self }
    }

    /// Whether a ray ends where it goes straight: there are no mirrors, and nothing repeats.
    #[inline(always)]
    pub(crate) const fn is_straight(&self) -> bool {
        !self.has_mirrors() && self.period.is_none()
    }

    /// These faces, of which each reflects a part of what arrives as a mirror does.
    #[cfg(feature = "alloc")]
    pub(crate) const fn with_specular(self, specular: &'a [F]) -> Self {
        Self { specular, ..self }
    }

    /// Whether some face is a mirror in part.
    #[inline(always)]
    pub(crate) const fn has_mirrors(&self) -> bool {
        !self.specular.is_empty()
    }

    /// ρ_s, the part of what arrives at a face that leaves as from a mirror.
    #[inline]
    pub(crate) fn specular(&self, face: u32) -> F {
        let own = self.specular.get(face as usize);
        own.copied().unwrap_or(zero())
    }

    /// The faces.
    #[must_use]
    pub const fn faces(&self) -> &'a [Face<F>] {
        self.faces
    }

    /// The faces as rays see them.
    #[must_use]
    pub const fn triangles(&self) -> &'a [Triangle<F>] {
        self.triangles
    }

    /// The hierarchy.
    #[must_use]
    pub const fn nodes(&self) -> &'a [Node<F>] {
        self.nodes
    }

    /// Whether light may leave.
    #[must_use]
    pub const fn is_open(&self) -> bool {
        self.open
    }

    #[inline(always)]
    pub(crate) fn face(&self, face: u32) -> Option<&'a Face<F>> {
        self.faces.get(face as usize)
    }

    /// All triangles but those of boxes that are `outside`.
    #[cfg(feature = "alloc")]
    pub(crate) fn but(
        self,
        outside: impl FnMut(&Node<F>) -> bool,
    ) -> impl Iterator<Item = &'a Triangle<F>> {
        let triangles = self.triangles;
        let leaves = leaves(self.nodes, outside).filter_map(|range| triangles.get(range));
        leaves.flatten()
    }
}

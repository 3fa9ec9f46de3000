//! Rigid parts of a mesh: which facets move together, and where they stand.
//!
//! Constants of this file are measured by `cargo test --test poses` (images of moved parts).

use super::{MaterialInput, Mesh, NO_NORMAL, Scene, check};
use crate::base::error::Error;
use crate::base::index::Index;
use crate::base::math::{Vec3, fabs, sqrt};

/// Largest difference of a pose's rotation from a rotation, in the products of its rows: what single precision leaves of one.
const ROTATION_SLACK: f64 = 1e-6;

/// Where a rigid part stands: what is at x in the mesh is at R x + t.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// The rows of the rotation R.
    pub rotation: [[f64; 3]; 3],
    /// The translation t, in the mesh's unit.
    pub translation: [f64; 3],
}

impl Default for Pose {
    fn default() -> Pose {
        Pose::REST
    }
}

impl Pose {
    /// Where the mesh has it.
    pub const REST: Pose =
        Pose { rotation: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], translation: [0.0; 3] };

    /// By a quaternion w + x i + y j + z k of any length but zero, which is turned about its vector part by twice the angle
    /// whose tangent is that part's length over w, and a translation. A quaternion of no length is found out where the pose
    /// is used.
    pub fn from_quaternion([w, x, y, z]: [f64; 4], translation: [f64; 3]) -> Pose {
        let largest = [w, x, y, z].into_iter().fold(0.0, |a, b| f64::max(a, fabs(b)));
        let [w, x, y, z] = [w, x, y, z].map(|part| part / largest);
        let length = sqrt(w * w + x * x + y * y + z * z);
        let [w, x, y, z] = [w, x, y, z].map(|part| part / length);
        let rotation = [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
            [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
            [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
        ];
        Pose { rotation, translation }
    }

    /// Turned about an axis of any length but zero through the point `pivot`, by an angle in radians, the right hand's way.
    pub fn about(pivot: [f64; 3], axis: [f64; 3], angle: f64) -> Pose {
        let [x, y, z] = axis;
        let length = sqrt(x * x + y * y + z * z);
        let (sin, cos) = (crate::base::math::sin(0.5 * angle), crate::base::math::cos(0.5 * angle));
        let [x, y, z] = axis.map(|part| part / length * sin);
        let turned = Pose::from_quaternion([cos, x, y, z], [0.0; 3]);
        let moved = Vec3::from_array(pivot) - turned.turn(Vec3::from_array(pivot));
        Pose { translation: moved.to_array(), ..turned }
    }

    /// A direction turned.
    #[inline]
    pub fn turn(&self, v: Vec3) -> Vec3 {
        let [a, b, c] = self.rotation.map(Vec3::from_array);
        Vec3::new(a.dot(v), b.dot(v), c.dot(v))
    }

    /// A direction turned back.
    #[inline]
    pub fn turn_back(&self, v: Vec3) -> Vec3 {
        let [a, b, c] = self.rotation.map(Vec3::from_array);
        a * v.x + b * v.y + c * v.z
    }

    /// A point moved.
    #[inline]
    pub fn point(&self, p: Vec3) -> Vec3 {
        self.turn(p) + Vec3::from_array(self.translation)
    }

    /// Whether directions stay as they are.
    pub fn is_unturned(&self) -> bool {
        self.rotation == Pose::REST.rotation
    }

    fn is_rigid(&self) -> bool {
        let [a, b, c] = self.rotation.map(Vec3::from_array);
        let products = [
            (a, a, 1.0),
            (b, b, 1.0),
            (c, c, 1.0),
            (a, b, 0.0),
            (b, c, 0.0),
            (c, a, 0.0),
            (a.cross(b), c, 1.0),
        ];
        // not a number is no product
        products.iter().all(|(x, y, wanted)| fabs(x.dot(*y) - wanted) <= ROTATION_SLACK)
            && self.translation.iter().all(|x| fabs(*x) < f64::INFINITY)
    }
}

/// The rigid parts of a mesh.
#[derive(Clone, Copy, Debug)]
pub struct Parts<'a> {
    /// The part of each facet.
    pub facets: &'a [u32],
    /// Where each part stands.
    pub poses: &'a [Pose],
}

impl Parts<'_> {
    /// The part of a facet.
    #[inline]
    pub fn of(&self, facet: usize) -> usize {
        self.facets.at(facet) as usize
    }

    /// Where a facet's part stands.
    #[inline]
    pub fn pose(&self, facet: usize) -> &Pose {
        self.poses.get(self.of(facet)).unwrap_or(&Pose::REST)
    }

    /// Refuses parts that are none of a mesh of this many facets.
    ///
    /// # Errors
    /// [`Error::Length`], [`Error::PartOutOfRange`] and [`Error::Pose`].
    pub fn check(&self, facets: usize) -> Result<(), Error> {
        if self.facets.len() != facets {
            return Err(Error::Length { what: "parts", expected: facets, given: self.facets.len() });
        }
        let parts = self.poses.len();
        if let Some(facet) = self.facets.iter().position(|part| *part as usize >= parts) {
            return Err(Error::PartOutOfRange { facet, part: self.of(facet), parts });
        }
        match self.poses.iter().position(|pose| !pose.is_rigid()) {
            Some(part) => Err(Error::Pose { part }),
            None => Ok(()),
        }
    }
}

/// A mesh whose parts are moved: each facet has corners of its own.
struct PosedMesh<'a, M> {
    mesh: &'a M,
    parts: &'a Parts<'a>,
}

/// The facet and the corner of a vertex of a [`PosedMesh`].
fn corner_of(index: usize) -> (usize, usize) {
    (index / 3, index % 3)
}

impl<M: Mesh> PosedMesh<'_, M> {
    /// Indices of the normals at a facet's corners, in the mesh.
    fn told(&self, facet: usize) -> [u32; 3] {
        if self.mesh.facet_normals() > 0 { self.mesh.facet_normal(facet) } else { self.mesh.facet(facet) }
    }
}

impl<M: Mesh> Mesh for PosedMesh<'_, M> {
    fn vertices(&self) -> usize {
        self.mesh.facets().saturating_mul(3)
    }

    fn vertex(&self, index: usize) -> [f64; 3] {
        let (facet, corner) = corner_of(index);
        let vertex = self.mesh.vertex(self.mesh.facet(facet).at(corner) as usize);
        let pose = self.parts.pose(facet);
        if *pose == Pose::REST { vertex } else { pose.point(Vec3::from_array(vertex)).to_array() }
    }

    fn facets(&self) -> usize {
        self.mesh.facets()
    }

    fn facet(&self, index: usize) -> [u32; 3] {
        [0, 1, 2].map(|corner| (3 * index + corner) as u32)
    }

    fn facet_materials(&self) -> usize {
        self.mesh.facet_materials()
    }

    fn facet_material(&self, facet: usize) -> u32 {
        self.mesh.facet_material(facet)
    }

    fn normals(&self) -> usize {
        if self.mesh.normals() > 0 { self.vertices() } else { 0 }
    }

    fn normal(&self, index: usize) -> [f64; 3] {
        let (facet, corner) = corner_of(index);
        let told = self.told(facet).at(corner) as usize;
        if told >= self.mesh.normals() {
            // of a corner that has none: it is never asked for
            return Vec3::Z.to_array();
        }
        self.parts.pose(facet).turn(Vec3::from_array(self.mesh.normal(told))).to_array()
    }

    fn facet_normals(&self) -> usize {
        if self.mesh.normals() > 0 { self.facets() } else { 0 }
    }

    fn facet_normal(&self, facet: usize) -> [u32; 3] {
        let told = self.told(facet);
        [0, 1, 2]
            .map(|corner| if told.at(corner) == NO_NORMAL { NO_NORMAL } else { (3 * facet + corner) as u32 })
    }

    fn materials(&self) -> usize {
        self.mesh.materials()
    }

    fn material(&self, index: usize) -> MaterialInput<'_> {
        self.mesh.material(index)
    }

    fn two_sided(&self) -> bool {
        self.mesh.two_sided()
    }

    fn bands(&self) -> usize {
        self.mesh.bands()
    }
}

impl<'m> Scene<'m> {
    /// As [`Scene::new`], of a mesh whose parts are moved; its bytes are the same.
    ///
    /// # Errors
    /// Those of [`Scene::new`] and of [`Parts::check`]; [`Error::VertexNotFinite`] where a vertex is moved beyond all numbers.
    pub fn posed<M: Mesh>(mesh: &M, parts: &Parts<'_>, memory: &'m mut [u8]) -> Result<Scene<'m>, Error> {
        check::sizes(mesh)?;
        check::materials(mesh)?;
        check::mesh(mesh)?;
        parts.check(mesh.facets())?;
        let limit = u32::MAX as usize / 3;
        if mesh.facets() > limit {
            return Err(Error::TooMany { what: "facets", limit });
        }
        match Scene::new(&PosedMesh { mesh, parts }, memory) {
            Err(Error::VertexNotFinite { vertex }) => {
                let (facet, corner) = corner_of(vertex);
                Err(Error::VertexNotFinite { vertex: mesh.facet(facet).at(corner) as usize })
            }
            made => made,
        }
    }
}

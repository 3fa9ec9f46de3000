//! Circles and polylines, checked and cut into elements.

mod check;
mod layout;

use crate::base::arena::{Arena, Need, plain_struct};
use crate::base::error::{Error, Field};
use crate::base::index::{Index, IndexMut};
use crate::base::math::{TAU, asin, atan2, clamp, cos, floor, sin};
use crate::plane::Vec2;
use crate::plane::lobe::PlaneLobe;
use crate::plane::stencil::{MAX_ORDER, NODES, Stencil};
use crate::scene::{MIRROR_AXIS_RATIO, within_one};
use check::check;
use layout::lay_out;

/// What [`Error::Body`] says of a number of elements.
pub const BODY_ELEMENTS: &str = "elements are not 1 to 2^20";
/// What [`Error::Body`] says of a radius.
pub const BODY_RADIUS: &str = "radius is not positive";

/// How a lobe is replaced by rays where a chain meets it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RaySet {
    /// As the paper prints it, eq. (18): the mirror ray and one at half of `spacing` (radians) to either side,
    /// weighed as q at their angles; the sum of the three is rho_0, and rays below the surface are lost.
    /// `renormalised`: the rays above the surface share A(theta) instead. Full tree.
    Paper {
        /// Full angle between the side rays, radians.
        spacing: f64,
        /// Share A(theta) among the rays above the surface.
        renormalised: bool,
    },
    /// Numbers of Gauss nodes in the visible lobe's energy: at the first lobe of a path, the second, and later.
    Gauss([u32; 3]),
    /// Numbers of equal shares of the visible lobe's energy, each with a ray at its midpoint: at the first lobe of a
    /// path, the second, and later.
    Equal([u32; 3]),
    /// Numbers of Gauss nodes in each part of the visible lobe that meets a body; the lobe is split at the silhouettes
    /// seen from the point, and what escapes to a uniform sky is exact. At the fourth lobe of a path and later: Gauss
    /// nodes in the whole lobe.
    Split([u32; 3]),
}

impl RaySet {
    /// A set whose error stays below `tolerance` times a uniform sky of 1 in the two-circle study at rho_0 = 0.8
    /// (`tests/plane_gloss.rs` measures it down to 1e-3): where lobes are wide, splitting at silhouettes gains
    /// most; where they are narrow, rays in the whole lobe are cheaper.
    pub fn for_tolerance(tolerance: f64, axis_ratio: f64) -> RaySet {
        match tolerance {
            t if t >= 1e-2 => RaySet::Split([4, 2, 1]),
            t if t >= 2e-3 && axis_ratio >= 9.5 => RaySet::Gauss([32, 6, 1]),
            t if t >= 2e-3 && axis_ratio >= 3.5 => RaySet::Split([12, 6, 2]),
            t if t >= 2e-3 => RaySet::Split([8, 4, 2]),
            t if t >= 1e-3 => RaySet::Split([24, 8, 2]),
            _ => RaySet::Split([32, 16, 8]),
        }
    }
}

/// A lobe in place of an ideal mirror.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlaneGloss {
    /// Long over short axis, >= 1; 1e4 and above: an ideal mirror.
    pub axis_ratio: f64,
    /// The rays that stand for it; `None`: those of [`RaySet::for_tolerance`] at the scene's tolerance.
    pub rays: Option<RaySet>,
}

/// Reflectances of a surface; diffuse + specular <= 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlaneMaterial {
    /// rho_d, 0 to 1.
    pub diffuse: f64,
    /// rho_s, or rho_0 of a lobe, 0 to 1.
    pub specular: f64,
    /// The lobe; `None`: an ideal mirror.
    pub gloss: Option<PlaneGloss>,
}

/// One body. Bodies touch at most in corners and do not overlap.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shape<'a> {
    /// Seen from outside.
    Circle {
        /// Centre.
        centre: [f64; 2],
        /// Radius, positive.
        radius: f64,
    },
    /// Straight segments, whose fronts are on the right of their direction: counter-clockwise for a solid body,
    /// clockwise for a cavity. Backs are black and opaque.
    Polyline {
        /// At least two; those that are closed: at least three, the first not repeated.
        points: &'a [[f64; 2]],
        /// The last point joins the first.
        closed: bool,
        /// The polyline stands for a smooth curve: mirror directions use normals interpolated between the
        /// points, and diffuse radiance is interpolated across them.
        smooth: bool,
    },
}

/// A body as it enters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BodyInput<'a> {
    /// Its shape.
    pub shape: Shape<'a>,
    /// Index of its material.
    pub material: usize,
    /// Elements of the circle, or of each segment, >= 1.
    pub elements: u32,
}

/// What a scene is made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlaneInput<'a> {
    /// At least one.
    pub bodies: &'a [BodyInput<'a>],
    /// At least one.
    pub materials: &'a [PlaneMaterial],
}

/// How the diffuse radiance varies between the unknowns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Basis {
    /// One unknown an element, constant on it (the paper).
    Constant,
    /// One unknown an element, linear between the elements' centres.
    Linear,
    /// Number of unknowns of an element (1 to [`MAX_ORDER`]): the polynomial through its Gauss points.
    Panels(u32),
}

impl Basis {
    /// Unknowns of an element.
    pub fn order(self) -> u32 {
        match self {
            Basis::Constant | Basis::Linear => 1,
            Basis::Panels(order) => order.clamp(1, MAX_ORDER as u32),
        }
    }
}

plain_struct! {
    /// A circle, or one segment of a polyline, checked.
    pub struct Primitive {
        /// Centre, or start.
        pub a: [f64; 2],
        /// (radius, 0), or end.
        pub b: [f64; 2],
        /// Front normal of a segment.
        pub normal: [f64; 2],
        /// Normal at the start of a smooth segment.
        pub start_normal: [f64; 2],
        /// Normal at its end.
        pub end_normal: [f64; 2],
        /// 0: circle, 1: segment.
        pub kind: u32,
        /// First element.
        pub first: u32,
        /// Elements.
        pub elements: u32,
        /// Material.
        pub material: u32,
        /// Body.
        pub body: u32,
        /// 1: interpolated normals.
        pub smooth: u32,
    }
}

plain_struct! {
    /// Where a body is.
    pub struct Body {
        /// Centre of a circle around it.
        pub centre: [f64; 2],
        /// Its radius.
        pub radius: f64,
        /// First primitive.
        pub first: u32,
        /// Primitives.
        pub count: u32,
        /// 1 where backs are never seen.
        pub closed: u32,
        /// Material.
        pub material: u32,
    }
}

plain_struct! {
    /// A material, checked.
    pub struct Material {
        /// rho_d.
        pub diffuse: f64,
        /// rho_s or rho_0.
        pub specular: f64,
        /// The lobe, where `set` is not 0.
        pub lobe: PlaneLobe,
        /// Spacing of the paper's rays.
        pub spacing: f64,
        /// Which ray set: 0 an ideal mirror, 1 and 2 the paper's, 3 Gauss, 4 equal, 5 split.
        pub set: u32,
        /// Its counts.
        pub counts: [u32; 3],
    }
}

impl Material {
    fn new(input: &PlaneMaterial, tolerance: f64) -> Result<Material, Error> {
        let (diffuse, specular) = within_one(input.diffuse, input.specular);
        let kept = Material { diffuse, specular, ..Material::default() };
        let Some(gloss) = input.gloss.filter(|g| g.axis_ratio < MIRROR_AXIS_RATIO && input.specular > 0.0)
        else {
            return Ok(kept);
        };
        let kept = Material { lobe: PlaneLobe::new(gloss.axis_ratio)?, ..kept };
        Ok(match gloss.rays.unwrap_or_else(|| RaySet::for_tolerance(tolerance, gloss.axis_ratio)) {
            RaySet::Paper { spacing, renormalised } => {
                Material { set: if renormalised { 2 } else { 1 }, spacing, ..kept }
            }
            RaySet::Gauss(counts) => Material { set: 3, counts, ..kept },
            RaySet::Equal(counts) => Material { set: 4, counts, ..kept },
            RaySet::Split(counts) => Material { set: 5, counts, ..kept },
        })
    }

    #[inline(always)]
    fn rays(&self) -> Option<RaySet> {
        match self.set {
            1 | 2 => Some(RaySet::Paper { spacing: self.spacing, renormalised: self.set == 2 }),
            3 => Some(RaySet::Gauss(self.counts)),
            4 => Some(RaySet::Equal(self.counts)),
            5 => Some(RaySet::Split(self.counts)),
            _ => None,
        }
    }
}

/// A point on a primitive.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    /// The point.
    pub point: Vec2,
    /// Unit normal of the surface there.
    pub normal: Vec2,
}

/// A checked scene.
#[derive(Clone, Copy, Debug)]
pub struct PlaneScene<'m> {
    primitives: &'m [Primitive],
    bodies: &'m [Body],
    materials: &'m [Material],
    basis: Basis,
    elements: u32,
}

/// No primitive: the origin of a ray is on none.
pub const NOWHERE: u32 = u32::MAX;

impl<'m> PlaneScene<'m> {
    /// Bytes for a scene of this input.
    pub fn bytes(input: &PlaneInput<'_>) -> Result<usize, Error> {
        let primitives = input.bodies.iter().map(|b| segments(&b.shape)).fold(0, usize::saturating_add);
        PlaneScene::bytes_for(primitives, input.bodies.len(), input.materials.len())
    }

    /// As [`PlaneScene::bytes`], by the numbers of circles and segments, bodies and materials.
    pub fn bytes_for(primitives: usize, bodies: usize, materials: usize) -> Result<usize, Error> {
        Need::new().and::<Primitive>(primitives).and::<Body>(bodies).and::<Material>(materials).bytes()
    }

    /// Checks the input and lays it out. `tolerance`, 1e-13 to 0.1 of a uniform sky, chooses the rays of lobes that
    /// have none of their own.
    ///
    /// # Errors
    /// [`Error::Range`] of the tolerance; every fault of the input with its index ([`Error::Body`],
    /// [`Error::MaterialRange`], [`Error::ReflectanceSum`], [`Error::MaterialOutOfRange`], [`Error::NoFacets`],
    /// [`Error::NoMaterials`]); [`Error::BufferTooSmall`].
    pub fn new(
        input: &PlaneInput<'_>,
        basis: Basis,
        tolerance: f64,
        memory: &'m mut [u8],
    ) -> Result<PlaneScene<'m>, Error> {
        if !(1e-13..=0.1).contains(&tolerance) {
            return Err(Error::Range { field: Field::Tolerance, band: 0, value: tolerance });
        }
        check(input)?;
        let mut arena = Arena::new(memory, PlaneScene::bytes(input)?)?;
        let count = input.bodies.iter().map(|b| segments(&b.shape)).sum();
        let primitives = arena.take::<Primitive>(count)?;
        let bodies = arena.take::<Body>(input.bodies.len())?;
        let materials = arena.take::<Material>(input.materials.len())?;
        for (material, kept) in input.materials.iter().zip(materials.iter_mut()) {
            *kept = Material::new(material, tolerance)?;
        }
        let (mut first, mut elements) = (0, 0u32);
        for (index, (body, kept)) in input.bodies.iter().zip(bodies.iter_mut()).enumerate() {
            let count = segments(&body.shape);
            *kept = lay_out(body, index, first, &mut elements, primitives.part_mut(first..first + count))?;
            first += count;
        }
        Ok(PlaneScene { primitives, bodies, materials, basis, elements })
    }

    /// All primitives.
    pub fn primitives(&self) -> &'m [Primitive] {
        self.primitives
    }

    /// All bodies.
    pub fn bodies(&self) -> &'m [Body] {
        self.bodies
    }

    /// How the diffuse radiance varies between the unknowns.
    pub fn basis(&self) -> Basis {
        self.basis
    }

    /// Number of unknowns.
    pub fn unknowns(&self) -> usize {
        self.elements as usize * self.basis.order() as usize
    }

    /// rho_d of a material.
    #[inline(always)]
    pub fn diffuse(&self, material: u32) -> f64 {
        self.materials.get(material as usize).map_or(0.0, |m| m.diffuse)
    }

    /// rho_s, or rho_0, of a material.
    #[inline(always)]
    pub fn specular(&self, material: u32) -> f64 {
        self.materials.get(material as usize).map_or(0.0, |m| m.specular)
    }

    /// A material's lobe and the rays that stand for it.
    #[inline(always)]
    pub fn lobe(&self, material: u32) -> Option<(&'m PlaneLobe, RaySet)> {
        let material = self.materials.get(material as usize)?;
        material.rays().map(|rays| (&material.lobe, rays))
    }

    /// The lobe alone of a material that has one.
    #[inline(always)]
    pub(crate) fn lobe_alone(&self, material: u32) -> Option<&'m PlaneLobe> {
        self.materials.get(material as usize).map(|material| &material.lobe)
    }

    /// Whether any material has a lobe.
    pub fn is_glossy(&self) -> bool {
        self.bodies.iter().any(|body| self.lobe(body.material).is_some())
    }

    /// Whether any material mirrors.
    pub fn mirrors(&self) -> bool {
        self.bodies.iter().any(|b| self.specular(b.material) > 0.0)
    }

    /// The primitive of an unknown and the unknown's parameter on it.
    pub fn unknown(&self, unknown: usize) -> (usize, f64) {
        let order = self.basis.order();
        let (element, node) = (unknown as u32 / order, unknown % order as usize);
        let primitive = self.primitives.partition_point(|p| p.first + p.elements <= element);
        let Some(p) = self.primitives.get(primitive) else { return (0, 0.5) };
        let x = NODES.get(order as usize).map_or(0.5, |nodes| nodes.at.as_slice().at(node));
        (primitive, (f64::from(element - p.first) + x) / f64::from(p.elements))
    }

    /// The point of parameter `v` (0 to 1) of a primitive: on a circle the angle in turns; on a segment
    /// of more than one element counted so that elements shrink toward its ends.
    pub fn place(&self, primitive: usize, v: f64) -> Place {
        let Some(p) = self.primitives.get(primitive) else {
            return Place { point: Vec2::ZERO, normal: Vec2::Y };
        };
        let (a, b) = (Vec2::from(p.a), Vec2::from(p.b));
        if p.kind == 0 {
            let normal = Vec2::new(cos(TAU * v), sin(TAU * v));
            return Place { point: a + normal * b.x, normal };
        }
        let t = if p.elements == 1 { v } else { v * v * (3.0 - 2.0 * v) };
        Place { point: a + (b - a) * t, normal: Vec2::from(p.normal) }
    }

    /// The parameter of a point on a primitive: the inverse of [`PlaneScene::place`].
    #[inline]
    pub fn parameter(&self, primitive: usize, point: Vec2) -> f64 {
        let Some(p) = self.primitives.get(primitive) else { return 0.5 };
        let a = Vec2::from(p.a);
        if p.kind == 0 {
            let turns = atan2(point.y - a.y, point.x - a.x) / TAU;
            return if turns < 0.0 { turns + 1.0 } else { turns };
        }
        let along = Vec2::from(p.b) - a;
        let t = ((point - a).dot(along) / along.dot(along)).clamp(0.0, 1.0);
        if p.elements == 1 {
            return t;
        }
        // the root of v^2 (3 - 2 v) = t
        0.5 - sin(asin(1.0 - 2.0 * t) / 3.0)
    }

    /// The weights of the unknowns whose sum is the diffuse radiance at parameter `v` of a primitive.
    #[inline]
    pub fn stencil(&self, primitive: usize, v: f64) -> Stencil {
        let Some(p) = self.primitives.get(primitive) else { return Stencil::NONE };
        let w = v * f64::from(p.elements);
        match self.basis {
            Basis::Constant => Stencil::one(p.first + (w as u32).min(p.elements - 1)),
            Basis::Linear => self.linear(p, w),
            Basis::Panels(_) => {
                let element = (w as u32).min(p.elements - 1);
                Stencil::panel(self.basis.order() as usize, p.first + element, w - f64::from(element))
            }
        }
    }

    /// Linear between the centres around `w` elements from the start of `p`: around a circle or a smooth
    /// polyline, or within a segment, whose ends are extrapolated.
    fn linear(&self, p: &Primitive, w: f64) -> Stencil {
        let (first, count, wraps) = self.run(p);
        let w = w + f64::from(p.first - first) - 0.5;
        if count == 1 {
            return Stencil::one(first);
        }
        let below = floor(w);
        let below = if wraps { below } else { clamp(below, 0.0, f64::from(count - 2)) };
        let share = w - below;
        let wrapped = |i: f64| {
            let i = if i < 0.0 { i + f64::from(count) } else { i };
            let i = if i >= f64::from(count) { i - f64::from(count) } else { i };
            first + i as u32
        };
        Stencil::two([wrapped(below), wrapped(below + 1.0)], [1.0 - share, share])
    }

    /// The elements that follow one another smoothly around `p`: first, count, and whether they close.
    fn run(&self, p: &Primitive) -> (u32, u32, bool) {
        match self.bodies.get(p.body as usize) {
            Some(body) if p.smooth == 1 => {
                let parts = self.primitives.part(body.first as usize..(body.first + body.count) as usize);
                let first = parts.first().map_or(0, |q| q.first);
                (first, parts.iter().map(|q| q.elements).sum(), body.closed == 1)
            }
            _ => (p.first, p.elements, p.kind == 0),
        }
    }
}

/// Primitives of a body.
fn segments(shape: &Shape<'_>) -> usize {
    match shape {
        Shape::Circle { .. } => 1,
        Shape::Polyline { points, closed: true, .. } => points.len(),
        Shape::Polyline { points, closed: false, .. } => points.len().saturating_sub(1),
    }
}

//! Form factors with opaque triangles in the path.
//!
//! Constants of this file are measured by `cargo test --test form_factor_visible` (errors against ray counts).

use super::convex::{CAPACITY, Convex, double_area, edges, pieces};
use super::pair::{fronts, polygon_to_polygon};
use super::patch::{HalvingPath, Patch, patches};
use super::point::point_to_polygon;
use super::rule::GAUSS_3;
use crate::base::error::Error;
use crate::base::index::{Index, IndexMut};
use crate::base::math::{Vec3, clamp, sqrt, unit};

/// Rounding of a height, as a share of the distance.
const HEIGHT_ROUNDING: f64 = 2e-15;

/// Corners of a stored piece: a triangle cut at the polygon's plane has four sides, and a piece that they cut
/// grows by one corner each, to what a [`Convex`] holds.
const STORED: usize = 6;

/// Times that a patch of the receiver is halved, at least: to meet a small shadow at all.
const SHALLOWEST: u32 = 6;

/// Factor on the resolution where patches are larger than the target is high above them: two resolutions of a narrow
/// gap agree by chance.
const NEAR_RESOLUTION_FACTOR: u32 = 4;

/// Times that a patch of the receiver is halved, at most.
const RECEIVER_HALVINGS_MOST: u32 = 26;

/// A value with the error that comes with it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// The value.
    pub value: f64,
    /// Expected bound on its absolute error. Not a bound: a shadow too small for all points of
    /// the quadrature goes unseen.
    pub error: f64,
}

/// Form factor from the point `p` with the unit normal `n` to what of a convex planar `polygon` the opaque
/// triangles `occluders` leave visible: as [`point_to_polygon`], exact but for rounding.
///
/// Occluders hide what lies behind them as seen from p, whichever side they turn; those that p sees edge-on,
/// that lie in the polygon's plane or beyond it hide nothing. `scratch` holds the convex pieces of the visible
/// part (what it holds before does not matter): an error where it has too few places; each occluder cuts the
/// pieces that its outline crosses into at most four.
///
/// Nishita and Nakamae, 1985.
pub fn visible_point_to_polygon<'o>(
    p: Vec3,
    n: Vec3,
    polygon: &[Vec3],
    occluders: impl IntoIterator<Item = &'o [Vec3; 3]>,
    scratch: &mut [Convex],
) -> Result<f64, Error> {
    let (Some(first), Some(normal)) = (polygon.first(), unit(double_area(polygon))) else {
        return Ok(0.0);
    };
    let distance = (*first - p).dot(normal);
    let (normal, distance) = if distance < 0.0 { (-normal, -distance) } else { (normal, distance) };
    let mut list = Pieces { slots: scratch, count: 0 };
    for piece in pieces(polygon) {
        list.push_front(&piece, p, n)?;
    }
    for occluder in occluders {
        if list.count == 0 {
            break;
        }
        if let Some(shadow) = Shadow::new(&occluder.map(|c| c - p), normal, distance) {
            list.subtract(&shadow)?;
        }
    }
    let visible = list.slots.iter().take(list.count);
    let sum: f64 = visible.map(|piece| point_to_polygon(Vec3::ZERO, n, piece.corners())).sum();
    Ok(sum.min(1.0))
}

/// Form factor from the convex planar polygon `a` to what of `b` the opaque triangles `occluders` leave visible: the
/// mean over a of [`visible_point_to_polygon`], one-sided as [`polygon_to_polygon`].
///
/// Gauss points on a, whose patches are halved where two resolutions differ, until the expected error (which comes
/// back, at least a quarter of it) is below about `tolerance` (absolute, > 0). Outlines of shadows bend the integrand:
/// the cost grows as the tolerance to the power -1/2. In [0, [`polygon_to_polygon`]]. `scratch` as there.
pub fn visible_polygon_to_polygon(
    a: &[Vec3],
    b: &[Vec3],
    occluders: &[[Vec3; 3]],
    tolerance: f64,
    scratch: &mut [Convex],
) -> Result<Estimate, Error> {
    let unobstructed = polygon_to_polygon(a, b);
    if unobstructed <= 0.0 {
        return Ok(Estimate { value: 0.0, error: 0.0 });
    }
    let Estimate { value, error } = visible(a, b, occluders, tolerance, scratch)?;
    // What differences show is often a hundredth of the tolerance, but so little is not to be relied on.
    let error = error.max(0.25 * tolerance).min(unobstructed);
    Ok(Estimate { value: clamp(value, 0.0, unobstructed), error })
}

/// [`visible_polygon_to_polygon`] as its differences tell.
// apart: the stack of what nothing hides is not on top of its own
#[inline(never)]
fn visible(
    a: &[Vec3],
    b: &[Vec3],
    occluders: &[[Vec3; 3]],
    tolerance: f64,
    scratch: &mut [Convex],
) -> Result<Estimate, Error> {
    let area = double_area(a);
    let size = 0.5 * sqrt(area.dot(area));
    let (mut value, mut error) = (0.0, 0.0);
    let Some(normal) = unit(area) else { return Ok(Estimate { value, error }) };
    for piece in pieces(a) {
        for target in pieces(b) {
            let Some((receiver, target)) = fronts(&piece, &target) else {
                continue;
            };
            let base = receiver.corners().first().copied().unwrap_or(Vec3::ZERO);
            let heights = target.corners().iter().map(|c| (*c - base).dot(normal));
            let height = heights.fold(0.0, f64::max);
            let tolerance = 0.25 * tolerance;
            let mut mean = Mean { normal, size, height, target, occluders, tolerance, scratch };
            if cfg!(feature = "std") {
                let mut parts = [Convex::EMPTY; RECEIVER_PARTS_MOST];
                let count = cut_along_traces(&receiver, normal, occluders, &mut parts);
                for part in parts.iter().take(count) {
                    mean.add_part(part, &mut value, &mut error)?;
                }
                continue;
            }
            // where the stack is small, one after the other, each cut anew
            let (mut at, mut part) = (0, receiver);
            while at < one_along_traces(&receiver, normal, occluders, at, &mut part) {
                mean.add_part(&part, &mut value, &mut error)?;
                at += 1;
            }
        }
    }
    Ok(Estimate { value, error })
}

/// The most parts of a receiver.
const RECEIVER_PARTS_MOST: usize = if cfg!(feature = "std") { 64 } else { 8 };

/// Cuts a receiver into parts along the lines in which occluders stand on its plane or pass it, as what is visible jumps
/// there. Returns their number.
#[inline(never)]
fn cut_along_traces(
    receiver: &Convex,
    normal: Vec3,
    occluders: &[[Vec3; 3]],
    parts: &mut [Convex; RECEIVER_PARTS_MOST],
) -> usize {
    let mut count = 1;
    parts.set(0, *receiver);
    let Some(base) = receiver.corners().first() else { return 0 };
    for occluder in occluders {
        let Some(across) = unit(double_area(occluder)) else { continue };
        let reach = occluder.iter().map(|c| (*c - *base).abs().max_element()).fold(0.0, f64::max);
        let tolerance = TRACE * reach;
        let heights = occluder.map(|c| (c - *base).dot(normal));
        let on = heights.iter().filter(|h| h.abs() <= tolerance).count();
        let crosses = heights.iter().any(|h| *h > tolerance) && heights.iter().any(|h| *h < -tolerance);
        // a corner that touches leaves no line, and what lies in the plane hides nothing
        if on == 3 || on < 2 && !crosses {
            continue;
        }
        let beside = |c: Vec3| (c - occluder[0]).dot(across);
        let before = count;
        for at in 0..before {
            let Some(part) = parts.get(at).copied() else { continue };
            let [one, other] = [part.clip(beside, tolerance), part.clip(|c| -beside(c), tolerance)];
            if one.is_empty()
                || other.is_empty()
                || count == RECEIVER_PARTS_MOST
                || part.corners().len() + 2 > CAPACITY
            {
                continue;
            }
            parts.set(at, one);
            parts.set(count, other);
            count += 1;
        }
    }
    count
}

/// One of the parts of [`cut_along_traces`]. Returns their number.
#[inline(never)]
fn one_along_traces(
    receiver: &Convex,
    normal: Vec3,
    occluders: &[[Vec3; 3]],
    at: usize,
    out: &mut Convex,
) -> usize {
    let mut parts = [Convex::EMPTY; RECEIVER_PARTS_MOST];
    let count = cut_along_traces(receiver, normal, occluders, &mut parts);
    if let Some(part) = parts.get(at) {
        *out = *part;
    }
    count
}

/// Corners of occluders that come this near to the receiver's plane stand on it, as a share of the distance: coordinates
/// that were turned are off by some roundings.
const TRACE: f64 = 1e-12;

/// The directions that a convex occluder hides: those on the positive side of all planes through the point.
struct Shadow {
    normals: Convex,
}

impl Shadow {
    /// The shadow of a triangle, seen from the origin, on the plane normal . x = distance, distance >= 0; none
    /// where it is seen edge-on or lies beyond that plane.
    #[cfg_attr(target_pointer_width = "32", inline(never))]
    fn new(triangle: &[Vec3; 3], normal: Vec3, distance: f64) -> Option<Shadow> {
        let reach = sqrt(triangle.iter().fold(0.0, |m: f64, c| m.max(c.length_squared())));
        let tolerance = HEIGHT_ROUNDING * reach.max(distance);
        let before = Convex::new(triangle).clip(|c| distance - c.dot(normal), tolerance);
        let facing = before.corners().first()?.dot(unit(double_area(triangle))?);
        if facing.abs() <= HEIGHT_ROUNDING * reach {
            return None;
        }
        let mut normals = Convex::EMPTY;
        for (a, b) in edges(before.corners()) {
            if let Some(m) = unit(a.cross(b - a)) {
                normals.push(if facing > 0.0 { m } else { -m });
            }
        }
        Some(Shadow { normals })
    }

    /// The hidden part of a piece.
    fn hidden(&self, piece: &Convex, tolerance: f64) -> Convex {
        self.normals.corners().iter().fold(*piece, |part, m| part.clip(|c| c.dot(*m), tolerance))
    }
}

/// The visible pieces in the caller's memory: the first `count` slots.
struct Pieces<'s> {
    slots: &'s mut [Convex],
    count: usize,
}

impl Pieces<'_> {
    /// Appends what of a piece is before the plane of a point, seen from there.
    #[cfg_attr(target_pointer_width = "32", inline(never))]
    fn push_front(&mut self, piece: &Convex, p: Vec3, n: Vec3) -> Result<(), Error> {
        self.push(&piece.map(|c| c - p).clip(|c| c.dot(n), 0.0))
    }

    /// Appends a piece, in two where it has many corners; one without area is left out.
    #[cfg_attr(target_pointer_width = "32", inline(never))]
    fn push(&mut self, piece: &Convex) -> Result<(), Error> {
        let corners = piece.corners();
        let middle = corners.len() / 2;
        match (corners.get(..=middle), corners.get(middle..), corners.first()) {
            _ if piece.is_empty() => Ok(()),
            (Some(head), Some(tail), Some(first)) if corners.len() > STORED => {
                let mut rest = Convex::new(tail);
                rest.push(*first);
                self.store(Convex::new(head))?;
                self.store(rest)
            }
            _ => self.store(*piece),
        }
    }

    fn store(&mut self, piece: Convex) -> Result<(), Error> {
        let limit = self.slots.len();
        let slot = self.slots.get_mut(self.count);
        *slot.ok_or(Error::TooMany { what: "visible pieces of a polygon", limit })? = piece;
        self.count += 1;
        Ok(())
    }

    fn copy(&mut self, from: usize, to: usize) {
        let piece = self.slots.get(from).copied();
        if let (Some(piece), Some(slot)) = (piece, self.slots.get_mut(to)) {
            *slot = piece;
        }
    }

    /// Takes a shadow out of all pieces.
    #[cfg_attr(target_pointer_width = "32", inline(never))]
    fn subtract(&mut self, shadow: &Shadow) -> Result<(), Error> {
        let mut index = 0;
        let mut untouched = self.count;
        while index < untouched {
            let Some(piece) = self.slots.get(index).copied() else {
                break;
            };
            let reach = piece.corners().iter().fold(0.0, |m: f64, c| m.max(c.abs().max_element()));
            let tolerance = HEIGHT_ROUNDING * reach;
            if shadow.hidden(&piece, tolerance).is_empty() {
                index += 1;
                continue;
            }
            // The last untouched piece takes this one's slot, the last new one takes that one's.
            untouched -= 1;
            self.count -= 1;
            self.copy(untouched, index);
            self.copy(self.count, untouched);
            let mut rest = piece;
            for m in shadow.normals.corners() {
                self.push(&rest.clip(|c| -c.dot(*m), tolerance))?;
                rest = rest.clip(|c| c.dot(*m), tolerance);
            }
        }
        Ok(())
    }
}

/// The mean over the receiver of the factor from its points to the visible part of the target.
struct Mean<'m> {
    normal: Vec3,
    /// Area of the receiver, over which the mean is taken.
    size: f64,
    /// How far above its plane the target rises.
    height: f64,
    target: Convex,
    occluders: &'m [[Vec3; 3]],
    tolerance: f64,
    scratch: &'m mut [Convex],
}

impl Mean<'_> {
    /// Adds a part's of the mean, and its error.
    #[cfg_attr(not(target_pointer_width = "32"), inline)]
    fn add_part(&mut self, part: &Convex, value: &mut f64, error: &mut f64) -> Result<(), Error> {
        for patch in patches(part.corners()) {
            let coarse = self.over(&patch)?;
            let part = self.refined(&patch, coarse)?;
            *value += part.value;
            *error += part.error;
        }
        Ok(())
    }

    /// A patch's part of the mean, by one rule.
    #[cfg_attr(target_pointer_width = "32", inline(never))]
    fn over(&mut self, patch: &Patch) -> Result<f64, Error> {
        let mut sum = 0.0;
        for (p, area) in patch.nodes(self.normal, GAUSS_3) {
            let target = self.target.corners();
            sum += area * visible_point_to_polygon(p, self.normal, target, self.occluders, self.scratch)?;
        }
        Ok(sum / self.size)
    }

    /// The same, halved until both resolutions agree.
    ///
    /// The patches that a shadow's outline bends lie along it, and are as many as it is longer than they are:
    /// each may differ by the tolerance times its own length's share. Along an outline the difference falls by
    /// 2.8 a halving and is shared by two: less than a quarter of the parent's is taken for chance.
    #[cfg_attr(target_pointer_width = "32", inline(never))]
    fn refined(&mut self, whole: &Patch, coarse: f64) -> Result<Estimate, Error> {
        let mut halvings = [Halving::default(); RECEIVER_HALVINGS_MOST as usize];
        let (mut path, mut patch, mut coarse, mut parent) =
            (HalvingPath::default(), *whole, coarse, f64::INFINITY);
        // two halvings halve the size
        let (mut shallowest, mut square) = (SHALLOWEST, whole.size() * whole.size());
        square /= f64::from(1u32 << SHALLOWEST);
        while 4.0 * square > self.height * self.height && shallowest < SHALLOWEST + NEAR_RESOLUTION_FACTOR {
            (shallowest, square) = (shallowest + 1, 0.5 * square);
        }
        loop {
            let (low, high) = (self.over(&patch.half(false))?, self.over(&patch.half(true))?);
            let difference = (low + high - coarse).abs();
            let error = difference.max(0.25 * parent);
            let within = error <= self.tolerance * patch.size() / sqrt(self.size);
            let depth = path.depth();
            if !(within && depth >= shallowest) && path.down(RECEIVER_HALVINGS_MOST) {
                halvings.set(depth as usize, Halving { difference, high, ..Halving::default() });
                (patch, coarse, parent) = (patch.half(false), low, difference);
                continue;
            }
            let mut done = Estimate { value: low + high, error };
            while path.up() {
                let Halving { low_value, low_error, .. } = halvings.at(path.depth() as usize);
                done = Estimate { value: low_value + done.value, error: low_error + done.error };
            }
            if !path.across() {
                return Ok(done);
            }
            if let Some(halving) = halvings.get_mut(path.depth() as usize - 1) {
                (halving.low_value, halving.low_error) = (done.value, done.error);
                (coarse, parent) = (halving.high, halving.difference);
            }
            patch = path.steps().fold(*whole, |patch, upper| patch.half(upper));
        }
    }
}

/// A patch that was halved, on the path to its halves' parts.
#[derive(Clone, Copy, Default)]
struct Halving {
    /// How far both resolutions were apart.
    difference: f64,
    /// The upper half by one rule.
    high: f64,
    /// Result of the lower half, once there is one.
    low_value: f64,
    low_error: f64,
}

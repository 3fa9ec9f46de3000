//! From polygon to polygon, nothing in the path.
//!
//! Constants of this file are measured by `cargo test --test form_factor_pairs` (errors) and `cargo bench --bench counts`
//! (instructions).

use super::contour;
use super::convex::{Convex, double_area, edges, pieces};
use super::patch::{HalvingPath, Patch, patches};
use super::rule::Rule;
use crate::base::math::{FRAC_1_PI, Vec3, sqrt, unit};
use crate::base::simd::Isa;
use core::cmp::Ordering;

/// Heights below this share of the pair's extent are rounding: the corner lies on the other's plane.
pub(super) const PAIR_PLANE_ROUNDING: f64 = 1e-15;

/// The contour form loses this many times the rounding of one operation before the area form takes over.
const CANCELLATION: f64 = 1e5;

/// Patch pairs that the area form may spend on one pair of polygons.
const BUDGET: u32 = 4000;

/// Times that the area form may halve a patch: touching patches never get far enough apart.
const AREA_FORM_HALVINGS_MOST: u32 = 32;

/// Form factor from polygon `a` to polygon `b`, both convex and planar: the mean over a of
/// [`point_to_polygon`](super::point_to_polygon), [`exchange_area`] / area of a.
///
/// One-sided: only the sides from which the corners run counter-clockwise see each other; the parts behind the
/// other's plane are cut off. 0 where a polygon has no area.
pub fn polygon_to_polygon(a: &[Vec3], b: &[Vec3]) -> f64 {
    let area = 0.5 * length(double_area(a));
    let factor = exchange_area(a, b) / area;
    if factor >= 0.0 { factor.min(1.0) } else { 0.0 }
}

/// Exchange area A_a F_ab of two convex planar polygons, in the square of the unit of length: one-sided, as
/// [`polygon_to_polygon`]. The same bits for (a, b) and (b, a). In [0, min(A_a, A_b)].
///
/// Relative error 1e-10 for separated polygons, however far, and for needles; 1e-9 for polygons that touch. (Of
/// 100,000 random pairs of triangles 99.9 in 100 are within 3e-11; the worst, that see each other edge-on,
/// within 3e-9.) Where polygons of very unlike extent touch, rounding adds 1e-16 L_a L_b / (A_a F_ab) for
/// perimeters L.
pub fn exchange_area(a: &[Vec3], b: &[Vec3]) -> f64 {
    exchange_area_with(Isa::BASELINE, a, b)
}

/// [`exchange_area`] on an instruction set, with the same bits.
pub(super) fn exchange_area_with(isa: Isa, a: &[Vec3], b: &[Vec3]) -> f64 {
    let limit = 0.5 * length(double_area(a)).min(length(double_area(b)));
    let (first, second) = if in_order(a, b) { (a, b) } else { (b, a) };
    let Some(origin) = first.first() else {
        return 0.0;
    };
    let extent = |m: f64, c: &Vec3| m.max((*c - *origin).abs().max_element());
    let extent = second.iter().fold(first.iter().fold(0.0, extent), extent);
    let Some(scale) = power_of_two_below(extent) else {
        return 0.0;
    };
    let local = |piece: Convex| piece.map(|c| (c - *origin) / scale);
    let mut sum = 0.0;
    for p in pieces(first).map(local) {
        for q in pieces(second).map(local) {
            sum += exchange(isa, &p, &q);
        }
    }
    let value = sum * scale * scale;
    if value >= 0.0 { value.min(limit) } else { 0.0 }
}

/// One order for both ways of naming the pair: smaller area first, then by the corners' numbers.
fn in_order(a: &[Vec3], b: &[Vec3]) -> bool {
    let by_area = double_area(a).length_squared().total_cmp(&double_area(b).length_squared());
    let numbers = |v: &Vec3| v.to_array();
    let by_corners = || {
        let pairs = a.iter().flat_map(numbers).zip(b.iter().flat_map(numbers));
        pairs.map(|(x, y)| x.total_cmp(&y)).find(|o| o.is_ne()).unwrap_or(a.len().cmp(&b.len()))
    };
    by_area.then_with(by_corners) != Ordering::Greater
}

/// The power of two in (x/2, x]; none where x is zero, subnormal, not finite or its square overflows.
pub(super) fn power_of_two_below(x: f64) -> Option<f64> {
    const EXPONENT: u64 = 0x7ff << 52;
    (x > 1e-150 && x < 1e150).then(|| f64::from_bits(x.to_bits() & EXPONENT))
}

/// The parts of two pieces that lie before each other's planes; none where either is empty.
pub(super) fn fronts(a: &Convex, b: &Convex) -> Option<(Convex, Convex)> {
    let (na, nb) = (unit(double_area(a.corners()))?, unit(double_area(b.corners()))?);
    let (pa, pb) = (*a.corners().first()?, *b.corners().first()?);
    let reach =
        b.corners().iter().chain(a.corners()).fold(0.0, |m: f64, c| m.max((*c - pa).abs().max_element()));
    let front_a = a.clip(|v| (v - pb).dot(nb), PAIR_PLANE_ROUNDING * reach);
    let front_b = b.clip(|v| (v - pa).dot(na), PAIR_PLANE_ROUNDING * reach);
    (!front_a.is_empty() && !front_b.is_empty()).then_some((front_a, front_b))
}

/// Exchange area of two pieces whose extent is about 1.
// apart, as the two ways that it may go: none burdens the stack of another
#[inline(never)]
fn exchange(isa: Isa, a: &Convex, b: &Convex) -> f64 {
    let (Some(na), Some(nb)) = (unit(double_area(a.corners())), unit(double_area(b.corners()))) else {
        return 0.0;
    };
    let Some((front_a, front_b)) = fronts(a, b) else {
        return 0.0;
    };
    if let Some(sum) = by_area(&front_a, na, &front_b, nb, 0) {
        return sum;
    }
    let sum = contour::integral(isa, &front_a, &front_b).max(0.0) * (0.5 * FRAC_1_PI);
    if sum * CANCELLATION < perimeter(&front_a) * perimeter(&front_b) {
        return by_area(&front_a, na, &front_b, nb, BUDGET).unwrap_or(sum);
    }
    sum
}

/// The area form, free of cancellation: over all patches of both polygons, split until far enough apart; none
/// where that takes more than `splits` splits, which is found before any is computed: polygons that touch never do.
#[inline(never)]
fn by_area(a: &Convex, na: Vec3, b: &Convex, nb: Vec3, splits: u32) -> Option<f64> {
    let pairs = || patches(a.corners()).flat_map(|p| patches(b.corners()).map(move |q| (p, q)));
    let mut left = splits;
    for (p, q) in pairs() {
        split(&p, &q, &mut left, &mut |_, _, _| {})?;
    }
    let (mut left, mut sum) = (splits, 0.0);
    for (p, q) in pairs() {
        split(&p, &q, &mut left, &mut |p, q, rule| sum += Patch::product(p, na, q, nb, rule))?;
    }
    Some(sum)
}

/// Halves two patches until each pair of parts is far enough apart for a rule, and gives those to `work`; none where that
/// takes too many splits.
///
/// Lower halves first. What waits is not kept on a stack: the path to a part, upper or lower half by level, says how to get
/// it from the whole.
fn split(a: &Patch, b: &Patch, left: &mut u32, work: &mut impl FnMut(&Patch, &Patch, Rule)) -> Option<()> {
    let (mut p, mut q) = (*a, *b);
    let mut path = HalvingPath::default();
    loop {
        if let Some(rule) = Patch::rule(&p, &q) {
            work(&p, &q, rule);
            if !path.next() {
                return Some(());
            }
            (p, q) = (*a, *b);
            path.steps().for_each(|upper| halve(&mut p, &mut q, upper));
        } else {
            *left = left.checked_sub(1)?;
            if !path.down(AREA_FORM_HALVINGS_MOST) {
                return None;
            }
            halve(&mut p, &mut q, false);
        }
    }
}

/// Puts a half in the place of the larger patch.
fn halve(a: &mut Patch, b: &mut Patch, upper: bool) {
    let larger = if a.size() >= b.size() { a } else { b };
    *larger = larger.half(upper);
}

/// Sum of the sides.
fn perimeter(polygon: &Convex) -> f64 {
    edges(polygon.corners()).map(|(a, b)| length(b - a)).sum()
}

/// Length of a vector.
fn length(v: Vec3) -> f64 {
    sqrt(v.dot(v))
}

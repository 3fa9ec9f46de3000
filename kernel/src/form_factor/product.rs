//! The area form of the exchange area, of eight pairs of patches side by side.
//!
//! Constants of this file are measured by `cargo test --test form_factor_pairs` (errors) and `cargo bench --bench counts`
//! (instructions).

use super::cubature::{CUBATURE_POINTS_MOST, CUBATURE_RULES, Points, SQUARE, TRIANGLE};
use super::pair::PAIR_PLANE_ROUNDING;
use crate::base::arena::plain_table;
use crate::base::index::{Index, IndexMut, pieces};
use crate::base::math::{FRAC_1_PI, Vec3, fabs, sqrt};
use crate::base::simd::{Lanes64, WIDTH, Wide, WideTask};

/// A number in each lane.
pub(super) type Eight = [f64; WIDTH];

plain_table! {
    /// Eight patches, lane by lane: triangles with the sides u and v, parallelograms, or quadrilaterals. All are the
    /// triangles (u, far) and (far, v), of a triangle the second empty. Lanes left over hold zeros.
    pub struct Block {
        pub corner: [Eight; 3],
        pub u: [Eight; 3],
        pub v: [Eight; 3],
        /// From the corner to the opposite one; of a triangle v again.
        pub far: [Eight; 3],
        pub normal: [Eight; 3],
        /// Of the triangles (u, far) and (far, v).
        pub areas: [Eight; 2],
        /// Mean of the corners.
        pub centre: [Eight; 3],
        /// Of the sphere about the centre that holds the patch.
        pub radius: Eight,
        /// Length that distances are compared with to choose a rule.
        pub size: Eight,
        /// A [`Shape`]'s number.
        pub shape: Eight,
    }
}

/// Shape as which rules take a patch.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Shape {
    Triangle,
    Parallelogram,
    Quadrilateral,
}

/// Number of shapes.
pub(super) const SHAPES: usize = 3;

impl Shape {
    /// Of these corners, three or four.
    fn of([a, b, c, d]: &[Vec3; 4], normal: Vec3) -> Shape {
        let (u, v) = (*b - *a, *d - *a);
        let twist = (*c - *a) - u - v;
        // What is left of a rule's error where a quadrilateral so near to a parallelogram is taken for one: 1e-12.
        let near = |part: f64, whole: f64| fabs(part) <= 1e-6 * fabs(whole);
        let area = u.cross(v).dot(normal);
        if c == d {
            Shape::Triangle
        } else if near(u.cross(twist).dot(normal), area)
            && near(twist.cross(v).dot(normal), area)
            && twist.length_squared() <= 1e-12 * (u.length_squared() + v.length_squared())
        {
            Shape::Parallelogram
        } else {
            Shape::Quadrilateral
        }
    }

    pub(super) fn number(self) -> usize {
        match self {
            Shape::Triangle => 0,
            Shape::Parallelogram => 1,
            Shape::Quadrilateral => 2,
        }
    }

    pub(super) fn numbered(number: usize) -> Shape {
        match number {
            0 => Shape::Triangle,
            1 => Shape::Parallelogram,
            _ => Shape::Quadrilateral,
        }
    }
}

impl Block {
    /// No patches.
    pub(super) const EMPTY: Block = Block {
        corner: [[0.0; WIDTH]; 3],
        u: [[0.0; WIDTH]; 3],
        v: [[0.0; WIDTH]; 3],
        far: [[0.0; WIDTH]; 3],
        normal: [[0.0; WIDTH]; 3],
        areas: [[0.0; WIDTH]; 2],
        centre: [[0.0; WIDTH]; 3],
        radius: [0.0; WIDTH],
        size: [0.0; WIDTH],
        shape: [0.0; WIDTH],
    };

    /// Puts the patch with these corners (the last twice where there are three) and this unit normal into a lane.
    pub(super) fn set(&mut self, lane: usize, corners: &[Vec3; 4], normal: Vec3) {
        let [a, b, c, d] = *corners;
        let (u, v, far) = (b - a, d - a, c - a);
        let shape = Shape::of(corners, normal);
        let half = |x: Vec3, y: Vec3| 0.5 * x.cross(y).dot(normal).max(0.0);
        let centre = if shape == Shape::Triangle { (a + b + c) / 3.0 } else { (a + b + c + d) * 0.25 };
        let radius = sqrt(corners.iter().fold(0.0, |m: f64, c| m.max((*c - centre).length_squared())));
        let values = [a, u, v, far, normal, centre];
        let places =
            [&mut self.corner, &mut self.u, &mut self.v, &mut self.far, &mut self.normal, &mut self.centre];
        for (place, value) in places.into_iter().zip(values) {
            place.iter_mut().zip(value.to_array()).for_each(|(lanes, x)| lanes.set(lane, x));
        }
        self.areas.iter_mut().zip([half(u, far), half(far, v)]).for_each(|(lanes, x)| lanes.set(lane, x));
        self.radius.set(lane, radius);
        self.size.set(lane, if shape == Shape::Parallelogram { radius * PARALLELOGRAM } else { radius });
        self.shape.set(lane, shape.number() as f64);
    }

    /// The shape of a lane's patch.
    pub(super) fn shape(&self, lane: usize) -> Shape {
        Shape::numbered(self.shape.at(lane) as usize)
    }

    /// Copies what a product needs of one lane of `from`.
    #[inline]
    pub(super) fn copy(&mut self, lane: usize, from: &Block, source: usize) {
        let pairs = [
            (&mut self.corner, &from.corner),
            (&mut self.u, &from.u),
            (&mut self.v, &from.v),
            (&mut self.far, &from.far),
            (&mut self.normal, &from.normal),
        ];
        for (to, from) in pairs {
            to.iter_mut().zip(from).for_each(|(to, from)| to.set(lane, from.at(source)));
        }
        self.areas.iter_mut().zip(&from.areas).for_each(|(to, from)| to.set(lane, from.at(source)));
    }

    /// A block with one lane's patch in all lanes.
    pub(super) fn spread(&self, lane: usize) -> Block {
        let one = |lanes: Eight| [lanes.at(lane); WIDTH];
        Block {
            corner: self.corner.map(one),
            u: self.u.map(one),
            v: self.v.map(one),
            far: self.far.map(one),
            normal: self.normal.map(one),
            areas: self.areas.map(one),
            centre: self.centre.map(one),
            radius: one(self.radius),
            size: one(self.size),
            shape: one(self.shape),
        }
    }
}

/// A vector in each lane.
#[derive(Clone, Copy)]
pub(super) struct Wide3<F>(F, F, F);

impl<F: Wide> Wide3<F> {
    #[inline(always)]
    pub(super) fn load(lanes: impl Lanes64<F = F>, [x, y, z]: &[Eight; 3]) -> Self {
        Wide3(lanes.of(x), lanes.of(y), lanes.of(z))
    }

    #[inline(always)]
    pub(super) fn minus(self, o: Self) -> Self {
        Wide3(self.0 - o.0, self.1 - o.1, self.2 - o.2)
    }

    #[inline(always)]
    pub(super) fn plus(self, o: Self) -> Self {
        Wide3(self.0 + o.0, self.1 + o.1, self.2 + o.2)
    }

    #[inline(always)]
    pub(super) fn times(self, f: F) -> Self {
        Wide3(self.0 * f, self.1 * f, self.2 * f)
    }

    #[inline(always)]
    pub(super) fn dot(self, o: Self) -> F {
        self.0 * o.0 + self.1 * o.1 + self.2 * o.2
    }
}

/// Points of a patch: x, y, z and weight, lane by lane.
#[derive(Clone, Copy)]
#[repr(align(64))]
pub(super) struct Place([Eight; 4]);

/// Room for the points of one side: of a quadrilateral, those of two triangles.
pub(super) type Places = [Place; PRODUCT_POINTS];

/// Points of one side at most: those of the largest rule on two triangles.
pub(super) const PRODUCT_POINTS: usize = 2 * CUBATURE_POINTS_MOST;

impl Place {
    pub(super) const NONE: Place = Place([[0.0; WIDTH]; 4]);
}

/// The rule of a side.
#[derive(Clone, Copy)]
pub(super) struct Rule {
    pub number: usize,
    pub shape: Shape,
}

impl Rule {
    fn points(self) -> Points {
        let rules: &[Points; CUBATURE_RULES] =
            if self.shape == Shape::Parallelogram { &SQUARE } else { &TRIANGLE };
        rules.get(self.number).copied().unwrap_or(&[])
    }
}

/// Exchange areas of eight pairs of patches that lie before each other's planes, by a product of two rules.
///
/// r cos is the height of one point over the other's plane, and does not depend on where the other is: the weight of a
/// point is its area times its height, and a pair of points costs 1/r^4. Four of those are summed over a common
/// denominator, since a division costs as much as ten products.
pub(super) struct Product<'a> {
    pub first: &'a Block,
    pub first_rule: Rule,
    pub second: &'a Block,
    pub second_rule: Rule,
    pub places: &'a mut Places,
}

/// A triangle or parallelogram in each lane.
#[derive(Clone, Copy)]
struct Side<F> {
    corner: Wide3<F>,
    u: Wide3<F>,
    v: Wide3<F>,
    area: F,
    /// Height of the corner over the other's plane, and what it grows by along the sides.
    height: F,
    rise_u: F,
    rise_v: F,
}

impl<F: Wide> Side<F> {
    /// One part of a patch or, of a quadrilateral, both. `corner`: where it lies; `from`: the way to it from a point of the
    /// other's plane.
    #[inline(always)]
    fn parts(
        lanes: impl Lanes64<F = F>,
        own: &Block,
        shape: Shape,
        corner: Wide3<F>,
        from: Wide3<F>,
        other: &Block,
    ) -> ([Side<F>; 2], usize) {
        let normal = Wide3::load(lanes, &other.normal);
        let height = from.dot(normal);
        let (u, v, far) =
            (Wide3::load(lanes, &own.u), Wide3::load(lanes, &own.v), Wide3::load(lanes, &own.far));
        let (area, second) = (lanes.of(&own.areas[0]), lanes.of(&own.areas[1]));
        let (rise_u, rise_v, rise_far) = (u.dot(normal), v.dot(normal), far.dot(normal));
        let whole = Side { corner, u, v, area: area + second, height, rise_u, rise_v };
        match shape {
            Shape::Quadrilateral => {
                let first = Side { v: far, rise_v: rise_far, area, ..whole };
                ([first, Side { u: far, rise_u: rise_far, area: second, ..whole }], 2)
            }
            _ => ([whole, whole], 1),
        }
    }

    /// A point and its weight: its area times its height, which is below zero by rounding alone.
    #[inline(always)]
    fn point(&self, lanes: impl Lanes64<F = F>, [s, t, weight]: &[f64; 3]) -> (Wide3<F>, F) {
        let (s, t) = (lanes.all(*s), lanes.all(*t));
        let height = self.height + self.rise_u * s + self.rise_v * t;
        let weight = lanes.all(*weight) * self.area * height.max(lanes.all(0.0));
        (self.corner.plus(self.u.times(s)).plus(self.v.times(t)), weight)
    }
}

impl WideTask for Product<'_> {
    type Out = Eight;

    #[inline(always)]
    fn run<L: Lanes64>(self, lanes: L) -> Eight {
        let Product { first, first_rule, second, second_rule, places } = self;
        let zero = lanes.all(0.0);
        let none = Wide3(zero, zero, zero);
        let to = Wide3::load(lanes, &second.corner).minus(Wide3::load(lanes, &first.corner));
        let (parts, count) = Side::parts(lanes, second, second_rule.shape, to, to, first);
        let rule = second_rule.points();
        for (part, places) in parts.iter().take(count).zip(pieces(&mut places[..], rule.len())) {
            for (place, point) in places.iter_mut().zip(rule) {
                let (Wide3(x, y, z), weight) = part.point(lanes, point);
                place.0 = [x.array(), y.array(), z.array(), weight.array()];
            }
        }
        let (fours, rest) = places.head(count * rule.len()).as_chunks::<4>();
        let (parts, count) = Side::parts(lanes, first, first_rule.shape, none, none.minus(to), second);
        let mut sum = zero;
        for part in parts.iter().take(count) {
            for point in first_rule.points() {
                let (from, weight) = part.point(lanes, point);
                let mut row = zero;
                for four in fours {
                    let [a, b, c, d] = four;
                    let (a, wa) = fourth_power(lanes, a, from);
                    let (b, wb) = fourth_power(lanes, b, from);
                    let (c, wc) = fourth_power(lanes, c, from);
                    let (d, wd) = fourth_power(lanes, d, from);
                    let (ab, cd) = (a * b, c * d);
                    row = row + ((wa * b + wb * a) * cd + (wc * d + wd * c) * ab) / (ab * cd);
                }
                for place in rest {
                    let (r4, w) = fourth_power(lanes, place, from);
                    row = row + w / r4;
                }
                sum = sum + weight * row;
            }
        }
        (sum * lanes.all(FRAC_1_PI)).array()
    }
}

/// r^4 from a point to a place, and the place's weight.
#[inline(always)]
fn fourth_power<L: Lanes64>(lanes: L, place: &Place, from: Wide3<L::F>) -> (L::F, L::F) {
    let [x, y, z, weight] = &place.0;
    let r = Wide3(lanes.of(x), lanes.of(y), lanes.of(z)).minus(from);
    let r2 = r.dot(r);
    (r2 * r2, lanes.of(weight))
}

/// In place of the number of a pair's rules: one patch lies behind the other.
pub(super) const BEHIND: u8 = 254;

/// In place of the number of a pair's rules: no rule is exact enough.
pub(super) const EXACT: u8 = 255;

/// Rules of the pairs of one patch, spread over all lanes, and eight others, by lane: [`BEHIND`],
/// [`EXACT`], or the number of the rule for the own patch times [`CUBATURE_RULES`] and that for the other's.
pub(super) struct Classes<'a> {
    pub own: &'a Block,
    pub others: &'a Block,
    pub least: &'a [f64; CUBATURE_RULES],
}

/// How much larger than a triangle of the same radius a parallelogram counts, to be integrated as exactly.
const PARALLELOGRAM: f64 = 1.16;

/// Patches nearer than this, in units of the scene's extent, are left to the exact forms: r^16 would be subnormal.
const NEAREST: f64 = 1e-15;

impl WideTask for Classes<'_> {
    type Out = [u8; WIDTH];

    #[inline(always)]
    fn run<L: Lanes64>(self, lanes: L) -> [u8; WIDTH] {
        let Classes { own, others, least } = self;
        let zero = lanes.all(0.0);
        let to = Wide3::load(lanes, &others.corner).minus(Wide3::load(lanes, &own.corner));
        let apart = Wide3::load(lanes, &others.centre).minus(Wide3::load(lanes, &own.centre));
        let (radius, other_radius) = (lanes.of(&own.radius), lanes.of(&others.radius));
        let extent = apart.0.abs() + apart.1.abs() + apart.2.abs() + (radius + other_radius);
        let slack = extent * lanes.all(PAIR_PLANE_ROUNDING);
        let (own_normal, other_normal) =
            (Wide3::load(lanes, &own.normal), Wide3::load(lanes, &others.normal));
        let (high, low) = heights(lanes, to.dot(own_normal), others, own_normal);
        let (own_high, own_low) = heights(lanes, zero - to.dot(other_normal), own, other_normal);
        let seen = L::F::bits(high.gt(slack)) & L::F::bits(own_high.gt(slack));
        let before = L::F::bits(low.gt(zero - slack)) & L::F::bits(own_low.gt(zero - slack));
        let distance2 = apart.dot(apart);
        let mine = rule_number(lanes, least, lanes.of(&own.size), other_radius, distance2);
        let theirs = rule_number(lanes, least, lanes.of(&others.size), radius, distance2);
        // small whole numbers, all of them exact
        let rules = lanes.all(CUBATURE_RULES as f64);
        let far = L::F::bits(rules.gt(mine)) & L::F::bits(rules.gt(theirs)) & before;
        let numbers = (mine * rules + theirs).array();
        let mut classes = [EXACT; WIDTH];
        for (lane, (class, number)) in classes.iter_mut().zip(numbers).enumerate() {
            if seen >> lane & 1 == 0 {
                *class = BEHIND;
            } else if far >> lane & 1 == 1 {
                *class = number as u8;
            }
        }
        classes
    }
}

/// The greatest and the least height of a patch's corners over a plane, `base` being the first's.
#[inline(always)]
fn heights<L: Lanes64>(lanes: L, base: L::F, patch: &Block, normal: Wide3<L::F>) -> (L::F, L::F) {
    let a = base + Wide3::load(lanes, &patch.u).dot(normal);
    let b = base + Wide3::load(lanes, &patch.v).dot(normal);
    let c = base + Wide3::load(lanes, &patch.far).dot(normal);
    let zero = lanes.all(0.0);
    let low = (zero - base).max(zero - a).max((zero - b).max(zero - c));
    (base.max(a).max(b.max(c)), zero - low)
}

/// Number of the smallest rule for a patch at such a distance; [`CUBATURE_RULES`] where none is exact enough.
#[inline(always)]
fn rule_number<L: Lanes64>(
    lanes: L,
    least: &[f64; CUBATURE_RULES],
    size: L::F,
    other: L::F,
    distance2: L::F,
) -> L::F {
    let mut number = lanes.all(CUBATURE_RULES as f64);
    for least in least {
        let distance = size * lanes.all(*least) + other + lanes.all(NEAREST);
        let far = distance2.gt(distance * distance);
        number = (number - lanes.all(1.0)).where_else(far, number);
    }
    number
}

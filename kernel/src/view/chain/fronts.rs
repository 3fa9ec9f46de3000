//! Light from all elements that face a point, in closed form, as if none hid another: the control variate of final
//! gathering. Rays from the point then find the difference alone, which is what hidden elements do not bring, what linear
//! functions over elements add, and mirrors.
//!
//! The sum over elements of form factor times mean radiance is exact to rounding. A ray's expected sum over all elements
//! that it crosses is the same sum, so that the estimate stays unbiased whatever the radiances.

use super::gather::{BANDS, GATHERS};
use super::{SIGNS, Solved, sign};
use crate::base::arena::{Arena, Need};
use crate::base::error::Error;
use crate::base::index::{Index, IndexMut};
use crate::base::math::{FRAC_1_PI, TAU, Vec3, sqrt};
use crate::base::simd::{Isa, Lanes64, WIDTH, Wide, WideTask, run_wide, spread, wide_dot};
use crate::coupling::mirror_path::STRAIGHT;
use crate::coupling::{Record, RowView};
use crate::form_factor::angle::lambert_term;
use crate::form_factor::point_to_triangle;
use crate::rays::ray::Hit;

/// Most elements that are looked at from the points of one: with more, rays cost less.
const FRONTS_MOST: usize = if GATHERS { 4096 } else { 0 };

/// Cost of looking at one element from a point, in rays. Measured by `cargo bench --bench peers`.
const FRONT_COST: f64 = 0.05;

/// Height over a point's plane, in scene coordinates, up to which an element lies in it.
const FRONT_HEIGHT_LEAST: f64 = 1e-12;

/// Least share of what a row's rays have met that single facets and their parts make up: clusters have no closed form.
const SINGLE_SHARE_LEAST: f64 = 0.5;

/// Rows of a [`Block`]: three corners, the normal and the plane's distance from the origin.
const BLOCK_ROWS: usize = 13;

/// Corners, normal and distance from the origin of [`WIDTH`] elements, lane by lane.
type Block = [[f64; WIDTH]; BLOCK_ROWS];

/// Corners of [`WIDTH`] elements relative to a point, lane by lane.
type Active = [[f64; WIDTH]; 9];

/// What a point receives from the elements that face it, as if nothing hid any, over pi.
#[derive(Clone, Copy, Debug)]
pub(super) struct Facing {
    /// Irradiance of each band.
    pub light: [f64; BANDS],
    /// Share of the hemisphere that they would fill.
    pub share: f64,
    /// Expected errors, with each set of signs.
    pub signed: [f64; SIGNS],
}

/// [`Tables`] where final gathering is available: no room on small stacks.
#[derive(Debug)]
pub(crate) struct Fronts<'m>([Tables<'m>; GATHERS as usize]);

/// The elements that the latest receiver's row has met, and their mean radiance.
#[derive(Debug)]
pub(super) struct Tables<'m> {
    blocks: &'m mut [Block],
    unknowns: &'m mut [u32],
    /// Mean radiance of each of them by band, and last its expected error relative to the reference radiance.
    light: &'m mut [f64],
    /// By unknown of the scene: where it stands among them, if that tells the same.
    places: &'m mut [u32],
    count: usize,
    /// The receiver, and one; 0 at first.
    receiver: usize,
    /// Whether the tables are filled for it.
    made: bool,
}

impl<'m> Fronts<'m> {
    /// Adds the memory for a scene of `unknowns` unknowns.
    pub fn need(need: Need, unknowns: usize, bands: usize) -> Need {
        let most = FRONTS_MOST.min(unknowns);
        let need = need.and::<Block>(most.div_ceil(WIDTH)).and::<u32>(most);
        need.and::<f64>(most * (bands + 1)).and::<u32>(if most > 0 { unknowns } else { 0 })
    }

    /// Takes that memory.
    pub fn new(arena: &mut Arena<'m>, unknowns: usize, bands: usize) -> Result<Fronts<'m>, Error> {
        let most = FRONTS_MOST.min(unknowns);
        let tables = Tables {
            blocks: arena.take(most.div_ceil(WIDTH))?,
            unknowns: arena.take(most)?,
            light: arena.take(most * (bands + 1))?,
            places: arena.take(if most > 0 { unknowns } else { 0 })?,
            count: 0,
            receiver: 0,
            made: false,
        };
        let mut own = Fronts::none();
        own.0.iter_mut().zip([tables]).for_each(|(to, tables)| *to = tables);
        Ok(own)
    }

    /// Without memory: nothing is known.
    pub fn none() -> Fronts<'m> {
        Fronts([(); GATHERS as usize].map(|()| Tables {
            blocks: &mut [],
            unknowns: &mut [],
            light: &mut [],
            places: &mut [],
            count: 0,
            receiver: 0,
            made: false,
        }))
    }

    /// The elements of a receiver, where they cost less than `rays` rays.
    pub(super) fn of(&mut self, solved: &Solved<'_>, receiver: usize, rays: f64) -> Option<&Tables<'m>> {
        let tables = self.0.first_mut()?;
        tables.prepare(solved, receiver, rays).then_some(&*tables)
    }

    /// Those of the latest receiver.
    #[inline(always)]
    pub(super) fn latest(&self) -> Option<&Tables<'m>> {
        self.0.first()
    }
}

impl Tables<'_> {
    /// Makes ready for points of a receiver; whether its elements cost less than `rays` rays. Only then are the tables filled.
    fn prepare(&mut self, solved: &Solved<'_>, receiver: usize, rays: f64) -> bool {
        if self.receiver != receiver + 1 {
            (self.receiver, self.made) = (receiver + 1, false);
            self.count = self.count_of(solved, receiver);
        }
        let pays = self.count > 0 && self.count as f64 * FRONT_COST < rays;
        if pays && !self.made {
            self.made = true;
            self.make(solved, receiver);
        }
        pays
    }

    /// Number of elements with closed forms that a receiver's row has met; 0 where there is no room for them, or clusters are
    /// most of what it has met.
    fn count_of(&self, solved: &Solved<'_>, receiver: usize) -> usize {
        let (mut all, mut single, mut count) = (0.0, 0.0, 0);
        for record in straight_targets(solved.rows.of(receiver)) {
            all += record.weight;
            if !solved.elements.is_cluster(record.unknown()) {
                single += record.weight;
                count += 1;
            }
        }
        if count > self.unknowns.len() || single < SINGLE_SHARE_LEAST * all { 0 } else { count }
    }

    /// Fills the tables for a receiver.
    #[inline(never)]
    fn make(&mut self, solved: &Solved<'_>, receiver: usize) {
        let (scene, elements, stride) = (solved.scene, solved.elements, solved.shape.bands + 1);
        self.count = 0;
        for record in straight_targets(solved.rows.of(receiver)) {
            let (unknown, at) = (record.unknown(), self.count);
            let (facet, side) = elements.facet_of(unknown);
            let corners = elements.corners(scene, unknown / scene.sides().max(1));
            let single = !elements.is_cluster(unknown);
            if single && self.put(unknown, &corners, scene.side_normal(facet, side)) {
                mean_radiance(solved, unknown, self.light.part_mut(at * stride..(at + 1) * stride));
            }
        }
    }

    /// Adds an element; false where there is no room.
    fn put(&mut self, unknown: usize, corners: &[Vec3; 3], normal: Vec3) -> bool {
        let at = self.count;
        let (Some(to), Some(block)) = (self.unknowns.get_mut(at), self.blocks.get_mut(at / WIDTH)) else {
            return false;
        };
        *to = unknown as u32;
        self.places.set(unknown, at as u32);
        if at.is_multiple_of(WIDTH) {
            // lanes left over face nobody
            *block = [[0.0; WIDTH]; BLOCK_ROWS];
        }
        let values = corners.iter().chain([&normal]).flat_map(|v| v.to_array());
        let values = values.chain([normal.dot(corners[0])]);
        block.iter_mut().zip(values).for_each(|(row, x)| row.set(at % WIDTH, x));
        self.count += 1;
        true
    }

    /// The values of the unknown that a ray crosses, and which it is; `None` where it is not among these.
    #[inline(always)]
    pub(super) fn crossed(&self, solved: &Solved<'_>, hit: &Hit) -> Option<(usize, &[f64])> {
        let side = usize::from(!hit.front);
        if side >= solved.scene.sides() {
            return None;
        }
        let (unknown, _) = solved.elements.locate(hit.facet as usize, side, hit.u, hit.v);
        let place = self.places.at(unknown) as usize;
        let known = place < self.count && self.unknowns.at(place) as usize == unknown;
        let stride = solved.shape.bands + 1;
        known.then(|| (unknown, self.light.part(place * stride..(place + 1) * stride)))
    }

    /// What the elements bring a point that they face.
    #[inline(never)]
    pub(super) fn facing(&self, isa: Isa, (point, normal): (Vec3, Vec3), bands: usize) -> Facing {
        run_wide(isa, Look { fronts: self, point, normal, bands })
    }
}

/// Entries of a row that its rays met first.
fn straight_targets<'a>(row: Option<RowView<'a>>) -> impl Iterator<Item = &'a Record> {
    row.into_iter().flat_map(|row| row.targets).filter(|record| record.path() == STRAIGHT)
}

/// Mean radiance of an unknown, and the expected error of its diffuse part. What mirrors show of it is taken for the mean of
/// all that arrives, as it is where all shines alike.
fn mean_radiance(solved: &Solved<'_>, unknown: usize, values: &mut [f64]) {
    let (scene, elements, shape) = (solved.scene, solved.elements, solved.shape);
    let (facet, side) = elements.facet_of(unknown);
    let (diffuse, specular) = (scene.diffuse(scene.material(facet)), scene.specular(scene.material(facet)));
    let emission = solved.light.emission(scene, facet, side);
    let Some(level) = solved.level(1) else {
        values.iter_mut().zip(emission).for_each(|(value, own)| *value = *own);
        return;
    };
    let irradiance = solved.irradiance.part(shape.at(unknown, level));
    let thrown = solved.images.mean(shape, elements.kept_side(facet, side), unknown, level);
    let sunlit = solved.solution.sun.at(unknown);
    let mut largest: f64 = 0.0;
    for (band, (value, rho)) in values.iter_mut().zip(diffuse).enumerate() {
        let sun = solved.light.sun.as_ref().map_or(0.0, |sun| sun.irradiance(band));
        let mean = irradiance.at(band).max(0.0);
        let arrives = mean + thrown.at(band) + sunlit * sun;
        *value = emission.at(band) + FRAC_1_PI * (rho * arrives + specular.at(band) * mean);
        largest = largest.max(*rho);
    }
    values.set(shape.bands, largest * sqrt(solved.expected_variance(unknown)));
}

/// [`Fronts::facing`] at work.
struct Look<'a> {
    fronts: &'a Tables<'a>,
    point: Vec3,
    normal: Vec3,
    bands: usize,
}

/// Elements whose form factors are to be found together.
struct Together {
    corners: Active,
    places: [usize; WIDTH],
    count: usize,
}

impl WideTask for Look<'_> {
    type Out = Facing;

    #[inline(always)]
    fn run<L: Lanes64>(self, lanes: L) -> Facing {
        let mut facing = Facing { light: [0.0; BANDS], share: 0.0, signed: [0.0; SIGNS] };
        let mut together = Together { corners: [[0.0; WIDTH]; 9], places: [0; WIDTH], count: 0 };
        let (p, n) = (spread(lanes, self.point), spread(lanes, self.normal));
        let (zero, least) = (lanes.all(0.0), lanes.all(FRONT_HEIGHT_LEAST));
        // loops rather than closures, which are not inlined into code compiled for another instruction set
        for (number, block) in self.fronts.blocks.iter().take(self.fronts.count.div_ceil(WIDTH)).enumerate() {
            let height =
                lanes.of(&block[9]) * p[0] + lanes.of(&block[10]) * p[1] + lanes.of(&block[11]) * p[2]
                    - lanes.of(&block[12]);
            let mut kept = L::F::bits(height.gt(least));
            if kept == 0 {
                continue;
            }
            let mut relative = [zero; 9];
            let mut heights = [zero; 3];
            for corner in 0..3 {
                for axis in 0..3 {
                    relative[3 * corner + axis] = lanes.of(&block[3 * corner + axis]) - p[axis];
                }
                heights[corner] = relative[3 * corner] * n[0]
                    + relative[3 * corner + 1] * n[1]
                    + relative[3 * corner + 2] * n[2];
            }
            let top = heights[0].max(heights[1]).max(heights[2]);
            kept &= L::F::bits(top.gt(least));
            if kept == 0 {
                continue;
            }
            let depth = (zero - heights[0]).max(zero - heights[1]).max(zero - heights[2]);
            let cut = L::F::bits(depth.gt(zero));
            let mut rows = [[0.0; WIDTH]; 9];
            for (row, x) in rows.iter_mut().zip(&relative) {
                *row = x.array();
            }
            while kept != 0 {
                let lane = kept.trailing_zeros() as usize % WIDTH;
                kept &= kept - 1;
                let place = number * WIDTH + lane;
                if cut >> lane & 1 == 1 {
                    self.add_cut(block, lane, place, &mut facing);
                    continue;
                }
                for (to, from) in together.corners.iter_mut().zip(&rows) {
                    to[together.count] = from[lane];
                }
                together.places[together.count] = place;
                together.count += 1;
                if together.count == WIDTH {
                    self.add_all(lanes, &together, &n, &mut facing);
                    together.count = 0;
                }
            }
        }
        if together.count > 0 {
            self.add_all(lanes, &together, &n, &mut facing);
        }
        facing
    }
}

impl Look<'_> {
    /// Adds elements that lie wholly above the horizon.
    #[inline(always)]
    fn add_all<L: Lanes64>(&self, lanes: L, together: &Together, n: &[L::F; 3], facing: &mut Facing) {
        let mut corners = [lanes.all(0.0); 9];
        for (to, from) in corners.iter_mut().zip(&together.corners) {
            *to = lanes.of(from);
        }
        let sum =
            edge(lanes, &corners, 0, 3, n) + edge(lanes, &corners, 3, 6, n) + edge(lanes, &corners, 6, 0, n);
        let factors = (sum.abs() * lanes.all(1.0 / TAU)).array();
        for (place, factor) in together.places.iter().zip(factors).take(together.count) {
            self.add(*place, factor, facing);
        }
    }

    /// Adds an element that the horizon cuts.
    #[inline(never)]
    fn add_cut(&self, block: &Block, lane: usize, place: usize, facing: &mut Facing) {
        let corner = |k: usize| Vec3::new(block[3 * k][lane], block[3 * k + 1][lane], block[3 * k + 2][lane]);
        let triangle = [corner(0), corner(1), corner(2)];
        self.add(place, point_to_triangle(self.point, self.normal, &triangle), facing);
    }

    #[inline(always)]
    fn add(&self, place: usize, factor: f64, facing: &mut Facing) {
        let (stride, fronts) = (self.bands + 1, self.fronts);
        let values = fronts.light.part(place * stride..(place + 1) * stride);
        let unknown = fronts.unknowns.at(place) as usize;
        for (sum, value) in facing.light.iter_mut().zip(values).take(self.bands) {
            *sum += factor * value;
        }
        facing.share += factor;
        let error = factor * values.at(self.bands);
        for (set, sum) in facing.signed.iter_mut().enumerate() {
            *sum += sign(unknown, set) * error;
        }
    }
}

/// One term of Lambert's sum, theta (a x b)/|a x b| . n, of the edge between two corners.
#[inline(always)]
fn edge<L: Lanes64>(lanes: L, corners: &[L::F; 9], from: usize, to: usize, n: &[L::F; 3]) -> L::F {
    let (a, b) = (
        [corners[from], corners[from + 1], corners[from + 2]],
        [corners[to], corners[to + 1], corners[to + 2]],
    );
    let side = [b[0] - a[0], b[1] - a[1], b[2] - a[2]];
    let cross =
        [a[1] * side[2] - a[2] * side[1], a[2] * side[0] - a[0] * side[2], a[0] * side[1] - a[1] * side[0]];
    let sine = wide_dot(&cross, &cross).sqrt();
    lambert_term(lanes, sine, wide_dot(&a, &b), wide_dot(&cross, n))
}

#[cfg(all(test, feature = "std"))]
mod tests {
    use super::*;
    use crate::base::qmc::Sequence;

    /// 1e-14: a hundred form factors, each to some 1e-16 and relatively to the ratio of distance and size, 20 at most.
    #[test]
    fn elements_that_face_a_point_have_their_form_factors() {
        const COUNT: usize = 101;
        let mut blocks = [[[f64::NAN; WIDTH]; BLOCK_ROWS]; COUNT.div_ceil(WIDTH)];
        let (mut unknowns, mut places, mut light) = ([0; COUNT], [0; COUNT], [0.0; 2 * COUNT]);
        let mut tables = Tables {
            blocks: &mut blocks,
            unknowns: &mut unknowns,
            light: &mut light,
            places: &mut places,
            count: 0,
            receiver: 0,
            made: false,
        };
        let sequence = Sequence::new(7);
        let corner = |n: u32| {
            let ((x, y), (z, _)) = (sequence.pair(n, 0), sequence.pair(n, 2));
            Vec3::new(4.0 * x - 2.0, 4.0 * y - 2.0, 2.0 * z - 0.7)
        };
        let (point, normal) = (Vec3::new(0.1, -0.2, 0.05), Vec3::Z);
        let (mut share, mut sum, mut cut) = (0.0, 0.0, 0);
        for n in 0..COUNT {
            let corners = [0, 1, 2].map(|k| corner(3 * n as u32 + k));
            let plane = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize();
            assert!(tables.put(n, &corners, plane));
            tables.light[2 * n] = n as f64;
            if plane.dot(point - corners[0]) > 0.0 {
                let factor = point_to_triangle(point, normal, &corners);
                (share, sum) = (share + factor, sum + n as f64 * factor);
                cut += usize::from(factor > 0.0 && corners.iter().any(|c| c.z < point.z));
            }
        }
        assert!(cut > 5 && share > 1.0, "{cut} elements cross the horizon, {share}");
        assert!(!tables.put(COUNT, &[Vec3::ZERO; 3], Vec3::Z));
        for isa in Isa::all() {
            let facing = tables.facing(isa, (point, normal), 1);
            assert!((facing.share - share).abs() < 1e-14, "{} {share}", facing.share);
            assert!((facing.light[0] - sum).abs() < 1e-14 * COUNT as f64, "{} {sum}", facing.light[0]);
            assert_eq!(facing.light, tables.facing(Isa::BASELINE, (point, normal), 1).light);
        }
    }
}

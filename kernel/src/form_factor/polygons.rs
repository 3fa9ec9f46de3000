//! Exchange areas of many pairs of polygons, eight pairs at a time.
//!
//! Constants of this file are measured by `cargo test --test form_factor_pairs` (errors) and `cargo bench --bench counts`
//! (instructions).

use super::convex::double_area;
use super::cubature::CUBATURE_RULES;
use super::pair::{exchange_area_with, power_of_two_below};
use super::product::{
    BEHIND, Block, Classes, EXACT, Eight, PRODUCT_POINTS, Place, Places, Product, Rule, SHAPES, Shape,
};
use crate::base::arena::{Arena, Need};
use crate::base::error::{Error, Field};
use crate::base::index::{Index, IndexMut};
use crate::base::math::{Vec3, unit};
use crate::base::simd::{Isa, WIDTH, run_wide};
use core::ops::Range;

/// Least distance between a patch's centre and the sphere about the other patch, in units of the own radius, for which
/// each rule of [`super::cubature`] is exact enough: 7e-11 on either side, the worst of 30,000 patches of each shape at
/// each distance, needles among them, seen at grazing angles and by planes that touch them. All weights are positive, so
/// that the relative error does not grow where the patches see each other edge-on.
const RULE_DISTANCES: [f64; CUBATURE_RULES] = [100.0, 23.5, 10.3, 6.2, 4.4];

/// The largest rule for polygons of several patches: with larger ones the exact forms are faster.
const LARGEST_OF_SEVERAL: u8 = 3;

/// Convex planar polygons made ready for the exchange areas of many pairs of them.
///
/// Holds the caller's polygons and slices of the caller's memory. Queries take `&self` and may run at the same time on
/// any number of threads.
#[derive(Clone, Copy, Debug)]
pub struct Polygons<'m, P> {
    polygons: &'m [P],
    /// The patches of all polygons in order: a triangle, a quadrilateral, a fan of quadrilaterals.
    blocks: &'m [Block],
    /// By polygon, and one more: its first patch.
    starts: &'m [u32],
    /// By patch: its polygon.
    owners: &'m [u32],
    /// Unit of the patches' lengths; 0 where they are unfit for any rule.
    scale: f64,
    isa: Isa,
}

/// Patches of a polygon of `corners` corners.
fn patch_count(corners: usize) -> usize {
    (corners.saturating_sub(1) / 2).max(1)
}

impl<'m, P: AsRef<[Vec3]>> Polygons<'m, P> {
    /// Bytes of memory that [`Polygons::new`] needs: some 200 a triangle or quadrilateral.
    ///
    /// # Errors
    /// [`Error::TooMany`] for 2^32 corners and more.
    pub fn bytes(polygons: &[P]) -> Result<usize, Error> {
        need(polygons.len(), patches(polygons)?)
    }

    /// Prepares the polygons; any corners are taken, those without area exchange nothing. `memory` holds at least
    /// [`Polygons::bytes`] bytes, of any content and alignment.
    ///
    /// # Errors
    /// [`Error::BufferTooSmall`]; [`Error::TooMany`].
    pub fn new(isa: Isa, polygons: &'m [P], memory: &'m mut [u8]) -> Result<Self, Error> {
        let count = patches(polygons)?;
        let mut arena = Arena::new(memory, need(polygons.len(), count)?)?;
        let blocks = arena.take::<Block>(count.div_ceil(WIDTH))?;
        let starts = arena.take::<u32>(polygons.len() + 1)?;
        let owners = arena.take::<u32>(count)?;
        let scale = scale(polygons);
        let mut patch = 0;
        for (index, polygon) in polygons.iter().enumerate() {
            starts.set(index, patch as u32);
            let corners = polygon.as_ref();
            let normal = unit(double_area(corners)).unwrap_or(Vec3::ZERO);
            for k in 0..patch_count(corners.len()) {
                let corner = |n: usize| corners.get(n).or(corners.last()).copied().unwrap_or(Vec3::ZERO);
                let part = [corner(0), corner(2 * k + 1), corner(2 * k + 2), corner(2 * k + 3)];
                let part = part.map(|c| if scale > 0.0 { c / scale } else { Vec3::ZERO });
                if let Some(block) = blocks.get_mut(patch / WIDTH) {
                    block.set(patch % WIDTH, &part, normal);
                }
                owners.set(patch, index as u32);
                patch += 1;
            }
        }
        starts.set(polygons.len(), patch as u32);
        Ok(Polygons { polygons, blocks, starts, owners, scale, isa })
    }

    /// Number of polygons.
    pub fn len(&self) -> usize {
        self.polygons.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.polygons.is_empty()
    }

    /// Exchange areas of the polygon `row` with those of `columns`, into as many `areas`; with itself 0.
    ///
    /// As [`exchange_area`](super::exchange_area) pair by pair: relative error 1e-10 for separated polygons, 1e-9 for
    /// polygons that touch, and what is said there of those that see each other edge-on. The same bits for (i, j) and
    /// (j, i), whatever the range, on every instruction set.
    ///
    /// With AVX-512 pairs that face away cost 3 ns, separated triangles and parallelograms 15 to 170 ns by their distance
    /// in sizes, other quadrilaterals three times that, near pairs and polygons of more corners 1 to 3 us.
    ///
    /// # Errors
    /// [`Error::Range`] where there is no such row or column; [`Error::Length`] where there is not one area a column.
    pub fn exchange_areas(&self, row: usize, columns: Range<usize>, areas: &mut [f64]) -> Result<(), Error> {
        let last = columns.end.max(row.saturating_add(1));
        if last > self.len() || columns.start > columns.end {
            return Err(Error::Range { field: Field::Rows, band: 0, value: last as f64 });
        }
        let expected = columns.end - columns.start;
        if areas.len() != expected {
            return Err(Error::Length { what: "exchange areas", expected, given: areas.len() });
        }
        areas.fill(0.0);
        let middle = row.max(columns.start).min(columns.end);
        let after = (row + 1).max(columns.start).min(columns.end);
        let (low, high) = areas.split_at_mut_checked(middle - columns.start).unwrap_or((&mut [], &mut []));
        let high = high.get_mut(after - middle..).unwrap_or(&mut []);
        if !low.is_empty() {
            Row::new(self, row, true).fill(columns.start..middle, low);
        }
        if !high.is_empty() {
            Row::new(self, row, false).fill(after..columns.end, high);
        }
        Ok(())
    }

    /// Whether every polygon is one patch, of the same index.
    fn all_single(&self) -> bool {
        self.owners.len() == self.polygons.len()
    }

    /// The polygon's corners.
    fn corners(&self, index: usize) -> &[Vec3] {
        self.polygons.get(index).map_or(&[], |p| p.as_ref())
    }

    /// The polygon's patches.
    fn patches(&self, index: usize) -> Range<usize> {
        self.starts.at(index) as usize..self.starts.at(index + 1) as usize
    }

    /// The block of a patch.
    fn block(&self, patch: usize) -> &Block {
        self.blocks.get(patch / WIDTH).unwrap_or(&Block::EMPTY)
    }

    /// By the exact forms.
    fn exact(&self, a: usize, b: usize) -> f64 {
        exchange_area_with(self.isa, self.corners(a), self.corners(b))
    }

    /// The exchange area of two polygons of which at least one has several patches: all pairs of patches by the same
    /// rules, `a`'s one after the other.
    fn several(&self, a: usize, b: usize) -> f64 {
        let mut worst = (0, 0);
        let mut seen = false;
        for p in self.patches(a) {
            let own = self.block(p).spread(p % WIDTH);
            for (_, class) in self.classes(&own, self.patches(b)) {
                match class {
                    EXACT => return self.exact(a, b),
                    BEHIND => {}
                    _ => {
                        seen = true;
                        worst = (
                            worst.0.max(class / CUBATURE_RULES as u8),
                            worst.1.max(class % CUBATURE_RULES as u8),
                        );
                    }
                }
            }
        }
        if !seen {
            return 0.0;
        }
        if worst.0.max(worst.1) > LARGEST_OF_SEVERAL {
            return self.exact(a, b);
        }
        // Whatever its shape, a patch is two triangles.
        let [first_rule, second_rule] =
            [worst.0, worst.1].map(|number| Rule { number: number.into(), shape: Shape::Quadrilateral });
        let (mut first, mut second, mut places) = (Block::EMPTY, Block::EMPTY, [Place::NONE; PRODUCT_POINTS]);
        let (mut lane, mut sum) = (0, 0.0);
        let mut add = |first: &Block, second: &Block, lanes: usize| {
            let product = Product { first, first_rule, second, second_rule, places: &mut places };
            run_wide(self.isa, product).head(lanes).iter().for_each(|x| sum += x);
        };
        for p in self.patches(a) {
            for q in self.patches(b) {
                first.copy(lane, self.block(p), p % WIDTH);
                second.copy(lane, self.block(q), q % WIDTH);
                lane += 1;
                if lane == WIDTH {
                    add(&first, &second, lane);
                    lane = 0;
                }
            }
        }
        add(&first, &second, lane);
        sum * self.scale * self.scale
    }

    /// The classes of a range of patches against one that is spread over all lanes.
    fn classes<'s>(
        &'s self,
        own: &'s Block,
        patches: Range<usize>,
    ) -> impl Iterator<Item = (usize, u8)> + 's {
        let blocks = patches.start / WIDTH..patches.end.div_ceil(WIDTH);
        blocks
            .flat_map(move |b| {
                let others = self.block(b * WIDTH);
                let classes = run_wide(self.isa, Classes { own, others, least: &RULE_DISTANCES });
                (b * WIDTH..).zip(classes)
            })
            .filter(move |(patch, _)| patches.contains(patch))
    }
}

fn need(polygons: usize, patches: usize) -> Result<usize, Error> {
    Need::new().and::<Block>(patches.div_ceil(WIDTH)).and::<u32>(polygons + 1).and::<u32>(patches).bytes()
}

/// Patches of all polygons.
fn patches<P: AsRef<[Vec3]>>(polygons: &[P]) -> Result<usize, Error> {
    let limit = u32::MAX as usize;
    let sum = polygons.iter().try_fold(0usize, |sum, p| sum.checked_add(patch_count(p.as_ref().len())));
    sum.filter(|&sum| sum < limit).ok_or(Error::TooMany { what: "patches of polygons", limit })
}

/// The power of two below the extent of all polygons; 0 where its square is not a number.
fn scale<P: AsRef<[Vec3]>>(polygons: &[P]) -> f64 {
    let mut corners = polygons.iter().flat_map(|p| p.as_ref());
    let Some(origin) = corners.next() else {
        return 0.0;
    };
    let extent = corners.fold(0.0, |m: f64, c| m.max((*c - *origin).abs().max_element()));
    power_of_two_below(extent).unwrap_or(0.0)
}

/// Pairs of the same class that wait to be eight.
#[derive(Clone, Copy)]
struct Queue {
    /// Patches of the columns.
    patches: [u32; WIDTH],
    count: usize,
}

/// The pairs of one polygon with others of which all have greater, or all have smaller indices.
struct Row<'p, 'm, P> {
    polygons: &'p Polygons<'m, P>,
    row: usize,
    /// Whether the columns' indices are smaller: then they are the first of each pair.
    second: bool,
    own: Block,
    shape: Shape,
    gathered: Block,
    places: Places,
    /// By the column's shape, then by class.
    queues: [Queue; SHAPES * CUBATURE_RULES * CUBATURE_RULES],
}

impl<'p, 'm, P: AsRef<[Vec3]>> Row<'p, 'm, P> {
    fn new(polygons: &'p Polygons<'m, P>, row: usize, second: bool) -> Self {
        let patch = polygons.starts.at(row) as usize;
        Row {
            polygons,
            row,
            second,
            own: polygons.block(patch).spread(patch % WIDTH),
            shape: polygons.block(patch).shape(patch % WIDTH),
            gathered: Block::EMPTY,
            places: [Place::NONE; PRODUCT_POINTS],
            queues: [Queue { patches: [0; WIDTH], count: 0 }; SHAPES * CUBATURE_RULES * CUBATURE_RULES],
        }
    }

    /// All areas with these columns.
    fn fill(&mut self, columns: Range<usize>, areas: &mut [f64]) {
        let polygons = self.polygons;
        let first = polygons.starts.at(columns.start) as usize;
        let end = polygons.starts.at(columns.end) as usize;
        let one_by_one = polygons.scale == 0.0;
        if one_by_one || polygons.patches(self.row).len() > 1 || end - first > areas.len() {
            for (column, area) in columns.clone().zip(areas.iter_mut()) {
                let several = polygons.patches(self.row).len() > 1 || polygons.patches(column).len() > 1;
                if one_by_one {
                    *area = polygons.exact(self.row, column);
                } else if several {
                    *area = polygons.several(self.row.min(column), self.row.max(column));
                }
            }
        }
        if one_by_one || polygons.patches(self.row).len() > 1 {
            return;
        }
        for b in first / WIDTH..end.div_ceil(WIDTH) {
            let others = polygons.block(b * WIDTH);
            let classes = run_wide(polygons.isa, Classes { own: &self.own, others, least: &RULE_DISTANCES });
            let lanes = first.saturating_sub(b * WIDTH)..(end - b * WIDTH).min(WIDTH);
            self.block(b, lanes, &classes, others, columns.start, areas);
        }
        for number in 0..self.queues.len() {
            self.flush(number, columns.start, areas);
        }
    }

    /// Rules that the classes of a block's `lanes` ask for.
    fn block(
        &mut self,
        block: usize,
        lanes: Range<usize>,
        classes: &[u8; WIDTH],
        others: &Block,
        start: usize,
        areas: &mut [f64],
    ) {
        let (class, shape) = (classes.at(0), others.shape.at(0));
        let alike = classes.iter().all(|c| *c == class) && others.shape.iter().all(|s| *s == shape);
        let polygons = self.polygons;
        if alike && lanes == (0..WIDTH) && polygons.all_single() {
            if class < BEHIND {
                let values = self.product(others, class, others.shape(0));
                let first = (block * WIDTH).wrapping_sub(start);
                areas.iter_mut().skip(first).zip(values).for_each(|(area, value)| *area = value);
            }
            if class != EXACT {
                return;
            }
        }
        for lane in lanes {
            let patch = block * WIDTH + lane;
            let column = polygons.owners.at(patch) as usize;
            match classes.at(lane) {
                BEHIND => {}
                _ if polygons.patches(column).len() > 1 => {}
                EXACT => areas.set(column.wrapping_sub(start), polygons.exact(self.row, column)),
                class => {
                    let number =
                        usize::from(class) + others.shape(lane).number() * CUBATURE_RULES * CUBATURE_RULES;
                    if self.push(number, patch) {
                        self.flush(number, start, areas);
                    }
                }
            }
        }
    }

    /// Lets a patch wait; true where the queue is full.
    fn push(&mut self, number: usize, patch: usize) -> bool {
        let Some(queue) = self.queues.get_mut(number) else {
            return false;
        };
        queue.patches.set(queue.count, patch as u32);
        queue.count += 1;
        queue.count == WIDTH
    }

    /// Works off a queue.
    fn flush(&mut self, number: usize, start: usize, areas: &mut [f64]) {
        let Some(queue) = self.queues.get_mut(number) else {
            return;
        };
        let (patches, count) = (queue.patches, core::mem::take(&mut queue.count));
        if count == 0 {
            return;
        }
        let mut gathered = Block::EMPTY;
        core::mem::swap(&mut gathered, &mut self.gathered);
        for (lane, patch) in patches.head(count).iter().enumerate() {
            let patch = *patch as usize;
            gathered.copy(lane, self.polygons.block(patch), patch % WIDTH);
        }
        let (class, shape) = (
            number % (CUBATURE_RULES * CUBATURE_RULES),
            Shape::numbered(number / (CUBATURE_RULES * CUBATURE_RULES)),
        );
        let values = self.product(&gathered, class as u8, shape);
        core::mem::swap(&mut gathered, &mut self.gathered);
        for (patch, value) in patches.head(count).iter().zip(values) {
            let column = self.polygons.owners.at(*patch as usize) as usize;
            areas.set(column.wrapping_sub(start), value);
        }
    }

    /// The exchange areas of eight pairs, in the square of the caller's unit.
    fn product(&mut self, others: &Block, class: u8, shape: Shape) -> Eight {
        let own_rule = Rule { number: usize::from(class) / CUBATURE_RULES, shape: self.shape };
        let rule = Rule { number: usize::from(class) % CUBATURE_RULES, shape };
        let places = &mut self.places;
        let (first, first_rule, second, second_rule) = match self.second {
            true => (others, rule, &self.own, own_rule),
            false => (&self.own, own_rule, others, rule),
        };
        let product = Product { first, first_rule, second, second_rule, places };
        run_wide(self.polygons.isa, product).map(|x| x * self.polygons.scale * self.polygons.scale)
    }
}

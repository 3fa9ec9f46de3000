//! Extended form factors (eq. 12): which share of an element's cosine hemisphere each other element fills,
//! seen straight or by way of mirrors, and where the rest of the hemisphere escapes to the sky.
//!
//! Rows of unknowns are computed by [`rows::fill`] into blocks of caller memory, each block a range of rows;
//! the numbers of a row do not depend on how rows are grouped into blocks. [`Coupling`] reads the blocks.

mod bake;
pub mod bundle;
pub mod cluster;
pub(crate) mod detail;
pub mod element;
mod exact;
pub mod kept;
pub mod mirror_path;
pub mod motion;
pub mod pack;
pub mod plane_sides;
pub mod row_builder;
pub mod rows;
pub mod subdivide;

use crate::base::arena::{View, plain_struct};
use crate::base::error::Error;
use crate::base::index::Index;
use crate::base::math::Vec3;
use crate::base::octahedron::{self, SKY_BITS};
use crate::base::simd::{self, Isa, Task};
use crate::coupling::element::Local;
use bundle::Bundles;
use core::ops::Range;
use mirror_path::{MirrorPath, STRAIGHT};

plain_struct! {
    /// One term of a row, escapes only while it grows: then they are put in [`bundle`]s. The gradient is how the weight
    /// varies over the element, in local coordinates.
    pub struct Record {
        /// Bit 63: an escape; bits 16..: target unknown (32 bits) or direction; bits 0..16: number of the [`MirrorPath`].
        pub key: u64,
        /// Share of the cosine hemisphere, mean over the element.
        pub weight: f64,
        /// Change of the weight with the local coordinates.
        pub gradient: [f32; 2],
        /// What tells the weight's error: half the difference between two halves of the rays, of two quarters of the
        /// element and of the others; the middle quarter's weight beside its neighbours', by either half.
        pub half_differences: [f32; 4],
        /// The weight times where on the target its rays arrive, in local coordinates.
        pub moment: [f32; 2],
    }
}

plain_struct! {
    /// What is known of one row.
    pub struct Row {
        /// First record.
        pub start: u32,
        /// First record in whose place escapes stand.
        pub escapes: u32,
        /// [`ABSENT`], [`OPEN`], [`TRACED`] or [`ENCLOSED`].
        pub state: u32,
        /// Rays traced.
        pub rays: u32,
        /// Rays traced beyond the first hits.
        pub chain_rays: u32,
        /// Share of the element that is not inside a body, where nothing sees it; the row is that part's mean, or the
        /// whole element's where that share is 0.
        pub visible_share: f32,
        /// Weight of chains cut before their end, times the largest product of their mirrors.
        pub truncated_weight: f64,
        /// Share of the hemisphere in which straight rays meet facets.
        pub blocked: f64,
    }
}

impl Row {
    /// Rays traced in all.
    pub fn all_rays(&self) -> u64 {
        u64::from(self.rays) + u64::from(self.chain_rays)
    }
}

/// State of a row that nothing needs: of a degenerate facet, or of one that reflects nothing diffusely.
pub const ABSENT: u32 = 0;
/// State of a row that sees nothing but the sky: nothing rises above its facet's plane.
pub const OPEN: u32 = 1;
/// State of a row whose rays were traced; its escapes hold what is blocked, to be taken off the whole sky.
pub const TRACED: u32 = 2;
/// State of a row whose rays were traced and mostly met facets; its escapes hold what is open instead.
pub const ENCLOSED: u32 = 3;

plain_struct! {
    /// The head of a block.
    pub struct Head {
        /// First unknown.
        pub first: u64,
        /// Rows.
        pub rows: u64,
        /// Records.
        pub records: u64,
        /// Mirror paths.
        pub paths: u64,
        /// Room for mirror paths.
        pub capacity: u64,
        /// Spectral bands.
        pub bands: u64,
        /// Room for rows.
        pub room: u64,
        /// 1 where escapes keep their directions.
        pub directional: u64,
    }
}

/// Bit of a key that marks an escape.
const ESCAPE: u64 = 1 << 63;

/// The path of an escape that stands for light which does not arrive: its first ray met a facet.
pub const BLOCKED: u16 = u16::MAX;

impl Record {
    /// A target seen along a path, at a point of it.
    #[inline(always)]
    pub fn target((unknown, (a, b)): (usize, Local), path: u16, weight: f64, gradient: [f32; 2]) -> Record {
        let key = (unknown as u64) << 16 | u64::from(path);
        let moment = [(weight * a) as f32, (weight * b) as f32];
        Record { key, weight, gradient, half_differences: [0.0; 4], moment }
    }

    /// The sky seen along a path in `direction` (kept to 6.6e-5 rad), or in any direction.
    #[inline(always)]
    pub fn escape(direction: Option<Vec3>, path: u16, weight: f64, gradient: [f32; 2]) -> Record {
        let packed = direction.map_or(0, octahedron::pack::<SKY_BITS>);
        Record {
            key: ESCAPE | packed << 16 | u64::from(path),
            weight,
            gradient,
            half_differences: [0.0; 4],
            moment: [0.0; 2],
        }
    }

    /// Number of its path.
    #[inline(always)]
    pub fn path(&self) -> u16 {
        self.key as u16
    }

    /// True for an escape to the sky.
    #[inline(always)]
    pub fn is_escape(&self) -> bool {
        self.key & ESCAPE != 0
    }

    /// The target unknown.
    #[inline(always)]
    pub fn unknown(&self) -> usize {
        (self.key >> 16) as u32 as usize
    }

    /// A target on which the sun shines from the direction `image` (as the radiosity wing packs it; 0: by lobes or curved
    /// mirrors) by way of a last `mirror`, a facet.
    pub fn beam(
        (unknown, (a, b)): (usize, Local),
        path: u16,
        weight: f64,
        (image, mirror): (u64, u32),
    ) -> Record {
        // records of different images stay apart
        let apart = image.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 50;
        // 24 bits of each are exact: 16 of the image above 8 of the mirror
        let part = |k: u32| (image >> (16 * k) & 0xffff) << 8 | u64::from(mirror >> (8 * k) & 0xff);
        let half_differences = [3, 2, 1, 0].map(|k| part(k) as f32);
        let key = (unknown as u64 | apart << 32) << 16 | u64::from(path);
        // where on the element it falls: weighted sums of the place, of its squared distance from the middle, and a count
        let gradient = [weight * a, weight * b].map(|x| x as f32);
        Record {
            key,
            weight,
            gradient,
            half_differences,
            moment: [(weight * (a * a + a * b + b * b)) as f32, 1.0],
        }
    }

    /// The record with `share` of its weight.
    pub fn scaled_beam(self, share: f64) -> Record {
        let scaled = |x: f32| (share * f64::from(x)) as f32;
        let [square, count] = self.moment;
        let gradient = self.gradient.map(scaled);
        Record { weight: share * self.weight, gradient, moment: [scaled(square), count], ..self }
    }

    /// A beam's sums of places, of their squared distances from the middle, and its count, all weighted but the last.
    pub fn places(&self) -> [f32; 4] {
        let ([a, b], [square, count]) = (self.gradient, self.moment);
        [a, b, square, count]
    }

    /// The image of a beam.
    pub fn image(&self) -> u64 {
        self.half_differences.iter().fold(0, |image, part| image << 16 | *part as u64 >> 8)
    }

    /// The last mirror of a beam, a facet.
    pub fn mirror(&self) -> usize {
        self.half_differences.iter().fold(0, |mirror, part| mirror << 8 | *part as usize & 0xff)
    }

    /// Adds up what two rays of a row found.
    #[inline(always)]
    pub fn join(&mut self, record: &Record) -> bool {
        if self.key != record.key {
            return false;
        }
        self.weight += record.weight;
        self.gradient[0] += record.gradient[0];
        self.gradient[1] += record.gradient[1];
        self.moment[0] += record.moment[0];
        self.moment[1] += record.moment[1];
        self.half_differences.iter_mut().zip(record.half_differences).for_each(|(to, from)| *to += from);
        true
    }

    /// Adds up what two rays of a beam brought.
    pub fn join_beam(&mut self, record: &Record) -> bool {
        let same = self.key == record.key && self.half_differences == record.half_differences;
        if same {
            self.weight += record.weight;
            self.gradient.iter_mut().zip(record.gradient).for_each(|(to, from)| *to += from);
            self.moment.iter_mut().zip(record.moment).for_each(|(to, from)| *to += from);
        }
        same
    }

    /// The direction of an escape, packed.
    #[inline(always)]
    fn packed(&self) -> u32 {
        (self.key >> 16) as u32
    }
}

/// A block of finished rows.
#[derive(Clone, Copy, Debug)]
pub struct Block<'m> {
    head: Head,
    rows: &'m [Row],
    paths: &'m [MirrorPath],
    products: &'m [f64],
    records: &'m [Record],
}

impl<'m> Block<'m> {
    /// A block without rows.
    pub const EMPTY: Block<'static> = Block {
        head: Head {
            first: 0,
            rows: 0,
            records: 0,
            paths: 0,
            capacity: 0,
            bands: 0,
            room: 0,
            directional: 0,
        },
        rows: &[],
        paths: &[],
        products: &[],
        records: &[],
    };

    /// Opens what [`rows::fill`] wrote.
    pub fn open(memory: &'m [u8]) -> Result<Block<'m>, Error> {
        let mut view = View::new(memory);
        let head = view.take::<Head>(1)?.at(0);
        let rows = view.take::<Row>(head.room as usize + 1)?;
        let paths = view.take::<MirrorPath>(head.capacity as usize)?;
        let products = view.take::<f64>((head.capacity * head.bands) as usize)?;
        let records = view.take::<Record>(head.records as usize)?;
        let rows = rows.part(0..head.rows as usize + 1);
        Ok(Block { head, rows, paths: paths.part(0..head.paths as usize), products, records })
    }

    /// The unknowns whose rows it holds.
    pub fn range(&self) -> Range<usize> {
        self.head.first as usize..(self.head.first + self.head.rows) as usize
    }

    /// Bytes of the memory it was opened from that it needs, when that starts on a boundary of
    /// [`crate::base::arena::ALIGNMENT`].
    pub fn extent(&self, memory: &[u8]) -> usize {
        let end = self.records.as_ptr_range().end as usize;
        end.saturating_sub(memory.as_ptr() as usize)
    }

    /// Records in it.
    pub fn records(&self) -> usize {
        self.records.len()
    }

    /// Bytes in use.
    pub fn memory(&self) -> usize {
        size_of::<Head>()
            + size_of_val(self.rows)
            + size_of_val(self.paths)
            + self.paths.len() * self.head.bands as usize * 8
            + size_of_val(self.records)
    }
}

/// One row: what an element side sees.
#[derive(Clone, Copy, Debug)]
pub struct RowView<'m> {
    /// Statistics.
    pub row: Row,
    /// Terms with a target.
    pub targets: &'m [Record],
    /// Terms that end in the sky by way of mirrors, and the blocked or (where the row is [`ENCLOSED`]) the open part
    /// of the hemisphere.
    pub escapes: Bundles<'m>,
    paths: &'m [MirrorPath],
    products: &'m [f64],
    bands: usize,
}

impl<'m> RowView<'m> {
    /// Products of the mirror reflectances of a path, one per band; nothing of [`BLOCKED`].
    #[inline(always)]
    pub fn products(&self, path: u16) -> &'m [f64] {
        let at = path as usize * self.bands;
        self.products.get(at..at + self.bands).unwrap_or(&[])
    }

    /// Sum over the targets of their shares times `values`, of which there are `sums.len()`, one of each band, for each
    /// unknown, into `sums`.
    #[inline(always)]
    pub fn gather<T: Copy + Default + Into<f64>>(&self, values: &[T], sums: &mut [f64]) {
        if let [sum] = sums {
            *sum = 0.0;
            for record in self.targets {
                let product = self.products.at(record.path() as usize);
                *sum += record.weight * product * values.at(record.unknown()).into();
            }
            return;
        }
        simd::run(Isa::detect(), Gather { row: self, values, sums });
    }

    /// Sums over the targets of their shares, one per band: [`RowView::gather`] of ones.
    pub fn sums(&self, sums: &mut [f64]) {
        sums.fill(0.0);
        for record in self.targets {
            let products = self.products(record.path());
            sums.iter_mut().zip(products).for_each(|(s, p)| *s += record.weight * p);
        }
    }

    /// What the row holds of the sky seen straight, with the sign by which it counts: what is blocked is taken off the whole sky,
    /// what is open makes it up.
    #[inline(always)]
    pub fn straight_sky(&self) -> impl Iterator<Item = (<Bundles<'m> as IntoIterator>::Item, f64)> + use<'m> {
        let enclosed = self.row.state == ENCLOSED;
        let straight = self.escapes.into_iter().filter(|bundle| matches!(bundle.path, BLOCKED | STRAIGHT));
        straight.map(move |bundle| {
            let sign = if bundle.path == BLOCKED && !enclosed { -1.0 } else { 1.0 };
            (bundle, sign)
        })
    }

    /// Mirrors on a path.
    #[inline(always)]
    pub fn depth(&self, path: u16) -> u32 {
        self.paths.get(path as usize).map_or(0, |w| w.depth)
    }

    /// The path of a number.
    fn path(&self, path: u16) -> MirrorPath {
        self.paths.at(path as usize)
    }
}

/// [`RowView::gather`] of many bands.
struct Gather<'a, T> {
    row: &'a RowView<'a>,
    values: &'a [T],
    sums: &'a mut [f64],
}

impl<T: Copy + Default + Into<f64>> Task for Gather<'_, T> {
    type Out = ();

    #[inline(always)]
    fn run(self) {
        let (bands, targets) = (self.sums.len(), self.row.targets);
        let (blocks, rest) = self.sums.as_chunks_mut::<BLOCK>();
        let whole = blocks.len() * BLOCK;
        for (block, sums) in blocks.iter_mut().enumerate() {
            let mut own = [0.0; BLOCK];
            for record in targets {
                let products = self.row.products(record.path()).get(block * BLOCK..);
                let values = self.values.get(record.unknown() * bands + block * BLOCK..);
                let Some((products, values)) = products.zip(values) else { continue };
                let first = (products.first_chunk::<BLOCK>(), values.first_chunk::<BLOCK>());
                if let (Some(products), Some(values)) = first {
                    for i in 0..BLOCK {
                        own[i] += record.weight * products[i] * values[i].into();
                    }
                }
            }
            *sums = own;
        }
        rest.fill(0.0);
        for record in targets.iter().filter(|_| whole < bands) {
            let values = self.values.part(record.unknown() * bands + whole..(record.unknown() + 1) * bands);
            let terms = self.row.products(record.path()).iter().skip(whole).zip(values);
            rest.iter_mut().zip(terms).for_each(|(s, (p, x))| *s += record.weight * p * (*x).into());
        }
    }
}

/// Bands whose sums stay in registers.
const BLOCK: usize = 8;

/// All rows of a scene.
#[derive(Clone, Copy, Debug)]
pub struct Coupling<'m> {
    blocks: &'m [Block<'m>],
    unknowns: usize,
}

impl<'m> Coupling<'m> {
    /// Joins blocks that cover the unknowns 0.. in order.
    ///
    /// # Errors
    /// [`Error::Mismatch`] where rows are missing or out of order.
    pub fn new(blocks: &'m [Block<'m>], unknowns: usize) -> Result<Coupling<'m>, Error> {
        let mut next = 0;
        for block in blocks {
            if block.range().start != next {
                return Err(Error::Mismatch { what: "coupling block" });
            }
            next = block.range().end;
        }
        if next != unknowns {
            return Err(Error::Mismatch { what: "coupling block" });
        }
        Ok(Coupling { blocks, unknowns })
    }

    /// Blocks that cover any one range of rows, in order.
    pub fn part(blocks: &'m [Block<'m>]) -> Coupling<'m> {
        Coupling { blocks, unknowns: blocks.last().map_or(0, |b| b.range().end) }
    }

    /// Number of rows.
    pub fn unknowns(&self) -> usize {
        self.unknowns
    }

    /// The rows of a range of unknowns, in order.
    #[inline]
    pub fn rows(&self, range: Range<usize>) -> Rows<'m> {
        let first = self.blocks.partition_point(|b| b.range().end <= range.start);
        let blocks = self.blocks.get(first..).unwrap_or(&[]);
        let start = blocks.first().map_or(range.end, |b| b.range().start.max(range.start));
        Rows { blocks, next: start, end: range.end }
    }

    /// One row; an empty one of state [`ABSENT`] beyond the last.
    pub fn row(&self, unknown: usize) -> Row {
        let block = self.blocks.get(self.blocks.partition_point(|b| b.range().end <= unknown));
        block.and_then(|b| b.rows.get(unknown - b.range().start)).copied().unwrap_or_default()
    }

    /// Rays that its rows took.
    pub fn rays(&self) -> u64 {
        self.rows(0..self.unknowns).map(|(_, view)| view.row.all_rays()).sum()
    }

    /// Bytes in use.
    pub fn memory(&self) -> usize {
        self.blocks.iter().map(Block::memory).sum()
    }

    /// True where a new sky needs no new rays: escapes keep their directions.
    pub fn is_directional(&self) -> bool {
        self.blocks.iter().all(|b| b.head.directional != 0)
    }
}

/// The rows of a range of unknowns and which they are, in order.
#[derive(Clone, Debug)]
pub struct Rows<'m> {
    /// Blocks of which rows are left, the present one first.
    blocks: &'m [Block<'m>],
    next: usize,
    end: usize,
}

impl<'m> Iterator for Rows<'m> {
    type Item = (usize, RowView<'m>);

    #[inline(always)]
    fn next(&mut self) -> Option<(usize, RowView<'m>)> {
        if self.next >= self.end {
            return None;
        }
        while self.next >= self.blocks.first()?.range().end {
            (_, self.blocks) = self.blocks.split_first()?;
        }
        let unknown = self.next;
        self.next += 1;
        Some((unknown, row_of(self.blocks.first()?, unknown)))
    }
}

#[inline(always)]
fn row_of<'m>(block: &Block<'m>, unknown: usize) -> RowView<'m> {
    let at = unknown - block.head.first as usize;
    let (row, next) = (block.rows.at(at), block.rows.at(at + 1));
    RowView {
        row,
        targets: block.records.part(row.start as usize..row.escapes as usize),
        escapes: Bundles::new(block.records.part(row.escapes as usize..next.start as usize)),
        paths: block.paths,
        products: block.products,
        bands: block.head.bands as usize,
    }
}

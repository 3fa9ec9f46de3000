//! Couplings in baked blocks.

use super::bundle::Bundles;
use super::mirror_path::{MIRRORS_MOST, MirrorPath, STRAIGHT};
use super::{ABSENT, BLOCKED, Block, ENCLOSED, Head, Record, Row};
use crate::base::arena::View;
use crate::base::arena::Writer;
use crate::base::error::Error;
use crate::base::index::Index;
use crate::coupling::element::Elements;
use crate::scene::Scene;

impl<'m> Block<'m> {
    pub(crate) fn put(&self, writer: &mut Writer<'_>) -> Result<(), Error> {
        let paths = self.paths.len();
        writer.put(&[Head { capacity: paths as u64, room: self.head.rows, ..self.head }])?;
        writer.put(self.rows)?;
        writer.put(self.paths)?;
        writer.put(self.products.head(paths * self.head.bands as usize))?;
        writer.put(self.records)
    }

    pub(crate) fn get(
        view: &mut View<'m>,
        scene: &Scene<'_>,
        elements: &Elements<'_>,
        directional: bool,
    ) -> Result<Block<'m>, Error> {
        let head = view.take::<Head>(1)?.first().copied().ok_or(Error::Block)?;
        let unknowns = elements.unknowns() as u64;
        let counted = head.first <= unknowns
            && head.rows <= unknowns - head.first
            && head.room == head.rows
            && head.capacity == head.paths
            && (1..=u64::from(BLOCKED)).contains(&head.paths)
            && head.records <= u64::from(u32::MAX)
            && head.bands == scene.bands() as u64
            && head.directional == u64::from(directional);
        if !counted {
            return Err(Error::Block);
        }
        let paths = head.paths as usize;
        let block = Block {
            head,
            rows: view.take(head.rows as usize + 1)?,
            paths: view.take(paths)?,
            products: view.take(paths.checked_mul(scene.bands()).ok_or(Error::Block)?)?,
            records: view.take(usize::try_from(head.records).map_err(|_| Error::Block)?)?,
        };
        let sound = block.words_sound(scene) && block.rows_sound(elements.unknowns());
        if sound { Ok(block) } else { Err(Error::Block) }
    }

    /// Whether the paths are a tree of mirror classes and hold the products of their reflectances.
    fn words_sound(&self, scene: &Scene<'_>) -> bool {
        let bands = scene.bands();
        let of = |path: usize| self.products.part(path * bands..(path + 1) * bands);
        self.paths.iter().enumerate().all(|(at, path)| {
            if at == usize::from(STRAIGHT) {
                return path.depth == 0 && of(at).iter().all(|p| *p == 1.0);
            }
            let parent: MirrorPath = self.paths.at(path.parent as usize);
            let specular = scene.specular(path.class as usize);
            let factors = of(path.parent as usize).iter().zip(specular);
            (path.parent as usize) < at
                && path.depth == parent.depth + 1
                && path.depth as usize <= MIRRORS_MOST
                && specular.len() == bands
                && of(at).iter().zip(factors).all(|(p, (q, rho))| *p == q * rho)
        })
    }

    /// Rows are ranges of records one after the other, targets before escapes.
    fn rows_sound(&self, unknowns: usize) -> bool {
        let ends = self.rows.iter().skip(1).map(|next| next.start);
        let mut at = 0;
        let rows = self.rows.iter().zip(ends).all(|(row, end)| {
            let ordered = row.start == at && row.start <= row.escapes && row.escapes <= end;
            at = end;
            ordered && self.row_sound(row, end, unknowns)
        });
        rows && at as usize == self.records.len()
    }

    fn row_sound(&self, row: &Row, end: u32, unknowns: usize) -> bool {
        let targets = self.records.part(row.start as usize..row.escapes as usize);
        let escapes = Bundles::new(self.records.part(row.escapes as usize..end as usize));
        let known = |path: u16| (path as usize) < self.paths.len();
        // closed chains count twice at most; gradients of a share of the hemisphere: 36 times it at most
        let share = |weight: f64| (0.0..=2.0 + 1e-6).contains(&weight);
        let bounded = |values: &[f32]| values.iter().all(|g| g.abs() <= 100.0);
        let weighed = |r: &Record| {
            share(r.weight) && [&r.gradient[..], &r.half_differences, &r.moment].into_iter().all(bounded)
        };
        (ABSENT..=ENCLOSED).contains(&row.state)
            && (0.0..=1.0).contains(&row.visible_share)
            && row.truncated_weight >= 0.0
            && row.truncated_weight.is_finite()
            && (-1e-6..=2.0 + 1e-6).contains(&row.blocked)
            && targets
                .iter()
                .all(|r| !r.is_escape() && r.unknown() < unknowns && known(r.path()) && weighed(r))
            && escapes.rest().iter().all(|word| *word == 0)
            && escapes.into_iter().all(|b| {
                (known(b.path) || b.path == BLOCKED)
                    && share(b.total())
                    && bounded(&b.gradient)
                    && bounded(&b.half_differences)
            })
    }
}

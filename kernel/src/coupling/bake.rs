//! Couplings in baked blocks.

use super::bundle::Bundles;
use super::word::{MIRRORS_MOST, STRAIGHT, Word};
use super::{ABSENT, BLOCKED, Block, ENCLOSED, Head, Record, Row};
use crate::base::arena::View;
use crate::base::arena::Writer;
use crate::base::error::Error;
use crate::base::index::Index;
use crate::coupling::element::Elements;
use crate::scene::Scene;

impl<'m> Block<'m> {
    pub(crate) fn put(&self, writer: &mut Writer<'_>) -> Result<(), Error> {
        let words = self.words.len();
        writer.put(&[Head { capacity: words as u64, room: self.head.rows, ..self.head }])?;
        writer.put(self.rows)?;
        writer.put(self.words)?;
        writer.put(self.products.head(words * self.head.bands as usize))?;
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
            && head.capacity == head.words
            && (1..=u64::from(BLOCKED)).contains(&head.words)
            && head.records <= u64::from(u32::MAX)
            && head.bands == scene.bands() as u64
            && head.directional == u64::from(directional);
        if !counted {
            return Err(Error::Block);
        }
        let words = head.words as usize;
        let block = Block {
            head,
            rows: view.take(head.rows as usize + 1)?,
            words: view.take(words)?,
            products: view.take(words.checked_mul(scene.bands()).ok_or(Error::Block)?)?,
            records: view.take(usize::try_from(head.records).map_err(|_| Error::Block)?)?,
        };
        let sound = block.words_sound(scene) && block.rows_sound(elements.unknowns());
        if sound { Ok(block) } else { Err(Error::Block) }
    }

    /// Words are trees of mirror classes whose products are theirs.
    fn words_sound(&self, scene: &Scene<'_>) -> bool {
        let bands = scene.bands();
        let of = |word: usize| self.products.part(word * bands..(word + 1) * bands);
        self.words.iter().enumerate().all(|(at, word)| {
            if at == usize::from(STRAIGHT) {
                return word.depth == 0 && of(at).iter().all(|p| *p == 1.0);
            }
            let parent: Word = self.words.at(word.parent as usize);
            let specular = scene.specular(word.class as usize);
            let factors = of(word.parent as usize).iter().zip(specular);
            (word.parent as usize) < at
                && word.depth == parent.depth + 1
                && word.depth as usize <= MIRRORS_MOST
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
        let known = |word: u16| (word as usize) < self.words.len();
        // closed chains count twice at most; gradients of a share of the hemisphere: 36 times it at most
        let share = |weight: f64| (0.0..=2.0 + 1e-6).contains(&weight);
        let bounded = |values: &[f32]| values.iter().all(|g| g.abs() <= 100.0);
        let weighed =
            |r: &Record| share(r.weight) && [&r.gradient[..], &r.checks, &r.moment].into_iter().all(bounded);
        (ABSENT..=ENCLOSED).contains(&row.state)
            && (0.0..=1.0).contains(&row.exposed)
            && row.lost >= 0.0
            && row.lost.is_finite()
            && (-1e-6..=2.0 + 1e-6).contains(&row.blocked)
            && targets
                .iter()
                .all(|r| !r.is_escape() && r.unknown() < unknowns && known(r.word()) && weighed(r))
            && escapes.rest().iter().all(|word| *word == 0)
            && escapes.into_iter().all(|b| {
                (known(b.word) || b.word == BLOCKED)
                    && share(b.total())
                    && bounded(&b.gradient)
                    && bounded(&b.checks)
            })
    }
}

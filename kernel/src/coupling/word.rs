//! Which mirrors a path met: words over mirror classes, whatever the order, and their band products.
//!
//! A coupling by way of mirrors carries a product of mirror reflectances that differs by band. A record keeps
//! the geometric weight and the number of a word; the word keeps the product. Words form a tree in which each
//! path from the root names the classes in ascending order, so that a product is always multiplied in the same
//! order and its bits do not depend on the order in which paths were found.

use crate::base::arena::plain_struct;
use crate::base::index::{Index, IndexMut};
use crate::scene::Scene;
use core::cmp::Ordering;

/// The word without letters: no mirror met.
pub const STRAIGHT: u16 = 0;

/// The most mirrors that one path may meet.
pub const MIRRORS_MOST: usize = 1000;

plain_struct! {
    /// One word: its last (highest) mirror class, and the rest.
    pub struct Word {
        /// Last mirror class.
        pub class: u32,
        /// Number of letters.
        pub depth: u32,
        /// First word with one more letter than this one; 0: none.
        pub child: u16,
        /// Next word with the same parent; 0: none.
        pub sibling: u16,
        /// The word without its last letter.
        pub parent: u16,
        /// Keeps the size a multiple of four.
        pub unused: u16,
    }
}

/// A growing table of words in caller memory.
#[derive(Debug)]
pub struct Words<'m> {
    words: &'m mut [Word],
    products: &'m mut [f64],
    bands: usize,
    used: usize,
}

impl<'m> Words<'m> {
    /// The table with the empty word alone; `products` has `bands` values for each of `words`.
    pub fn new(words: &'m mut [Word], products: &'m mut [f64], bands: usize) -> Words<'m> {
        products.iter_mut().take(bands).for_each(|p| *p = 1.0);
        Words { words, products, bands, used: 1 }
    }

    /// Words in use, the empty one included.
    pub fn used(&self) -> usize {
        self.used
    }

    /// True where the table has all the words that a record can name: more memory would not help.
    pub fn is_exhausted(&self) -> bool {
        self.used >= self.words.len() && self.words.len() >= u16::MAX as usize
    }

    /// The word itself.
    #[inline(always)]
    pub fn get(&self, word: u16) -> Word {
        self.words.get(word as usize).copied().unwrap_or_default()
    }

    /// Largest product of a word over the bands.
    #[inline]
    pub fn largest(&self, word: u16) -> f64 {
        let at = word as usize * self.bands;
        self.products.part(at..at + self.bands).iter().fold(0.0, |a, &b| if b > a { b } else { a })
    }

    /// The word with one more letter; `None` where the table is full or the word has [`MIRRORS_MOST`] letters.
    pub fn push(&mut self, word: u16, class: u32, scene: &Scene<'_>) -> Option<u16> {
        if self.get(word).depth as usize >= MIRRORS_MOST {
            return None;
        }
        let (mut at, mut higher) = (word, 0);
        while at != STRAIGHT && self.get(at).class > class {
            (at, higher) = (self.get(at).parent, higher + 1);
        }
        let mut new = self.append(at, class, scene)?;
        // the higher letters again, some at a time: links lead from the last to the first
        let mut letters = [0u32; 16];
        while higher > 0 {
            let some = higher.min(letters.len());
            let mut at = word;
            for _ in some..higher {
                at = self.get(at).parent;
            }
            for letter in letters.head_mut(some).iter_mut().rev() {
                *letter = self.get(at).class;
                at = self.get(at).parent;
            }
            higher -= some;
            for &letter in letters.head(some) {
                new = self.append(new, letter, scene)?;
            }
        }
        Some(new)
    }

    fn append(&mut self, word: u16, class: u32, scene: &Scene<'_>) -> Option<u16> {
        let first = self.get(word).child;
        let mut at = first;
        while at != 0 {
            if self.get(at).class == class {
                return Some(at);
            }
            at = self.get(at).sibling;
        }
        let new =
            u16::try_from(self.used).ok().filter(|&n| (n as usize) < self.words.len() && n < u16::MAX)?;
        let depth = self.get(word).depth + 1;
        self.words
            .set(new as usize, Word { class, depth, child: 0, sibling: first, parent: word, unused: 0 });
        self.words.set(word as usize, Word { child: new, ..self.get(word) });
        let (from, to) = (word as usize * self.bands, new as usize * self.bands);
        for (band, &rho) in scene.specular(class as usize).iter().enumerate() {
            self.products.set(to + band, self.products.at(from + band) * rho);
        }
        self.used += 1;
        Some(new)
    }

    /// An order of words that does not depend on their numbers.
    #[inline]
    pub fn compare(&self, a: u16, b: u16) -> Ordering {
        compare(self.words, a, b)
    }
}

/// As [`Words::compare`], for a finished table.
pub fn compare(words: &[Word], mut a: u16, mut b: u16) -> Ordering {
    let get = |w: u16| words.get(w as usize).copied().unwrap_or_default();
    if a == b {
        return Ordering::Equal;
    }
    let order = get(a).depth.cmp(&get(b).depth);
    if order != Ordering::Equal {
        return order;
    }
    while a != b {
        let (x, y) = (get(a), get(b));
        if x.class != y.class {
            return x.class.cmp(&y.class);
        }
        (a, b) = (x.parent, y.parent);
    }
    Ordering::Equal
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{MaterialInput, SceneInput};

    #[test]
    fn a_word_is_its_letters_whatever_their_order() {
        let material = |s: &'static [f64]| MaterialInput {
            diffuse: &[0.0, 0.0],
            specular: s,
            emission: &[0.0, 0.0],
            gloss: None,
        };
        let materials = [material(&[0.1, 0.9]), material(&[0.3, 0.2]), material(&[0.7, 0.6])];
        let input = SceneInput {
            vertices: &[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]],
            facets: &[[0, 1, 2]],
            facet_materials: &[],
            normals: &[],
            facet_normals: &[],
            materials: &materials,
            two_sided: false,
            bands: 2,
        };
        let mut memory = [0u8; 4096];
        let scene = Scene::new(&input, &mut memory).unwrap();
        let (mut storage, mut products) = ([Word::default(); 40], [0.0; 80]);
        let mut words = Words::new(&mut storage, &mut products, 2);
        let spell = |words: &mut Words<'_>, letters: &[u32]| {
            letters.iter().fold(STRAIGHT, |word, &class| words.push(word, class, &scene).unwrap())
        };
        let a = spell(&mut words, &[2, 0, 1, 0]);
        assert_eq!(a, spell(&mut words, &[0, 0, 1, 2]));
        assert_eq!(a, spell(&mut words, &[1, 2, 0, 0]));
        assert_ne!(a, spell(&mut words, &[1, 2, 0]));
        assert_eq!(words.get(a).depth, 4);
        let at = a as usize * 2;
        assert_eq!(words.products[at..at + 2], [0.1 * 0.1 * 0.3 * 0.7, 0.9 * 0.9 * 0.2 * 0.6]);
        let b = spell(&mut words, &[1, 1, 1, 1]);
        assert_eq!(words.compare(a, b), words.compare(b, a).reverse());
        assert_eq!(words.compare(a, a), Ordering::Equal);
        let mut word = STRAIGHT;
        let mut pushed = 0;
        while let Some(next) = words.push(word, 2, &scene) {
            word = next;
            pushed += 1;
        }
        assert!(pushed > 10 && words.used() == 40, "a full table says so");
    }
}

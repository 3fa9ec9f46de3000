//! Specular paths between two sides of facets: the mirror classes that a path met, in any order, and the product of their
//! reflectances per band.
//!
//! A coupling by way of mirrors carries a product of mirror reflectances that differs by band. A record keeps the
//! geometric weight and the number of a path; the path's entry in the table keeps the product. The entries form a tree
//! in which each way from the root names the classes in ascending order. A product is therefore always multiplied in
//! the same order, and its bits do not depend on the order in which paths were found.
//!
//! Constants of this file are measured by `cargo test --test closure` (light by way of up to a thousand mirrors).

use crate::base::arena::plain_struct;
use crate::base::index::{Index, IndexMut};
use crate::scene::Scene;
use core::cmp::Ordering;

/// Number of the path without mirrors.
pub const STRAIGHT: u16 = 0;

/// Largest number of mirrors on one path.
pub const MIRRORS_MOST: usize = 1000;

plain_struct! {
    /// A path: its last (highest) mirror class, and the path without it.
    pub struct MirrorPath {
        /// Last mirror class.
        pub class: u32,
        /// Number of mirrors.
        pub depth: u32,
        /// First path with one more mirror than this one; 0: none.
        pub child: u16,
        /// Next path with the same parent; 0: none.
        pub sibling: u16,
        /// The path without its last mirror.
        pub parent: u16,
        /// Keeps the size a multiple of four.
        pub unused: u16,
    }
}

/// A growing table of paths in caller memory.
#[derive(Debug)]
pub struct MirrorPaths<'m> {
    paths: &'m mut [MirrorPath],
    products: &'m mut [f64],
    bands: usize,
    used: usize,
}

impl<'m> MirrorPaths<'m> {
    /// The table with [`STRAIGHT`] alone; `products` has `bands` values for each of `paths`.
    pub fn new(paths: &'m mut [MirrorPath], products: &'m mut [f64], bands: usize) -> MirrorPaths<'m> {
        products.iter_mut().take(bands).for_each(|p| *p = 1.0);
        MirrorPaths { paths, products, bands, used: 1 }
    }

    /// Paths in use, [`STRAIGHT`] included.
    pub fn used(&self) -> usize {
        self.used
    }

    /// True where the table has all the paths that a record can name: more memory would not help.
    pub fn is_exhausted(&self) -> bool {
        self.used >= self.paths.len() && self.paths.len() >= u16::MAX as usize
    }

    /// The path of a number.
    #[inline(always)]
    pub fn get(&self, path: u16) -> MirrorPath {
        self.paths.get(path as usize).copied().unwrap_or_default()
    }

    /// Largest product of reflectances of a path over the bands.
    #[inline]
    pub fn largest(&self, path: u16) -> f64 {
        let at = path as usize * self.bands;
        self.products.part(at..at + self.bands).iter().fold(0.0, |a, &b| if b > a { b } else { a })
    }

    /// The path with one more mirror; `None` where the table is full or the path has [`MIRRORS_MOST`] mirrors.
    pub fn push(&mut self, path: u16, class: u32, scene: &Scene<'_>) -> Option<u16> {
        if self.get(path).depth as usize >= MIRRORS_MOST {
            return None;
        }
        let (mut at, mut higher) = (path, 0);
        while at != STRAIGHT && self.get(at).class > class {
            (at, higher) = (self.get(at).parent, higher + 1);
        }
        let mut new = self.append(at, class, scene)?;
        // the higher classes again, some at a time: links lead from the last to the first
        let mut classes = [0u32; 16];
        while higher > 0 {
            let some = higher.min(classes.len());
            let mut at = path;
            for _ in some..higher {
                at = self.get(at).parent;
            }
            for class in classes.head_mut(some).iter_mut().rev() {
                *class = self.get(at).class;
                at = self.get(at).parent;
            }
            higher -= some;
            for &class in classes.head(some) {
                new = self.append(new, class, scene)?;
            }
        }
        Some(new)
    }

    fn append(&mut self, path: u16, class: u32, scene: &Scene<'_>) -> Option<u16> {
        let first = self.get(path).child;
        let mut at = first;
        while at != 0 {
            if self.get(at).class == class {
                return Some(at);
            }
            at = self.get(at).sibling;
        }
        let new =
            u16::try_from(self.used).ok().filter(|&n| (n as usize) < self.paths.len() && n < u16::MAX)?;
        let depth = self.get(path).depth + 1;
        self.paths.set(
            new as usize,
            MirrorPath { class, depth, child: 0, sibling: first, parent: path, unused: 0 },
        );
        self.paths.set(path as usize, MirrorPath { child: new, ..self.get(path) });
        let (from, to) = (path as usize * self.bands, new as usize * self.bands);
        for (band, &rho) in scene.specular(class as usize).iter().enumerate() {
            self.products.set(to + band, self.products.at(from + band) * rho);
        }
        self.used += 1;
        Some(new)
    }

    /// An order of paths that does not depend on their numbers.
    #[inline]
    pub fn compare(&self, a: u16, b: u16) -> Ordering {
        compare(self.paths, a, b)
    }
}

/// As [`MirrorPaths::compare`], for a finished table.
pub fn compare(paths: &[MirrorPath], mut a: u16, mut b: u16) -> Ordering {
    let get = |w: u16| paths.get(w as usize).copied().unwrap_or_default();
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
    fn a_path_is_its_mirrors_whatever_their_order() {
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
        let (mut storage, mut products) = ([MirrorPath::default(); 40], [0.0; 80]);
        let mut paths = MirrorPaths::new(&mut storage, &mut products, 2);
        let extend_path = |paths: &mut MirrorPaths<'_>, classes: &[u32]| {
            classes.iter().fold(STRAIGHT, |path, &class| paths.push(path, class, &scene).unwrap())
        };
        let a = extend_path(&mut paths, &[2, 0, 1, 0]);
        assert_eq!(a, extend_path(&mut paths, &[0, 0, 1, 2]));
        assert_eq!(a, extend_path(&mut paths, &[1, 2, 0, 0]));
        assert_ne!(a, extend_path(&mut paths, &[1, 2, 0]));
        assert_eq!(paths.get(a).depth, 4);
        let at = a as usize * 2;
        assert_eq!(paths.products[at..at + 2], [0.1 * 0.1 * 0.3 * 0.7, 0.9 * 0.9 * 0.2 * 0.6]);
        let b = extend_path(&mut paths, &[1, 1, 1, 1]);
        assert_eq!(paths.compare(a, b), paths.compare(b, a).reverse());
        assert_eq!(paths.compare(a, a), Ordering::Equal);
        let mut path = STRAIGHT;
        let mut pushed = 0;
        while let Some(next) = paths.push(path, 2, &scene) {
            path = next;
            pushed += 1;
        }
        assert!(pushed > 10 && paths.used() == 40, "a full table says so");
    }
}

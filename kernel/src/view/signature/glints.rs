//! What a signature shows of the sun in mirrors and narrow lobes, facet by facet: a glint may be far smaller than a cell.
//!
//! Where the sun or one of its images stands is known, and so is the direction that every point of a facet mirrors toward
//! the observer. A facet is halved until that direction is linear over each part; what the disc takes of a part is then a
//! chord of a circle on each of some lines across it. Lobes are summed over parts that are small against the angle to the
//! disc. Whether a point is seen and lit, rays tell.
//!
//! Constants of this file are measured by `cargo test --test signature -- --nocapture` (errors of glints).

use super::Sums;
use crate::base::index::{Index, IndexMut};
use crate::base::math::{Vec3, clamp, frame, pow, sin, sqrt};
use crate::base::qmc::{Sequence, hash2};
use crate::rays::surface::Surface;
use crate::scene::lobe::{Highlight, Lobe};
use crate::scene::sun::Sun;
use crate::scene::{MAX_BANDS, Scene};
use crate::view::chain::{NARROW_LOBE_RATIO, Path, Solved};
use crate::view::importance::Importance;

/// Number of facets in one row of a view that looks for glints.
pub(super) const GLINT_FACETS: usize = 64;

/// Most halvings of a facet's sides.
const GLINT_HALVINGS_MOST: u32 = 9;

/// Largest bend of the mirrored direction over a part of a facet, in half angles of the disc, at which the part counts
/// as linear: its glint is off by about this share.
const GLINT_BEND_MOST: f64 = 0.004;

/// Largest extent of what a part of a facet may show, in diameters of the sun's disc.
const GLINT_WIDTH_FACTOR: f64 = 1.5;

/// Lines across a part of a facet.
const GLINT_LINES: u32 = 64;

/// Lines across a part where rays from the first [`GLINT_LINES`] disagree.
const GLINT_LINES_MOST: u32 = 1024;

/// Largest angle of a part of a facet, over its angle to the disc, at which the lobe is summed by points of the part.
const LOBE_PART_ANGLE_MOST: f64 = 0.3;

/// Whether any facet shows the sun apart from the rays through cells.
pub(super) fn are_wanted(solved: &Solved<'_>) -> bool {
    solved.light.sun.is_some()
        && solved.settings.max_bounces != Some(0)
        && (0..solved.scene.materials()).any(|material| is_apart(solved.scene, material))
}

/// Whether a material's glints are found here: an ideal mirror, or a lobe that is narrow.
fn is_apart(scene: &Scene<'_>, material: usize) -> bool {
    scene.mirror(material) != crate::scene::NO_MIRROR
        && scene.gloss(material).is_none_or(|ratio| ratio >= NARROW_LOBE_RATIO)
}

/// Three points in a facet's barycentric weights, and how often its sides were halved for them.
#[derive(Clone, Copy)]
struct Part {
    corners: [(f64, f64); 3],
    depth: u32,
}

impl Part {
    /// The point of barycentric weights within the part.
    fn at(&self, u: f64, v: f64) -> (f64, f64) {
        let [a, b, c] = self.corners;
        let w = 1.0 - u - v;
        (w * a.0 + u * b.0 + v * c.0, w * a.1 + u * b.1 + v * c.1)
    }

    /// Its share of the facet.
    fn share(&self) -> f64 {
        1.0 / (1u64 << (2 * self.depth)) as f64
    }

    /// One of its four quarters.
    fn quarter(&self, number: u32) -> Part {
        let [a, b, c] = self.corners;
        let (p, q, r) = (self.at(0.5, 0.0), self.at(0.5, 0.5), self.at(0.0, 0.5));
        let corners = match number {
            0 => [a, p, r],
            1 => [p, b, q],
            2 => [r, q, c],
            _ => [q, r, p],
        };
        Part { corners, depth: self.depth + 1 }
    }
}

/// The looks for glints along one direction.
pub(super) struct Glints<'a, 'w, 'm> {
    pub solved: &'a Solved<'a>,
    /// From the observer toward the object.
    pub forward: Vec3,
    /// Area of the whole view, in the caller's square units.
    pub whole: f64,
    /// Products of the reflectances on the way to an image, and sums of what is seen of it.
    pub products: &'w mut [[f64; MAX_BANDS]; 2],
    /// What a facet adds.
    pub shown: &'w mut [f64; MAX_BANDS],
    /// Where facets' shares are noted.
    pub importance: Option<&'w mut Importance<'m>>,
}

/// One facet's side, and the sun or an image of it.
struct Seen<'s> {
    facet: usize,
    side: usize,
    /// Projected, in the caller's square units.
    area: f64,
    sun: Sun<'s>,
    /// Whether it is the sun itself.
    straight: bool,
    /// Mirrors that may follow.
    most: u32,
}

/// How the direction that a part of a facet mirrors toward the observer changes over it: lengths of differences of unit vectors.
struct Spread {
    /// From the middle's to the mean of the corners'.
    bend: f64,
    /// From the middle's to the farthest of the corners'.
    reach: f64,
    /// From the middle's to the direction of the sun.
    off: f64,
}

impl Glints<'_, '_, '_> {
    /// Adds what the facets of a row show.
    pub fn row(&mut self, row: usize, sums: &mut Sums) {
        let scene = self.solved.scene;
        let end = ((row + 1) * GLINT_FACETS).min(scene.facets());
        for facet in row * GLINT_FACETS..end {
            if !is_apart(scene, scene.material(facet)) || scene.areas().at(facet) == 0.0 {
                continue;
            }
            let cosine = -scene.side_normal(facet, 0).dot(self.forward);
            let side = usize::from(cosine < 0.0);
            if cosine != 0.0 && side < scene.sides() {
                let area = scene.area(facet) * cosine.abs();
                match self.importance {
                    None => self.facet(facet, side, area, sums),
                    Some(_) => self.noted(facet, side, area, sums),
                }
            }
        }
    }

    /// [`Glints::facet`], and notes what it adds.
    // apart: it does not burden the stack of all else
    #[inline(never)]
    fn noted(&mut self, facet: usize, side: usize, area: f64, sums: &mut Sums) {
        *self.shown = sums.intensity;
        self.facet(facet, side, area, sums);
        if let Some(importance) = self.importance.as_deref_mut() {
            self.shown.iter_mut().zip(&sums.intensity).for_each(|(before, after)| *before = after - *before);
            importance.add_glints(facet, self.shown);
        }
    }

    fn facet(&mut self, facet: usize, side: usize, area: f64, sums: &mut Sums) {
        let solved = self.solved;
        let (Some(sun), scene) = (&solved.light.sun, solved.scene) else { return };
        let surface = Surface::new(scene, facet, side, 1.0 / 3.0, 1.0 / 3.0);
        let Some(mirror) = surface.mirror(scene) else { return };
        let most = solved.settings.max_bounces.map_or(u32::MAX, |most| most - 1);
        let place = solved.elements.kept_side(facet, side);
        let images = solved.images.of(solved.elements.facet_sides(), place);
        let suns = core::iter::once((*sun, true)).chain(images.map(|axis| (sun.seen_toward(axis), false)));
        for (sun, straight) in suns {
            if surface.normal.dot(sun.direction()) <= -sin(sun.half_angle()) {
                continue;
            }
            let seen = Seen { facet, side, area, sun, straight, most };
            match &mirror.lobe {
                None if sun.is_point() => {}
                None => self.glint(&seen, sums),
                Some(lobe) => self.highlight(&seen, lobe, sums),
            }
        }
    }

    /// The direction that a point of a facet mirrors toward the observer.
    #[cfg_attr(target_pointer_width = "32", inline(never))]
    fn toward(&self, seen: &Seen<'_>, at: (f64, f64)) -> Vec3 {
        self.mirrored(seen, at).1
    }

    /// How the mirrored direction changes over a part of a facet.
    // apart on small machines: does not burden the stack of what the part shows
    #[cfg_attr(target_pointer_width = "32", inline(never))]
    fn spread(&self, seen: &Seen<'_>, part: &Part) -> Spread {
        let ends = part.corners.map(|corner| self.toward(seen, corner));
        let middle = self.toward(seen, part.at(1.0 / 3.0, 1.0 / 3.0));
        let reach = ends.iter().map(|end| (*end - middle).length_squared()).fold(0.0, f64::max);
        let off = sqrt((middle - seen.sun.direction()).length_squared());
        let bend = (ends[0] + ends[1] + ends[2]) / 3.0 - middle;
        Spread { bend: sqrt(bend.length_squared()), reach: sqrt(reach), off }
    }

    /// A point of a facet, and the direction that it mirrors toward the observer.
    fn mirrored(&self, seen: &Seen<'_>, (u, v): (f64, f64)) -> (Surface, Vec3) {
        let surface = Surface::new(self.solved.scene, seen.facet, seen.side, u, v);
        let mirrored = surface.mirrored(self.solved.scene, self.forward);
        (surface, mirrored)
    }

    /// Calls `leaf` with the parts of a facet that `halves` does not want halved.
    fn parts(
        &mut self,
        mut halves: impl FnMut(&mut Self, &Part) -> Option<bool>,
        mut leaf: impl FnMut(&mut Self, &Part),
    ) {
        let mut part = Part { corners: [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)], depth: 0 };
        // each with the number of its quarters that wait
        let (mut halved, mut count) = ([(part, 0); GLINT_HALVINGS_MOST as usize], 0);
        loop {
            match halves(self, &part) {
                None => {}
                Some(true) if part.depth < GLINT_HALVINGS_MOST => {
                    halved.set(count, (part, 4));
                    count += 1;
                }
                Some(_) => leaf(self, &part),
            }
            while count > 0 && halved.get(count - 1).is_some_and(|(_, waiting)| *waiting == 0) {
                count -= 1;
            }
            let Some((whole, waiting)) = count.checked_sub(1).and_then(|last| halved.get_mut(last)) else {
                return;
            };
            *waiting -= 1;
            part = whole.quarter(*waiting);
        }
    }

    /// The sun's disc in an ideal mirror.
    #[cfg_attr(target_pointer_width = "32", inline(never))]
    fn glint(&mut self, seen: &Seen<'_>, sums: &mut Sums) {
        let (axis, radius) = (seen.sun.direction(), sin(seen.sun.half_angle()));
        let halves = |this: &mut Self, part: &Part| {
            let Spread { bend, reach, off } = this.spread(seen, part);
            // half as far again: the direction bends
            if off > 1.5 * reach + 1.01 * radius {
                return None;
            }
            Some(bend > GLINT_BEND_MOST * radius || reach > GLINT_WIDTH_FACTOR * radius)
        };
        let (first, second) = frame(axis);
        self.parts(halves, |this, part| {
            let ends = part.corners.map(|corner| {
                let mirrored = this.toward(seen, corner);
                (mirrored.dot(first) / radius, mirrored.dot(second) / radius)
            });
            this.lines(seen, part, ends, sums);
        });
    }

    /// Adds the glint of a part on which the mirrored direction is linear: `ends` are those of its corners, in half widths
    /// of the disc from its middle.
    #[cfg_attr(target_pointer_width = "32", inline(never))]
    fn lines(&mut self, seen: &Seen<'_>, part: &Part, [a, b, c]: [(f64, f64); 3], sums: &mut Sums) {
        let bands = self.solved.shape.bands;
        let sequence = Sequence::new(hash2(seen.facet as u32, part.depth));
        let mut lines = GLINT_LINES;
        loop {
            let (mut all, mut lit) = (0.0, 0.0);
            self.products[1].head_mut(bands).fill(0.0);
            for line in 0..lines {
                let u = (f64::from(line) + 0.5) / f64::from(lines);
                let start = (a.0 + u * (b.0 - a.0), a.1 + u * (b.1 - a.1));
                let along = ((1.0 - u) * (c.0 - a.0), (1.0 - u) * (c.1 - a.1));
                let Some((from, to)) = chord(start, along) else { continue };
                let share = 2.0 * (1.0 - u) / f64::from(lines) * (to - from);
                all += share;
                let (place, _) = sequence.pair(line, 0);
                let (surface, toward) =
                    self.mirrored(seen, part.at(u, (1.0 - u) * (from + place * (to - from))));
                if self.is_lit(seen, &surface, toward, sums) {
                    lit += share;
                    let [products, sum] = &mut *self.products;
                    sum.iter_mut().zip(&*products).take(bands).for_each(|(sum, p)| *sum += share * p);
                }
            }
            let partly = lit > 0.0 && lit < all;
            if partly && lines < GLINT_LINES_MOST {
                lines *= 4;
                continue;
            }
            let off = if partly { sqrt(lit * (all - lit)) * pow(f64::from(lines), -0.75) } else { 0.0 };
            self.add(seen, part.share(), (|band| seen.sun.disc_radiance(band), off), sums);
            return;
        }
    }

    /// The sun in a lobe.
    #[cfg_attr(target_pointer_width = "32", inline(never))]
    fn highlight(&mut self, seen: &Seen<'_>, lobe: &Lobe, sums: &mut Sums) {
        let solved = self.solved;
        let width = seen.sun.half_angle() + 1.0 / lobe.ratio();
        let scale = self.scale(seen);
        let faint = solved.settings.budget.glints * self.whole;
        let brings = |value: f64, part: &Part| scale * value * part.share() * seen.area;
        let halves = |this: &mut Self, part: &Part| {
            let Spread { reach, off, .. } = this.spread(seen, part);
            let nearest = (off - 1.5 * reach).max(0.0);
            // the lobe as high as at the nearest point
            let most = lobe.value(1.0 - 0.5 * nearest * nearest);
            Some(reach > LOBE_PART_ANGLE_MOST * (off + width) && brings(most, part) > faint)
        };
        self.parts(halves, |this, part| this.points(seen, lobe, part, scale, faint, sums));
    }

    /// Adds what a small part shows of the sun in a lobe, by points of it.
    #[cfg_attr(target_pointer_width = "32", inline(never))]
    fn points(&mut self, seen: &Seen<'_>, lobe: &Lobe, part: &Part, scale: f64, faint: f64, sums: &mut Sums) {
        let bands = self.solved.shape.bands;
        let sequence = Sequence::new(hash2(seen.facet as u32, 0x5000 + part.depth));
        let (mut all, mut lit, mut count, mut goal) = (0.0, 0.0, 0u32, 1);
        self.products[1].head_mut(bands).fill(0.0);
        while count < goal {
            let [u, v] = QUADRATIC_POINTS.at(count as usize % QUADRATIC_POINTS.len());
            let (surface, mirrored) = self.mirrored(seen, part.at(u, v));
            let highlight = Highlight::new(lobe, mirrored, &seen.sun);
            let (x, y) = sequence.pair(count, 2);
            let (value, toward) = match &highlight {
                Some(highlight) => (highlight.value, highlight.sample(x, y)),
                None => (lobe.value(mirrored.dot(seen.sun.direction())), seen.sun.sample(x, y)),
            };
            all += value;
            if value > 0.0 && self.is_lit(seen, &surface, toward, sums) {
                lit += value;
                let [products, sum] = &mut *self.products;
                sum.iter_mut().zip(&*products).take(bands).for_each(|(sum, p)| *sum += value * p);
            }
            count += 1;
            // a part that brings little takes one ray
            if count == 1 && scale * value * part.share() * seen.area > faint {
                goal = QUADRATIC_POINTS.len() as u32;
            }
        }
        let share = 1.0 / f64::from(count);
        self.products[1].head_mut(bands).iter_mut().for_each(|sum| *sum *= share);
        let off = if lit > 0.0 && lit < all { sqrt(lit * (all - lit)) * pow(share, 1.5) } else { 0.0 };
        self.add(seen, part.share(), (|band| seen.sun.irradiance(band), off), sums);
    }

    /// What a lobe's value of 1 brings, the most over the bands relative to the reference radiance.
    fn scale(&self, seen: &Seen<'_>) -> f64 {
        let specular = self.solved.scene.specular(self.solved.scene.material(seen.facet));
        let values = specular.iter().enumerate().zip(self.solved.reference);
        let scale = |((band, rho), reference): ((usize, &f64), &f64)| match *reference > 0.0 {
            true => rho * seen.sun.irradiance(band) / reference,
            false => 0.0,
        };
        values.map(scale).fold(0.0, f64::max)
    }

    /// Whether the observer sees a point, and it the sun in the direction that it mirrors; the product of the reflectances
    /// on the way there.
    fn is_lit(&mut self, seen: &Seen<'_>, surface: &Surface, toward: Vec3, sums: &mut Sums) -> bool {
        let solved = self.solved;
        sums.rays += 1;
        if toward.dot(surface.normal) <= 0.0 || solved.bvh.occluded(&surface.spawn_ray(-self.forward)) {
            return false;
        }
        let [products, _] = &mut *self.products;
        if seen.straight {
            products.head_mut(solved.shape.bands).fill(1.0);
            sums.rays += 1;
            return !solved.bvh.occluded(&surface.spawn_ray(toward));
        }
        let (Some(sun), mut path) = (&solved.light.sun, Path::default()) else { return false };
        let lit =
            solved.mirrored_sun(sun, surface, (toward, seen.sun.direction()), seen.most, products, &mut path);
        sums.rays += u64::from(path.rays);
        lit
    }

    /// Adds a part's `light`, by band, whose sums are known; `off` is what its share is expected to be wrong by.
    fn add(&self, seen: &Seen<'_>, share: f64, (light, off): (impl Fn(usize) -> f64, f64), sums: &mut Sums) {
        let specular = self.solved.scene.specular(self.solved.scene.material(seen.facet));
        for (band, rho) in specular.iter().enumerate() {
            let each = seen.area * share * rho * light(band);
            let value = sums.intensity.at(band) + each * self.products[1].at(band);
            sums.intensity.set(band, value);
            let doubt = sums.doubt2.at(band) + (each * off) * (each * off);
            sums.doubt2.set(band, doubt);
        }
    }
}

/// Points of a part whose mean is exact for quadratic functions.
const QUADRATIC_POINTS: [[f64; 2]; 3] =
    [[1.0 / 6.0, 1.0 / 6.0], [2.0 / 3.0, 1.0 / 6.0], [1.0 / 6.0, 2.0 / 3.0]];

/// The part of a line from `start` over `along` that is in the unit circle.
fn chord(start: (f64, f64), along: (f64, f64)) -> Option<(f64, f64)> {
    let square = along.0 * along.0 + along.1 * along.1;
    let inside = 1.0 - (start.0 * start.0 + start.1 * start.1);
    // so short that it is a point
    if square < 1e-18 {
        return (inside >= 0.0).then_some((0.0, 1.0));
    }
    let half = -(start.0 * along.0 + start.1 * along.1) / square;
    let root = half * half + inside / square;
    if root <= 0.0 {
        return None;
    }
    let root = sqrt(root);
    let (from, to) = (clamp(half - root, 0.0, 1.0), clamp(half + root, 0.0, 1.0));
    (from < to).then_some((from, to))
}

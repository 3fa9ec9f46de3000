//! Sunlight on a point that a chain meets: straight, mirrored by flat facets, and in lobes.
//!
//! Constants of this file are measured by `cargo run --release --example calibrate` (errors of penumbrae) and `cargo test
//! --test highlights` (errors of highlights).

use super::occluders::{RayKind, may_meet};
use super::{Mode, OccluderCache, Path, PathState, RaySample, Solved, Terms};
use crate::base::index::{Index, IndexMut};
use crate::base::math::{FRAC_1_PI, Vec3, clamp, pow, reflect, sqrt};
use crate::base::qmc::{Sequence, hash2};
use crate::coupling::mirror_path::MIRRORS_MOST;
use crate::radiosity::sun_image::{Image, SUN_DISTANCE_LEAST};
use crate::rays::ray::{Hit, Ray};
use crate::rays::surface::{Mirror, Surface};
use crate::scene::MAX_BANDS;
use crate::scene::lobe::{Highlight, Lobe};
use crate::scene::sun::Sun;

/// Most rays toward the sun's disc, in a first set, of a ray that integrates ([`RaySample::Integrate`]): where all of them
/// agree, they are enough.
const DISC_RAYS: u32 = 16;

/// Most rays toward the sun's disc, in a first set, of a ray that probes ([`RaySample::Probe`]).
const DISC_RAYS_PROBING: u32 = 4;

/// Largest factor on [`DISC_RAYS`] where more than the reference radiance is at stake, as in highlights.
const SUN_RAYS_FACTOR_MOST: f64 = 32.0;

/// Most rays toward the sun's disc from one point.
const MOST_DISC_RAYS: u32 = 1024;

/// Whether part of the sun's disc, or of an image of it, may stand above the plane of a surface.
#[inline]
fn faces(surface: &Surface, sun: &Sun<'_>) -> bool {
    surface.normal.dot(sun.direction()) > -sun.half_angle()
}

/// An image of the sun that flat mirrors show.
struct ShownSun<'a> {
    /// The sun itself.
    sun: &'a Sun<'a>,
    /// The sun where it seems to stand.
    image: Sun<'a>,
    /// Most mirrors on the way to it.
    mirrors_most: u32,
}

impl Solved<'_> {
    /// cos(sun) V at a point: one shadow ray for a point sun, a few for a disc.
    #[cfg_attr(target_pointer_width = "32", inline(never))]
    #[cfg_attr(not(target_pointer_width = "32"), inline)]
    pub(super) fn sun_cosine(
        &self,
        state: &PathState<'_>,
        surface: &Surface,
        mode: &mut Mode<'_, '_>,
        path: &mut Path,
    ) -> f64 {
        let Some(sun) = &self.light.sun else { return 0.0 };
        let cosine = sun.cosine(surface.normal);
        if cosine <= 0.0 {
            return 0.0;
        }
        let known = mode.occluders.before(self, surface, RayKind::Sun, (sun.direction(), sun.half_angle()));
        if known.is_some_and(<[u32]>::is_empty) && surface.normal.dot(sun.direction()) > sun.half_angle() {
            // all of the disc is above the facet
            return cosine;
        }
        let at_stake = cosine * self.sun_at_stake(state, surface, sun);
        let mut lit = 0.0;
        let disc = Disc::OnPlane(sun, surface.normal);
        let all = self.over_disc(&disc, at_stake, mode.sample, path, |path, toward, share| {
            let seen = self.sees_sun(surface, toward, known, path);
            lit += if seen { share } else { 0.0 };
            seen
        });
        if all > 0.0 { cosine * (lit / all) } else { 0.0 }
    }

    /// Whether nothing stands before a point in a direction; `known` is all that may, if that is known.
    fn sees_sun(&self, surface: &Surface, toward: Vec3, known: Option<&[u32]>, path: &mut Path) -> bool {
        let ray = surface.spawn_ray(toward);
        path.rays += u32::from(known.is_none_or(|k| !k.is_empty()));
        match known {
            Some([]) => true,
            Some(known) => self.bvh.closest_among(&ray, known).is_none(),
            None => !self.bvh.occluded(&ray),
        }
    }

    /// Calls `ray` with directions toward the sun and their shares until it is known well enough, for what is at stake,
    /// which part of the disc brings light (`ray` says true); returns the sum of all shares.
    #[inline]
    fn over_disc(
        &self,
        disc: &Disc<'_>,
        at_stake: f64,
        sample: RaySample,
        path: &mut Path,
        mut ray: impl FnMut(&mut Path, Vec3, f64) -> bool,
    ) -> f64 {
        if let Some(toward) = disc.point() {
            ray(path, toward, 1.0);
            return 1.0;
        }
        // other coordinates than those of the place in the pixel: the same ones of another sequence are correlated with
        // them bit by bit
        let (sequence, coordinate, mut count, mut goal) = match sample {
            RaySample::Stratum { seed, index } => (Sequence::new(seed), 2, index, index + 1),
            RaySample::Integrate(seed) => {
                (Sequence::new(hash2(seed, 0x0d15_c000)), 0, 0, self.disc_rays(at_stake, DISC_RAYS))
            }
            RaySample::Probe(seed) => {
                (Sequence::new(hash2(seed, 0x0d15_c000)), 0, 0, self.disc_rays(at_stake, DISC_RAYS_PROBING))
            }
        };
        let (mut lit, mut all) = (0.0, 0.0);
        while count < goal {
            let (u, v) = sequence.pair(count, coordinate);
            let (toward, share) = disc.sample(u, v);
            count += 1;
            if share > 0.0 {
                all += share;
                lit += if ray(path, toward, share) { share } else { 0.0 };
            }
            if count == goal && lit != 0.0 && lit != all {
                let part = lit / all;
                let error = at_stake * sqrt(part * (1.0 - part)) * pow(f64::from(count), -0.75);
                let alone = matches!(sample, RaySample::Integrate(_));
                if alone && count < MOST_DISC_RAYS && error > self.settings.budget.image {
                    goal *= 2;
                } else if !alone && error > self.settings.budget.penumbra_pixels {
                    path.sampled = true;
                } else {
                    path.noise += error;
                }
            }
        }
        all
    }

    /// Rays toward the sun's disc to begin with.
    #[cfg_attr(target_pointer_width = "32", inline(never))]
    fn disc_rays(&self, at_stake: f64, most: u32) -> u32 {
        // what a highlight brings may be many times the reference radiance: an edge across the disc then shows far out
        let most = (f64::from(most) * clamp(at_stake, 1.0, SUN_RAYS_FACTOR_MOST)) as u32;
        let ratio = 0.5 * at_stake / self.settings.budget.penumbrae;
        (2..most).find(|&n| sqrt(sqrt(f64::from(n * n * n))) >= ratio).unwrap_or(most)
    }

    /// What the sun brings to a chain by a facet that faces it, relative to the reference radiance.
    #[cfg_attr(target_pointer_width = "32", inline(never))]
    fn sun_at_stake(&self, state: &PathState<'_>, surface: &Surface, sun: &Sun<'_>) -> f64 {
        let diffuse = self.scene.diffuse(surface.material);
        let mut largest: f64 = 0.0;
        for (band, (rho, reference)) in diffuse.iter().zip(self.reference).enumerate() {
            let value = FRAC_1_PI * rho * state.throughput.at(band) * sun.irradiance(band);
            largest = if value > 0.0 { largest.max(value / reference) } else { largest };
        }
        largest
    }

    /// Adds to `to` the sunlight that flat mirrors reflect onto a point: rays toward each of its images.
    #[inline(never)]
    pub(super) fn add_images(
        &self,
        state: &mut PathState<'_>,
        surface: &Surface,
        mode: &mut Mode<'_, '_>,
        to: &mut [f64; MAX_BANDS],
        path: &mut Path,
    ) {
        let Some(sun) = &self.light.sun else { return };
        let bands = self.shape.bands;
        let most = self.settings.max_bounces.map_or(u32::MAX, |most| most.saturating_sub(state.mirrors + 1));
        let mut images = mode.occluders.images(self, surface, sun.half_angle());
        while let Some(one) = images.next(mode.occluders) {
            let axis = one.axis;
            let image = sun.seen_toward(axis);
            let cosine = image.cosine(surface.normal);
            if cosine <= 0.0 {
                continue;
            }
            if !self.may_show(&one, surface, sun, mode.occluders) {
                continue;
            }
            let at_stake = cosine * self.sun_at_stake(state, surface, sun);
            let [lit, products] = &mut *state.images;
            lit.head_mut(bands).fill(0.0);
            let disc = Disc::OnPlane(&image, surface.normal);
            let all = self.over_disc(&disc, at_stake, mode.sample, path, |path, toward, share| {
                let seen = self.mirrored_sun(sun, surface, (toward, axis), most, products, path);
                if seen {
                    lit.iter_mut().zip(&*products).take(bands).for_each(|(sum, p)| *sum += share * p);
                }
                seen
            });
            if all > 0.0 {
                self.add_lit(state, surface, (sun, cosine, all), to);
            }
        }
    }

    /// Whether any mirror may show a point an image of the sun.
    #[cfg_attr(target_pointer_width = "32", inline(never))]
    fn may_show(
        &self,
        image: &Image,
        surface: &Surface,
        sun: &Sun<'_>,
        occluders: &mut OccluderCache<'_>,
    ) -> bool {
        let axis = image.axis;
        let shows =
            |facet: usize| may_meet(&self.scene.corners().at(facet), surface.point, axis, sun.half_angle());
        if let Some(mut all) = image.mirrors.all() {
            return all.any(shows);
        }
        let known = occluders.before(self, surface, RayKind::Image(image.number), (axis, sun.half_angle()));
        known.is_none_or(|mirrors| mirrors.iter().any(|facet| shows(*facet as usize)))
    }

    /// Adds what an image of the sun brings, of whose disc `state.images` holds the lit share of `all`.
    #[cfg_attr(target_pointer_width = "32", inline(never))]
    fn add_lit(
        &self,
        state: &PathState<'_>,
        surface: &Surface,
        (sun, cosine, all): (&Sun<'_>, f64, f64),
        to: &mut [f64; MAX_BANDS],
    ) {
        let diffuse = self.scene.diffuse(surface.material);
        for (band, (to, (lit, rho))) in to.iter_mut().zip(state.images[0].iter().zip(diffuse)).enumerate() {
            let irradiance = sun.irradiance(band) * cosine * (lit / all);
            *to += state.throughput.at(band) * rho * FRAC_1_PI * irradiance;
        }
    }

    /// Whether mirrors show a point that looks `toward` it the sun whose middle seems to stand in the direction `axis`,
    /// and the product of the reflectances of those that it meets, at most `most`.
    pub(in crate::view) fn mirrored_sun(
        &self,
        sun: &Sun<'_>,
        from: &Surface,
        (toward, mut axis): (Vec3, Vec3),
        most: u32,
        products: &mut [f64; MAX_BANDS],
        path: &mut Path,
    ) -> bool {
        let mut ray = from.spawn_ray(toward);
        let mut mirrors = 0;
        products.head_mut(self.shape.bands).fill(1.0);
        loop {
            path.rays += 1;
            let Some(hit) = self.bvh.closest(&ray) else {
                return mirrors > 0 && 1.0 - axis.dot(sun.direction()) < SUN_DISTANCE_LEAST;
            };
            if mirrors >= most || !self.mirrors_on(sun, &hit, mirrors, (&mut ray, &mut axis), products) {
                return false;
            }
            mirrors += 1;
        }
    }

    /// Mirrors a ray that looks for the sun, after so few mirrors that more may follow, where it meets a mirror that may show
    /// it: the ray, the direction in which the sun seems to stand, and the product of the reflectances.
    // apart on small machines: does not burden the stack of the search
    #[cfg_attr(target_pointer_width = "32", inline(never))]
    #[cfg_attr(not(target_pointer_width = "32"), inline(always))]
    fn mirrors_on(
        &self,
        sun: &Sun<'_>,
        hit: &Hit,
        mirrors: u32,
        (ray, axis): (&mut Ray, &mut Vec3),
        products: &mut [f64; MAX_BANDS],
    ) -> bool {
        let Some(surface) = &Surface::of_hit(self.scene, hit) else { return false };
        let Some(normal) = surface.flat_mirror(self.scene) else { return false };
        let mut largest = 0.0;
        for (product, rho) in products.iter_mut().zip(self.scene.specular(surface.material)) {
            *product *= rho;
            largest = f64::max(largest, *product);
        }
        // as far as beams are traced
        if largest < self.settings.budget.beam_chains || mirrors as usize >= MIRRORS_MOST {
            return false;
        }
        *axis = reflect(*axis, normal);
        let (sides, side) =
            (self.elements.facet_sides(), self.elements.kept_side(surface.facet, surface.side));
        if 1.0 - axis.dot(sun.direction()) >= SUN_DISTANCE_LEAST && !self.images.may_show(sides, side, *axis)
        {
            // what this mirror shows is no image of the sun
            return false;
        }
        *ray = surface.spawn_ray(surface.mirrored(self.scene, ray.direction));
        true
    }

    /// The sun and its images in a lobe, evaluated directly: E q(sun, view) V, the mean over the disc.
    #[inline(never)]
    pub(super) fn add_sun_gloss(
        &self,
        state: &mut PathState<'_>,
        surface: &Surface,
        mirror: &Mirror,
        mode: &mut Mode<'_, '_>,
        terms: &mut Terms,
        path: &mut Path,
    ) {
        let (Some(sun), Some(lobe)) = (&self.light.sun, &mirror.lobe) else { return };
        let mirrored = surface.mirrored(self.scene, state.ray.direction);
        if faces(surface, sun) {
            self.add_straight_gloss(state, surface, (sun, lobe, mirrored), mode, terms, path);
        }
        self.add_image_gloss(state, surface, (sun, lobe, mirrored), mode, terms, path);
    }

    /// The sun's images in a lobe about the direction `mirrored`.
    // apart on small machines, as is the sun itself: neither burdens the stack of the other
    #[cfg_attr(target_pointer_width = "32", inline(never))]
    fn add_image_gloss(
        &self,
        state: &mut PathState<'_>,
        surface: &Surface,
        (sun, lobe, mirrored): (&Sun<'_>, &Lobe, Vec3),
        mode: &mut Mode<'_, '_>,
        terms: &mut Terms,
        path: &mut Path,
    ) {
        let mirrors_most =
            self.settings.max_bounces.map_or(u32::MAX, |most| most.saturating_sub(state.mirrors));
        let mut images = mode.occluders.images(self, surface, sun.half_angle());
        while let Some(one) = images.next(mode.occluders) {
            let shown = &ShownSun { sun, image: sun.seen_toward(one.axis), mirrors_most };
            if faces(surface, &shown.image) && self.may_show(&one, surface, sun, mode.occluders) {
                self.add_gloss_of_image(state, surface, (shown, lobe, mirrored), mode.sample, terms, path);
            }
        }
    }

    /// One image of the sun in a lobe about the direction `mirrored`.
    // apart on small machines: does not burden the stack of finding the mirrors that show it
    #[cfg_attr(target_pointer_width = "32", inline(never))]
    fn add_gloss_of_image(
        &self,
        state: &mut PathState<'_>,
        surface: &Surface,
        (shown, lobe, mirrored): (&ShownSun<'_>, &Lobe, Vec3),
        sample: RaySample,
        terms: &mut Terms,
        path: &mut Path,
    ) {
        // in one place of the stack: it is large
        let highlight = &Highlight::new(lobe, mirrored, &shown.image);
        let (disc, value) = Disc::of_lobe(highlight.as_ref(), lobe, mirrored, &shown.image);
        let at_stake = value * self.gloss_at_stake(state.throughput, shown.sun);
        let all = self.shown_over_disc(state, surface, shown, (&disc, at_stake), sample, path);
        self.add_highlight(state, (shown.sun, value, all), terms);
        self.glare(state, lobe, value, at_stake, path);
    }

    /// Sums the lit share of an image's disc into `state.images`; returns the sum of all shares.
    // apart on small machines: does not burden the stack of finding the highlight
    #[cfg_attr(target_pointer_width = "32", inline(never))]
    fn shown_over_disc(
        &self,
        state: &mut PathState<'_>,
        surface: &Surface,
        shown: &ShownSun<'_>,
        (disc, at_stake): (&Disc<'_>, f64),
        sample: RaySample,
        path: &mut Path,
    ) -> f64 {
        let ShownSun { sun, image, mirrors_most } = shown;
        let (bands, axis) = (self.shape.bands, image.direction());
        let [lit, products] = &mut *state.images;
        lit.head_mut(bands).fill(0.0);
        self.over_disc(disc, at_stake, sample, path, |path, toward, share| {
            let seen = toward.dot(surface.normal) > 0.0
                && self.mirrored_sun(sun, surface, (toward, axis), *mirrors_most, products, path);
            if seen {
                lit.iter_mut().zip(&*products).take(bands).for_each(|(sum, p)| *sum += share * p);
            }
            seen
        })
    }

    /// The sun itself in a lobe about the direction `mirrored`.
    // apart on small machines: does not burden the stack of images
    #[cfg_attr(target_pointer_width = "32", inline(never))]
    fn add_straight_gloss(
        &self,
        state: &mut PathState<'_>,
        surface: &Surface,
        (sun, lobe, mirrored): (&Sun<'_>, &Lobe, Vec3),
        mode: &mut Mode<'_, '_>,
        terms: &mut Terms,
        path: &mut Path,
    ) {
        let bands = self.shape.bands;
        let known = mode.occluders.before(self, surface, RayKind::Sun, (sun.direction(), sun.half_angle()));
        let [lit, _] = &mut *state.images;
        lit.head_mut(bands).fill(0.0);
        let highlight = &Highlight::new(lobe, mirrored, sun);
        let (disc, value) = Disc::of_lobe(highlight.as_ref(), lobe, mirrored, sun);
        let at_stake = value * self.gloss_at_stake(state.throughput, sun);
        let all = self.over_disc(&disc, at_stake, mode.sample, path, |path, toward, share| {
            let seen = toward.dot(surface.normal) > 0.0 && self.sees_sun(surface, toward, known, path);
            lit.head_mut(bands).iter_mut().for_each(|sum| *sum += if seen { share } else { 0.0 });
            seen
        });
        self.add_highlight(state, (sun, value, all), terms);
        self.glare(state, lobe, value, at_stake, path);
    }

    /// Notes a highlight that other rays of a lobe may meet nearer to its middle. Directions in which it is brighter than
    /// some value are as many as the inverse of that, so that the brightest of n rays tells what the rest of it brings.
    fn glare(&self, state: &PathState<'_>, lobe: &Lobe, value: f64, brought: f64, path: &mut Path) {
        if state.lobes > 0
            && value > 0.0
            && state.images[0].head(self.shape.bands).iter().any(|lit| *lit > 0.0)
        {
            path.glare = path.glare.max(brought * sqrt(lobe.value(1.0) / value));
        }
    }

    /// What a highlight of the value 1 brings to a chain, relative to the reference radiance.
    pub(super) fn gloss_at_stake(&self, throughput: &[f64; MAX_BANDS], sun: &Sun<'_>) -> f64 {
        let mut largest: f64 = 0.0;
        for (band, (throughput, reference)) in throughput.iter().zip(self.reference).enumerate() {
            let value = throughput * sun.irradiance(band);
            largest = if value > 0.0 { largest.max(value / reference) } else { largest };
        }
        largest
    }

    /// Adds a highlight of which `state.images` holds the lit share of `all`.
    fn add_highlight(
        &self,
        state: &PathState<'_>,
        (sun, value, all): (&Sun<'_>, f64, f64),
        terms: &mut Terms,
    ) {
        if all <= 0.0 {
            return;
        }
        let own = terms.mirror_sky.iter_mut().zip(state.throughput.iter().zip(&state.images[0]));
        for (band, (to, (throughput, lit))) in own.enumerate().take(self.shape.bands) {
            *to += throughput * sun.irradiance(band) * value * (lit / all);
        }
    }
}

/// The sun's disc, or an image of it, as rays toward it are spread.
enum Disc<'a> {
    /// Evenly, each by its share of the irradiance of a plane of this normal.
    OnPlane(&'a Sun<'a>, Vec3),
    /// As dense as a lobe is high.
    InLobe(&'a Highlight),
    /// Evenly, in a lobe that is the same all over it.
    Even(&'a Sun<'a>),
}

impl<'a> Disc<'a> {
    /// The disc in a lobe about the direction `mirrored`, and the mean of q/rho_0 over it: the lobe's highlight, or where there
    /// is none, the lobe at the disc's middle.
    fn of_lobe(
        highlight: Option<&'a Highlight>,
        lobe: &Lobe,
        mirrored: Vec3,
        sun: &'a Sun<'a>,
    ) -> (Disc<'a>, f64) {
        match highlight {
            Some(highlight) => (Disc::InLobe(highlight), highlight.value),
            None => (Disc::Even(sun), lobe.value(mirrored.dot(sun.direction()))),
        }
    }

    /// The direction toward a point.
    fn point(&self) -> Option<Vec3> {
        match self {
            Disc::OnPlane(sun, _) => sun.is_point().then(|| sun.direction()),
            Disc::Even(sun) => sun.is_point().then(|| sun.direction()),
            Disc::InLobe(_) => None,
        }
    }

    /// A direction for a point of the unit square, and its share; 0 or more.
    #[cfg_attr(target_pointer_width = "32", inline(never))]
    #[cfg_attr(not(target_pointer_width = "32"), inline)]
    fn sample(&self, u: f64, v: f64) -> (Vec3, f64) {
        match self {
            Disc::OnPlane(sun, normal) => {
                let toward = sun.sample(u, v);
                (toward, sun.share(toward, *normal))
            }
            Disc::InLobe(highlight) => (highlight.sample(u, v), 1.0),
            Disc::Even(sun) => (sun.sample(u, v), 1.0),
        }
    }
}

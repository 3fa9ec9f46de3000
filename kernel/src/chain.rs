//! Eq. (15) along one ray: diffuse radiance of each facet that the specular chain meets, times the mirrors
//! before it, and the sky where the chain leaves the object.

use crate::bvh::Bvh;
use crate::element::Elements;
use crate::index::{Index, IndexMut};
use crate::light::{Light, Shape};
use crate::math::{FRAC_1_PI, Vec3, pow};
use crate::mirror::{Mirror, Surface};
use crate::qmc::{Sequence, hash2};
use crate::ray::Ray;
use crate::scene::{MAX_BANDS, Scene};

/// How far chains are followed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChainSettings {
    /// Chains end where what they can still bring falls below this share of the reference radiance.
    pub cutoff: f64,
    /// Light reflected more often does not count; `None`: by `cutoff` alone.
    pub max_bounces: Option<u32>,
    /// Share of the reference radiance that a sampled lobe or penumbra may be wrong by.
    pub tolerance: f64,
}

/// A solved scene: what the radiance along any ray follows from.
#[derive(Clone, Copy, Debug)]
pub struct Solved<'a> {
    /// The scene.
    pub scene: &'a Scene<'a>,
    /// Its facets' tree.
    pub bvh: &'a Bvh<'a>,
    /// Its elements.
    pub elements: &'a Elements<'a>,
    /// The light.
    pub light: &'a Light<'a>,
    /// Irradiance without the sun's direct part: mean and gradients of each element side.
    pub irradiance: &'a [f64],
    /// Shape of `irradiance`.
    pub shape: Shape,
    /// Expected error of each unknown's irradiance over pi, relative to the reference radiance.
    pub noise: &'a [f32],
    /// Reference radiance, one value per band.
    pub reference: &'a [f64],
    /// Largest radiance that any ray can see, relative to the reference radiance, over all bands.
    pub brightest: f64,
    /// How far chains are followed.
    pub settings: ChainSettings,
}

/// The three terms of eq. (11) along a ray, one value per band each.
#[derive(Clone, Copy, Debug)]
pub struct Terms {
    /// Diffuse radiance of the first facet.
    pub diffuse: [f64; MAX_BANDS],
    /// Sky and sun by way of mirrors, or straight where the ray meets nothing.
    pub mirror_sky: [f64; MAX_BANDS],
    /// Diffuse radiance of other facets by way of mirrors.
    pub mirror_diffuse: [f64; MAX_BANDS],
}

impl Terms {
    /// All zero.
    pub const ZERO: Terms =
        Terms { diffuse: [0.0; MAX_BANDS], mirror_sky: [0.0; MAX_BANDS], mirror_diffuse: [0.0; MAX_BANDS] };

    /// Sets the first `bands` values to zero.
    #[inline]
    pub fn clear(&mut self, bands: usize) {
        self.diffuse.head_mut(bands).fill(0.0);
        self.mirror_sky.head_mut(bands).fill(0.0);
        self.mirror_diffuse.head_mut(bands).fill(0.0);
    }

    /// Adds the first `bands` values of `next`.
    pub fn add(&mut self, next: &Terms, bands: usize) {
        let pairs = [
            (&mut self.diffuse, &next.diffuse),
            (&mut self.mirror_sky, &next.mirror_sky),
            (&mut self.mirror_diffuse, &next.mirror_diffuse),
        ];
        for (to, from) in pairs {
            to.iter_mut().zip(from).take(bands).for_each(|(to, from)| *to += from);
        }
    }

    /// Radiance in one band.
    #[inline]
    pub fn sum(&self, band: usize) -> f64 {
        self.diffuse.at(band) + self.mirror_sky.at(band) + self.mirror_diffuse.at(band)
    }
}

/// What a ray met besides its radiance.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Path {
    /// True where the first ray met the object.
    pub object: bool,
    /// Rays traced beyond the first.
    pub rays: u32,
    /// Most that chains cut before their end could still have brought, relative to the reference radiance.
    pub tail: f64,
    /// Expected error from the diffuse solution, relative to the reference radiance.
    pub noise: f64,
}

/// Which ray of an image it is, so that lobes and penumbrae of different rays are sampled apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sample {
    /// A ray that stands for itself: lobes and penumbrae are integrated.
    Alone(u32),
    /// Ray number `index` of those that `seed` names and whose mean counts: one point of the sun's disc each.
    OneOf {
        /// Names the rays.
        seed: u32,
        /// This ray among them.
        index: u32,
    },
}

impl Sample {
    /// A number for the sequences of one ray.
    fn seed(self) -> u32 {
        match self {
            Sample::Alone(seed) => seed,
            Sample::OneOf { seed, index } => hash2(seed, index + 1),
        }
    }
}

/// A chain on its way.
struct Leg {
    ray: Ray,
    /// Product of the mirror reflectances so far, per band.
    through: [f64; MAX_BANDS],
    /// Mirrors met.
    mirrors: u32,
    /// True where the last of them was a lobe, whose sunlight is evaluated directly.
    lobe: bool,
}

/// Rays toward the sun's disc: all of the first few agree, or so many are taken.
const DISC_RAYS: (u32, u32) = (4, 32);

/// Error of n rays of a lobe of albedo 1: 0.08 n^-0.71 (the two-cylinder study under a uniform sky of 1).
const LOBE_ERROR: f64 = 0.08;
const LOBE_POWER: f64 = 1.4;

/// The most rays of one lobe.
const MOST_LOBE_RAYS: f64 = 1024.0;

impl Solved<'_> {
    /// Radiance against `ray`, added to `terms` (cleared by the caller).
    pub fn radiance(&self, ray: &Ray, sample: Sample, terms: &mut Terms) -> Path {
        let mut path = Path::default();
        let bands = self.shape.bands;
        let mut leg = Leg { ray: *ray, through: [0.0; MAX_BANDS], mirrors: 0, lobe: false };
        leg.through.head_mut(bands).fill(1.0);
        self.follow(leg, sample, true, terms, &mut path);
        path
    }

    /// Follows a chain to its end; the first lobe branches if `branch`, all others take one ray.
    fn follow(&self, mut leg: Leg, sample: Sample, branch: bool, terms: &mut Terms, path: &mut Path) {
        loop {
            let Some(hit) = self.bvh.closest(&leg.ray) else {
                self.escape(&leg, terms);
                return;
            };
            path.object |= leg.mirrors == 0;
            let Some(surface) = Surface::of_hit(self.scene, &hit) else { return };
            self.add_diffuse(&leg, &surface, sample, terms, path);
            let Some(mirror) = surface.mirror(self.scene) else { return };
            if self.settings.max_bounces.is_some_and(|most| leg.mirrors >= most) {
                return;
            }
            let specular = self.scene.specular(surface.material);
            let bands = self.shape.bands;
            let mut largest = 0.0;
            for (through, rho) in leg.through.head_mut(bands).iter_mut().zip(specular) {
                *through *= rho;
                largest = f64::max(largest, *through);
            }
            if largest * self.brightest < self.settings.cutoff
                || leg.mirrors as usize >= crate::coupling::word::LONGEST
            {
                path.tail += largest * self.brightest;
                return;
            }
            leg.mirrors += 1;
            leg.lobe = mirror.lobe.is_some();
            match &mirror.lobe {
                None => {
                    let direction = surface.mirrored(self.scene, leg.ray.direction);
                    leg.ray = surface.leave(direction);
                }
                Some(_) => {
                    self.add_sun_gloss(&leg, &surface, &mirror, terms);
                    if branch {
                        self.branch(&leg, &surface, &mirror, sample, terms, path);
                        return;
                    }
                    let sequence = Sequence::new(hash2(sample.seed(), leg.mirrors));
                    let (u, v) = sequence.pair(leg.mirrors, 0);
                    self.turn(&mut leg, &surface, &mirror, u, v);
                }
            }
            path.rays += 1;
        }
    }

    /// One ray of a lobe, weighed with the lobe's albedo.
    fn turn(&self, leg: &mut Leg, surface: &Surface, mirror: &Mirror, u: f64, v: f64) {
        let (direction, share) = surface.go_on(self.scene, mirror, leg.ray.direction, u, v);
        leg.through.head_mut(self.shape.bands).iter_mut().for_each(|t| *t *= share);
        leg.ray = surface.leave(direction);
    }

    /// n equal-energy rays of the visible lobe.
    fn branch(
        &self,
        leg: &Leg,
        surface: &Surface,
        mirror: &Mirror,
        sample: Sample,
        terms: &mut Terms,
        path: &mut Path,
    ) {
        let Some(lobe) = &mirror.lobe else { return };
        let n = self.lobe_rays(surface.material, sample);
        let mirrored = surface.mirrored(self.scene, leg.ray.direction);
        let largest = leg.through.head(self.shape.bands).iter().fold(0.0, |a: f64, &b| a.max(b));
        path.noise += LOBE_ERROR * largest * pow(f64::from(n), -1.0 / LOBE_POWER);
        let share = lobe.albedo(mirrored.dot(surface.normal)) / f64::from(n);
        for i in 0..n {
            let direction = lobe.ray(i as usize, n as usize, mirrored, surface.normal);
            let mut through = leg.through;
            through.head_mut(self.shape.bands).iter_mut().for_each(|t| *t *= share);
            let next = Leg { ray: surface.leave(direction), through, mirrors: leg.mirrors, lobe: true };
            path.rays += 1;
            self.follow(next, Sample::OneOf { seed: sample.seed(), index: i }, false, terms, path);
        }
    }

    /// Rays of the first lobe: as its material asks, or so that the error, about 0.08 rho n^-0.7 (the
    /// two-cylinder study), meets the tolerance.
    fn lobe_rays(&self, material: usize, sample: Sample) -> u32 {
        if let Some(n) = self.scene.gloss_rays(material) {
            return n;
        }
        let rho = self.scene.specular(material).iter().fold(0.0, |a: f64, &b| a.max(b));
        let wanted = pow(LOBE_ERROR * rho / self.settings.tolerance, LOBE_POWER);
        // rays of one pixel share its lobe
        let share = if matches!(sample, Sample::OneOf { .. }) { 0.125 } else { 1.0 };
        (share * wanted.min(MOST_LOBE_RAYS)).max(1.0) as u32
    }

    /// The chain leaves the object: sky, and the sun's disc.
    fn escape(&self, leg: &Leg, terms: &mut Terms) {
        let bands = self.shape.bands;
        if let Some(sky) = &self.light.sky {
            let mut radiance = [0.0; MAX_BANDS];
            sky.radiance(leg.ray.direction, radiance.head_mut(bands));
            let own = radiance.iter().zip(&leg.through).take(bands);
            terms.mirror_sky.iter_mut().zip(own).for_each(|(to, (l, through))| *to += through * l);
        }
        if let Some(sun) = &self.light.sun
            && !sun.is_point()
            && !leg.lobe
            && sun.contains(leg.ray.direction)
        {
            let own = terms.mirror_sky.iter_mut().zip(&leg.through).take(bands);
            own.enumerate().for_each(|(band, (to, through))| *to += through * sun.disc_radiance(band));
        }
    }

    /// Diffuse radiance of a facet toward the chain.
    #[inline]
    fn add_diffuse(&self, leg: &Leg, surface: &Surface, sample: Sample, terms: &mut Terms, path: &mut Path) {
        let bands = self.shape.bands;
        let to = if leg.mirrors == 0 { &mut terms.diffuse } else { &mut terms.mirror_diffuse };
        let emission = self.scene.emission(surface.material);
        to.iter_mut().zip(&leg.through).zip(emission).for_each(|((to, through), own)| *to += through * own);
        let diffuse = self.scene.diffuse(surface.material);
        let level = match self.settings.max_bounces {
            Some(most) if leg.mirrors >= most => return,
            Some(most) if self.shape.levels > 1 => (most - leg.mirrors - 1) as usize,
            _ => 0,
        };
        if diffuse.iter().all(|&d| d == 0.0) {
            return;
        }
        let (unknown, (a, b)) = self.elements.locate(surface.facet, surface.side, surface.u, surface.v);
        let values =
            self.irradiance.part(self.shape.at(unknown, level.min(self.shape.levels.saturating_sub(1))));
        let sunlit = self.sun_cosine(surface, sample, path);
        let mut weight = 0.0;
        for (band, ((to, through), rho)) in to.iter_mut().zip(&leg.through).zip(diffuse).enumerate() {
            let smooth = values.at(band) + a * values.at(bands + band) + b * values.at(2 * bands + band);
            let mut irradiance = smooth.max(0.0);
            if sunlit > 0.0
                && let Some(sun) = &self.light.sun
            {
                irradiance += sunlit * sun.irradiance(band);
            }
            let share = through * rho;
            *to += share * FRAC_1_PI * irradiance;
            weight = f64::max(weight, share);
        }
        path.noise += weight * f64::from(self.noise.at(unknown));
    }

    /// cos(sun) V at a point: one shadow ray for a point sun, a few for a disc.
    #[inline]
    fn sun_cosine(&self, surface: &Surface, sample: Sample, path: &mut Path) -> f64 {
        let Some(sun) = &self.light.sun else { return 0.0 };
        let cosine = sun.cosine(surface.normal);
        if cosine <= 0.0 {
            return 0.0;
        }
        if sun.is_point() {
            path.rays += 1;
            let shadow = self.bvh.occluded(&surface.leave(sun.direction()));
            return if shadow { 0.0 } else { cosine };
        }
        let (sequence, mut count, mut goal) = match sample {
            Sample::Alone(seed) => (Sequence::new(hash2(seed, 0x0d15_c000)), 0, DISC_RAYS.0),
            Sample::OneOf { seed, index } => (Sequence::new(hash2(seed, 0x0d15_c000)), index, index + 1),
        };
        let (mut lit, mut all) = (0.0, 0.0);
        while count < goal {
            let (u, v) = sequence.pair(count, 0);
            let toward = sun.sample(u, v);
            let share = sun.share(toward, surface.normal);
            count += 1;
            if share > 0.0 {
                all += share;
                path.rays += 1;
                lit += if self.bvh.occluded(&surface.leave(toward)) { 0.0 } else { share };
            }
            if matches!(sample, Sample::Alone(_)) && count == DISC_RAYS.0 && lit != 0.0 && lit != all {
                goal = DISC_RAYS.1;
            }
        }
        if all > 0.0 { cosine * (lit / all) } else { 0.0 }
    }

    /// The sun in a lobe, evaluated directly: E q(sun, view) V.
    fn add_sun_gloss(&self, leg: &Leg, surface: &Surface, mirror: &Mirror, terms: &mut Terms) {
        let (Some(sun), Some(lobe)) = (&self.light.sun, &mirror.lobe) else { return };
        let toward: Vec3 = sun.direction();
        if toward.dot(surface.normal) <= 0.0 || self.bvh.occluded(&surface.leave(toward)) {
            return;
        }
        let mirrored = surface.mirrored(self.scene, leg.ray.direction);
        let value = lobe.value(mirrored.dot(toward));
        let own = terms.mirror_sky.iter_mut().zip(&leg.through).take(self.shape.bands);
        own.enumerate().for_each(|(band, (to, through))| *to += through * sun.irradiance(band) * value);
    }
}

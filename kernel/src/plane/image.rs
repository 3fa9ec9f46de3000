//! Images of the plane model: one line of samples, eq. (15) along each sample's ray.

use crate::base::error::{Error, Field};
use crate::base::index::span;
use crate::base::math::{cos, sin};
use crate::plane::Vec2;
use crate::plane::light::Light;
use crate::plane::lobe::PlaneLobe;
use crate::plane::path::{Chains, Hit, PathState, Sink};
use crate::plane::scene::{NOWHERE, PlaneScene};
use crate::plane::scratch::Scratch;
use core::ops::Range;

/// An orthographic view: samples at the centres of equal cells across the object's projected extent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    toward: Vec2,
    along: Vec2,
    first: f64,
    step: f64,
    far: f64,
    samples: usize,
}

impl View {
    /// The view from the direction (sin `angle`, cos `angle`), `samples` across.
    ///
    /// # Errors
    /// [`Error::Range`] where the angle is not finite or there is no sample.
    pub fn new(scene: &PlaneScene<'_>, angle: f64, samples: usize) -> Result<View, Error> {
        if !angle.is_finite() {
            return Err(Error::Range { field: Field::Direction, band: 0, value: angle });
        }
        if samples == 0 {
            return Err(Error::Range { field: Field::Resolution, band: 0, value: 0.0 });
        }
        let toward = Vec2::new(sin(angle), cos(angle));
        let along = Vec2::new(cos(angle), -sin(angle));
        let (mut low, mut high, mut far) = (f64::INFINITY, f64::NEG_INFINITY, 0.0);
        for p in scene.primitives() {
            let (ends, radius) = if p.kind == 0 { ([p.a, p.a], p.b[0]) } else { ([p.a, p.b], 0.0) };
            for end in ends.map(Vec2::from) {
                low = f64::min(low, end.dot(along) - radius);
                high = f64::max(high, end.dot(along) + radius);
                far = f64::max(far, end.dot(toward) + 2.0 * radius);
            }
        }
        let step = (high - low) / samples as f64;
        Ok(View { toward, along, first: low + 0.5 * step, step, far: far + (high - low), samples })
    }

    /// Number of samples.
    pub fn samples(&self) -> usize {
        self.samples
    }

    /// Abscissa of a sample.
    pub fn abscissa(&self, sample: usize) -> f64 {
        self.first + self.step * sample as f64
    }

    /// Origin and direction of the ray at an abscissa.
    pub fn ray(&self, abscissa: f64) -> (Vec2, Vec2) {
        (self.along * abscissa + self.toward * self.far, -self.toward)
    }
}

/// A solved scene: what the radiance along any ray follows from.
#[derive(Clone, Copy, Debug)]
pub struct Solved<'a> {
    /// The scene.
    pub scene: &'a PlaneScene<'a>,
    /// The light.
    pub light: &'a Light<'a>,
    /// Diffuse radiance of all unknowns without the sun's direct part, level by level
    /// ([`crate::plane::solve::System::levels`]).
    pub radiance: &'a [f64],
    /// Light reflected more often does not count.
    pub max_bounces: Option<u32>,
    /// Chains end where their mirrors leave less than this share.
    pub cutoff: f64,
}

/// What a ray brings.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Seen {
    /// Radiance: the sky's where nothing is met.
    pub radiance: f64,
    /// Whether the ray meets the object.
    pub object: bool,
    /// Rays traced.
    pub rays: u32,
    /// Light that chains could still bring which were cut, as a share of the brightest.
    pub lost: f64,
}

/// Takes up one ray's light.
struct Eye<'a> {
    solved: &'a Solved<'a>,
    seen: Seen,
}

impl Sink for Eye<'_> {
    fn meet(&mut self, hit: &Hit, state: &PathState) {
        self.seen.rays += 1;
        self.seen.object = true;
        let solved = self.solved;
        let Some(p) = solved.scene.primitives().get(hit.primitive as usize) else { return };
        let diffuse = solved.scene.diffuse(p.material);
        let level = match solved.max_bounces {
            Some(most) if state.depth >= most => return,
            Some(most) if most > 1 => (most - state.depth - 1) as usize,
            _ => 0,
        };
        if diffuse == 0.0 {
            return;
        }
        let unknowns = solved.scene.unknowns();
        let values = solved.radiance.get(level * unknowns..).unwrap_or(&[]);
        let v = solved.scene.parameter(hit.primitive as usize, hit.point);
        let stencil = solved.scene.stencil(hit.primitive as usize, v);
        let smooth: f64 = stencil.terms().map(|(u, w)| w * values.get(u).copied().unwrap_or(0.0)).sum();
        let sun = diffuse * solved.light.sunlit(solved.scene, hit.point, hit.normal, hit.primitive);
        self.seen.radiance += state.throughput * (smooth + sun);
    }

    fn back(&mut self) {
        self.seen.rays += 1;
        self.seen.object = true;
    }

    fn escape(&mut self, state: &PathState) {
        self.seen.rays += 1;
        self.seen.radiance += state.throughput * self.solved.light.radiance(state.direction, state.depth > 0);
    }

    fn glossy(&mut self, hit: &Hit, mirrored: Vec2, lobe: &PlaneLobe, state: &PathState) {
        let solved = self.solved;
        self.seen.radiance += state.throughput * solved.light.in_lobe(solved.scene, hit, mirrored, lobe);
    }

    fn lost(&mut self, throughput: f64) {
        self.seen.lost += throughput;
    }
}

impl Solved<'_> {
    /// What arrives against `direction` (a unit vector) at `origin`, a point on no body.
    pub fn radiance(&self, origin: Vec2, direction: Vec2, scratch: &mut Scratch<'_>) -> Seen {
        let mut eye = Eye { solved: self, seen: Seen::default() };
        let chains = Chains {
            scene: self.scene,
            most: self.max_bounces.unwrap_or(u32::MAX),
            sky_nodes: if self.light.is_uniform() { 1 } else { 16 },
            cuts: self.light.cuts(),
        };
        let (skip, floor) = (NOWHERE, self.cutoff.max(1e-15));
        let state = PathState { origin, direction, skip, throughput: 1.0, floor, depth: 0, lobes: 0 };
        chains.follow(state, &mut eye, scratch);
        eye.seen
    }
}

/// The samples of `range` of a view, to `out`.
///
/// # Errors
/// [`Error::Length`] where `out` does not fit the range; [`Error::Mismatch`] where the scratch is another scene's
/// or has no room for the light's cuts.
pub fn fill(
    solved: &Solved<'_>,
    view: &View,
    range: Range<usize>,
    out: &mut [Seen],
    scratch: &mut Scratch<'_>,
) -> Result<(), Error> {
    if out.len() != span(&range) {
        return Err(Error::Length { what: "samples", expected: span(&range), given: out.len() });
    }
    scratch.check(solved.scene, solved.light.cuts().len())?;
    for (sample, out) in range.zip(out) {
        let (origin, direction) = view.ray(view.abscissa(sample));
        *out = solved.radiance(origin, direction, scratch);
    }
    Ok(())
}

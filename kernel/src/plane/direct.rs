//! Sky and sun on every unknown, straight and by way of mirrors and lobes: the right-hand side of eq. (12).

use crate::base::error::Error;
use crate::base::index::{parts, pieces, span};
use crate::plane::Vec2;
use crate::plane::light::{Light, Sky};
use crate::plane::lobe::PlaneLobe;
use crate::plane::path::{Hit, PathState, Sink};
use crate::plane::rows::{Gather, RowSettings, check_bounces, class, gather};
use crate::plane::scene::PlaneScene;
use crate::plane::scratch::Scratch;
use core::ops::Range;

/// Number of values that [`fill`] writes for each unknown: one for each number of reflections that counts.
pub use crate::plane::rows::classes;

/// Takes up the light of one row.
struct Gatherer<'a> {
    scene: &'a PlaneScene<'a>,
    light: &'a Light<'a>,
    settings: &'a RowSettings,
    /// Sky already counted by the row's closure.
    closed: bool,
    out: &'a mut [f64],
}

impl Gatherer<'_> {
    fn add(&mut self, depth: u32, value: f64) {
        if let Some(out) = class(depth, self.settings).and_then(|c| self.out.get_mut(c)) {
            *out += value;
        }
    }
}

impl Sink for Gatherer<'_> {
    fn meet(&mut self, hit: &Hit, state: &PathState) {
        if self.light.sun.is_none() {
            return;
        }
        let Some(p) = self.scene.primitives().get(hit.primitive as usize) else { return };
        let diffuse = self.scene.diffuse(p.material);
        if diffuse > 0.0 {
            let lit = self.light.sunlit(self.scene, hit.point, hit.normal, hit.primitive);
            self.add(state.depth + 1, state.throughput * diffuse * lit);
        }
    }

    fn escape(&mut self, state: &PathState) {
        if !self.closed {
            self.add(state.depth, state.throughput * self.light.radiance(state.direction, state.depth > 0));
        }
    }

    fn glossy(&mut self, hit: &Hit, mirrored: Vec2, lobe: &PlaneLobe, state: &PathState) {
        self.add(state.depth, state.throughput * self.light.in_lobe(self.scene, hit, mirrored, lobe));
    }
}

/// Mean over the half circle of the radiance that arrives at the unknowns of `range`, without the sun's direct
/// part and without what other unknowns send: [`classes`] values an unknown, to `out`. `open` is what
/// [`crate::plane::rows::fill`] wrote for the same range: under a uniform sky and no sun nothing is traced.
///
/// # Errors
/// [`Error::Range`] of the reflections that count; [`Error::Length`]; [`Error::Mismatch`] where the scratch is
/// another scene's or has no room for the light's cuts.
pub fn fill(
    scene: &PlaneScene<'_>,
    light: &Light<'_>,
    settings: &RowSettings,
    range: Range<usize>,
    open: &[f64],
    out: &mut [f64],
    scratch: &mut Scratch<'_>,
) -> Result<(), Error> {
    check_bounces(settings)?;
    let classes = classes(settings);
    for (what, given) in [("open shares", open.len()), ("plane light", out.len())] {
        let expected = span(&range).saturating_mul(classes);
        if given != expected {
            return Err(Error::Length { what, expected, given });
        }
    }
    scratch.check(scene, light.cuts().len())?;
    let closed = light.is_uniform();
    let traced = !closed || light.sun.is_some();
    for (unknown, (open, out)) in range.zip(parts(open, classes).zip(pieces(out, classes))) {
        let sky = if let (Sky::Uniform(radiance), true) = (light.sky, closed) { radiance } else { 0.0 };
        out.iter_mut().zip(open).for_each(|(out, share)| *out = sky * share);
        if traced {
            let mut sink = Gatherer { scene, light, settings, closed, out };
            gather(&Gather { scene, settings, light: Some(light) }, unknown, &mut sink, scratch);
        }
    }
    Ok(())
}

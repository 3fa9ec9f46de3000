//! Mean irradiance and radiance of a facet's side over its elements.

use crate::base::math::FRAC_1_PI;
use crate::coupling::Coupling;
use crate::view::chain::Solved;

/// Irradiance (all that arrives, mean over the facet, not divided by pi) and diffuse radiance (emission + rho_d
/// irradiance/pi) of one side of a facet, one value per band each. `sun` is the mean of cos V of each unknown.
/// Degenerate facets: zeros.
pub fn side(
    solved: &Solved<'_>,
    coupling: &Coupling<'_>,
    sun: &[f64],
    facet: usize,
    side: usize,
    irradiance: &mut [f64],
    radiance: &mut [f64],
) {
    let (scene, shape, last) = (solved.scene, solved.shape, solved.shape.levels.saturating_sub(1));
    irradiance.fill(0.0);
    radiance.fill(0.0);
    if scene.areas().get(facet).is_none_or(|area| *area == 0.0) {
        return;
    }
    let level = solved.settings.max_bounces.map_or(last, |most| last.min(most as usize));
    for unknown in solved.elements.unknowns_of(facet, side) {
        let mean = solved.irradiance.get(shape.at(unknown, level)).unwrap_or(&[]);
        // what lies inside a body receives nothing
        let share = solved.elements.share(unknown) * f64::from(coupling.row(unknown).visible_share);
        let lit = sun.get(unknown).copied().unwrap_or(0.0);
        let reflected_irradiance =
            solved.images.mean(shape, solved.elements.facet_side(unknown), unknown, level);
        for (band, (e, m)) in irradiance.iter_mut().zip(mean).enumerate() {
            let sun = solved.light.sun.as_ref().map_or(0.0, |s| s.irradiance(band));
            *e += (m + reflected_irradiance.get(band).copied().unwrap_or(0.0) + lit * sun) * share;
        }
    }
    let material = scene.material(facet);
    let own = solved.light.emission(scene, facet, side).iter().zip(scene.diffuse(material));
    for ((l, e), (emission, diffuse)) in radiance.iter_mut().zip(irradiance).zip(own) {
        *l = emission + diffuse * FRAC_1_PI * *e;
    }
}

//! Irradiance and radiance of a facet's side: means over its elements; in a cluster of facets, at the facet's middle.

use crate::base::math::{FRAC_1_PI, PI};
use crate::coupling::Coupling;
use crate::rays::ray::{Hit, Ray};
use crate::rays::surface::Surface;
use crate::view::chain::{ChainScratch, RaySample, Solved, Terms};

/// Irradiance (all that arrives, mean over the facet, not divided by pi) and diffuse radiance (emission + rho_d
/// irradiance/pi) of one side of a facet, one value per band each. `sun` is the mean of cos V of each unknown.
/// Degenerate facets: zeros. Of a facet that shares its element with others, the irradiance is that at its middle, to the
/// error of an image.
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
    let first = solved.elements.unknowns_of(facet, side).next().unwrap_or(0);
    if solved.elements.is_cluster(first) {
        if coupling.row(first).visible_share > 0.0 {
            at_middle(solved, facet, side, irradiance, radiance);
        }
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

/// Irradiance and diffuse radiance at the middle of a facet's side, as an image shows it. Bands in which it reflects nothing,
/// and so show nothing, have the irradiance 0.
// apart: what chains need does not burden the stack of coarse meshes
#[inline(never)]
fn at_middle(solved: &Solved<'_>, facet: usize, side: usize, irradiance: &mut [f64], radiance: &mut [f64]) {
    let scene = solved.scene;
    let surface = Surface::new(scene, facet, side, 1.0 / 3.0, 1.0 / 3.0);
    let ray = Ray::new(surface.point + surface.normal, -surface.normal);
    let hit = Hit { t: 1.0, facet: facet as u32, u: surface.u, v: surface.v, front: side == 0 };
    let solved = Solved { settings: solved.settings.of_points(), ..*solved };
    let mut terms = Terms::ZERO;
    terms.clear(radiance.len());
    solved.radiance_at((&ray, Some(hit)), RaySample::Integrate(facet as u32), &mut terms, &mut {
        ChainScratch::ZERO
    });
    let own = solved.light.emission(scene, facet, side).iter().zip(scene.diffuse(surface.material));
    for (((l, e), shown), (emission, diffuse)) in
        radiance.iter_mut().zip(irradiance).zip(&terms.diffuse).zip(own)
    {
        *l = *shown;
        *e = if *diffuse > 0.0 { ((shown - emission) * PI / diffuse).max(0.0) } else { 0.0 };
    }
}

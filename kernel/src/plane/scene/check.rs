//! What can be wrong with a scene.

use super::{BODY_ELEMENTS, BODY_RADIUS, BodyInput, PlaneGloss, PlaneInput, RaySet, Shape, segments};
use crate::base::error::{Error, Field};
use crate::base::index::Index;
use crate::base::math::fabs;
use crate::plane::{Vec2, length};
use crate::scene::MOST_REFLECTANCE;

/// Checks materials and bodies.
pub(super) fn check(input: &PlaneInput<'_>) -> Result<(), Error> {
    if input.bodies.is_empty() {
        return Err(Error::NoFacets);
    }
    if input.materials.is_empty() {
        return Err(Error::NoMaterials);
    }
    for (material, m) in input.materials.iter().enumerate() {
        for (field, value) in [(Field::Diffuse, m.diffuse), (Field::Specular, m.specular)] {
            if !(0.0..=MOST_REFLECTANCE).contains(&value) {
                return Err(Error::MaterialRange { material, band: 0, field, value });
            }
        }
        let sum = m.diffuse + m.specular;
        if sum > MOST_REFLECTANCE {
            return Err(Error::ReflectanceSum { material, band: 0, sum });
        }
        if let Some(gloss) = m.gloss {
            check_gloss(material, &gloss)?;
        }
    }
    for (body, b) in input.bodies.iter().enumerate() {
        check_body(body, b)?;
        if b.material >= input.materials.len() {
            let materials = input.materials.len();
            return Err(Error::MaterialOutOfRange { facet: body, material: b.material, materials });
        }
    }
    Ok(())
}

fn check_gloss(material: usize, gloss: &PlaneGloss) -> Result<(), Error> {
    let value = gloss.axis_ratio;
    if !(value >= 1.0 && value.is_finite()) {
        return Err(Error::MaterialRange { material, band: 0, field: Field::AxisRatio, value });
    }
    let bad = match gloss.rays {
        None => None,
        Some(RaySet::Paper { spacing, .. }) => (!(0.0..=3.2).contains(&spacing)).then_some(spacing),
        Some(RaySet::Gauss(n) | RaySet::Equal(n) | RaySet::Split(n)) => {
            n.iter().find(|&&n| !(1..=4096).contains(&n)).map(|&n| f64::from(n))
        }
    };
    bad.map_or(Ok(()), |value| {
        Err(Error::MaterialRange { material, band: 0, field: Field::GlossRays, value })
    })
}

/// Sizes and coordinates whose squares f64 holds.
fn sane(x: f64) -> bool {
    x.is_finite() && fabs(x) < 1e100
}

fn check_body(body: usize, input: &BodyInput<'_>) -> Result<(), Error> {
    let fault = |what| Err(Error::Body { body, what });
    if !(1..=1 << 20).contains(&input.elements) {
        return fault(BODY_ELEMENTS);
    }
    match input.shape {
        Shape::Circle { centre, radius } => {
            if !(centre.into_iter().all(sane) && sane(radius)) {
                return fault("a value is not finite or beyond 1e100");
            }
            if radius <= 1e-100 {
                return fault(BODY_RADIUS);
            }
        }
        Shape::Polyline { points, closed, .. } => {
            if !points.iter().flatten().all(|&x| sane(x)) {
                return fault("a value is not finite or beyond 1e100");
            }
            if points.len() < if closed { 3 } else { 2 } {
                return fault("too few points");
            }
            let next = |i: usize| if i + 1 < points.len() { points.at(i + 1) } else { points.at(0) };
            if (0..segments(&input.shape))
                .any(|i| length(Vec2::from(next(i)) - Vec2::from(points.at(i))) <= 1e-100)
            {
                return fault("two successive points coincide");
            }
        }
    }
    Ok(())
}

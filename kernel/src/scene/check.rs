//! Everything that can be wrong with a scene's input.

use super::{MAX_BANDS, MOST_GLOSS_RAYS, MOST_REFLECTANCE, Mesh, NO_NORMAL, corner_normals, normal_facets};
use crate::base::error::{Error, Field};
use crate::base::math::{Vec3, unit};

/// Counts that do not fit together.
pub(super) fn sizes(mesh: &dyn Mesh) -> Result<(), Error> {
    if !(1..=MAX_BANDS).contains(&mesh.bands()) {
        return Err(Error::Bands { given: mesh.bands() });
    }
    if mesh.facets() == 0 {
        return Err(Error::NoFacets);
    }
    // two sides and the flag bit of a coupling record must fit into 32 bits
    if mesh.facets() > (1 << 29) {
        return Err(Error::TooMany { what: "facets", limit: 1 << 29 });
    }
    if mesh.materials() == 0 {
        return Err(Error::NoMaterials);
    }
    for (what, given) in
        [("facet_materials", mesh.facet_materials()), ("facet_normals", mesh.facet_normals())]
    {
        if given != 0 && given != mesh.facets() {
            return Err(Error::Length { what, expected: mesh.facets(), given });
        }
    }
    Ok(())
}

/// Values of materials out of range.
pub(super) fn materials(mesh: &dyn Mesh) -> Result<(), Error> {
    let bands = mesh.bands();
    for index in 0..mesh.materials() {
        let material = mesh.material(index);
        let fields = [
            (Field::Diffuse, material.diffuse, MOST_REFLECTANCE),
            (Field::Specular, material.specular, MOST_REFLECTANCE),
            (Field::Emission, material.emission, 1e37),
        ];
        for (field, values, largest) in fields {
            if values.len() != bands {
                let given = values.len();
                return Err(Error::BandCount { material: index, field, expected: bands, given });
            }
            for (band, &value) in values.iter().enumerate() {
                if !(0.0..=largest).contains(&value) {
                    return Err(Error::MaterialRange { material: index, band, field, value });
                }
            }
        }
        for (band, (d, s)) in material.diffuse.iter().zip(material.specular).enumerate() {
            if d + s > MOST_REFLECTANCE {
                return Err(Error::ReflectanceSum { material: index, band, sum: d + s });
            }
        }
        if let Some(gloss) = material.gloss {
            if !(gloss.axis_ratio >= 1.0 && gloss.axis_ratio.is_finite()) {
                let (field, value) = (Field::AxisRatio, gloss.axis_ratio);
                return Err(Error::MaterialRange { material: index, band: 0, field, value });
            }
            if let Some(rays) = gloss.rays.filter(|n| !(1..=MOST_GLOSS_RAYS).contains(n)) {
                let (field, value) = (Field::GlossRays, f64::from(rays));
                return Err(Error::MaterialRange { material: index, band: 0, field, value });
            }
        }
    }
    Ok(())
}

/// Vertices, normals and indices.
pub(super) fn mesh(mesh: &dyn Mesh) -> Result<(), Error> {
    let (vertices, normals, materials) = (mesh.vertices(), mesh.normals(), mesh.materials());
    if let Some(vertex) = (0..vertices).find(|&v| !mesh.vertex(v).iter().all(|x| x.is_finite())) {
        return Err(Error::VertexNotFinite { vertex });
    }
    if let Some(normal) = (0..normals).find(|&n| unit(Vec3::from_array(mesh.normal(n))).is_none()) {
        return Err(Error::NormalNotFinite { normal });
    }
    for facet in 0..mesh.facets() {
        if let Some(&index) = mesh.facet(facet).iter().find(|&&i| i as usize >= vertices) {
            return Err(Error::IndexOutOfRange { facet, index: index as usize, vertices });
        }
    }
    for facet in 0..normal_facets(mesh) {
        let missing = |i: &&u32| **i as usize >= normals && **i != NO_NORMAL;
        if let Some(&index) = corner_normals(mesh, facet).iter().find(missing) {
            return Err(Error::NormalIndexOutOfRange { facet, index: index as usize, normals });
        }
    }
    for facet in 0..mesh.facet_materials() {
        let material = mesh.facet_material(facet) as usize;
        if material >= materials {
            return Err(Error::MaterialOutOfRange { facet, material, materials });
        }
    }
    Ok(())
}

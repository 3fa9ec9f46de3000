//! Scenes in baked blocks.

use super::{MAX_BANDS, MIRROR_AXIS_RATIO, MOST_GLOSS_RAYS, NO_MIRROR, Scene, normal_and_area};
use crate::base::arena::Writer;
use crate::base::arena::{View, plain_struct};
use crate::base::error::Error;
use crate::base::index::Index;
use crate::base::math::Vec3;

plain_struct! {
    /// A scene without its arrays.
    pub struct Head {
        /// Facets.
        pub facets: u64,
        /// Materials.
        pub materials: u64,
        /// Spectral bands.
        pub bands: u64,
        /// Sides that carry a material.
        pub sides: u64,
        /// 1 with vertex normals.
        pub smooth: u64,
        /// Lowest corner of the bounding box, in the caller's coordinates.
        pub lowest: [f64; 3],
        /// Half its size.
        pub half: [f64; 3],
        /// Scene lengths per length of the caller.
        pub scale: f64,
    }
}

impl<'m> Scene<'m> {
    pub(crate) fn put(&self, writer: &mut Writer<'_>) -> Result<(), Error> {
        writer.put(&[Head {
            facets: self.corners.len() as u64,
            materials: self.mirror.len() as u64,
            bands: self.bands as u64,
            sides: self.sides as u64,
            smooth: u64::from(self.is_smooth()),
            lowest: self.lowest.to_array(),
            half: self.half.to_array(),
            scale: self.scale,
        }])?;
        writer.put(self.corners)?;
        writer.put(self.normals)?;
        writer.put(self.areas)?;
        writer.put(self.materials)?;
        writer.put(self.corner_normals)?;
        writer.put(self.diffuse)?;
        writer.put(self.specular)?;
        writer.put(self.emission)?;
        writer.put(self.mirror)?;
        writer.put(self.gloss_ratio)?;
        writer.put(self.gloss_rays)
    }

    pub(crate) fn get(view: &mut View<'m>) -> Result<Scene<'m>, Error> {
        let head = view.take::<Head>(1)?.first().copied().ok_or(Error::Block)?;
        let counted = (1..=1 << 28).contains(&head.facets)
            && (1..=1 << 28).contains(&head.materials)
            && (1..=MAX_BANDS as u64).contains(&head.bands)
            && (1..=2).contains(&head.sides)
            && head.smooth <= 1;
        if !counted {
            return Err(Error::Block);
        }
        let (facets, materials) = (head.facets as usize, head.materials as usize);
        let values = materials.checked_mul(head.bands as usize).ok_or(Error::Block)?;
        let mut scene = Scene {
            corners: view.take(facets)?,
            normals: view.take(facets)?,
            areas: view.take(facets)?,
            materials: view.take(facets)?,
            corner_normals: view.take(if head.smooth == 1 { facets } else { 0 })?,
            diffuse: view.take(values)?,
            specular: view.take(values)?,
            emission: view.take(values)?,
            mirror: view.take(materials)?,
            gloss_ratio: view.take(materials)?,
            gloss_rays: view.take(materials)?,
            lowest: Vec3::from_array(head.lowest),
            half: Vec3::from_array(head.half),
            scale: head.scale,
            bands: head.bands as usize,
            sides: head.sides as usize,
            degenerate: 0,
            memory: 0,
        };
        scene.degenerate = scene.areas.iter().filter(|a| **a == 0.0).count();
        let smooth = scene.is_smooth();
        scene.memory = Scene::need(facets, materials, scene.bands, smooth).bytes()?;
        if scene.is_sound() { Ok(scene) } else { Err(Error::Block) }
    }

    /// Everything is as [`Scene::new`] makes it.
    fn is_sound(&self) -> bool {
        let power = self.scale.is_normal() && self.scale > 0.0 && self.scale.to_bits() & ((1 << 52) - 1) == 0;
        power
            && self.lowest.is_finite()
            && self.half.is_finite()
            && self.facets_sound()
            && self.materials_sound()
    }

    fn facets_sound(&self) -> bool {
        let bits = |v: Vec3| v.to_array().map(f64::to_bits);
        let made = self.corners.iter().zip(self.normals).zip(self.areas).all(|((corners, normal), area)| {
            // the box is [-1, 1], but for the rounding of the shift
            if !corners.iter().all(|c| c.abs().max_element() <= 1.0 + 1e-9) {
                return false;
            }
            let (n, a) = normal_and_area(corners);
            bits(n) == bits(*normal) && a.to_bits() == area.to_bits()
        });
        let unit = |n: &Vec3| (n.length_squared() - 1.0).abs() < 1e-9;
        let mut smooth = self.corner_normals.iter().zip(self.areas);
        made && self.materials.iter().all(|m| (*m as usize) < self.mirror.len())
            && smooth.all(|(n, area)| n.iter().all(|n| unit(n) || (*area == 0.0 && *n == Vec3::ZERO)))
    }

    fn materials_sound(&self) -> bool {
        let share = |x: &f64| (0.0..=1.0).contains(x);
        let values = self.diffuse.iter().all(share)
            && self.specular.iter().all(share)
            && self.emission.iter().all(|x| (0.0..=1e37).contains(x))
            && self.diffuse.iter().zip(self.specular).all(|(d, s)| d + s <= 1.0 + 4.0 * f64::EPSILON);
        let gloss = self.gloss_ratio.iter().all(|r| *r == 0.0 || (1.0..MIRROR_AXIS_RATIO).contains(r))
            && self.gloss_rays.iter().all(|n| *n <= MOST_GLOSS_RAYS);
        let classes = self.mirror.iter().enumerate().all(|(material, &class)| {
            let reflects = self.specular(material).iter().any(|&s| s > 0.0);
            let same = self.specular(class as usize) == self.specular(material)
                && self.gloss_ratio.at(class as usize) == self.gloss_ratio.at(material);
            if reflects { class as usize <= material && same } else { class == NO_MIRROR }
        });
        values && gloss && classes
    }
}

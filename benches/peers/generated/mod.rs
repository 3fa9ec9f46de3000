//! Generated scenes of kinds that users have, drawn with a seed: what a comparison is measured on that nobody tuned for.

mod file;
mod kinds;
mod truth;

pub use file::write;
pub use kinds::KINDS;
pub use truth::truth;

use crate::drawn::Draw;
use crate::support::scenes::Mesh;
use crate::support::twin::{Material, Scene, Sky, Sun};
use blik_kernel::camera::CameraInput;

/// Pixels of an image's side.
const PIXELS: usize = 96;

/// A scene of a kind.
pub struct Generated {
    pub mesh: Mesh,
    /// Material of each index that the mesh names.
    pub materials: Vec<Material>,
    pub two_sided: bool,
    pub sky: Option<Sky>,
    pub sun: Option<Sun>,
    pub camera: CameraInput,
}

impl Generated {
    /// The scene of the kind at `index` of [`KINDS`] for a seed.
    pub fn new(index: usize, seed: usize) -> Generated {
        // streams of their own, away from the calibration's, which begin at 0
        let mut draw = Draw::new((seed + 1) << 16 | index);
        KINDS[index].1(&mut draw)
    }

    /// The scene of the kind of that name.
    pub fn named(kind: &str, seed: usize) -> Option<Generated> {
        let index = KINDS.iter().position(|(name, _)| *name == kind)?;
        Some(Generated::new(index, seed))
    }

    /// The scene as the twin and the judge take it.
    pub fn scene(&self) -> Scene {
        let mut scene = Scene::new(&self.mesh, &self.materials).two_sided(self.two_sided);
        (scene.sky, scene.sun) = (self.sky.clone(), self.sun.clone());
        scene
    }
}

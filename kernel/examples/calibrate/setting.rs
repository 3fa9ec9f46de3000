//! A kind's scene before its light and camera are drawn.

use crate::drawn::light::Suns;
use crate::support::scenes::Mesh;
use crate::support::twin::Material;
use glam::DVec3;

/// From where a scene is looked at.
#[derive(Clone, Copy, Debug)]
pub enum Eye {
    /// From 10 to 70 degrees above.
    Outside,
    /// From any side.
    Around,
    /// From 40 to 85 degrees above.
    Above,
    /// From the octant x, y, z > 0.
    Octant,
    /// From within a room of this size on z = 0.
    Within(DVec3),
}

/// A kind's scene before light and camera are drawn.
pub struct Setting {
    pub mesh: Mesh,
    pub materials: Vec<Material>,
    pub two_sided: bool,
    pub sun: f64,
    pub suns: Suns,
    pub dark: bool,
    pub rough: bool,
    pub eye: Eye,
}

impl Setting {
    /// One-sided, seen from outside, half the time in the sun.
    pub fn new(mesh: Mesh, materials: Vec<Material>) -> Setting {
        let (suns, eye) = (Suns::Any, Eye::Outside);
        Setting { mesh, materials, two_sided: false, sun: 0.5, suns, dark: false, rough: false, eye }
    }

    /// With a sun with the probability `p`.
    pub fn sun(self, p: f64) -> Setting {
        Setting { sun: p, ..self }
    }

    /// With suns of this kind.
    pub fn suns(self, suns: Suns) -> Setting {
        Setting { suns, ..self }
    }

    /// Seen from there.
    pub fn eye(self, eye: Eye) -> Setting {
        Setting { eye, ..self }
    }

    /// Both sides alike.
    pub fn two_sided(self) -> Setting {
        Setting { two_sided: true, ..self }
    }

    /// Without sky and sun.
    pub fn dark(self) -> Setting {
        Setting { dark: true, ..self }
    }

    /// Too noisy a reference for the smallest tolerance.
    pub fn rough(self) -> Setting {
        Setting { rough: true, ..self }
    }
}

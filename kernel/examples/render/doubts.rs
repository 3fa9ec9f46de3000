//! Warnings of what is allowed but seldom meant: an object out of view, turned inside out, or in the dark.

use crate::failure::{Failure, Warnings};
use crate::pipeline::Job;
use crate::scene_file::Scene;
use crate::view::View;

/// Share of backs in what is seen, from which on they are hardly meant: rims of open sheets show less, one turned wall of a
/// room more.
const MANY_BACKS: f64 = 0.1;

/// Warnings of the scene and of what the camera sees of it.
pub fn of(job: &Job, view: &View) -> Warnings {
    let mut warnings = Warnings::default();
    let mut warn = |what: String| warnings.append(Warnings::of(Failure::at(job.path, what)));
    if view.background == view.samples {
        warn(format!(
            "no pixel's centre meets the object, which lies {}: look at camera.eye, target and height or fov_deg",
            extent(job)
        ));
    }
    let backs = view.share_of_backs();
    if backs >= MANY_BACKS {
        warn(format!(
            "{:.0} % of what is seen are backs, which are black: are the facets' corners in the wrong order? \
             mesh.two_sided = true gives backs the fronts' material",
            100.0 * backs
        ));
    }
    if !shines(job.scene, job) {
        warn("nothing shines: no [sky], no [sun] and no emission of a material in use".into());
    }
    warnings
}

/// Whether there is any light.
fn shines(scene: &Scene, job: &Job) -> bool {
    let some = |values: &[f64]| values.iter().any(|x| *x > 0.0);
    // A gradient and a half sky shine by their ground, too; a table's factor is its radiance.
    scene.sky.as_ref().is_some_and(|sky| some(&sky.radiance) || some(&sky.ground))
        || scene.sun.as_ref().is_some_and(|sun| some(&sun.irradiance))
        || job.materials.iter().any(|material| some(&material.emission))
}

/// The box of the mesh, for messages.
fn extent(job: &Job) -> String {
    let (low, high) = job.mesh.bounds();
    format!("between {low:?} and {high:?}")
}

/// A warning where an image that shows the object is black all over, for no light reaches what is seen.
pub fn of_image(job: &Job, view: &View, pixels: &[f32]) -> Warnings {
    let dark = view.background < view.samples
        && view.share_of_backs() < MANY_BACKS
        && pixels.iter().all(|x| *x == 0.0);
    if dark && shines(job.scene, job) {
        let what = "the image is black: no light reaches what is seen, or nothing there reflects";
        return Warnings::of(Failure::at(job.path, what));
    }
    Warnings::default()
}

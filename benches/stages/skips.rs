//! What a scene does not contain costs nothing: each pair is the same work with something absent, then present.

use crate::scene::{Case, EYE, Mesh, Values, bowl, camera, image, sphere};
use crate::{group, pixels, quick};
use blik_kernel::host::{GeometryMemory, Host, Settings};
use blik_kernel::sky::SkyModel;
use criterion::Criterion;

/// Runs the two of a pair.
fn pair<R>(c: &mut Criterion, name: &str, mut absent: impl FnMut() -> R, mut present: impl FnMut() -> R) {
    let mut group = group(c, &format!("skip/{name}"));
    group.bench_function("absent", |b| b.iter(&mut absent));
    group.bench_function("present", |b| b.iter(&mut present));
}

/// Each kind of work that is not done where nothing needs it.
pub fn pairs(c: &mut Criterion) {
    let host = Host::new(0).expect("threads");
    let host = &host;
    materials(c, host);
    light(c, host);
    view(c, host);
}

fn mesh() -> Mesh {
    bowl(if quick() { 5 } else { 16 })
}

fn geometry(host: &Host, case: &Case) -> usize {
    case.geometry(host, &mut GeometryMemory::default()).report().bytes.coupling
}

/// The coupling's.
fn materials(c: &mut Criterion, host: &Host) {
    let diffuse = Case::new(mesh(), 0.3, 0.0);
    let mirrors = Case::new(mesh(), 0.3, 0.1);
    pair(c, "mirrors", || geometry(host, &diffuse), || geometry(host, &mirrors));
    let uniform = Settings { directional: false, ..Settings::default() };
    let closed = Case { settings: uniform, ..Case::new(mesh(), 0.3, 0.0) };
    pair(c, "directions_of_the_sky", || geometry(host, &closed), || geometry(host, &diffuse));
    let convex = Case::new(sphere(), 0.3, 0.0);
    let cavity = Case::new(sphere().flipped(), 0.3, 0.0);
    pair(c, "pairs_that_see_each_other", || geometry(host, &convex), || geometry(host, &cavity));
    let black = Case::new(mesh(), 0.3, 0.0).mixed(0.9, 0.0, 0.0);
    pair(c, "diffuse_facets", || geometry(host, &black), || geometry(host, &diffuse));
    let shiny = Case::new(mesh(), 0.0, 0.4);
    let asked = Settings { all_irradiances: true, ..Settings::default() };
    let asked = Case { settings: asked, ..Case::new(mesh(), 0.0, 0.4) };
    pair(c, "irradiances_asked_for", || geometry(host, &shiny), || geometry(host, &asked));
}

/// The light's and the solution's.
fn light(c: &mut Criterion, host: &Host) {
    let case = Case::new(mesh(), 0.3, 0.1);
    let mut memory = GeometryMemory::default();
    let (geometry, values) = (case.geometry(host, &mut memory), Values::new(1));
    let lit = |model, sun| values.light(host, &geometry, model, sun).reference()[0];
    pair(c, "sun", || lit(SkyModel::Overcast, false), || lit(SkyModel::Overcast, true));
    pair(c, "sky_integration", || lit(SkyModel::Uniform, false), || lit(SkyModel::Overcast, false));
}

/// The image's.
fn view(c: &mut Criterion, host: &Host) {
    let image_of = |c: &mut Criterion, name: &str, absent: Case, present: Case| {
        let (mut first, mut second) = (GeometryMemory::default(), GeometryMemory::default());
        let values = Values::new(1);
        let (absent, present) = (absent.geometry(host, &mut first), present.geometry(host, &mut second));
        let lit = |geometry| values.light(host, geometry, SkyModel::Overcast, true);
        let (absent, present) = (lit(&absent), lit(&present));
        pair(c, name, || image(host, &absent, EYE, pixels()), || image(host, &present, EYE, pixels()));
    };
    image_of(c, "mirrors_in_view", Case::new(mesh(), 0.3, 0.0), Case::new(mesh(), 0.3, 0.1));
    // after two mirrors of 0.01 nothing is left to follow
    image_of(c, "long_chains", Case::new(mesh(), 0.1, 0.01), Case::new(mesh(), 0.1, 0.8));
    let case = Case::new(mesh(), 0.3, 0.1);
    let mut memory = GeometryMemory::default();
    let (geometry, values) = (case.geometry(host, &mut memory), Values::new(1));
    let lit = values.light(host, &geometry, SkyModel::Overcast, true);
    let of_height =
        |height| host.image(&lit, &camera(EYE, height, pixels()), false).expect("a sound camera").pixels[0];
    pair(c, "pixels_of_the_object", || of_height(26.0), || of_height(2.6));
}

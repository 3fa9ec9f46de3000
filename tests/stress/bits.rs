//! One number of many images and facets: `.ci/long` compares that of a build with overflow checks and of a release.

use crate::hostile;
use crate::kernel;

/// FNV-1a.
fn add(digest: &mut u64, bits: u64) {
    for byte in bits.to_le_bytes() {
        *digest = (*digest ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
    }
}

#[test]
fn digest_of_hostile_images() {
    let mut digest = 0xcbf2_9ce4_8422_2325;
    for hostile in hostile::all().iter().step_by(23) {
        kernel::solve(&hostile.scene, &kernel::within(5e-2), |host, lit| {
            let image = host.image(lit, &hostile.camera, true).unwrap();
            image.pixels.iter().for_each(|p| add(&mut digest, u64::from(p.to_bits())));
            add(&mut digest, image.report.error_estimate.to_bits());
            lit.facets(|_, _, _, irradiance, _| {
                irradiance.iter().for_each(|e| add(&mut digest, e.to_bits()))
            });
        });
    }
    println!("digest {digest:016x}");
}

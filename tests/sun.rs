//! The sun as a point and as a disc.

use blik_kernel::math::{PI, Vec3, cos, sin};
use blik_kernel::sun::{Sun, SunInput};
use blik_kernel::{Error, Field};

fn sun(direction: [f64; 3], half_angle_deg: f64) -> Sun<'static> {
    Sun::new(&SunInput { direction, irradiance: &[3.0, 0.5], half_angle_deg }, 2).unwrap()
}

/// A normal whose angle to +z is `angle` radians.
fn tilted(angle: f64) -> Vec3 {
    Vec3::new(sin(angle) * 0.6, sin(angle) * 0.8, cos(angle))
}

/// The mean of max(0, n.d) over the disc around +z by nested Gauss rules: Simpson's in the radius of the disc's
/// projection, the arc above the plane exactly in azimuth.
fn mean_cosine(half_angle: f64, angle: f64) -> f64 {
    let steps = 200_000;
    let mut sum = 0.0;
    for i in 0..=steps {
        let radius = sin(half_angle) * i as f64 / steps as f64;
        let (height, swing) = (cos(angle), sin(angle) * radius / (1.0 - radius * radius).sqrt());
        // max(0, height + swing cos a) over the azimuths a; the projection's measure divides by d.s
        let arc = if height >= swing {
            PI
        } else if height <= -swing {
            0.0
        } else {
            (-height / swing).acos()
        };
        let ring = 2.0 * (arc * height + swing * sin(arc)) * radius;
        sum += ring
            * if i == 0 || i == steps {
                1.0
            } else if i % 2 == 1 {
                4.0
            } else {
                2.0
            };
    }
    sum / 3.0 / steps as f64 / sin(half_angle) / PI
}

#[test]
fn a_disc_on_the_planes_horizon() {
    // N-HORIZON: half angle 0.2665 degrees, E/L = al - sin(2 al)/2
    let disc = sun([0.0, 0.0, 2.0], 0.2665);
    let got = disc.cosine(Vec3::X) * disc.irradiance(0) / disc.disc_radiance(0);
    assert!((got / 6.708580023633366e-8 - 1.0).abs() < 1e-13, "{got}");
    for degrees in [1e-4, 1e-3, 0.2665, 3.0, 10.0_f64] {
        let disc = sun([0.0, 0.0, 1.0], degrees);
        let half = degrees.to_radians();
        assert_eq!(disc.half_angle(), half);
        for share in [-1.1, -0.99, -0.7, -0.1, 0.0, 0.3, 0.9, 0.999, 1.5] {
            let angle = PI / 2.0 - share * half;
            let (got, want) = (disc.cosine(tilted(angle)), mean_cosine(half, angle));
            // 1e-10 is what is asked; Simpson's rule meets a kink of order 3/2: (1/steps)^(5/2) of the disc
            // (the angle's own rounding moves the plane by 1e-16)
            assert!((got - want).abs() < 1e-10 * half + 2e-16, "{degrees} {share}: {got:e} {want:e}");
        }
    }
}

#[test]
fn away_from_the_horizon_disc_and_point_agree() {
    for angle in [0.0, 0.5, 1.3, 1.8, 3.0] {
        let want = cos(angle).max(0.0);
        for degrees in [0.0, 0.2665, 10.0] {
            let got = sun([0.0, 0.0, 1.0], degrees).cosine(tilted(angle));
            assert!((got - want).abs() < 1e-15, "{degrees} {angle}: {got} {want}");
        }
    }
    assert_eq!(sun([0.0, 0.0, 1.0], 0.0).cosine(Vec3::X), 0.0);
}

#[test]
fn samples_carry_equal_shares_of_the_irradiance() {
    for degrees in [1e-4, 0.2665, 10.0] {
        let disc = sun([0.3, -0.2, 0.7], degrees);
        // a plane below the whole disc, one that looks away, and one that the disc rises over
        let axis = disc.direction();
        let across = axis.cross(Vec3::X).normalize();
        let planes = [
            axis,
            (axis + across).normalize(),
            -axis,
            (across + axis * 0.3 * sin(disc.half_angle())).normalize(),
        ];
        let n = 64;
        let mut sums = [0.0; 4];
        let mut nearer = 0;
        for i in 0..n * n {
            let (u, v) = (((i % n) as f64 + 0.5) / n as f64, ((i / n) as f64 + 0.5) / n as f64);
            let d = disc.sample(u, v);
            assert!((d.length() - 1.0).abs() < 1e-15);
            assert!(disc.contains(d * (1.0 - 1e-15)), "{degrees} {u} {v}");
            let radius = d.cross(axis).length() / sin(disc.half_angle());
            nearer += usize::from(radius < 0.5);
            for (sum, plane) in sums.iter_mut().zip(planes) {
                *sum += disc.share(d, plane) / (n * n) as f64;
            }
        }
        // a quarter of the projected disc lies within half its radius
        assert!((nearer as f64 / (n * n) as f64 - 0.25).abs() < 0.01);
        for (i, (sum, plane)) in sums.into_iter().zip(planes).enumerate() {
            let want = disc.cosine(plane);
            // symmetric samples are exact where the disc is whole; else the midpoint rule's 1/n^2 of the disc
            let bound = if i < 3 { 1e-14 } else { 1e-3 * disc.half_angle() };
            assert!((sum - want).abs() < bound, "{degrees}, plane {i}: {sum} {want}");
        }
    }
    assert_eq!(sun([0.0, 0.0, 1.0], 0.0).sample(0.9, 0.1), Vec3::Z);
}

#[test]
fn disc_radiance_and_extent() {
    let disc = sun([0.0, 0.0, 1.0], 0.2665);
    let half = 0.2665_f64.to_radians();
    assert!((disc.disc_radiance(1) * PI * sin(half) * sin(half) - 0.5).abs() < 1e-15);
    assert!(disc.contains(tilted(half * 0.9999)) && !disc.contains(tilted(half * 1.0001)));
    assert!(!disc.contains(-Vec3::Z));
    assert!(!disc.is_point() && disc.bands() == 2 && disc.irradiance(2) == 0.0);
    let point = sun([0.0, 0.0, 1.0], 0.0);
    assert!(point.is_point() && !point.contains(Vec3::Z) && point.disc_radiance(0) == 0.0);
    assert_eq!(point.direction(), Vec3::Z);
}

#[test]
fn every_bad_input_has_its_error() {
    let base = SunInput { direction: [0.0, 0.0, 1.0], irradiance: &[1.0, 2.0], half_angle_deg: 0.2665 };
    let refuse = |input: SunInput| Sun::new(&input, 2).unwrap_err();
    assert_eq!(Sun::new(&base, 0).unwrap_err(), Error::Bands { given: 0 });
    for direction in [[0.0; 3], [f64::NAN, 0.0, 1.0], [f64::INFINITY, 0.0, 0.0]] {
        let error = Error::Direction { field: Field::SunDirection };
        assert_eq!(refuse(SunInput { direction, ..base }), error);
    }
    let field = Field::SunHalfAngle;
    for value in [-1.0, 9.9e-5, 10.1, f64::INFINITY] {
        assert_eq!(
            refuse(SunInput { half_angle_deg: value, ..base }),
            Error::Range { field, band: 0, value }
        );
    }
    assert!(matches!(refuse(SunInput { half_angle_deg: f64::NAN, ..base }), Error::Range { .. }));
    let field = Field::SunIrradiance;
    assert_eq!(
        refuse(SunInput { irradiance: &[1.0; 3], ..base }),
        Error::LightBandCount { field, expected: 2, given: 3 }
    );
    // the last would be a disc of radiance above 1e37
    for value in [-1.0, 2e37, 1e34] {
        let irradiance = [0.0, value];
        assert_eq!(
            Sun::new(&SunInput { irradiance: &irradiance, ..base }, 2).unwrap_err(),
            Error::Range { field, band: 1, value }
        );
    }
    assert!(Sun::new(&SunInput { irradiance: &[1e34; 2], half_angle_deg: 0.0, ..base }, 2).is_ok());
}

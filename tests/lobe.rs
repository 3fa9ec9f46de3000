//! Kholopov's lobe in three dimensions: closed forms, and samples against brute force.

use approx::{abs_diff_eq, assert_abs_diff_eq};
use blik_kernel::lobe::{Highlight, Lobe};
use blik_kernel::math::{PI, TAU, Vec3, cos, sin};
use blik_kernel::sun::{Sun, SunInput};
use blik_kernel::{Error, Field};

fn lobe(axis_ratio: f64) -> Lobe {
    Lobe::new(axis_ratio).unwrap()
}

/// Normal +z, mirror direction at `degrees` from it.
fn mirror(degrees: f64) -> Vec3 {
    Vec3::new(sin(degrees.to_radians()), 0.0, cos(degrees.to_radians()))
}

/// The mean over a midpoint rule of n cells of `f` on 0..1.
fn mean(n: usize, f: impl Fn(f64) -> f64) -> f64 {
    (0..n).map(|i| f((i as f64 + 0.5) / n as f64)).sum::<f64>() / n as f64
}

/// Integral of q f over the directions above the facet, straight from q's definition: midpoint rules in the
/// angle to the mirror direction (graded toward the peak) and in azimuth.
fn brute(lobe: &Lobe, mirror: Vec3, n: usize, f: impl Fn(Vec3) -> f64) -> f64 {
    let first = Vec3::Y;
    let second = mirror.cross(first);
    let half_pi = PI / 2.0;
    mean(n, |t| {
        let alpha = half_pi * t * t * t;
        let jacobian = half_pi * 3.0 * t * t * sin(alpha) * TAU * lobe.value(cos(alpha));
        jacobian
            * mean(n, |v| {
                let side = first * cos(TAU * v) + second * sin(TAU * v);
                let d = mirror * cos(alpha) + side * sin(alpha);
                if d.z > 0.0 { f(d) } else { 0.0 }
            })
    })
}

#[test]
fn solid_angle_and_half_energy_angles() {
    // PHYSICS: Omega_eq = rho_0/q(0) = pi ln(T^2)/(T^2 - 1) sr, and half of the energy outside alpha(1/2)
    for (ratio, omega, half) in [(50.0, 0.00984, 8.05), (10.0, 0.14614, 17.55), (3.0, 0.86285, 30.0)] {
        let lobe = lobe(ratio);
        // printed to five decimals and to two
        assert_abs_diff_eq!(1.0 / lobe.value(1.0), omega, epsilon = 5e-6);
        assert!((1.0 / lobe.value(1.0) - PI * f64::ln(ratio * ratio) / (ratio * ratio - 1.0)).abs() < 1e-14);
        assert_abs_diff_eq!(lobe.equivalent_solid_angle(1.0), omega, epsilon = 5e-6);
        assert_abs_diff_eq!(
            lobe.equivalent_solid_angle(0.2) * lobe.value(1.0),
            lobe.albedo(0.2),
            epsilon = 1e-15
        );
        let angle = lobe.sample(Vec3::Z, Vec3::Z, 0.5, 0.3).z.acos().to_degrees();
        assert!((lobe.cone(0.5).to_degrees() - angle).abs() < 1e-9 && lobe.cone(0.0) == 0.0);
        assert!(abs_diff_eq!(angle, half, epsilon = 6e-3), "{ratio}: {angle}");
    }
    assert_eq!(lobe(3.0).value(0.0), 0.0);
    assert_eq!(lobe(3.0).value(-0.5), 0.0);
}

#[test]
fn albedo_means() {
    // cosine-weighted over a scan line, int A cos dtheta, and over the hemisphere, int A 2 cos sin dtheta, and
    // the plain mean (eq. 17 in three dimensions), for rho_0 = 0.8
    for (ratio, line, hemisphere, plain) in
        [(50.0, 0.7812, 0.7687, 0.7529), (10.0, 0.7691, 0.7489, 0.7285), (3.0, 0.7488, 0.7166, 0.6965)]
    {
        let lobe = lobe(ratio);
        let angle = |t: f64| t * PI / 2.0;
        let a = |t: f64| 0.8 * lobe.albedo(cos(angle(t)));
        // printed to four decimals
        for (got, want, closed) in [
            (mean(4000, |t| a(t) * cos(angle(t)) * PI / 2.0), line, lobe.line_mean_albedo()),
            (mean(4000, |t| a(t) * sin(2.0 * angle(t)) * PI / 2.0), hemisphere, lobe.cosine_mean_albedo()),
            (mean(4000, a), plain, lobe.mean_albedo()),
        ] {
            assert!(abs_diff_eq!(got, want, epsilon = 6e-5), "{ratio}: {got}");
            // the midpoint rule of 4,000 points, on an integrand that bends within 1/ratio of its end
            assert!(abs_diff_eq!(got, 0.8 * closed, epsilon = 2e-6), "{ratio}: {got} {closed}");
        }
    }
    // at a ratio of 1 A is (1 + cos)/2, and nothing happens on the way there
    for excess in [0.0, 1e-15, 1e-12, 1e-9, 1e-7, 4.9e-4, 5.1e-4] {
        let lobe = lobe(1.0 + excess);
        let near = excess + 1e-12;
        assert!(abs_diff_eq!(lobe.line_mean_albedo() - 0.5, PI / 8.0, epsilon = near), "{excess}");
        assert!(abs_diff_eq!(lobe.cosine_mean_albedo(), 5.0 / 6.0, epsilon = near), "{excess}");
        assert!(abs_diff_eq!(lobe.mean_albedo() - 0.5, 1.0 / PI, epsilon = near), "{excess}");
    }
    for ratio in [1e3, 9999.0, 1e4] {
        let lobe = lobe(ratio);
        let means = [lobe.mean_albedo(), lobe.cosine_mean_albedo(), lobe.line_mean_albedo()];
        assert!(means.windows(2).all(|w| w[0] < w[1]) && means[2] < 1.0, "{means:?}");
    }
}

#[test]
fn albedo_is_the_integral_over_shares_of_azimuth() {
    // A(theta)/rho_0 = int_0^1 f du, f the share of the cone alpha(u) above the facet
    for ratio in [1.0 + 1e-9, 1.3, 3.0, 10.0, 50.0, 1000.0_f64] {
        for degrees in [0.0, 20.0, 60.0, 85.0, 89.9, 90.0] {
            let c = cos(f64::to_radians(degrees));
            let s = sin(f64::to_radians(degrees));
            let want = mean(200_000, |t| {
                // graded toward the peak
                let (u, density) = (t * t, 2.0 * t);
                let growth = |x: f64| x.exp_m1();
                let sin2 = growth(2.0 * u * ratio.ln()) / growth(2.0 * ratio.ln());
                let x = (1.0 - sin2).sqrt() * c / (sin2.sqrt() * s).max(1e-300);
                density * if x >= 1.0 { 1.0 } else { (-x).acos() / PI }
            });
            let got = lobe(ratio).albedo(c);
            // the integrand's square-root corner under 2e5 cells: 2e5^(-3/2)
            assert!(abs_diff_eq!(got, want, epsilon = 2e-8), "{ratio} {degrees}: {got} {want}");
        }
        assert_eq!(lobe(ratio).albedo(1.0), 1.0);
        assert_abs_diff_eq!(lobe(ratio).albedo(0.0), 0.5, epsilon = 1e-15);
        assert_abs_diff_eq!(lobe(ratio).albedo(0.3) + lobe(ratio).albedo(-0.3), 1.0, epsilon = 1e-15);
    }
}

#[test]
fn the_limits_of_the_axis_ratio() {
    // 1: cos(alpha)/pi, and the half plane's share (1 + cos theta)/2; and nothing happens on the way there
    for ratio in [1.0, 1.0 + 2.3e-16, 1.0 + 1e-12, 1.0 + 1e-7] {
        let lobe = lobe(ratio);
        let near = 3.0 * (ratio - 1.0) + 4e-16;
        for c in [0.01, 0.5, 0.9, 1.0] {
            assert!((lobe.value(c) - c / PI).abs() <= near, "{ratio} {c}");
            assert!((lobe.albedo(c) - 0.5 * (1.0 + c)).abs() <= near, "{ratio} {c}");
        }
        let (m, step) = (mirror(70.0), 1.0 / 32.0);
        for u in [0.5 * step, 0.3, 0.7, 0.99] {
            let (a, b) =
                (lobe.sample(m, Vec3::Z, u, 0.4), Lobe::new(1.0).unwrap().sample(m, Vec3::Z, u, 0.4));
            assert!((a - b).length() < 10.0 * (ratio - 1.0) + 1e-7, "{ratio} {u}: {a} {b}");
        }
    }
    assert!(!lobe(9999.0).is_mirror() && lobe(1e4).is_mirror() && lobe(1e300).is_mirror());
    for value in [0.999, -3.0, 0.0, f64::INFINITY] {
        assert_eq!(Lobe::new(value).unwrap_err(), Error::Range { field: Field::AxisRatio, band: 0, value });
    }
    assert!(Lobe::new(f64::NAN).is_err());
}

#[test]
fn samples_integrate_the_visible_lobe() {
    // smooth functions of direction; the last tells azimuth and side apart
    let functions: [fn(Vec3) -> f64; 4] =
        [|_| 1.0, |d| d.z, |d| (d.x + 0.3 * d.y).exp(), |d| 1.0 / (1.2 - d.x * d.z + 0.2 * d.y)];
    for ratio in [1.0, 3.0, 10.0, 50.0] {
        let lobe = lobe(ratio);
        for degrees in [0.0, 40.0, 75.0, 88.0, 90.0] {
            let m = mirror(degrees);
            let n = 20_000;
            for (k, f) in functions.iter().enumerate() {
                let mut sum = 0.0;
                for i in 0..n {
                    let d = lobe.ray(i, n, 0.0, m, Vec3::Z);
                    assert!(d.z > 0.0 && (d.length() - 1.0).abs() < 1e-8, "{ratio} {degrees} {i}: {d}");
                    sum += f(d);
                }
                let got = lobe.albedo(m.z) * sum / n as f64;
                let want = brute(&lobe, m, 800, f);
                // the sunflower's error is near 1/n of the function's range, times a few; the brute force's
                // midpoints leave 1e-4 at the horizon's step
                assert!(abs_diff_eq!(got / want, 1.0, epsilon = 2e-4), "{ratio} {degrees} {k}: {got} {want}");
            }
        }
    }
}

#[test]
fn samples_have_equal_energy_in_every_cell() {
    // of the samples of the unit square as many fall into a part of the lobe as it has energy
    let lobe = lobe(4.0);
    let m = mirror(72.0);
    let n = 400;
    let parts: [fn(Vec3) -> bool; 3] = [|d| d.y > 0.1, |d| d.z < 0.2, |d| d.x < 0.5 && d.y < 0.0];
    for (k, part) in parts.iter().enumerate() {
        let inside = |d: Vec3| f64::from(u8::from(part(d)));
        let got = mean(n, |u| mean(n, |v| inside(lobe.sample(m, Vec3::Z, u, v)))) * lobe.albedo(m.z);
        let want = brute(&lobe, m, 1000, inside);
        // cells of the square that the part's edge crosses: 1/n of the energy at most, mostly cancelling
        assert!(abs_diff_eq!(got, want, epsilon = 1e-3), "{k}: {got} {want}");
    }
}

#[test]
fn ray_sets() {
    let m = mirror(30.0);
    // wholly above the facet at normal view: the median is the mirror direction, the ring regular
    for ratio in [3.0, 50.0] {
        let lobe = lobe(ratio);
        assert!((lobe.ray(0, 1, 0.0, Vec3::Z, Vec3::Z) - Vec3::Z).length() < 1e-15);
        assert!((lobe.ray(0, 7, 0.0, Vec3::Z, Vec3::Z) - Vec3::Z).length() < 1e-15);
        let u: f64 = 1.0 / 7.0 + 3.0 / 7.0;
        let sin2 = (ratio.powf(2.0 * u) - 1.0) / (ratio * ratio - 1.0);
        for i in 1..7 {
            let (a, b) =
                (lobe.ray(i, 7, 0.0, Vec3::Z, Vec3::Z), lobe.ray(i % 6 + 1, 7, 0.0, Vec3::Z, Vec3::Z));
            assert_abs_diff_eq!(1.0 - a.z * a.z, sin2, epsilon = 1e-13);
            // neighbours 60 degrees apart
            assert_abs_diff_eq!(a.truncate().dot(b.truncate()) / sin2, 0.5, epsilon = 1e-12);
        }
        // symmetric about the plane of incidence
        for n in [2, 3, 5, 7] {
            let sum: f64 = (0..n).map(|i| lobe.ray(i, n, 0.0, m, Vec3::Z).y).sum();
            assert!(sum.abs() < 1e-9, "{n}: {sum}");
        }
    }
    // cut off at the horizon: half of the visible energy is above the single ray, half below it
    let (lobe, m) = (lobe(3.0), mirror(85.0));
    let ray = lobe.ray(0, 1, 0.0, m, Vec3::Z);
    assert!(ray.y.abs() < 1e-15 && ray.z > m.z);
    // the great circle through the ray and the y axis parts the lobe
    let side = Vec3::new(-ray.z, 0.0, ray.x);
    let above = brute(&lobe, m, 2000, |d| if d.dot(side) > 0.0 { 1.0 } else { 0.0 });
    assert_abs_diff_eq!(above / lobe.albedo(m.z), 0.5, epsilon = 1e-3);
}

#[test]
fn no_input_gives_nan() {
    for ratio in [1.0, 1.0001, 3.0, 1e4, 1e200] {
        let lobe = lobe(ratio);
        for degrees in [0.0, 1e-7, 1e-3, 45.0, 90.0, 90.0 + 1e-9, 120.0, 180.0] {
            let m = mirror(degrees);
            for u in [0.0, 1e-300, 0.5, 1.0 - 1e-16, 1.0] {
                for v in [0.0, 0.25, 0.5, 0.75, 1.0] {
                    let d = lobe.sample(m, Vec3::Z, u, v);
                    assert!(d.is_finite() && d.z > 0.0, "{ratio} {degrees} {u} {v}: {d}");
                }
            }
            assert!(lobe.albedo(m.z).is_finite() && lobe.value(m.z).is_finite());
        }
        assert!(lobe.ray(5, 0, 0.0, Vec3::Z, Vec3::Z).is_finite());
        assert!(lobe.value(1.0 + 1e-15).is_finite());
    }
}

/// Mean of q/rho_0 over a disc, straight from q's definition: midpoint rules in the angle to the disc's middle and in
/// azimuth, each graded toward the mirror direction.
fn brute_disc(lobe: &Lobe, angle: f64, half: f64, f: impl Fn(f64, f64) -> f64) -> f64 {
    let graded = |from: f64, to: f64, n: usize, f: &dyn Fn(f64) -> f64| {
        let span = to - from;
        span * mean(n, |t| 3.0 * t * t * f(from + span * t * t * t))
    };
    let ring = |at: f64| {
        let along = |azimuth: f64| {
            let hav = sin(0.5 * (at - angle)).powi(2) + sin(at) * sin(angle) * sin(0.5 * azimuth).powi(2);
            f(at, azimuth) * lobe.value(1.0 - 2.0 * hav)
        };
        2.0 * sin(at) * graded(0.0, PI, 400, &along)
    };
    let energy = if angle < half {
        graded(angle, 0.0, 400, &|at| -ring(at)).abs() + graded(angle, half, 400, &ring)
    } else {
        graded(half, 0.0, 400, &|at| -ring(at)).abs()
    };
    energy / (PI * sin(half).powi(2))
}

#[test]
fn a_disc_in_a_lobe_is_the_mean_over_it() {
    let cases = [
        (300.0, 0.2665, 0.0),
        (300.0, 0.2665, 0.1),
        (300.0, 0.2665, 0.266),
        (300.0, 0.2665, 0.2665),
        (300.0, 0.2665, 0.5),
        (300.0, 0.2665, 3.0),
        (50.0, 2.0, 1.0),
        (50.0, 2.0, 2.5),
        (9999.0, 0.2665, 0.05),
        (10.0, 10.0, 9.0),
        (10.0, 10.0, 15.0),
        (1.0, 10.0, 40.0),
        (2.0, 10.0, 80.0),
        (30.0, 1e-4, 1.0),
        (1e3, 0.02, 0.0),
    ];
    for (ratio, half, angle) in cases {
        let lobe = lobe(ratio);
        let input = |degrees: f64| SunInput {
            direction: [sin(degrees.to_radians()), 0.0, cos(degrees.to_radians())],
            irradiance: &[1.0],
            half_angle_deg: half,
        };
        let sun_input = input(angle);
        let sun = Sun::new(&sun_input, 1).unwrap();
        let truth = brute_disc(&lobe, angle.to_radians(), half.to_radians(), |_, _| 1.0);
        let point = lobe.value(cos(angle.to_radians()));
        let highlight = Highlight::new(&lobe, Vec3::Z, &sun);
        let value = highlight.map_or(point, |h| h.value);
        // midpoint rules of 400 graded cells; the integral's own error where the mirror direction meets the edge is 1e-5
        let tolerance = 1e-4 * truth;
        assert!((value - truth).abs() < tolerance, "{ratio}, {half}, {angle}: {value}, not {truth}");
        // samples are as dense as the lobe is high: the share of those on one side is that of the energy there
        let Some(highlight) = highlight else { continue };
        let n = 64;
        let (mut aside, mut inside) = (0.0, 0.0);
        for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
            let d =
                highlight.sample((f64::from(i) + 0.5) / f64::from(n), (f64::from(j) + 0.5) / f64::from(n));
            let off = (d - sun.direction()).length();
            assert!(
                (d.length() - 1.0).abs() < 1e-12
                    && off <= 2.0 * sin(half.to_radians() / 2.0) * (1.0 + 1e-9) + 1e-12
            );
            aside += f64::from(u8::from(d.dot(Vec3::Y) > 0.0));
            inside += f64::from(u8::from(d.dot(Vec3::Y.cross(sun.direction())) > 0.0));
        }
        let count = f64::from(n * n);
        assert!((aside / count - 0.5).abs() < 0.02, "{ratio}, {half}, {angle}: {aside}");
        let beyond = brute_disc(&lobe, angle.to_radians(), half.to_radians(), |_, azimuth| {
            f64::from(u8::from(azimuth < PI / 2.0))
        });
        // the part on the far side of the disc's middle, seen from the mirror direction or toward it: eight cells of samples
        let near = (inside / count - beyond / truth).abs().min((1.0 - inside / count - beyond / truth).abs());
        assert!(near < 0.05, "{ratio}, {half}, {angle}: {inside} of {count}, {}", beyond / truth);
    }
}

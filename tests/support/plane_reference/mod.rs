//! The plane model's truth: a readable solver of high order for circles and segments, without kernel code.
//!
//! Directions are cut at every grazing angle of the chains of mirrors, found by bisection, and each part takes a
//! Gauss rule graded toward its ends; diffuse radiance is a polynomial on short panels. Reflections are counted, or
//! all of them count. Lobes are integrated recursively, between silhouettes, in the lobe's own energy.

pub mod diffuse;
pub mod gloss;
pub mod scene;

use std::f64::consts::PI;

/// Nodes and weights of the n-point Gauss-Legendre rule on (0, 1), by Newton's method from Tricomi's guess.
pub fn gauss(n: usize) -> Vec<(f64, f64)> {
    let node = |i: usize| {
        let mut x = (PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
        let mut slope = 0.0;
        for _ in 0..50 {
            let (mut before, mut value) = (1.0, x);
            for k in 2..=n {
                let k = k as f64;
                (before, value) = (value, ((2.0 * k - 1.0) * x * value - (k - 1.0) * before) / k);
            }
            slope = n as f64 * (before - x * value) / (1.0 - x * x);
            x -= value / slope;
        }
        (0.5 * (1.0 - x), 1.0 / ((1.0 - x * x) * slope * slope))
    };
    (0..n).map(node).collect()
}

/// The rule [`gauss`] under x -> x^2 (3 - 2 x), which makes square roots at the ends harmless.
pub fn graded(n: usize) -> Vec<(f64, f64)> {
    gauss(n).into_iter().map(|(x, w)| (x * x * (3.0 - 2.0 * x), 6.0 * x * (1.0 - x) * w)).collect()
}

/// eps of eq. (16): rms of the differences over the samples of `counted`, divided by `reference`.
pub fn eps(mine: &[f64], truth: &[f64], counted: impl Fn(usize) -> bool, reference: f64) -> f64 {
    assert_eq!(mine.len(), truth.len());
    let squares: Vec<f64> =
        (0..mine.len()).filter(|&i| counted(i)).map(|i| (mine[i] - truth[i]).powi(2)).collect();
    assert!(!squares.is_empty() && squares.iter().all(|s| s.is_finite()));
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt() / reference
}

//! Nodes and weights of the rules by which spans and lobes are integrated.

use crate::base::index::Index;
use crate::base::quadrature::rule;

/// Nodes of the Gauss rule of exactly `n` points for n <= 3 and any `n` of [`rule`], else of panels of the 4-point rule or
/// the next larger number of points.
#[inline]
pub(crate) fn points(n: usize) -> usize {
    match n {
        0..=1 => 1,
        2..=3 => n,
        4..=32 => rule(n).0.len(),
        _ => 32 * n.div_ceil(32),
    }
}

/// One of the nodes of that rule on (0, 1), and its weight.
#[inline]
pub(crate) fn node(n: usize, number: usize) -> (f64, f64) {
    /// Half the distances of the 2- and 3-point rules' outer nodes.
    const OFF: [f64; 2] = [0.288_675_134_594_812_9, 0.387_298_334_620_741_7];
    match (n, number) {
        (0..=1, _) => (0.5, 1.0),
        (2, 0) => (0.5 - OFF[0], 0.5),
        (2, _) => (0.5 + OFF[0], 0.5),
        (3, 0) => (0.5 - OFF[1], 5.0 / 18.0),
        (3, 1) => (0.5, 4.0 / 9.0),
        (3, _) => (0.5 + OFF[1], 5.0 / 18.0),
        (4..=32, _) => {
            let (at, weights) = rule(n);
            (at.at(number), weights.at(number))
        }
        _ => {
            let panels = n.div_ceil(32) as f64;
            let (at, weights) = rule(32);
            (((number / 32) as f64 + at.at(number % 32)) / panels, weights.at(number % 32) / panels)
        }
    }
}

/// Calls `f` with all nodes and weights of that rule.
pub(crate) fn nodes(n: usize, mut f: impl FnMut(f64, f64)) {
    for number in 0..points(n) {
        let (x, w) = node(n, number);
        f(x, w);
    }
}

/// A node on (0, 1) of a rule whose nodes crowd at both ends, where what is integrated has square roots: silhouettes. One
/// node is the middle. `sum` is that of [`graded_sum`].
#[inline]
pub(crate) fn graded_node(n: usize, number: usize, sum: f64) -> (f64, f64) {
    let (x, w) = node(n, number);
    if n < 3 { (x, w) } else { (x * x * (3.0 - 2.0 * x), 6.0 * x * (1.0 - x) * w / sum) }
}

/// What makes the weights of that rule's nodes sum to 1.
pub(crate) fn graded_sum(n: usize) -> f64 {
    let mut sum = 0.0;
    nodes(n, |x, w| sum += 6.0 * x * (1.0 - x) * w);
    sum
}

/// Calls `f` with all nodes and weights of that rule.
pub(crate) fn graded(n: usize, mut f: impl FnMut(f64, f64)) {
    let sum = graded_sum(n);
    for number in 0..points(n) {
        let (x, w) = graded_node(n, number, sum);
        f(x, w);
    }
}

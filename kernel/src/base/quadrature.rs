//! Gauss-Legendre rules, computed when the crate is compiled.

/// The `N`-point Gauss-Legendre rule on (0, 1): exact for polynomials of degree below 2 N.
///
/// Nodes ascend; they and the weights are right to a few ulp of 1.
#[derive(Clone, Copy, Debug)]
pub struct Gauss<const N: usize> {
    /// Abscissas, ascending in (0, 1).
    pub nodes: [f64; N],
    /// Weights; their sum is 1.
    pub weights: [f64; N],
}

/// The Legendre polynomial of degree `n` at `x` and its derivative; not at x = 1 or -1.
const fn legendre(n: usize, x: f64) -> (f64, f64) {
    let (mut before, mut value) = (0.0, 1.0);
    let mut k = 0;
    while k < n {
        let degree = k as f64;
        let next = ((2.0 * degree + 1.0) * x * value - degree * before) / (degree + 1.0);
        (before, value) = (value, next);
        k += 1;
    }
    (value, n as f64 * (before - x * value) / (1.0 - x * x))
}

impl<const N: usize> Default for Gauss<N> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const N: usize> Gauss<N> {
    /// Finds the roots from the largest down: Newton's method on the polynomial divided by the roots found
    /// falls monotonically from beyond 1 to the next one, and two steps without the division remove its rounding.
    pub const fn new() -> Self {
        let mut rule = Gauss { nodes: [0.0; N], weights: [0.0; N] };
        let mut roots = [0.0; N];
        let mut found = 0;
        while found < N {
            let mut x = 1.1;
            loop {
                let (value, slope) = legendre(N, x);
                let (mut poles, mut j) = (0.0, 0);
                while j < found {
                    poles += 1.0 / (x - roots[j]);
                    j += 1;
                }
                let step = value / (slope - value * poles);
                x -= step;
                if step < 1e-10 {
                    break;
                }
            }
            let mut polish = 0;
            while polish < 2 {
                let (value, slope) = legendre(N, x);
                x -= value / slope;
                polish += 1;
            }
            let slope = legendre(N, x).1;
            roots[found] = x;
            rule.nodes[N - 1 - found] = 0.5 + 0.5 * x;
            rule.weights[N - 1 - found] = 1.0 / ((1.0 - x * x) * slope * slope);
            found += 1;
        }
        rule
    }
}

/// The rules that [`rule`] chooses from.
static GAUSS_LEGENDRE: (Gauss<4>, Gauss<6>, Gauss<8>, Gauss<10>, Gauss<12>, Gauss<16>, Gauss<24>, Gauss<32>) = (
    Gauss::new(),
    Gauss::new(),
    Gauss::new(),
    Gauss::new(),
    Gauss::new(),
    Gauss::new(),
    Gauss::new(),
    Gauss::new(),
);

/// Nodes and weights on (0, 1) of the smallest rule with at least `points` of 4, 6, 8, 10, 12, 16, 24 or 32
/// points; of the largest where none has as many.
pub fn rule(points: usize) -> (&'static [f64], &'static [f64]) {
    match points {
        0..=4 => (&GAUSS_LEGENDRE.0.nodes, &GAUSS_LEGENDRE.0.weights),
        5..=6 => (&GAUSS_LEGENDRE.1.nodes, &GAUSS_LEGENDRE.1.weights),
        7..=8 => (&GAUSS_LEGENDRE.2.nodes, &GAUSS_LEGENDRE.2.weights),
        9..=10 => (&GAUSS_LEGENDRE.3.nodes, &GAUSS_LEGENDRE.3.weights),
        11..=12 => (&GAUSS_LEGENDRE.4.nodes, &GAUSS_LEGENDRE.4.weights),
        13..=16 => (&GAUSS_LEGENDRE.5.nodes, &GAUSS_LEGENDRE.5.weights),
        17..=24 => (&GAUSS_LEGENDRE.6.nodes, &GAUSS_LEGENDRE.6.weights),
        _ => (&GAUSS_LEGENDRE.7.nodes, &GAUSS_LEGENDRE.7.weights),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rules_integrate_powers_up_to_their_degree() {
        for points in [4, 6, 8, 10, 12, 16, 24, 32] {
            let (nodes, weights) = rule(points);
            assert_eq!(nodes.len(), points);
            assert!(nodes.windows(2).all(|pair| pair[0] < pair[1]));
            for degree in 0..2 * points {
                let sum: f64 = nodes.iter().zip(weights).map(|(x, w)| w * x.powi(degree as i32)).sum();
                let want = 1.0 / (degree as f64 + 1.0);
                // nodes right to an ulp or two of 1, raised to a power of at most 63
                assert!((sum - want).abs() < 1e-14, "{points} points, degree {degree}: {sum} {want}");
            }
        }
    }
}

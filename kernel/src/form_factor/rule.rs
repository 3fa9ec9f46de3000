//! The Gauss-Legendre rules in use here, on [0, 1].

use crate::base::quadrature::Gauss;

/// A rule of any number of points.
#[derive(Clone, Copy)]
pub(super) struct Rule {
    nodes: &'static [f64],
    weights: &'static [f64],
}

impl Rule {
    const fn of<const N: usize>(rule: &'static Gauss<N>) -> Rule {
        Rule { nodes: &rule.nodes, weights: &rule.weights }
    }

    /// Number of points.
    pub(super) fn len(self) -> usize {
        self.nodes.len()
    }

    /// Nodes with their weights.
    pub(super) fn iter(self) -> impl Iterator<Item = (f64, f64)> {
        self.nodes.iter().copied().zip(self.weights.iter().copied())
    }
}

/// Gauss-Legendre rule of two points.
pub(super) const GAUSS_2: Rule = Rule::of(&const { Gauss::<2>::new() });
/// Gauss-Legendre rule of three points.
pub(super) const GAUSS_3: Rule = Rule::of(&const { Gauss::<3>::new() });
/// Gauss-Legendre rule of four points.
pub(super) const GAUSS_4: Rule = Rule::of(&const { Gauss::<4>::new() });
/// Gauss-Legendre rule of five points.
pub(super) const GAUSS_5: Rule = Rule::of(&const { Gauss::<5>::new() });
/// Gauss-Legendre rule of six points.
pub(super) const GAUSS_6: Rule = Rule::of(&const { Gauss::<6>::new() });

//! Which unknowns make the diffuse radiance at a point of an element, and with which weights.

use crate::base::quadrature::Gauss;

/// Most Gauss points of an element.
pub const MAX_ORDER: usize = 6;

/// Unknowns and their weights.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stencil {
    /// Unknowns.
    pub unknowns: [u32; MAX_ORDER],
    /// Their weights, of sum 1.
    pub weights: [f64; MAX_ORDER],
    /// How many.
    pub len: usize,
}

impl Stencil {
    pub(crate) const NONE: Stencil = Stencil { unknowns: [0; MAX_ORDER], weights: [0.0; MAX_ORDER], len: 0 };

    /// Unknowns with their weights.
    #[inline(always)]
    pub fn terms(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        self.unknowns.iter().zip(&self.weights).take(self.len).map(|(&u, &w)| (u as usize, w))
    }

    /// One unknown alone.
    pub(crate) fn one(unknown: u32) -> Stencil {
        let mut stencil = Stencil::NONE;
        stencil.len = 1;
        stencil.unknowns[0] = unknown;
        stencil.weights[0] = 1.0;
        stencil
    }

    /// Two unknowns.
    pub(crate) fn two(unknowns: [u32; 2], weights: [f64; 2]) -> Stencil {
        let ([a, b], [x, y]) = (unknowns, weights);
        Stencil { unknowns: [a, b, 0, 0, 0, 0], weights: [x, y, 0.0, 0.0, 0.0, 0.0], len: 2 }
    }

    /// Lagrange's polynomials of the element's Gauss points at `x`.
    #[inline]
    pub(crate) fn panel(order: usize, element: u32, x: f64) -> Stencil {
        let mut stencil = Stencil::NONE;
        let Some(nodes) = NODES.get(order) else { return stencil };
        stencil.len = order;
        let places = stencil.unknowns.iter_mut().zip(&mut stencil.weights).zip(&nodes.scale);
        for (k, ((unknown, weight), scale)) in places.enumerate().take(order) {
            let others =
                nodes.at.iter().enumerate().take(order).filter(|(j, _)| *j != k).map(|(_, at)| x - at);
            *unknown = element * order as u32 + k as u32;
            *weight = others.fold(*scale, |product, d| product * d);
        }
        stencil
    }
}

/// Gauss points of an element and the factors of Lagrange's polynomials through them.
pub(crate) struct Nodes {
    /// Abscissas, ascending in (0, 1).
    pub at: [f64; MAX_ORDER],
    /// Product of the inverse distances to the others.
    scale: [f64; MAX_ORDER],
}

const fn nodes<const N: usize>() -> Nodes {
    let rule = Gauss::<N>::new();
    let mut out = Nodes { at: [0.5; MAX_ORDER], scale: [1.0; MAX_ORDER] };
    let mut k = 0;
    while k < N {
        out.at[k] = rule.nodes[k];
        let mut j = 0;
        while j < N {
            if j != k {
                out.scale[k] /= rule.nodes[k] - rule.nodes[j];
            }
            j += 1;
        }
        k += 1;
    }
    out
}

/// By their number.
pub(crate) static NODES: [Nodes; MAX_ORDER + 1] =
    [nodes::<1>(), nodes::<1>(), nodes::<2>(), nodes::<3>(), nodes::<4>(), nodes::<5>(), nodes::<6>()];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stencils_reproduce_polynomials() {
        for (order, nodes) in NODES.iter().enumerate().skip(1) {
            for x in [-0.1, 0.0, 0.3, 0.99] {
                let stencil = Stencil::panel(order, 0, x);
                for power in 0..order as i32 {
                    let sum: f64 = stencil.terms().map(|(u, w)| w * nodes.at[u].powi(power)).sum();
                    assert!((sum - x.powi(power)).abs() < 1e-13, "{order} {power} {x}: {sum}");
                }
            }
        }
    }
}

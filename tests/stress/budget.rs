//! The error budget: what each routine may be off by, and why. The stress tests take their tolerances from here.

use std::fmt::Write as _;

/// An allowance.
#[derive(Clone, Copy, Debug)]
pub struct Allowed {
    pub routine: &'static str,
    /// Relative to the quantity itself, but where `why` says otherwise.
    pub error: f64,
    pub why: &'static str,
}

const fn allow(routine: &'static str, error: f64, why: &'static str) -> Allowed {
    Allowed { routine, error, why }
}

pub const SCALE: Allowed = allow(
    "scene: scale by a power of two, exact shift",
    0.0,
    "coordinates are recentred and scaled by a power of two before anything else: the same bits",
);
pub const SPLIT: Allowed =
    allow("any stage: threads, pieces, instruction set", 0.0, "rows are independent, lanes in fixed trees");
pub const LIGHT_SCALE: Allowed = allow(
    "light: radiance times a power of two",
    0.0,
    "all is linear in the light, and thresholds are relative to the reference radiance",
);
pub const PLACED: Allowed = allow(
    "irradiance of an open facet, any position, scale and rotation",
    1e-9,
    "closed forms of sky and sun in f64; the normal is that of the rounded corners, whose differences are exact",
);
pub const ROW: Allowed = allow(
    "coupling: what a row's records and the open sky add up to",
    1e-12,
    "thousands of shares of 1/n, each product of mirrors rounded at each of up to a thousand mirrors",
);
pub const SOLVE: Allowed = allow(
    "solve: radiances up to 1/(1 - rho) = 1000 times the emission",
    1e-9,
    "sweeps go on to 1e-5 of the tolerance, relative to the reference radiance",
);
pub const SOLVE_BRIGHT: Allowed = allow(
    "solve: the same at 1/(1 - rho) = 1e6",
    1e-9,
    "a row's sum is rounded to some 5e-16, which 1/(1 - rho) magnifies",
);
pub const SOLVE_BRIGHTEST: Allowed =
    allow("solve: the same at 1/(1 - rho) = 1e9", 1e-6, "the same, and 1 - rho is known to some 1e-7");
pub const PIXEL: Allowed = allow("image: a pixel", 6e-8, "f32: half an ulp");
pub const SLOPE: Allowed = allow(
    "image: linear light on an element",
    2e-6,
    "gradients and moments are kept in f32; relative to the light",
);
pub const FURNACE: Allowed = allow(
    "image: a furnace of facets anywhere, tolerance 1e-2",
    6e-4,
    "chains end where they bring less than 0.05 of the tolerance; relative to the reference radiance",
);

/// All of them.
pub const ALL: [Allowed; 11] =
    [SCALE, SPLIT, LIGHT_SCALE, PLACED, ROW, SOLVE, SOLVE_BRIGHT, SOLVE_BRIGHTEST, PIXEL, SLOPE, FURNACE];

#[test]
fn the_budget_is_in_the_docs() {
    let mut text = String::from("| routine | allowed | why |\n|---|---|---|\n");
    for Allowed { routine, error, why } in ALL {
        let _ = writeln!(text, "| {routine} | {error:.0e} | {why} |");
    }
    crate::docs::keep("budget", &text);
    assert!(crate::docs::text().contains(&text), "UPDATE_STRESS=1 cargo test --test stress budget");
}

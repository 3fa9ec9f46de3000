//! The error budget: how the wanted errors of the solution and of images are shared out.
//!
//! | share | of | size | meaning | why this size |
//! |---|---|---|---|---|
//! | [`solution`](ErrorBudget::solution) | | as asked | error of the diffuse solution: a row's rays are as many as keep its error, times the diffuse reflectance, below it | asked for; rounds of images choose it |
//! | [`elements`](ErrorBudget::elements) | solution² | 0.06 | expected squared error of the radiance by a triangle's unevenness, from which on it is quartered | elements add a quarter to what rows' rays leave |
//! | [`row_chains`](ErrorBudget::row_chains) | solution | 0.001 | product of reflectances at which mirror chains of rows end | cut chains are a bound that is certified: it must not be felt |
//! | [`solver`](ErrorBudget::solver) | solution | 0.001 | bound on the distance of the radiances from the system's solution | a sweep gains a factor 1/q: as for `row_chains` |
//! | [`image`](ErrorBudget::image) | | as asked | error of images | asked for |
//! | [`sky`](ErrorBudget::sky) | image | 0.05, at least 1e-9 | relative error of the sky's irradiance on a plane | all points of an image share it: it does not average out |
//! | [`straight`](ErrorBudget::straight) | image | 0.5 | error of an element's diffuse radiance by circles that stand for the outlines of what hides the sky | half of the images' error, since points find the rest of it exactly |
//! | [`beam_chains`](ErrorBudget::beam_chains) | image | 0.001 | product of reflectances at which chains of mirrors toward the sun end | the sun's irradiance exceeds the reference radiance by far |
//! | [`chains`](ErrorBudget::chains) | image | 0.05 | radiance that a view's chain may still bring where it ends, relative to the reference | the tail is certified and adds to every pixel alike |
//! | [`lobes`](ErrorBudget::lobes) | image | 1.5 | error of a lobe's radiance from which on it takes a second set of rays | lobes whose rays disagree fill less than a third of the pixels |
//! | [`gathering`](ErrorBudget::gathering) | | 3 | in tolerances of the image: error of an element from which on points gather for themselves | errors of single elements are a few times their root mean square |
//! | [`pixels`](ErrorBudget::pixels) | image | 0.5 | root mean square error by sampling pixels, over the object | half of the error in squares is a quarter: sampling is the cheapest part |
//! | [`flat_pixel`](ErrorBudget::flat_pixel) | image | 2 | contrast with the neighbours up to which a pixel is its centre | an edge of that contrast is wrong by a fifth of it |
//! | [`worst_pixel`](ErrorBudget::worst_pixel) | image | 2 | the most that one pixel may be wrong by | such pixels are few: they are edges |
//!
//! `cargo run --release --example calibrate` measures all of them: estimates and true errors on scenes of every kind. What a
//! run spent of them stands in the report (`host::Report::budget`).

/// Shares of the wanted errors, relative to the reference radiance; computed once from what is asked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorBudget {
    /// Wanted error of the diffuse solution.
    pub solution: f64,
    /// Expected squared error of a triangle that is not quartered.
    pub elements: f64,
    /// Product of reflectances at which mirror chains of rows end.
    pub row_chains: f64,
    /// Bound on the radiances' distance from the solution of the system.
    pub solver: f64,
    /// Wanted error of images.
    pub image: f64,
    /// Relative error of the sky's irradiance on a plane.
    pub sky: f64,
    /// Error of an element's diffuse radiance by circles that stand for the outlines of what hides the sky.
    pub straight: f64,
    /// Product of reflectances at which chains of mirrors toward the sun end.
    pub beam_chains: f64,
    /// Radiance that a chain may still bring where it ends.
    pub chains: f64,
    /// Error of a lobe's radiance from which on it takes more rays.
    pub lobes: f64,
    /// Error of an element from which on points gather for themselves, in `image`; views change it with the rays that
    /// they may take.
    pub gathering: f64,
    /// Root mean square error by sampling pixels.
    pub pixels: f64,
    /// Contrast with the neighbours up to which a pixel is its centre.
    pub flat_pixel: f64,
    /// The most that one pixel may be wrong by.
    pub worst_pixel: f64,
}

impl ErrorBudget {
    /// The shares of the wanted errors of the solution and of images.
    pub fn new(solution: f64, image: f64) -> ErrorBudget {
        ErrorBudget {
            solution,
            elements: 0.06 * solution * solution,
            row_chains: 1e-3 * solution,
            solver: 1e-3 * solution,
            image,
            sky: (0.05 * image).max(1e-9),
            straight: 0.5 * image,
            beam_chains: 1e-3 * image,
            chains: 0.05 * image,
            lobes: 1.5 * image,
            gathering: 3.0,
            pixels: 0.5 * image,
            flat_pixel: 2.0 * image,
            worst_pixel: 2.0 * image,
        }
    }
}

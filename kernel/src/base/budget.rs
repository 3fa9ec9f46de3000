//! The error budget: how the wanted errors of the solution and of images are shared out.
//!
//! | share | of | size | meaning | why this size |
//! |---|---|---|---|---|
//! | [`solution`](ErrorBudget::solution) | | as asked | error of the diffuse solution: a row's rays are as many as keep its error, times the diffuse reflectance, below it | asked for; rounds of images choose it |
//! | [`elements`](ErrorBudget::elements) | solution² | 0.06 | expected squared error of the radiance by a triangle's unevenness, from which on it is quartered | elements add a quarter to what rows' rays leave |
//! | [`probes`](ErrorBudget::probes) | elements | 0.25 | squared error of the radiance by a triangle's unevenness below which its points take no more rays, over its reflectance squared | what is surely below a quarter is not quartered, whatever more rays say |
//! | [`row_chains`](ErrorBudget::row_chains) | solution | 0.001 | product of reflectances at which mirror chains of rows end | cut chains are a bound that is certified: it must not be felt |
//! | [`solver`](ErrorBudget::solver) | solution | 0.001 | bound on the distance of the radiances from the system's solution | a sweep gains a factor 1/q: as for `row_chains` |
//! | [`solver_accelerated`](ErrorBudget::solver_accelerated) | solver | 0.01 | the same bound for accelerated sweeps | they are for rooms many times brighter than what lights them, which mirrors brighten once more |
//! | [`outline`](ErrorBudget::outline) | solution | 0.5 | relative error of a signature by the object's outline: cells of a view | half of the tolerance is left to what the outline shows |
//! | [`image`](ErrorBudget::image) | | as asked | error of images | asked for |
//! | [`sky`](ErrorBudget::sky) | image | 0.05, at least 1e-9 | relative error of the sky's irradiance on a plane | all points of an image share it: it does not average out |
//! | [`straight`](ErrorBudget::straight) | image | 0.5 | error of an element's diffuse radiance by circles that stand for the outlines of what hides the sky | half of the images' error, since points find the rest of it exactly |
//! | [`straight_departure`](ErrorBudget::straight_departure) | | 4 | in squares of `straight`: mean square departure of what is blocked from a linear function from which on quarters are cut again | a departure of twice the error is halved by each cut |
//! | [`straight_mean`](ErrorBudget::straight_mean) | | 0.5 | in squares of `straight`: error of the mean from which on the points are too few for a side of which the irradiance alone is asked | the row's rays tell the sky then |
//! | [`open_sky`](ErrorBudget::open_sky) | image | 0.25 | error of an element's linear function of the straight sky from which on a point looks for itself | the rest of the error is by reflected light |
//! | [`circles`](ErrorBudget::circles) | image | 0.25 | error that circles for outlines may leave at a point | as for `open_sky` |
//! | [`beam_chains`](ErrorBudget::beam_chains) | image | 0.001 | product of reflectances at which chains of mirrors toward the sun end | the sun's irradiance exceeds the reference radiance by far |
//! | [`chains`](ErrorBudget::chains) | image | 0.05 | radiance that a view's chain may still bring where it ends, relative to the reference | the tail is certified and adds to every pixel alike |
//! | [`lobes`](ErrorBudget::lobes) | image | 1.5 | error of a lobe's radiance from which on it takes a second set of rays | lobes whose rays disagree fill less than a third of the pixels |
//! | [`gathering`](ErrorBudget::gathering) | | 3 | in tolerances of the image: error of an element from which on points gather for themselves | errors of single elements are a few times their root mean square |
//! | [`gathering_rays`](ErrorBudget::gathering_rays) | | 0.85 | in tolerances of the image: expected error of a point, of which its rays may leave what the elements that it sees do not | an image whose elements are good enough meets its tolerance |
//! | [`penumbrae`](ErrorBudget::penumbrae) | image | 0.25 | error of a penumbra by the first set of rays toward the sun's disc | half of what is at stake, times n^-3/4: few pixels are in penumbrae |
//! | [`penumbra_pixels`](ErrorBudget::penumbra_pixels) | image | 0.1 | error of a penumbra above which the pixel takes more rays | rays of one pixel err alike, since their sequences are one |
//! | [`glints`](ErrorBudget::glints) | image | 0.001 | intensity of a part of a facet, over that of the reference radiance on the whole view, below which it is halved no more | parts are up to 2^18 of a facet |
//! | [`pixels`](ErrorBudget::pixels) | image | 0.5 | root mean square error by sampling pixels, over the object | half of the error in squares is a quarter: sampling is the cheapest part |
//! | [`flat_pixel`](ErrorBudget::flat_pixel) | image | 2 | contrast with the neighbours up to which a pixel is its centre | an edge of that contrast is wrong by a fifth of it |
//! | [`worst_pixel`](ErrorBudget::worst_pixel) | image | 2 | the most that one pixel may be wrong by | such pixels are few: they are edges |
//! | [`lines`](ErrorBudget::lines) | | 0.7 | in wanted errors of a pixel: error of an interval of a line, or between lines, that is halved no more | both directions together: 2^-1/2 |
//!
//! `cargo run --release --example calibrate` measures all of them: estimates and true errors on scenes of every kind. What a
//! run spent of them stands in the report (`host::Report::budget`); nothing else in the kernel multiplies a wanted error.

/// Shares of the wanted errors, relative to the reference radiance; computed once from what is asked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorBudget {
    /// Wanted error of the diffuse solution.
    pub solution: f64,
    /// Expected squared error of a triangle that is not quartered.
    pub elements: f64,
    /// Squared error of a triangle below which its points take no more rays.
    pub probes: f64,
    /// Product of reflectances at which mirror chains of rows end.
    pub row_chains: f64,
    /// Bound on the radiances' distance from the solution of the system.
    pub solver: f64,
    /// The same bound for accelerated sweeps.
    pub solver_accelerated: f64,
    /// Relative error of a signature by the object's outline.
    pub outline: f64,
    /// Wanted error of images.
    pub image: f64,
    /// Relative error of the sky's irradiance on a plane.
    pub sky: f64,
    /// Error of an element's diffuse radiance by circles that stand for the outlines of what hides the sky.
    pub straight: f64,
    /// Mean square departure of what is blocked from a linear function from which on quarters are cut again, in squares of
    /// `straight`.
    pub straight_departure: f64,
    /// Error of the mean of the straight sky by points, in squares of `straight`.
    pub straight_mean: f64,
    /// Error of an element's linear function of the straight sky from which on a point looks for itself.
    pub open_sky: f64,
    /// Error that circles for outlines may leave at a point.
    pub circles: f64,
    /// Product of reflectances at which chains of mirrors toward the sun end.
    pub beam_chains: f64,
    /// Radiance that a chain may still bring where it ends.
    pub chains: f64,
    /// Error of a lobe's radiance from which on it takes more rays.
    pub lobes: f64,
    /// Error of an element from which on points gather for themselves, in `image`; views change it with the rays that
    /// they may take.
    pub gathering: f64,
    /// Expected error of a point, in `image`, of which its rays may leave what the elements that it sees do not.
    pub gathering_rays: f64,
    /// Error of a penumbra by the first set of rays toward the sun's disc.
    pub penumbrae: f64,
    /// Error of a penumbra above which the pixel takes more rays.
    pub penumbra_pixels: f64,
    /// Intensity of a part of a facet below which it is halved no more, over that of the reference radiance on the whole view.
    pub glints: f64,
    /// Root mean square error by sampling pixels.
    pub pixels: f64,
    /// Contrast with the neighbours up to which a pixel is its centre.
    pub flat_pixel: f64,
    /// The most that one pixel may be wrong by.
    pub worst_pixel: f64,
    /// Error of an interval of a line, or between lines, that is halved no more, in wanted errors of the pixel.
    pub lines: f64,
}

impl ErrorBudget {
    /// The shares of the wanted errors of the solution and of images.
    pub fn new(solution: f64, image: f64) -> ErrorBudget {
        let (elements, solver) = (0.06 * solution * solution, 1e-3 * solution);
        ErrorBudget {
            solution,
            elements,
            probes: 0.25 * elements,
            row_chains: 1e-3 * solution,
            solver,
            solver_accelerated: 1e-2 * solver,
            outline: 0.5 * solution,
            image,
            sky: (0.05 * image).max(1e-9),
            straight: 0.5 * image,
            straight_departure: 4.0,
            straight_mean: 0.5,
            open_sky: 0.25 * image,
            circles: 0.25 * image,
            beam_chains: 1e-3 * image,
            chains: 0.05 * image,
            lobes: 1.5 * image,
            gathering: 3.0,
            gathering_rays: 0.85,
            penumbrae: 0.25 * image,
            penumbra_pixels: 0.1 * image,
            glints: 1e-3 * image,
            pixels: 0.5 * image,
            flat_pixel: 2.0 * image,
            worst_pixel: 2.0 * image,
            lines: 0.7,
        }
    }

    /// All shares by name, in the order of the table.
    #[rustfmt::skip]
    pub fn shares(&self) -> [(&'static str, f64); SHARE_COUNT] {
        let ErrorBudget {
            solution, elements, probes, row_chains, solver, solver_accelerated, outline, image, sky, straight,
            straight_departure, straight_mean, open_sky, circles, beam_chains, chains, lobes, gathering,
            gathering_rays, penumbrae, penumbra_pixels, glints, pixels, flat_pixel, worst_pixel, lines,
        } = *self;
        [
            ("solution", solution), ("elements", elements), ("probes", probes), ("row_chains", row_chains),
            ("solver", solver), ("solver_accelerated", solver_accelerated), ("outline", outline),
            ("image", image), ("sky", sky), ("straight", straight), ("straight_departure", straight_departure),
            ("straight_mean", straight_mean), ("open_sky", open_sky), ("circles", circles),
            ("beam_chains", beam_chains), ("chains", chains), ("lobes", lobes), ("gathering", gathering),
            ("gathering_rays", gathering_rays), ("penumbrae", penumbrae), ("penumbra_pixels", penumbra_pixels),
            ("glints", glints), ("pixels", pixels), ("flat_pixel", flat_pixel), ("worst_pixel", worst_pixel),
            ("lines", lines),
        ]
    }
}

/// Number of shares of an [`ErrorBudget`].
pub const SHARE_COUNT: usize = 26;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_tells_all_shares_in_their_order() {
        let rows = include_str!("budget.rs").lines().filter_map(|line| line.strip_prefix("//! | [`"));
        let rows = rows.filter_map(|row| Some(row.split_once('`')?.0));
        assert!(rows.eq(ErrorBudget::new(2e-3, 1e-3).shares().map(|(name, _)| name)));
    }
}

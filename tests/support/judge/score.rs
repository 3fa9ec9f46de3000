//! eps_c between an image and a reference of two independent halves, without the bias of the reference's noise.

/// A measured error and how well it is known.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Score {
    /// eps_c of the worst band: the root of the mean product of the differences from both halves, 0 where that is
    /// negative.
    pub eps: f64,
    /// The same with the mean product a standard error lower.
    pub low: f64,
    /// The same with the mean product a standard error higher.
    pub high: f64,
}

impl Score {
    /// Standard error of `eps`; where `eps` does not stand out of the noise, what would.
    pub fn error(&self) -> f64 {
        self.high - self.eps
    }
}

/// Compares `image` (pixel, band) with a reference whose halves hold the same pixels, over the `counted` ones,
/// relative to `reference` per band.
///
/// With independent errors a and b of the halves, (d - a)(d - b) has the mean d^2: nothing is to be subtracted. Its
/// variance, 2 d^2 v + v^2 for Gaussian errors of variance v, is the mean of ((d - a)^2 - (d - b)^2)^2/4.
pub fn score(image: &[f64], halves: [&[f64]; 2], counted: &[bool], reference: &[f64]) -> Score {
    let bands = reference.len();
    let pixels = counted.iter().filter(|&&c| c).count().max(1) as f64;
    let of_band = |band: usize| {
        let (mut mean, mut variance) = (0.0, 0.0);
        for pixel in (0..counted.len()).filter(|&p| counted[p]) {
            let at = pixel * bands + band;
            let [a, b] = halves.map(|half| (image[at] - half[at]) / reference[band]);
            mean += a * b / pixels;
            variance += (a * a - b * b).powi(2) / (4.0 * pixels * pixels);
        }
        let error = variance.sqrt();
        let root = |x: f64| x.max(0.0).sqrt();
        Score { eps: root(mean), low: root(mean - error), high: root(mean.max(0.0) + error) }
    };
    let worst = |a: Score, b: Score| if (b.eps, b.high) > (a.eps, a.high) { b } else { a };
    (0..bands).filter(|&b| reference[b] > 0.0).map(of_band).fold(Score::default(), worst)
}

/// Mean variance of one half over the counted pixels, relative to `reference`, in the worst band.
pub fn variance(halves: [&[f64]; 2], counted: &[bool], reference: &[f64]) -> f64 {
    let bands = reference.len();
    let pixels = counted.iter().filter(|&&c| c).count().max(1) as f64;
    let of_band = |band: usize| {
        let square = |p: usize| {
            ((halves[0][p * bands + band] - halves[1][p * bands + band]) / reference[band]).powi(2)
        };
        (0..counted.len()).filter(|&p| counted[p]).map(square).sum::<f64>() / (2.0 * pixels)
    };
    (0..bands).filter(|&b| reference[b] > 0.0).map(of_band).fold(0.0, f64::max)
}

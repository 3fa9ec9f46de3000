//! The measure of an image's error: eps of eq. 16 over the samples whose primary ray meets the object, divided by
//! the reference radiance, with the reference's own noise taken out.

/// Which pixels count: those that `hit` the object and are not `disputed`.
pub fn counted(hit: &[bool], disputed: &[bool]) -> Vec<bool> {
    assert_eq!(hit.len(), disputed.len());
    hit.iter().zip(disputed).map(|(&hit, &disputed)| hit && !disputed).collect()
}

/// How many of them there are.
pub fn pixels(counted: &[bool]) -> usize {
    counted.iter().filter(|&&c| c).count()
}

/// eps of eq. 16 per band: the rms of `image - reference` over the counted pixels, divided by the band's reference
/// radiance.
///
/// Images are row-major with the bands of a pixel side by side. Panics when lengths disagree, no pixel counts, or a
/// counted value is not finite (a mean would hide it).
pub fn eps(image: &[f32], reference: &[f32], counted: &[bool], reference_radiance: &[f64]) -> Vec<f64> {
    let bands = reference_radiance.len();
    assert_eq!(image.len(), counted.len() * bands, "image");
    assert_eq!(reference.len(), counted.len() * bands, "reference");
    let pixels = pixels(counted);
    assert!(pixels > 0, "no pixel counts");
    let mut squares = vec![0.0; bands];
    let both = image.chunks(bands).zip(reference.chunks(bands));
    for (pixel, (mine, theirs)) in both.enumerate().filter(|&(pixel, _)| counted[pixel]) {
        for ((sum, &a), &b) in squares.iter_mut().zip(mine).zip(theirs) {
            assert!(a.is_finite() && b.is_finite(), "pixel {pixel}: {a} against {b}");
            *sum += (f64::from(a) - f64::from(b)).powi(2);
        }
    }
    squares.iter().zip(reference_radiance).map(|(s, i)| (s / pixels as f64).sqrt() / i).collect()
}

/// The worst band and its eps.
pub fn worst(eps: &[f64]) -> (usize, f64) {
    let of_two = |a: (usize, f64), b: (usize, f64)| if b.1 > a.1 { b } else { a };
    eps.iter().copied().enumerate().reduce(of_two).expect("at least one band")
}

/// eps_c: what is left of `eps` without the reference's standard error.
pub fn corrected(eps: f64, standard_error: f64) -> f64 {
    (eps * eps - standard_error * standard_error).max(0.0).sqrt()
}

/// Root of the mean square of the differences; panics on a value that is not finite.
pub fn rms(mine: &[f64], theirs: &[f64]) -> f64 {
    assert_eq!(mine.len(), theirs.len());
    let sum: f64 = mine.iter().zip(theirs).map(|(a, b)| (a - b).powi(2)).sum();
    assert!(sum.is_finite() && !mine.is_empty());
    (sum / mine.len() as f64).sqrt()
}

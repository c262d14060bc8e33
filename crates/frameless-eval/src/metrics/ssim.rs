//! Structural similarity (Wang, Bovik, Sheikh and Simoncelli 2004, "Image Quality Assessment: From Error Visibility to
//! Structural Similarity", §III.B–C).
//!
//! Written out here: of the crates that offer it, one averages over windows that do not overlap (other values than
//! everybody else's), one is under a licence that we cannot use, the others compute SSIMULACRA. This one equals scikit-image's
//! `structural_similarity` with Gaussian weights, see `tests/python/`.

/// Side of the window, in pixels; pictures with a shorter side have no SSIM.
const WINDOW_PX: usize = 11;
/// Standard deviation of the window's Gaussian weights, in pixels (the paper's).
const SIGMA_PX: f32 = 1.5;
/// (K₁ L)² and (K₂ L)² with the paper's K₁ = 0.01, K₂ = 0.03 and L = 1, the range of our values: they keep the quotient
/// defined where a picture is black or flat.
const C1: f32 = 0.01 * 0.01;
const C2: f32 = 0.03 * 0.03;

/// Mean structural similarity of two pictures of `width` columns, over their luma; in [−1, 1], 1 for equal pictures.
/// `None` if a side is shorter than the window of 11 pixels.
///
/// With weights w of an 11×11 Gaussian window (σ = 1.5, Σw = 1):
///
///   μ_a = Σ w a,   σ_a² = Σ w a² − μ_a²,   σ_ab = Σ w a b − μ_a μ_b
///   SSIM = (2 μ_a μ_b + C₁)(2 σ_ab + C₂) / ((μ_a² + μ_b² + C₁)(σ_a² + σ_b² + C₂))
///
/// and the mean is over all windows that lie within the picture. As in the paper's own program colours count by their
/// luma, 0.299 R + 0.587 G + 0.114 B of the sRGB values.
///
/// # Panics
/// If the pictures differ in size, or are not made of whole rows.
pub fn ssim(a: &[[f32; 3]], b: &[[f32; 3]], width: usize) -> Option<f64> {
    assert!(a.len() == b.len() && width > 0, "pictures of one size");
    assert!(a.len().is_multiple_of(width), "whole rows");
    if width < WINDOW_PX || a.len() / width < WINDOW_PX {
        return None;
    }
    let (a, b) = (luma(a), luma(b));
    let product =
        |a: &[f32], b: &[f32]| -> Vec<f32> { a.iter().zip(b).map(|(a, b)| a * b).collect() };
    let blurred = |values: &[f32]| blurred(values, width);
    let (mean_a, mean_b) = (blurred(&a), blurred(&b));
    let (square_a, square_b) = (blurred(&product(&a, &a)), blurred(&product(&b, &b)));
    let mixed = blurred(&product(&a, &b));
    let at = |i: usize| -> f64 {
        let (mean_a, mean_b) = (mean_a[i], mean_b[i]);
        let (variance_a, variance_b) =
            (square_a[i] - mean_a * mean_a, square_b[i] - mean_b * mean_b);
        let covariance = mixed[i] - mean_a * mean_b;
        let likeness = (2.0 * mean_a * mean_b + C1) * (2.0 * covariance + C2);
        let most = (mean_a * mean_a + mean_b * mean_b + C1) * (variance_a + variance_b + C2);
        f64::from(likeness / most)
    };
    Some((0..mixed.len()).map(at).sum::<f64>() / mixed.len() as f64)
}

fn luma(picture: &[[f32; 3]]) -> Vec<f32> {
    picture.iter().map(|&[r, g, b]| 0.299 * r + 0.587 * g + 0.114 * b).collect()
}

/// The weighted mean around every pixel whose window lies within the picture: first along rows, then along columns.
fn blurred(values: &[f32], width: usize) -> Vec<f32> {
    let weights = gaussian();
    let narrow = width + 1 - WINDOW_PX;
    let mut rows = vec![0.0; narrow * (values.len() / width)];
    for (sums, row) in rows.chunks_exact_mut(narrow).zip(values.chunks_exact(width)) {
        for (k, weight) in weights.iter().enumerate() {
            add(sums, &row[k..k + narrow], *weight);
        }
    }
    let height = values.len() / width + 1 - WINDOW_PX;
    let mut result = vec![0.0; narrow * height];
    for (y, sums) in result.chunks_exact_mut(narrow).enumerate() {
        for (k, weight) in weights.iter().enumerate() {
            add(sums, &rows[(y + k) * narrow..(y + k + 1) * narrow], *weight);
        }
    }
    result
}

/// A loop over whole rows, which the compiler turns into vector instructions.
fn add(sums: &mut [f32], values: &[f32], weight: f32) {
    sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += value * weight);
}

/// exp(−x²/2σ²) for x = −5 … 5, with sum 1.
fn gaussian() -> [f32; WINDOW_PX] {
    let weights: [f32; WINDOW_PX] = std::array::from_fn(|i| {
        let x = i as f32 - (WINDOW_PX / 2) as f32;
        (-x * x / (2.0 * SIGMA_PX * SIGMA_PX)).exp()
    });
    let sum: f32 = weights.iter().sum();
    weights.map(|weight| weight / sum)
}

#[cfg(test)]
mod tests {
    use frameless::Rng;

    use super::*;

    fn noise(seed: u64, pixels: usize) -> Vec<[f32; 3]> {
        let mut rng = Rng::new(seed);
        (0..pixels).map(|_| std::array::from_fn(|_| rng.unit_f32())).collect()
    }

    #[test]
    fn equal_pictures_are_exactly_alike() {
        for picture in [noise(1, 40 * 30), vec![[0.0; 3]; 1200], vec![[1.0; 3]; 1200]] {
            assert_eq!(ssim(&picture, &picture, 40), Some(1.0));
        }
    }

    #[test]
    fn flat_pictures_by_hand() {
        // No variance: (2ab + C₁) / (a² + b² + C₁).
        let got = ssim(&[[0.5; 3]; 400], &[[0.25; 3]; 400], 20).expect("large enough");
        let want = (2.0 * 0.5 * 0.25 + 1e-4) / (0.25 + 0.0625 + 1e-4);
        assert!((got - want).abs() < 1e-4, "{got} {want}");
    }

    #[test]
    fn one_window_by_hand() {
        // Exactly one window: its weighted moments in double precision, without the separation.
        let (a, b) = (noise(2, 121), noise(3, 121));
        let (la, lb) = (luma(&a), luma(&b));
        let weights = gaussian();
        let sum = |f: &dyn Fn(usize) -> f32| -> f64 {
            (0..121).map(|i| f64::from(weights[i / 11] * weights[i % 11]) * f64::from(f(i))).sum()
        };
        let (ma, mb) = (sum(&|i| la[i]), sum(&|i| lb[i]));
        let (va, vb) = (sum(&|i| la[i] * la[i]) - ma * ma, sum(&|i| lb[i] * lb[i]) - mb * mb);
        let cov = sum(&|i| la[i] * lb[i]) - ma * mb;
        let want = (2.0 * ma * mb + 1e-4) * (2.0 * cov + 9e-4)
            / ((ma * ma + mb * mb + 1e-4) * (va + vb + 9e-4));
        let got = ssim(&a, &b, 11).expect("one window");
        assert!((got - want).abs() < 1e-5, "{got} {want}");
    }

    #[test]
    fn unlike_pictures_are_unlike_and_the_order_does_not_matter() {
        let (a, b) = (noise(4, 900), noise(5, 900));
        let there = ssim(&a, &b, 30).expect("large enough");
        assert!(there.abs() < 0.1, "{there}");
        assert_eq!(Some(there), ssim(&b, &a, 30));
    }

    #[test]
    fn pictures_smaller_than_the_window_have_no_similarity() {
        assert_eq!(ssim(&noise(1, 10 * 20), &noise(2, 10 * 20), 10), None);
        assert_eq!(ssim(&noise(1, 10 * 20), &noise(2, 10 * 20), 20), None);
    }
}

//! How far a picture is from the ideal. Pictures are display-referred sRGB in [0, 1], row-major.

mod flip;
mod ssim;

pub use flip::flip;
pub use ssim::ssim;

/// A picture: display-referred sRGB in [0, 1] per pixel, row-major.
pub type Picture = Vec<[f32; 3]>;

/// Root of the mean squared difference over all pixels and channels; in [0, 1]. Zero for equal pictures.
///
/// # Panics
/// If the pictures differ in size.
pub fn rmse(a: &[[f32; 3]], b: &[[f32; 3]]) -> f64 {
    assert_eq!(a.len(), b.len(), "pictures of one size");
    let sum: f64 = a.iter().zip(b).map(|(a, b)| squared_distance(a, b)).sum();
    (sum / (3 * a.len()) as f64).sqrt()
}

/// [`rmse`] over the pixels where `mask` is set; `None` if it is set nowhere.
pub fn rmse_where(mask: &[bool], a: &[[f32; 3]], b: &[[f32; 3]]) -> Option<f64> {
    assert!(a.len() == b.len() && a.len() == mask.len(), "pictures and mask of one size");
    let inside = || a.iter().zip(b).zip(mask).filter(|(_, inside)| **inside);
    let count = inside().count();
    let sum: f64 = inside().map(|((a, b), _)| squared_distance(a, b)).sum();
    (count > 0).then(|| (sum / (3 * count) as f64).sqrt())
}

/// Peak signal-to-noise ratio −20 log₁₀(RMSE) in dB, for values in [0, 1]; `None` for equal pictures, where it is infinite.
pub fn psnr_db(rmse: f64) -> Option<f64> {
    (rmse > 0.0).then(|| -20.0 * rmse.log10())
}

fn squared_distance(a: &[f32; 3], b: &[f32; 3]) -> f64 {
    (0..3).map(|k| f64::from(a[k] - b[k]).powi(2)).sum()
}

/// A pixel has changed if one of its channels differs by more than this: ten steps of 255.
const CHANGED_BY_MORE_THAN: f32 = 0.04;

/// Which pixels of the last of `ideals` differ from any of the earlier ones by more than 0.04 in some channel.
pub fn changed_region<'a>(
    ideals: impl IntoIterator<Item = &'a [[f32; 3]]>,
    now: &[[f32; 3]],
) -> Vec<bool> {
    let mut changed = vec![false; now.len()];
    for earlier in ideals {
        for ((changed, a), b) in changed.iter_mut().zip(earlier).zip(now) {
            *changed |= differ(a, b, CHANGED_BY_MORE_THAN);
        }
    }
    changed
}

/// Whether two colours differ by more than `tolerance` in any channel.
pub(crate) fn differ(a: &[f32; 3], b: &[f32; 3], tolerance: f32) -> bool {
    (0..3).any(|k| (a[k] - b[k]).abs() > tolerance)
}

/// Mean of the values; `None` of none.
pub fn mean(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let (mut sum, mut count) = (0.0, 0u32);
    for value in values {
        sum += value;
        count += 1;
    }
    (count > 0).then(|| sum / f64::from(count))
}

/// The value below which the fraction `q` of the values lies, linear between ranks (Hyndman and Fan 1996, type 7).
///
/// # Panics
/// If there is no value, or one is NaN.
pub fn quantile(mut values: Vec<f64>, q: f64) -> f64 {
    assert!(!values.is_empty(), "a quantile of nothing");
    values.sort_by(|a, b| a.partial_cmp(b).expect("no NaN"));
    let rank = q.clamp(0.0, 1.0) * (values.len() - 1) as f64;
    let (low, high) = (rank.floor() as usize, rank.ceil() as usize);
    values[low] + (values[high] - values[low]) * rank.fract()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rmse_by_hand() {
        let a = [[0.0; 3], [0.5, 0.5, 0.5]];
        let b = [[0.0, 0.0, 0.6], [0.5, 0.5, 0.5]];
        assert!((rmse(&a, &b) - (0.36f64 / 6.0).sqrt()).abs() < 1e-7);
        assert_eq!(rmse(&a, &a), 0.0);
        assert!(
            (rmse_where(&[true, false], &a, &b).expect("one pixel") - (0.12f64).sqrt()).abs()
                < 1e-7
        );
        assert_eq!(rmse_where(&[false, true], &a, &b), Some(0.0));
        assert_eq!(rmse_where(&[false, false], &a, &b), None);
    }

    #[test]
    fn psnr_by_hand() {
        assert_eq!(psnr_db(1.0), Some(0.0));
        assert!((psnr_db(0.1).expect("finite") - 20.0).abs() < 1e-12);
        assert_eq!(psnr_db(0.0), None);
    }

    #[test]
    fn the_changed_region_is_where_any_channel_moved_by_more_than_ten_steps() {
        let now = [[0.5; 3]; 3];
        let earlier = [[0.5, 0.5, 0.53], [0.5, 0.45, 0.5], [0.5; 3]];
        assert_eq!(changed_region([&earlier[..]], &now), [false, true, false]);
        assert_eq!(changed_region([&now[..], &earlier[..]], &now), [false, true, false]);
        assert_eq!(changed_region([], &now), [false; 3]);
    }

    #[test]
    fn quantiles_by_hand() {
        assert_eq!(quantile(vec![3.0, 1.0, 2.0], 0.5), 2.0);
        assert_eq!(quantile(vec![4.0], 0.95), 4.0);
        assert!((quantile((0..=100).map(f64::from).collect(), 0.95) - 95.0).abs() < 1e-9);
        assert_eq!(quantile(vec![0.0, 1.0], 0.25), 0.25);
    }
}

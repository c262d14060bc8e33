//! FLIP (Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström and Fairchild 2020, "FLIP: A Difference Evaluator for
//! Alternating Images"), by its authors' program.

use frameless::Display;
use nv_flip::{DEFAULT_PIXELS_PER_DEGREE, FlipImageRgb8};

/// Mean FLIP difference of two pictures of `width` columns, as a display with 8 bits per channel shows them; in [0, 1], 0
/// for equal pictures. The observer is the authors' default: 67 pixels per degree, a monitor of 0.7 m width and 3840 columns
/// seen from 0.7 m.
///
/// # Panics
/// If the pictures differ in size, are empty, or are not made of whole rows.
pub fn flip(reference: &[[f32; 3]], test: &[[f32; 3]], width: usize) -> f64 {
    assert!(reference.len() == test.len() && width > 0, "pictures of one size");
    assert!(reference.len().is_multiple_of(width) && !test.is_empty(), "whole rows");
    let height = test.len() / width;
    let image = |picture: &[[f32; 3]]| {
        let bytes: Vec<u8> = picture.as_flattened().iter().map(|&c| Display::quantize(c)).collect();
        FlipImageRgb8::with_data(width as u32, height as u32, &bytes)
    };
    let map = nv_flip::flip(image(reference), image(test), DEFAULT_PIXELS_PER_DEGREE).to_vec();
    map.iter().map(|&difference| f64::from(difference)).sum::<f64>() / map.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_pictures_do_not_differ_at_all() {
        let ramp: Vec<[f32; 3]> = (0..400).map(|i| [i as f32 / 400.0, 0.5, 0.1]).collect();
        assert_eq!(flip(&ramp, &ramp, 20), 0.0);
    }

    #[test]
    fn black_and_white_differ_almost_as_much_as_can_be() {
        // Two flat pictures differ in colour alone. The paper's redistribution (§4.1) leads the largest distance in its colour space,
        // that of green and blue, to 1, and black and white a little lower.
        let difference = flip(&[[0.0; 3]; 400], &[[1.0; 3]; 400], 20);
        assert!((0.9..1.0).contains(&difference), "{difference}");
    }

    #[test]
    fn more_noise_is_a_larger_difference() {
        let flat = vec![[0.5; 3]; 400];
        let noisy = |amplitude: f32| -> Vec<[f32; 3]> {
            let mut rng = frameless::Rng::new(1);
            (0..400).map(|_| [0.5 + amplitude * (rng.unit_f32() - 0.5); 3]).collect()
        };
        let (little, much) = (flip(&flat, &noisy(0.1), 20), flip(&flat, &noisy(0.5), 20));
        assert!(0.0 < little && little < 0.5 * much, "{little} {much}");
    }
}

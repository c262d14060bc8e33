//! Unit vectors, albedos and colours in four bytes each.

/// Octahedral map of a unit vector, 16 bits per coordinate; at most 7e-5 off in each component (Cigolle et al. 2014, "A survey of
/// efficient representations for independent unit vectors").
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct PackedNormal(pub(super) u32);

/// Square roots in 10 bits per channel; values outside [0, 1] are clamped.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct PackedAlbedo(pub(super) u32);

/// Linear red, green and blue in 9, 9 and 8 bits with a common exponent of 6 (as Ward 1991, "Real pixels", does in 8 bits each): off by at most two
/// thousandths of the brightest channel, blue by four.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct PackedLinear(pub(super) u32);

pub(super) const NORMAL_STEPS: f32 = 32_767.0;
pub(super) const ALBEDO_STEPS: f32 = 1023.0;

/// To the nearest whole number, half away from zero, for small numbers: `f32::round` is a call to a library.
#[inline(always)]
fn rounded(x: f32) -> i32 {
    (x + 0.5f32.copysign(x)) as i32
}

impl PackedNormal {
    pub(super) fn new([x, y, z]: [f32; 3]) -> PackedNormal {
        let sum = (x.abs() + y.abs() + z.abs()).max(f32::MIN_POSITIVE);
        let (u, v) = (x / sum, y / sum);
        let (u, v) = if z < 0.0 {
            ((1.0 - v.abs()).copysign(u), (1.0 - u.abs()).copysign(v))
        } else {
            (u, v)
        };
        let bits = |c: f32| u32::from(rounded(c * NORMAL_STEPS) as i16 as u16);
        PackedNormal(bits(u) << 16 | bits(v))
    }

    /// Not quite of length 1.
    pub(super) fn unpack(self) -> [f32; 3] {
        let coordinate = |bits: u32| f32::from(bits as u16 as i16) / NORMAL_STEPS;
        let (u, v) = (coordinate(self.0 >> 16), coordinate(self.0));
        let z = 1.0 - u.abs() - v.abs();
        // Below the equator the corners are folded back.
        let fold = (-z).max(0.0);
        let (x, y) = (u - fold.copysign(u), v - fold.copysign(v));
        let per_length = 1.0 / (x * x + y * y + z * z).sqrt().max(f32::MIN_POSITIVE);
        [x * per_length, y * per_length, z * per_length]
    }
}

impl PackedAlbedo {
    pub(super) fn new(albedo: [f32; 3]) -> PackedAlbedo {
        let bits = |c: f32| rounded(c.clamp(0.0, 1.0).sqrt() * ALBEDO_STEPS) as u32;
        PackedAlbedo(bits(albedo[0]) << 20 | bits(albedo[1]) << 10 | bits(albedo[2]))
    }

    pub(super) fn unpack(self) -> [f32; 3] {
        [self.0 >> 20, self.0 >> 10, self.0]
            .map(|bits| ((bits & 1023) as f32 / ALBEDO_STEPS).powi(2))
    }
}

/// Added to exponents so that they are not negative: colours are below 2³².
const LEAST_EXPONENT: i32 = 31;

/// 2^`exponent`.
#[inline(always)]
fn power(exponent: i32) -> f32 {
    f32::from_bits(((127 + exponent) as u32) << 23)
}

impl PackedLinear {
    /// Negative channels become 0.
    #[inline(always)]
    pub(super) fn new([r, g, b]: [f32; 3]) -> PackedLinear {
        // The brightest is below 2^exponent.
        let exponent = (r.max(g).max(b).max(0.0).to_bits() >> 23) as i32 - 126;
        let exponent = exponent.clamp(-LEAST_EXPONENT, LEAST_EXPONENT + 1);
        let per_step = power(9 - exponent);
        let steps = |c: f32, most: u32| ((c + 0.5) as u32).min(most);
        let [r, g] = [r, g].map(|c| steps(c * per_step, 511));
        let b = steps(b * (0.5 * per_step), 255);
        PackedLinear(((exponent + LEAST_EXPONENT) as u32) << 26 | r << 17 | g << 8 | b)
    }

    pub(super) fn unpack(self) -> [f32; 3] {
        let step = power((self.0 >> 26) as i32 - LEAST_EXPONENT - 9);
        let channel = |bits: u32, step: f32| bits as f32 * step;
        let (r, g) = (self.0 >> 17 & 511, self.0 >> 8 & 511);
        [channel(r, step), channel(g, step), channel(self.0 & 255, 2.0 * step)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_come_back() {
        let mut rng = crate::Rng::new(1);
        for _ in 0..10_000 {
            let scale = 2f32.powf(60.0 * (rng.unit_f32() - 0.5));
            let linear: [f32; 3] = std::array::from_fn(|_| scale * rng.unit_f32());
            let most = linear.iter().copied().fold(0.0, f32::max);
            let back = PackedLinear::new(linear).unpack();
            for (k, per_most) in [(0, 0.002), (1, 0.002), (2, 0.004)] {
                assert!((back[k] - linear[k]).abs() <= per_most * most, "{linear:?} {back:?}");
            }
        }
        assert_eq!(PackedLinear::new([0.0, -1.0, 0.0]).unpack(), [0.0; 3]);
        assert_eq!(PackedLinear::new([1.0, 0.5, 0.25]).unpack(), [1.0, 0.5, 0.25]);
        assert!(PackedLinear::new([f32::MAX; 3]).unpack()[0] > 4e9);
    }

    #[test]
    fn unit_vectors_come_back() {
        let mut rng = crate::Rng::new(1);
        for _ in 0..10_000 {
            let v: [f32; 3] = std::array::from_fn(|_| rng.unit_f32() - 0.5);
            let length = (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt().max(1e-6);
            let v = v.map(|x| x / length);
            let back = PackedNormal::new(v).unpack();
            (0..3).for_each(|k| assert!((v[k] - back[k]).abs() < 7e-5, "{v:?} {back:?}"));
        }
        for axis in [[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]] {
            assert_eq!(PackedNormal::new(axis).unpack(), axis);
        }
    }

    #[test]
    fn albedos_come_back() {
        for albedo in [[0.0, 0.5, 1.0], [0.01, 0.18, 0.9], [2.0, -1.0, 0.3]] {
            let back = PackedAlbedo::new(albedo).unpack();
            let wanted = albedo.map(|c: f32| c.clamp(0.0, 1.0));
            (0..3).for_each(|k| assert!((wanted[k] - back[k]).abs() < 1e-3, "{back:?}"));
        }
    }
}

//! Unit vectors and albedos in four bytes each.

/// Octahedral map of a unit vector, 16 bits per coordinate; at most 7e-5 off in each component (Cigolle et al. 2014, "A survey of
/// efficient representations for independent unit vectors").
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct PackedNormal(pub(super) u32);

/// Square roots in 10 bits per channel; values outside [0, 1] are clamped.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct PackedAlbedo(pub(super) u32);

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

#[cfg(test)]
mod tests {
    use super::*;

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

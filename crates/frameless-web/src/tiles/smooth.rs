//! Tiles without detail: there a step between neighbouring tiles is seen that would be lost in a texture.
//!
//! A sky that becomes slowly darker changes by less than is worth sending at any one time. Where something moves in front of it, its tiles
//! are sent, and are newer than those around: a halo, of two or three steps of brightness. So tiles without detail are followed by
//! their mean.

use super::Grid;

/// Between pixels beside or below each other, in steps of a channel: more than a gradient has, less than an edge.
const STEEPEST: u8 = 4;
/// Of a mean, per step of a channel.
const PARTS: u32 = 64;
/// Squared difference of means (Σ over the channels, in steps) that is seen beside tiles that have not changed: little more than one step in each
/// channel.
const SEEN: f64 = 4.0;

/// The mean colour of a tile without detail, R G B in 1/64 of a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Mean([u16; 3]);

impl Mean {
    /// None where the tile has detail.
    pub(crate) fn of(grid: &Grid, tile: usize, rgba: &[[u8; 4]]) -> Option<Mean> {
        let (mut sums, mut pixels) = ([0; 3], 0);
        let mut above: Option<&[[u8; 4]]> = None;
        for row in grid.rows(tile) {
            let row = &rgba[row];
            let is_steep = |(a, b): (&[u8; 4], &[u8; 4])| {
                a.iter().zip(b).any(|(a, b)| a.abs_diff(*b) > STEEPEST)
            };
            if row.iter().zip(&row[1..]).any(is_steep)
                || above.is_some_and(|above| row.iter().zip(above).any(is_steep))
            {
                return None;
            }
            for [r, g, b, _] in row {
                for (sum, channel) in sums.iter_mut().zip([r, g, b]) {
                    *sum += u32::from(*channel);
                }
            }
            pixels += row.len() as u32;
            above = Some(row);
        }
        Some(Mean(sums.map(|sum| (PARTS * sum / pixels.max(1)) as u16)))
    }

    /// Whether the step from the one to the other is seen.
    pub(crate) fn is_seen_beside(self, other: Mean) -> bool {
        let steps = |k: usize| f64::from(self.0[k].abs_diff(other.0[k])) / f64::from(PARTS);
        (0..3).map(|k| steps(k).powi(2)).sum::<f64>() >= SEEN
    }
}

#[cfg(test)]
mod tests {
    use frameless::Size;

    use super::*;

    fn mean(colour: impl Fn(u32, u32) -> [u8; 4]) -> Option<Mean> {
        let size = Size::new(21, 16);
        let pixels = (0..size.pixels() as u32).map(|pixel| colour(pixel % 21, pixel / 21));
        Mean::of(&Grid::new(size), 0, &pixels.collect::<Vec<_>>())
    }

    #[test]
    fn a_gradient_has_a_mean_and_an_edge_has_none() {
        assert_eq!(mean(|x, y| [x as u8, 2 * y as u8, 9, 255]), Some(Mean([480, 960, 576])));
        assert_eq!(mean(|x, _| [if x < 8 { 100 } else { 105 }, 0, 0, 255]), None);
        assert_eq!(mean(|_, y| [0, if y < 8 { 100 } else { 105 }, 0, 255]), None);
        // What lies beside the tile is not its own.
        assert!(mean(|x, _| [if x < 16 { 0 } else { 255 }; 4]).is_some());
    }

    #[test]
    fn more_than_a_step_in_each_channel_is_seen_and_half_of_one_is_not() {
        let grey = |level: u16| Mean([level; 3]);
        assert!(grey(640).is_seen_beside(grey(720)));
        assert!(!grey(640).is_seen_beside(grey(672)));
        assert!(!grey(640).is_seen_beside(grey(640)));
    }
}

//! Pictures as the clients see them: only those in which something changed, with what changed in them.
//!
//! What rests is refined for seconds by differences that nobody sees. Were each of those pictures published, no client would ever have
//! *the* picture: so a picture in which no change can be seen is published only twice a second, or once it is the same twice. And where
//! nothing moves, what has been published is first to be drawn by a client, every bit of it; only then comes something better.

use std::hash::{BuildHasher, Hasher};
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

use foldhash::quality::FixedState;
use frameless::Size;
use frameless_session::Picture;

use super::{Grid, Mean};

/// A change of a tile that is seen: mean squared difference of its pixels (Σ over the channels, 8 bits each). A pixel in a hundred
/// that is off by six steps in each channel, or one that is off by thirty.
const SEEN: f64 = 1.0;
/// What nobody sees is published this often.
const UNSEEN_INTERVAL: Duration = Duration::from_millis(500);
/// What is only refined waits for clients no longer than this.
const REFINED_AT_LATEST: Duration = Duration::from_secs(2);
/// Without a change that is seen for so long the picture is calm.
const CALM: Duration = Duration::from_millis(120);

/// A picture with what is known of its tiles.
pub(crate) struct Published {
    /// From 1, growing.
    pub(crate) number: u32,
    /// Grows with every change of size.
    pub(crate) generation: u32,
    /// Width and height.
    pub(crate) size: Size,
    /// sRGB-encoded, row-major.
    pub(crate) rgba: Vec<[u8; 4]>,
    /// Of the bytes of each tile: equal digests, equal tiles.
    pub(crate) digests: Vec<u64>,
    /// Per tile: squared differences from one published picture to the next, summed over all since the generation began.
    pub(crate) change_sums: Vec<u64>,
    /// Per tile: its mean colour, if it has no detail.
    pub(crate) means: Vec<Option<Mean>>,
    /// From then on nothing that is seen has changed for a while, if no other picture is published.
    pub(crate) calm_at: Instant,
    /// Pairs of client and its last input that the picture shows.
    pub(crate) inputs: Vec<(u32, u32)>,
    crc: OnceLock<u32>,
}

impl Published {
    /// Its tiles.
    pub(crate) fn grid(&self) -> Grid {
        Grid::new(self.size)
    }

    /// The last of the client's inputs that it shows; 0: none.
    pub(crate) fn input_of(&self, client: u32) -> u32 {
        self.inputs.iter().find(|(of, _)| *of == client).map_or(0, |(_, input)| *input)
    }

    /// CRC-32 of R G B of all pixels; worked out when it is asked for first.
    pub(crate) fn crc(&self) -> u32 {
        *self.crc.get_or_init(|| {
            let mut hasher = crc32fast::Hasher::new();
            let mut row = Vec::with_capacity(3 * self.size.width as usize);
            for pixels in self.rgba.chunks(self.size.width as usize) {
                row.clear();
                row.extend(pixels.iter().flat_map(|&[r, g, b, _]| [r, g, b]));
                hasher.update(&row);
            }
            hasher.finalize()
        })
    }
}

/// Why a picture differs from the last one, if it does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Occasion {
    /// It is the first one that shows an input.
    Input,
    /// Something may have moved.
    Motion,
    /// Nothing moves: more samples have been added up. `is_drawn`: nobody is still waiting for parts of the last one.
    Refinement { is_drawn: bool },
}

/// What became of a picture.
pub(crate) enum Taken {
    /// It is to be shown.
    New(Arc<Published>),
    /// The last one will do; the picture's memory.
    Same(Vec<[u8; 4]>),
}

/// Decides which pictures are published.
pub(crate) struct Publisher {
    last: Option<Arc<Published>>,
    taken_at: Instant,
    // Of the last picture, published or not.
    taken: u64,
    published_at: Instant,
    seen_at: Instant,
}

impl Publisher {
    pub(crate) fn new(now: Instant) -> Publisher {
        Publisher { last: None, taken_at: now, taken: 0, published_at: now, seen_at: now }
    }

    /// When the last picture came, published or not.
    pub(crate) fn taken_at(&self) -> Instant {
        self.taken_at
    }

    /// For how long nothing that is seen has changed.
    pub(crate) fn quiet_for(&self, now: Instant) -> Duration {
        now.saturating_duration_since(self.seen_at)
    }

    /// The number of the last picture that was published; 0: none.
    pub(crate) fn last_number(&self) -> u32 {
        self.last.as_ref().map_or(0, |last| last.number)
    }

    /// Compares the picture with the last one that was published. The first one that shows an input is published in any case if anything
    /// differs.
    pub(crate) fn take(
        &mut self,
        picture: Picture,
        inputs: Vec<(u32, u32)>,
        occasion: Occasion,
        now: Instant,
    ) -> Taken {
        self.taken_at = now;
        let digest_of_all = digest_of([picture.rgba.as_flattened()]);
        let stands_still = std::mem::replace(&mut self.taken, digest_of_all) == digest_of_all;
        let other_size = self.last.take_if(|last| last.size != picture.size);
        let begun = other_size.map_or([1, 1], |other| {
            [other.number.wrapping_add(1), other.generation.wrapping_add(1)]
        });
        let Some(last) = &self.last else {
            let published = first(picture, begun, inputs, now);
            return self.publish(published, now);
        };
        let grid = last.grid();
        let differences: Vec<u64> = (0..grid.len())
            .map(|tile| difference(&grid, tile, &last.rgba, &picture.rgba))
            .collect();
        let differs = differences.iter().any(|&difference| difference > 0);
        let is_seen = differences
            .iter()
            .enumerate()
            .any(|(tile, &sum)| sum as f64 >= SEEN * f64::from(grid.pixels(tile)));
        let age = now.duration_since(self.published_at);
        let is_worth_it = is_seen || stands_still || age >= UNSEEN_INTERVAL;
        let is_due = match occasion {
            Occasion::Input => true,
            Occasion::Motion => is_worth_it,
            Occasion::Refinement { is_drawn } => {
                is_worth_it && (is_drawn || age >= REFINED_AT_LATEST)
            }
        };
        if is_seen && !matches!(occasion, Occasion::Refinement { .. }) {
            self.seen_at = now;
        }
        if !(differs && is_due) {
            return Taken::Same(picture.rgba);
        }
        let (mut digests, mut change_sums) = (last.digests.clone(), last.change_sums.clone());
        let mut means = last.means.clone();
        for (tile, difference) in differences.into_iter().enumerate().filter(|(_, sum)| *sum > 0) {
            digests[tile] = digest(&grid, tile, &picture.rgba);
            change_sums[tile] += difference;
            means[tile] = Mean::of(&grid, tile, &picture.rgba);
        }
        let published = Published {
            number: last.number.wrapping_add(1),
            generation: last.generation,
            size: picture.size,
            rgba: picture.rgba,
            digests,
            change_sums,
            means,
            calm_at: self.seen_at + CALM,
            inputs,
            crc: OnceLock::new(),
        };
        self.publish(published, now)
    }

    fn publish(&mut self, mut published: Published, now: Instant) -> Taken {
        if self.last.is_none() {
            self.seen_at = now;
            published.calm_at = now + CALM;
        }
        self.published_at = now;
        let published = Arc::new(published);
        self.last = Some(Arc::clone(&published));
        Taken::New(published)
    }
}

/// Of a generation.
fn first(
    picture: Picture,
    [number, generation]: [u32; 2],
    inputs: Vec<(u32, u32)>,
    now: Instant,
) -> Published {
    let grid = Grid::new(picture.size);
    Published {
        number,
        generation,
        size: picture.size,
        digests: (0..grid.len()).map(|tile| digest(&grid, tile, &picture.rgba)).collect(),
        change_sums: vec![0; grid.len()],
        means: (0..grid.len()).map(|tile| Mean::of(&grid, tile, &picture.rgba)).collect(),
        rgba: picture.rgba,
        calm_at: now,
        inputs,
        crc: OnceLock::new(),
    }
}

/// Squared differences of a tile's pixels, summed over the channels.
fn difference(grid: &Grid, tile: usize, before: &[[u8; 4]], after: &[[u8; 4]]) -> u64 {
    let of_row = |row: std::ops::Range<usize>| {
        let (before, after) = (&before[row.clone()], &after[row]);
        if before == after {
            return 0;
        }
        let squares = before.as_flattened().iter().zip(after.as_flattened()).map(|(&a, &b)| {
            let difference = u32::from(a.abs_diff(b));
            difference * difference
        });
        u64::from(squares.sum::<u32>())
    };
    grid.rows(tile).map(of_row).sum()
}

fn digest(grid: &Grid, tile: usize, rgba: &[[u8; 4]]) -> u64 {
    digest_of(grid.rows(tile).map(|row| rgba[row].as_flattened()))
}

fn digest_of<'a>(parts: impl IntoIterator<Item = &'a [u8]>) -> u64 {
    let mut hasher = FixedState::with_seed(0).build_hasher();
    parts.into_iter().for_each(|part| hasher.write(part));
    hasher.finish()
}

#[cfg(test)]
pub(crate) mod tests {
    use frameless_session::{Ages, Status};

    use super::*;

    pub(crate) fn picture(size: Size, rgba: Vec<[u8; 4]>) -> Picture {
        let status = Status {
            scene_secs: 0.0,
            samples_per_sec: 0.0,
            pictures_per_sec: 0.0,
            ages: Ages::default(),
            overlay: None,
        };
        Picture { size, rgba, mark: 0, status }
    }

    const SIZE: Size = Size { width: 40, height: 20 };

    fn grey(level: u8) -> Picture {
        picture(SIZE, vec![[level, level, level, 255]; SIZE.pixels()])
    }

    pub(crate) fn published(taken: Taken) -> Arc<Published> {
        match taken {
            Taken::New(published) => published,
            Taken::Same(_) => panic!("not published"),
        }
    }

    #[test]
    fn what_is_seen_is_published_at_once_and_the_same_never() {
        let now = Instant::now();
        let mut publisher = Publisher::new(now);
        let first = published(publisher.take(grey(10), Vec::new(), Occasion::Motion, now));
        let mut other = grey(10);
        other.rgba[5][0] = 90;
        let second = published(publisher.take(other, Vec::new(), Occasion::Motion, now));
        assert!(second.number > first.number);
        assert_ne!(second.digests[0], first.digests[0]);
        assert_eq!(second.digests[1..], first.digests[1..]);
        assert_eq!(second.change_sums, [6400, 0, 0, 0, 0, 0]);
        let mut same = grey(10);
        same.rgba[5][0] = 90;
        let later = now + Duration::from_secs(60);
        assert!(matches!(publisher.take(same, Vec::new(), Occasion::Input, later), Taken::Same(_)));
    }

    #[test]
    fn what_nobody_sees_waits_half_a_second_and_still_comes() {
        let now = Instant::now();
        let mut publisher = Publisher::new(now);
        published(publisher.take(grey(10), Vec::new(), Occasion::Motion, now));
        let one_step = || {
            let mut picture = grey(10);
            picture.rgba[7] = [11, 10, 10, 255];
            picture
        };
        let other_step = || {
            let mut picture = one_step();
            picture.rgba[9] = [11, 10, 10, 255];
            picture
        };
        let at = |ms| now + Duration::from_millis(ms);
        assert!(matches!(
            publisher.take(one_step(), Vec::new(), Occasion::Motion, at(100)),
            Taken::Same(_)
        ));
        let shown = published(publisher.take(other_step(), Vec::new(), Occasion::Motion, at(510)));
        assert!(shown.calm_at <= at(510));
    }

    #[test]
    fn what_stands_still_is_published_at_once() {
        let now = Instant::now();
        let mut publisher = Publisher::new(now);
        published(publisher.take(grey(10), Vec::new(), Occasion::Motion, now));
        let mut one_step = || {
            let mut picture = grey(10);
            picture.rgba[7] = [11, 10, 10, 255];
            publisher.take(picture, Vec::new(), Occasion::Motion, now)
        };
        assert!(matches!(one_step(), Taken::Same(_)));
        published(one_step());
        assert!(matches!(one_step(), Taken::Same(_)), "nothing differs any longer");
    }

    #[test]
    fn what_is_refined_waits_until_the_last_picture_is_drawn() {
        let now = Instant::now();
        let mut publisher = Publisher::new(now);
        published(publisher.take(grey(10), Vec::new(), Occasion::Motion, now));
        let mut refined = |level, is_drawn, ms| {
            let at = now + Duration::from_millis(ms);
            publisher.take(grey(level), Vec::new(), Occasion::Refinement { is_drawn }, at)
        };
        assert!(matches!(refined(20, false, 100), Taken::Same(_)));
        assert!(matches!(refined(30, false, 600), Taken::Same(_)));
        let second = published(refined(40, true, 700));
        assert!(
            second.calm_at < now + Duration::from_millis(700),
            "nothing moves: exactly at once"
        );
        assert!(matches!(refined(50, false, 2600), Taken::Same(_)));
        published(refined(60, false, 2700));
    }

    #[test]
    fn a_slow_fade_is_seen_before_half_a_second() {
        let now = Instant::now();
        let mut publisher = Publisher::new(now);
        published(publisher.take(grey(10), Vec::new(), Occasion::Motion, now));
        // One step in each channel: 3 ≥ SEEN.
        assert!(
            published(publisher.take(grey(11), Vec::new(), Occasion::Motion, now)).calm_at > now
        );
    }

    #[test]
    fn another_size_is_another_generation() {
        let now = Instant::now();
        let mut publisher = Publisher::new(now);
        let first = published(publisher.take(grey(10), Vec::new(), Occasion::Motion, now));
        let small = picture(Size::new(1, 1), vec![[0, 0, 0, 255]]);
        let second = published(publisher.take(small, Vec::new(), Occasion::Motion, now));
        assert!(second.generation > first.generation && second.number > first.number);
        assert_eq!(second.digests.len(), 1);
    }

    #[test]
    fn the_checksum_is_that_of_the_specification() {
        let now = Instant::now();
        // "123456789", whose CRC-32 is known.
        let rgba = vec![*b"123\xff", *b"456\xff", *b"789\xff"];
        let three = picture(Size::new(1, 3), rgba);
        let shown = published(Publisher::new(now).take(three, Vec::new(), Occasion::Motion, now));
        assert_eq!(shown.crc(), 0xcbf4_3926);
    }
}

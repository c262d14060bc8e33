//! Decoding many pictures in bounded memory, and keeping them as large as there is room for.
//!
//! Before a picture is decoded nobody knows whether it is all of one colour, and then it takes nothing. So pictures are decoded as many at once
//! as fit, those first that take most meanwhile, as least is kept then; and whenever there is no room for those that are kept, the largest of
//! them is halved. What comes of it does not depend on threads.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use rayon::prelude::*;

use crate::Encoding;

use super::decode::Decoded;
use super::document::Document;
use super::error::Fault;
use super::image::Encoded;
use super::limits::Budget;

/// All pictures, and how large they are.
pub(super) struct Pictures {
    /// Per picture.
    pub(super) decoded: Vec<Result<Decoded, Fault>>,
    /// Per picture: whether it has fewer pixels than in the file, but for those all of one colour.
    pub(super) is_reduced: Vec<bool>,
    /// Why some are reduced: the limit that they would pass as they are in the file.
    pub(super) no_room: Option<Fault>,
}

/// Decodes those that may be.
pub(super) fn decode_all(
    encoded: Vec<Result<Encoded, Fault>>,
    encodings: &[Encoding],
    document: &mut Document<'_>,
) -> Pictures {
    let mut room = Room::new(encoded.len());
    let mut waiting = Vec::new();
    for (index, encoded) in encoded.into_iter().enumerate() {
        match encoded {
            Ok(encoded) => waiting.push((index, encoded)),
            Err(fault) => room.decoded[index] = Some(Err(fault)),
        }
    }
    let work = waiting.iter().map(|(_, encoded)| encoded.work_pixels);
    room.all_work_pixels = work.fold(0, u64::saturating_add);
    waiting.sort_by_key(|(_, encoded)| Reverse(encoded.working_bytes));
    while !waiting.is_empty() {
        room.refuse_work(&mut waiting, &document.budget);
        let Some((_, first)) = waiting.first() else { break };
        room.make(first.working_bytes, &document.budget, encodings);
        let count = room.count(&waiting, &document.budget);
        let next: Vec<_> = waiting.drain(..count).collect();
        let views = &document.views;
        let decoded = next.into_par_iter();
        let decoded =
            decoded.map(|(index, encoded)| (index, encoded.work_pixels, encoded.decode(views)));
        let decoded: Vec<(usize, u64, Result<Decoded, Fault>)> = decoded.collect();
        for (index, work_pixels, decoded) in decoded {
            room.work(work_pixels, &decoded);
            room.put(index, decoded);
        }
        while document.budget.check_pixels(room.pixels).is_err() && room.halve_largest(encodings) {}
    }
    document.budget.keep_pixels(room.pixels);
    let no_room = document.budget.check_pixels(room.pixels_in_file).err().or(room.none_meanwhile);
    let decoded = room.decoded.into_iter().map(|decoded| decoded.expect("each has been put"));
    Pictures { decoded: decoded.collect(), is_reduced: room.is_reduced, no_room }
}

/// What has been decoded so far.
struct Room {
    decoded: Vec<Option<Result<Decoded, Fault>>>,
    is_reduced: Vec<bool>,
    /// Those that can be halved: pixels and index.
    largest: BinaryHeap<(u64, usize)>,
    /// Of all, as they are kept, and as they are in the file.
    pixels: u64,
    pixels_in_file: u64,
    /// What has been done to decode them.
    work_pixels: u64,
    /// What would be done to decode all of them, each once.
    all_work_pixels: u64,
    /// The limit that was in the way when one was to be decoded beside those that were kept.
    none_meanwhile: Option<Fault>,
}

impl Room {
    fn new(count: usize) -> Room {
        Room {
            decoded: (0..count).map(|_| None).collect(),
            is_reduced: vec![false; count],
            largest: BinaryHeap::new(),
            pixels: 0,
            pixels_in_file: 0,
            work_pixels: 0,
            all_work_pixels: 0,
            none_meanwhile: None,
        }
    }

    /// What is kept, and what decoding takes beside it.
    fn check(&self, working_bytes: u64, budget: &Budget) -> Result<(), Fault> {
        let kept = self.pixels.saturating_mul(size_of::<[u8; 4]>() as u64);
        budget.check_decoders(kept.saturating_add(working_bytes))
    }

    /// Those that would be too much to decode, the largest first, are not decoded at all.
    fn refuse_work(&mut self, waiting: &mut Vec<(usize, Encoded)>, budget: &Budget) {
        waiting.retain(|&(index, Encoded { work_pixels, .. })| {
            let work_pixels = self.work_pixels.saturating_add(work_pixels);
            let refusal = budget.check_work(work_pixels, self.all_work_pixels);
            let Err(fault) = refusal else { return true };
            self.decoded[index] = Some(Err(fault));
            false
        });
    }

    /// Counts it: twice what was begun again.
    fn work(&mut self, work_pixels: u64, decoded: &Result<Decoded, Fault>) {
        let is_read_twice = decoded.as_ref().map_or(true, |decoded| decoded.is_read_twice);
        let times = if is_read_twice { 2 } else { 1 };
        self.work_pixels = self.work_pixels.saturating_add(work_pixels.saturating_mul(times));
    }

    /// Room for one picture to be decoded, as far as there can be.
    fn make(&mut self, working_bytes: u64, budget: &Budget, encodings: &[Encoding]) {
        while let Err(fault) = self.check(working_bytes, budget) {
            if !self.halve_largest(encodings) {
                return;
            }
            self.none_meanwhile.get_or_insert(fault);
        }
    }

    /// How many of those waiting may be decoded at once; one at least.
    fn count(&self, waiting: &[(usize, Encoded)], budget: &Budget) -> usize {
        let (mut working_bytes, mut work_pixels) = (0_u64, self.work_pixels);
        let fits = waiting.iter().take_while(|(_, encoded)| {
            working_bytes = working_bytes.saturating_add(encoded.working_bytes);
            work_pixels = work_pixels.saturating_add(encoded.work_pixels);
            self.check(working_bytes, budget).is_ok()
                && budget.check_work(work_pixels, work_pixels).is_ok()
        });
        fits.count().max(1)
    }

    fn put(&mut self, index: usize, decoded: Result<Decoded, Fault>) {
        if let Ok(Decoded { image, .. }) = &decoded {
            let pixels = image.rgba.len() as u64;
            self.largest.push((pixels, index));
            self.pixels += pixels;
            self.pixels_in_file += pixels;
        }
        self.decoded[index] = Some(decoded);
    }

    /// False if none has more than one pixel.
    fn halve_largest(&mut self, encodings: &[Encoding]) -> bool {
        let Some((pixels, index)) = self.largest.pop().filter(|&(pixels, _)| pixels > 1) else {
            return false;
        };
        let Some(Ok(Decoded { image, .. })) = &mut self.decoded[index] else {
            unreachable!("it has been decoded");
        };
        *image = image.half(encodings[index]);
        let halved = image.rgba.len() as u64;
        self.largest.push((halved, index));
        self.pixels = self.pixels - pixels + halved;
        self.is_reduced[index] = true;
        true
    }
}

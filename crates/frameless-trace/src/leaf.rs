//! What lies in the leaves: up to four triangles with the vertices that they share, one after another in memory without gaps.
//!
//! In words of 32 bits, for n triangles with m vertices, the first and second of which are
//!
//! ```text
//! bits         0–3 … 12–15    16–19 … 28–31
//! word 0       B of each      C of each            which of the m vertices are a triangle's second and third
//! word 1       A of each      16–18: m − 1; 19–20: n − 1
//! ```
//!
//! and after them n numbers of triangles, m times x, m times y, m times z. Of neighbours four share six vertices: 25 bytes per triangle
//! instead of 40 that a triangle takes alone. Lanes without a triangle repeat the last one.

use glam::Vec3;

/// Triangles of a leaf at most.
pub(crate) const MOST_TRIANGLES: usize = 4;
/// Its vertices at most: as many as a vector register has lanes.
pub(crate) const MOST_VERTICES: usize = 8;
const HEADER: usize = 2;
/// No leaf is longer, nor is what is read of it: eight of each coordinate, however many are used.
pub(crate) const LONGEST: usize = HEADER + MOST_TRIANGLES + 3 * MOST_VERTICES;

/// Corners with one name are one vertex.
pub(crate) type Name = [u32; 3];

/// A corner of a triangle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Corner {
    pub(crate) at: Vec3,
    pub(crate) name: Name,
}

/// How many vertices these triangles have together.
pub(crate) fn vertices(triangles: &[[Name; 3]]) -> usize {
    let all = triangles.as_flattened();
    (0..all.len()).filter(|&k| !all[..k].contains(&all[k])).count()
}

/// Appends a leaf to `words`; returns where it is.
///
/// # Panics
/// If it has more triangles or vertices than there may be.
pub(crate) fn write(words: &mut Vec<u32>, triangles: &[(u32, [Corner; 3])]) -> usize {
    assert!((1..=MOST_TRIANGLES).contains(&triangles.len()), "{} triangles", triangles.len());
    let mut vertices = Distinct { corners: [triangles[0].1[0]; 3 * MOST_TRIANGLES], count: 0 };
    let mut corners = [[0u32; 3]; MOST_TRIANGLES];
    for (lane, corners) in corners.iter_mut().enumerate() {
        let (_, triangle) = &triangles[lane.min(triangles.len() - 1)];
        *corners = triangle.map(|corner| vertices.place_of(corner) as u32);
    }
    let vertices = &vertices.corners[..vertices.count];
    assert!(vertices.len() <= MOST_VERTICES, "{} vertices", vertices.len());
    let lanes = |corner: usize| {
        (0..MOST_TRIANGLES).map(|lane| corners[lane][corner] << (4 * lane)).sum::<u32>()
    };
    let counts = (vertices.len() as u32 - 1) | (triangles.len() as u32 - 1) << 3;
    let place = words.len();
    words.extend([lanes(1) | lanes(2) << 16, lanes(0) | counts << 16]);
    words.extend(triangles.iter().map(|triangle| triangle.0));
    for axis in 0..3 {
        words.extend(vertices.iter().map(|vertex| vertex.at[axis].to_bits()));
    }
    place
}

/// Corners with different names.
struct Distinct {
    corners: [Corner; 3 * MOST_TRIANGLES],
    count: usize,
}

impl Distinct {
    /// Where a corner is, after it has been added if it was not there.
    fn place_of(&mut self, corner: Corner) -> usize {
        let known = self.corners[..self.count].iter().position(|one| one.name == corner.name);
        known.unwrap_or_else(|| {
            self.corners[self.count] = corner;
            self.count += 1;
            self.count - 1
        })
    }
}

/// Where in the words of a leaf that begins at `place` its vertices are: the x of the first, and how many.
pub(crate) fn vertices_at(words: &[u32], place: usize) -> (usize, usize) {
    let leaf = Leaf::at(words, place);
    (place + leaf.first_vertex(), leaf.vertices())
}

/// A leaf to look into.
#[derive(Clone, Copy)]
pub(crate) struct Leaf<'a>(&'a [u32; LONGEST]);

impl<'a> Leaf<'a> {
    /// # Panics
    /// If there are fewer than [`LONGEST`] words from there on.
    #[inline(always)]
    pub(crate) fn at(words: &'a [u32], place: usize) -> Leaf<'a> {
        Leaf(words[place..].first_chunk().expect("words are padded"))
    }

    #[inline(always)]
    pub(crate) fn words(self) -> &'a [u32; LONGEST] {
        self.0
    }

    /// n: 1 to 4.
    #[inline(always)]
    pub(crate) fn triangles(self) -> usize {
        (self.0[1] >> 19 & 3) as usize + 1
    }

    /// m: 1 to 8.
    #[inline(always)]
    pub(crate) fn vertices(self) -> usize {
        (self.0[1] >> 16 & 7) as usize + 1
    }

    /// Where its vertices begin: at most word 6.
    #[inline(always)]
    pub(crate) fn first_vertex(self) -> usize {
        HEADER + self.triangles()
    }

    /// The number of the triangle in a lane.
    #[inline(always)]
    pub(crate) fn triangle(self, lane: usize) -> u32 {
        self.0[HEADER + lane % MOST_TRIANGLES]
    }

    /// Per lane which vertices are second and third: four bits each.
    #[inline(always)]
    pub(crate) fn second_and_third(self) -> u32 {
        self.0[0]
    }

    /// Per lane which vertices are third and first.
    #[inline(always)]
    pub(crate) fn third_and_first(self) -> u32 {
        self.0[0] >> 16 | self.0[1] << 16
    }

    /// Which of its vertices is a corner of the triangle in a lane.
    #[inline(always)]
    pub(crate) fn vertex_of(self, lane: usize, corner: usize) -> usize {
        let places = match corner {
            0 => self.0[1],
            1 => self.0[0],
            _ => self.0[0] >> 16,
        };
        (places >> (4 * (lane % MOST_TRIANGLES)) & 7) as usize
    }

    /// A corner of the triangle in a lane.
    #[inline(always)]
    pub(crate) fn corner(self, lane: usize, corner: usize) -> [f32; 3] {
        let (first, count) = (self.first_vertex(), self.vertices());
        let place = first + self.vertex_of(lane, corner);
        [0, 1, 2].map(|axis| f32::from_bits(self.0[place + axis * count]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn corner(k: u32) -> Corner {
        Corner { at: Vec3::new(k as f32, -(k as f32), 0.5), name: [k, 0, 0] }
    }

    #[test]
    fn what_is_written_is_read() {
        let strip: Vec<(u32, [Corner; 3])> =
            (0..4).map(|k| (100 + k, [k, k + 1, k + 2].map(corner))).collect();
        let apart: Vec<(u32, [Corner; 3])> =
            (0..2).map(|k| (7 * k, [3 * k, 3 * k + 1, 3 * k + 2].map(corner))).collect();
        let mut words = Vec::new();
        let lists = [&strip[..], &strip[..3], &apart[..], &strip[..1]];
        let places = lists.map(|list| write(&mut words, list));
        assert_eq!(places, [0, 24, 24 + 20, 24 + 20 + 22]);
        words.resize(words.len() + LONGEST, 0);
        for (list, place) in lists.into_iter().zip(places) {
            let leaf = Leaf::at(&words, place);
            assert_eq!(leaf.triangles(), list.len());
            let names: Vec<[Name; 3]> = list.iter().map(|(_, t)| t.map(|c| c.name)).collect();
            assert_eq!(leaf.vertices(), vertices(&names));
            for lane in 0..4 {
                let (number, triangle) = &list[lane.min(list.len() - 1)];
                for (k, corner) in triangle.iter().enumerate() {
                    assert_eq!(leaf.corner(lane, k), corner.at.to_array());
                }
                assert!(lane >= list.len() || leaf.triangle(lane) == *number);
            }
        }
    }
}

//! Which material each triangle of a mesh has. Files give one to whole primitives, so that a number for each triangle would be four bytes
//! of a million that say the same.

use std::fmt;
use std::ops::Index;

/// A material's index per triangle, stored once for every run of triangles that have the same.
#[derive(Clone, Default, PartialEq, Eq)]
pub struct TriangleMaterials {
    /// None of them empty, neighbours of different materials.
    runs: Vec<Run>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Run {
    /// The first triangle that is not of it.
    end: u32,
    material: u32,
}

impl TriangleMaterials {
    /// The same for all of so many triangles.
    pub fn all(material: u32, count: usize) -> TriangleMaterials {
        let mut all = TriangleMaterials::default();
        all.resize(count, material);
        all
    }

    /// How many triangles have one.
    pub fn len(&self) -> usize {
        self.runs.last().map_or(0, |run| run.end as usize)
    }

    /// Whether none has.
    pub fn is_empty(&self) -> bool {
        self.runs.is_empty()
    }

    /// As that of [`Vec`]: triangles that are new get `material`.
    ///
    /// # Panics
    /// If there are 2³² triangles.
    pub fn resize(&mut self, count: usize, material: u32) {
        let count = u32::try_from(count).expect("less than 2³² triangles");
        while self.runs.last().is_some_and(|run| run.end > count) {
            let before = self.runs.len().checked_sub(2).map_or(0, |before| self.runs[before].end);
            match self.runs.last_mut() {
                Some(last) if before < count => last.end = count,
                _ => drop(self.runs.pop()),
            }
        }
        match self.runs.last_mut() {
            Some(last) if last.end == count => {}
            Some(last) if last.material == material => last.end = count,
            None if count == 0 => {}
            _ => self.runs.push(Run { end: count, material }),
        }
    }

    /// A triangle's, if it has one.
    #[inline]
    pub fn get(&self, triangle: usize) -> Option<&u32> {
        (triangle < self.len()).then(|| &self[triangle])
    }

    /// One by one.
    pub fn iter(&self) -> impl Iterator<Item = u32> + '_ {
        let mut end = 0;
        self.runs.iter().flat_map(move |run| {
            let begin = std::mem::replace(&mut end, run.end);
            std::iter::repeat_n(run.material, (run.end - begin) as usize)
        })
    }

    /// All that there are, some perhaps several times.
    pub fn used(&self) -> impl Iterator<Item = u32> + '_ {
        self.runs.iter().map(|run| run.material)
    }

    /// What it takes of memory.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.runs[..])
    }
}

/// # Panics
/// If no triangle has any; else of a triangle that does not exist, with what is right for none.
impl Index<usize> for TriangleMaterials {
    type Output = u32;

    #[inline]
    fn index(&self, triangle: usize) -> &u32 {
        match &self.runs[..] {
            [only] => &only.material,
            runs => &runs[runs.partition_point(|run| run.end as usize <= triangle)].material,
        }
    }
}

/// As the array that it stands for: what knows a scene by its text knows it still.
impl fmt::Debug for TriangleMaterials {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_list().entries(self.iter()).finish()
    }
}

impl FromIterator<u32> for TriangleMaterials {
    fn from_iter<I: IntoIterator<Item = u32>>(materials: I) -> TriangleMaterials {
        let mut all = TriangleMaterials::default();
        for (before, material) in materials.into_iter().enumerate() {
            all.resize(before + 1, material);
        }
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_went_in_comes_out_and_neighbours_share() {
        let list = [3, 3, 3, 0, 7, 7, 3];
        let materials: TriangleMaterials = list.into_iter().collect();
        assert!(materials.iter().eq(list));
        assert!((0..list.len()).all(|k| materials[k] == list[k]));
        assert!(materials.used().eq([3, 0, 7, 3]));
        assert_eq!(format!("{materials:?}"), format!("{list:?}"));
        assert_eq!((materials.len(), materials.get(6), materials.get(7)), (7, Some(&3), None));
    }

    #[test]
    fn resizing_is_that_of_an_array() {
        let (mut materials, mut list) = (TriangleMaterials::default(), Vec::new());
        for (count, material) in
            [(0, 1), (2, 1), (5, 1), (6, 2), (6, 3), (4, 9), (5, 1), (5, 2), (0, 1), (1, 4)]
        {
            materials.resize(count, material);
            list.resize(count, material);
            assert!(materials.iter().eq(list.iter().copied()), "{count} {material}");
            assert_eq!((materials.len(), materials.is_empty()), (count, count == 0));
        }
    }
}

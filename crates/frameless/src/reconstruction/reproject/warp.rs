//! The forward step: every sample whose object moves goes to where its surface is now.
//!
//! The samples that move are lifted out of their cells, and put down again where they are now ([`carry`]); all others stay where they
//! are. So it is with samples that move and whose cells have been taken by new ones since the last refresh.
//! Where two samples meet in a cell, the nearer one stays if it is nearer by 1.5 %, unless a ray has gone [`past`] it. On the same surface
//! the newer one stays, and the other moves to the neighbouring cell on its side, if that is a gap in its object: empty, and the object is
//! beyond it, too, at once or after one more empty cell. (At the object's edge it would make the object a pixel wider.)
//!
//! Bands of rows are carried side by side; a sample that leaves its band is put down when all of them have been carried. Bands are
//! the same whatever the number of threads, and so is what comes out.

mod carry;
mod past;

use std::ops::Range;
use std::sync::Mutex;

use super::cells::Cells;
use super::store::{self, Layout, Record, SCREEN, Sample, Shading, Store, Surfel};
use crate::spare::give_back_but;
use crate::{bands, wide};

use carry::{Band, Carry, Lifted};
pub(super) use past::Motion;
use past::Ray;

/// Depths within this ratio belong to the same surface.
const SAME_SURFACE: f32 = 0.015;

/// The first cell lies in the border, so that no sample is ever there.
const NOWHERE: u32 = 0;
/// Neither inside a picture nor NaN.
const GONE_PX: f32 = -1.0;

/// Rows of a band: few samples leave it, and eight threads have something to do with a small picture.
const BAND_ROWS: usize = 64;
/// So many samples later the cell that is prefetched is used.
const AHEAD: usize = 12;
/// So many displaced samples are carried at a time.
const CHUNK: usize = 4096;

/// See the module.
#[derive(Default)]
pub(super) struct Warp {
    /// Samples that move, and whose cells others have taken since the last refresh.
    displaced: Vec<Displaced>,
    /// How many have lost their cells at the last refresh, at the most in a band. Room for them, and for what has been lifted, is kept
    /// no longer than a refresh takes: it may be as much as a fifth of the store.
    losers: usize,
}

/// What is left to do when samples of a band have been carried.
struct Moved {
    /// Samples that came to another band, or to a row that had not been lifted.
    early: Vec<(u32, Mover)>,
    losers: Vec<Loser>,
}

/// One sample on its way.
#[derive(Clone, Copy)]
struct Mover {
    /// Where in the picture, in pixels; [`GONE_PX`] outside.
    px: [f32; 2],
    object: u32,
    primitive: u32,
    record: Record,
    surfel: Surfel,
    shading: Shading,
}

/// The same, where it is kept meanwhile.
#[derive(Clone, Copy)]
struct Moving<'a> {
    px: [f32; 2],
    object: u32,
    primitive: u32,
    record: &'a Record,
    surfel: &'a Surfel,
    shading: &'a Shading,
}

/// A sample whose cell a ray has taken.
#[derive(Clone, Copy)]
struct Displaced {
    mover: Mover,
    by: Ray,
}

/// Who lost its cell, the one beside it where there may be room, and the one beyond that.
type Loser = ([u32; 2], Mover);

impl Mover {
    #[inline(always)]
    fn moving(&self) -> Moving<'_> {
        let Mover { px, object, primitive, record, surfel, shading } = self;
        Moving { px: *px, object: *object, primitive: *primitive, record, surfel, shading }
    }
}

impl Moving<'_> {
    #[inline(always)]
    fn mover(&self) -> Mover {
        let Moving { px, object, primitive, record, surfel, shading } = *self;
        Mover { px, object, primitive, record: *record, surfel: *surfel, shading: *shading }
    }
}

impl Warp {
    /// `rests`: of an object number, whether its samples stay where they are.
    pub(super) fn run(
        &mut self,
        store: &mut Store,
        motion: &Motion<'_>,
        threads: usize,
        rests: impl Fn(u32) -> bool + Sync,
    ) {
        let mut bands = self.carry_bands(store, motion, threads, rests);
        self.carry_displaced(motion, threads);
        let late = self.put_down_early(store, motion, &mut bands);
        self.losers = bands.iter().map(|band| band.losers.len()).max().unwrap_or(0);
        let of_bands = bands.iter().map(|band| &band.losers);
        of_bands.chain([&late]).for_each(|losers| step_aside(store, losers));
    }

    /// Takes the sample in a cell away until the next refresh: it moves, and somebody else is there now. Beyond as many as there are
    /// cells, while nobody asks for a picture, samples are lost.
    /// `by`: the other.
    pub(super) fn displace(&mut self, store: &mut Store, cell: usize, by: &Sample) {
        if self.displaced.len() < store.layout.len() {
            let mover = at(&Cells::of(store), cell, by.px);
            self.displaced.push(Displaced { mover, by: Ray::of(by) });
            store.remove(cell);
        }
    }

    pub(super) fn has_displaced(&self) -> bool {
        !self.displaced.is_empty()
    }

    fn carry_bands(
        &self,
        store: &mut Store,
        motion: &Motion<'_>,
        threads: usize,
        rests: impl Fn(u32) -> bool + Sync,
    ) -> Vec<Moved> {
        let (layout, rests) = (store.layout, &rests);
        let height = layout.size.height as usize;
        // With several cells per pixel those of a row do not lie together.
        let rows = if layout.per_side == 1 { BAND_ROWS } else { height };
        let new = || Moved { early: Vec::new(), losers: Vec::with_capacity(self.losers) };
        let mut moved: Vec<Moved> = (0..height.div_ceil(rows)).map(|_| new()).collect();
        // Rows of each thread.
        let lifted = Mutex::<Vec<Lifted>>::default();
        let mut rest = Cells::of(store);
        rest.split_off_first(layout.row(0));
        let bands = moved.iter_mut().zip((0..height).step_by(rows)).map(|(moved, row)| {
            let rows = row..(row + rows).min(height);
            let count = if layout.per_side == 1 { rows.len() * layout.stride } else { usize::MAX };
            let cells = rest.split_off_first(count);
            let first = layout.row(row as i32);
            Band { rows: rows.start as i32..rows.end as i32, cells, first, moved }
        });
        bands::run(threads, bands.collect(), |band| {
            let mut rows = with(&lifted, Vec::pop).unwrap_or_default();
            wide::run(Carry { layout, motion, rests, band, lifted: &mut rows });
            with(&lifted, |unused| unused.push(rows));
        });
        moved
    }

    /// To where their surfaces are now, or out of the picture; out of it, too, if the ray that has taken their cell has gone past them.
    fn carry_displaced(&mut self, motion: &Motion<'_>, threads: usize) {
        let chunks = self.displaced.chunks_mut(CHUNK).collect();
        bands::run(threads, chunks, |chunk: &mut [Displaced]| {
            for Displaced { mover, by } in chunk {
                let is_behind = by.is_behind(mover.record.depth(), SAME_SURFACE);
                let surface = store::surface(mover.object, mover.primitive, &mover.surfel);
                match motion.now().project(&surface) {
                    Some(there) => {
                        mover.px = there.px;
                        mover.record.set_offset(store::from_centre(there.px));
                        mover.record.set_depth(there.depth);
                    }
                    None => mover.px = [GONE_PX; 2],
                }
                if is_behind && motion.is_past(by, [0.0; 2], &mover.moving()) {
                    mover.px = [GONE_PX; 2];
                }
            }
        });
    }

    /// Returns who loses a cell by that.
    fn put_down_early(
        &mut self,
        store: &mut Store,
        motion: &Motion<'_>,
        bands: &mut [Moved],
    ) -> Vec<Loser> {
        let (displaced, losers) = (&mut self.displaced, &mut Vec::new());
        let layout = store.layout;
        let cells = &mut Cells::of(store);
        let everywhere = &(0..layout.plane as u32);
        for (cell, mover) in bands.iter_mut().flat_map(|band| band.early.drain(..)) {
            let mut losing =
                Losing { layout: &layout, motion, lifted: everywhere, first: 0, losers };
            put_down(cells, cell as usize, &mover.moving(), &mut losing);
        }
        for (i, Displaced { mover, .. }) in displaced.iter().enumerate() {
            if let Some(later) = displaced.get(i + AHEAD)
                && let Some(cell) = layout.of_px(later.mover.px)
            {
                cells.prefetch(cell);
            }
            if let Some(cell) = layout.of_px(mover.px) {
                let mut losing =
                    Losing { layout: &layout, motion, lifted: everywhere, first: 0, losers };
                put_down(cells, cell, &mover.moving(), &mut losing);
            }
        }
        let used = displaced.len();
        displaced.clear();
        give_back_but(displaced, used);
        std::mem::take(losers)
    }
}

/// Who lost its cell goes to the one beside it, if that is a gap in its object.
fn step_aside(store: &mut Store, losers: &[Loser]) {
    let layout = store.layout;
    let cells = &mut Cells::of(store);
    for (i, ([cell, beyond], loser)) in losers.iter().enumerate() {
        if let Some(([later, _], _)) = losers.get(i + AHEAD) {
            cells.prefetch(*later as usize);
        }
        let [cell, beyond] = [*cell, *beyond].map(|cell| cell as usize);
        let goes_on = |cell: usize| cells.object.get(cell) == Some(&loser.object);
        // Where samples are few a gap is two cells wide.
        let next = (beyond + beyond).wrapping_sub(cell);
        let is_wide = layout.per_side == 1 && cells.is_empty(beyond) && goes_on(next);
        if cells.is_empty(cell) && (goes_on(beyond) || is_wide) {
            let (x, y) = layout.pixel_of(cell);
            let [px, py] = loser.px;
            let mut record = loser.record;
            record.set_offset([px - x as f32 - 0.5, py - y as f32 - 0.5]);
            cells.touched.mark(x, y);
            put(cells, cell, &Moving { record: &record, ..loser.moving() });
        }
    }
}

/// Threads that panic leave nothing behind that is half done.
fn with<T, R>(shared: &Mutex<T>, work: impl FnOnce(&mut T) -> R) -> R {
    work(&mut shared.lock().unwrap_or_else(|poisoned| poisoned.into_inner()))
}

/// What becomes of those that lose their cells.
struct Losing<'a> {
    layout: &'a Layout,
    motion: &'a Motion<'a>,
    /// Cells of the first sub-grid, and those above them in others: whoever is in one of these now is there to stay, or somebody else is.
    lifted: &'a Range<u32>,
    /// The number of the first of the cells.
    first: usize,
    losers: &'a mut Vec<Loser>,
}

impl Losing<'_> {
    /// Nobody goes where somebody is already.
    #[inline(always)]
    fn push(&mut self, cells: &Cells<'_>, loser: &Mover) {
        let Some([cell, beyond]) = beside(self.layout, loser.px) else { return };
        let is_lifted = self.lifted.contains(&(self.layout.in_plane(cell) as u32));
        if !is_lifted || cells.is_empty(cell - self.first) {
            self.losers.push(([cell as u32, beyond as u32], *loser));
        }
    }
}

/// The cell beside the one of a position in the picture, on its side, and the one beyond that.
#[inline(always)]
fn beside(layout: &Layout, [x, y]: [f32; 2]) -> Option<[usize; 2]> {
    let n = layout.per_side as i32;
    let [x, y] = [x * n as f32, y * n as f32];
    // Positions in the picture are not negative.
    let [column, row] = [x as i32, y as i32];
    let [fx, fy] = [x - column as f32 - 0.5, y - row as f32 - 0.5];
    // Looked up, since nobody can guess it.
    let downwards = usize::from(fx.abs() <= fy.abs());
    let sign = ([fx, fy][downwards].to_bits() >> 31) as i32;
    let step = 1 - 2 * sign;
    let (at, end) = ([column, row][downwards], [layout.size.width, layout.size.height][downwards]);
    let inside = 0..n * end as i32;
    if !(inside.contains(&(at + step)) && inside.contains(&(at + 2 * step))) {
        return None;
    }
    let [dx, dy] = [[step, 0], [0, step]][downwards];
    Some([1, 2].map(|steps| layout.neighbour(0, 0, column + steps * dx, row + steps * dy)))
}

/// One sample to its new cell, if it stays there.
#[inline(always)]
fn put_down(cells: &mut Cells<'_>, cell: usize, mover: &Moving<'_>, losing: &mut Losing<'_>) {
    cells.touched.mark_px(mover.px);
    let motion = losing.motion;
    if cells.is_empty(cell) {
        // Who was there is somewhere else now, but where its ray went is still known.
        if !motion.last_is_past(&cells.record[cell], mover) {
            put(cells, cell, mover);
        }
    } else {
        meet(cells, cell, mover, losing);
    }
}

/// One sample to a cell in which another is.
// Few samples meet; those that do not are to be put down fast.
#[inline(never)]
fn meet(cells: &mut Cells<'_>, cell: usize, mover: &Moving<'_>, losing: &mut Losing<'_>) {
    let motion = losing.motion;
    let (here, there) = (mover.record.depth(), cells.record[cell].depth());
    let on_screen = cells.object[cell] == SCREEN;
    if !on_screen && here < there * (1.0 - SAME_SURFACE) {
        match motion.sample_is_past(&at(cells, cell, mover.px).moving(), mover) {
            true => losing.push(cells, &mover.mover()),
            false => put(cells, cell, mover),
        }
        return;
    }
    if !on_screen && here > there * (1.0 + SAME_SURFACE) {
        let other = at(cells, cell, mover.px);
        if motion.sample_is_past(mover, &other.moving()) {
            losing.push(cells, &other);
            put(cells, cell, mover);
        }
        return;
    }
    let samples = [mover.mover(), at(cells, cell, mover.px)];
    let later = usize::from(!mover.record.tick().is_later_than(cells.record[cell].tick()));
    losing.push(cells, &samples[1 - later]);
    put(cells, cell, &samples[later].moving());
}

/// The sample in a cell of the pixel at a position in the picture.
#[inline(always)]
fn at(cells: &Cells<'_>, cell: usize, pixel_px: [f32; 2]) -> Mover {
    let (record, offset) = (cells.record[cell], cells.record[cell].offset());
    Mover {
        px: [0, 1].map(|k| pixel_px[k] as i32 as f32 + 0.5 + offset[k]),
        object: cells.object[cell],
        primitive: cells.primitive(cell),
        record,
        surfel: cells.surfel[cell],
        shading: cells.shading(cell),
    }
}

/// Into a cell, instead of who is there.
#[inline(always)]
fn put(cells: &mut Cells<'_>, cell: usize, mover: &Moving<'_>) {
    cells.record[cell] = *mover.record;
    cells.surfel[cell] = *mover.surfel;
    cells.object[cell] = mover.object;
    cells.put_rest(cell, mover.shading, mover.primitive);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reconstruction::reproject::store::Tick;
    use crate::{Pose, Projection, Size};

    /// Takes x of object 0 to column `scale` · x + `shift`.
    fn pose(scale: f32, shift: f32) -> Pose {
        let projection = Projection([
            [scale, 0.0, 0.0, shift],
            [0.0, 1.0, 0.0, 0.0],
            [0.0, 0.0, 0.0, 1.0],
            [0.0, 0.0, 0.0, 1.0],
        ]);
        Pose { picture_from_object: vec![projection], ..Pose::default() }
    }

    fn sample_at(x: f32, tick: u32) -> Sample {
        let surfel = Surfel::new([x, 0.5, 0.0], [0.0; 3]);
        Sample { surfel, ..Sample::at([x, 0.5], 0.0, tick) }
    }

    /// Samples of object 0 at positions x of a row of eight pixels, each newer than the one before, where a pose that makes everything
    /// half as wide takes them.
    fn halved(positions: &[f32]) -> Vec<Option<(u32, f32)>> {
        let mut store = Store::new(Size::new(8, 1), 1, false);
        (1..).zip(positions).for_each(|(tick, &x)| store.insert(&sample_at(x, tick), false));
        Warp::default().run(&mut store, &Motion::unknown(&pose(0.5, 0.0)), 1, |_| false);
        let cell = |x| store.layout.of_pixel(x, 0);
        let px = |x: i32| x as f32 + 0.5 + store.record[cell(x)].offset()[0];
        let sample = |x| (store.tick(cell(x)).0, px(x));
        (0..8).map(|x| (!store.is_empty(cell(x))).then(|| sample(x))).collect()
    }

    #[test]
    fn who_is_displaced_comes_back_where_its_surface_is() {
        let mut store = Store::new(Size::new(8, 1), 1, true);
        let cell = |store: &Store, x: f32| store.layout.of_px([x, 0.5]).expect("inside");
        let (old, gone) = (cell(&store, 1.5), cell(&store, 7.5));
        for (i, x) in [(old, 1.5), (gone, 7.5)] {
            store.insert(&sample_at(x, 1), false);
            store.shading[i].0[5] = f32::from_bits(7);
        }
        let mut warp = Warp::default();
        for (i, x) in [(old, 1.2), (gone, 7.8)] {
            warp.displace(&mut store, i, &Sample { px: [x, 0.9], ..sample_at(x, 2) });
            // Something at rest has been traced there.
            store.object[i] = SCREEN;
        }
        // Three to the right: one of the two leaves the picture.
        warp.run(&mut store, &Motion::unknown(&pose(1.0, 3.0)), 1, |object| object == SCREEN);
        let now = cell(&store, 4.5);
        assert_eq!((store.object[now], store.record[now].offset()[0]), (0, 0.0));
        assert_eq!(store.shading[now].lit(), 7);
        assert_eq!((store.object[old], store.object[gone]), (SCREEN, SCREEN));
    }

    #[test]
    fn who_loses_its_cell_steps_aside_into_a_gap() {
        // 0.25 and 0.75 meet in the first cell: the newer stays, the other goes to its right, since beyond that there is the object, too.
        let [stays, aside] = [Some((2, 0.25)), Some((1, 0.75))];
        assert_eq!(halved(&[1.5, 0.5, 4.5])[..3], [stays, aside, Some((3, 2.25))]);
        // To the left there is nothing.
        assert_eq!(halved(&[0.5, 1.5])[..2], [Some((2, 0.75)), None]);
        // And here the cell to the right is taken.
        assert_eq!(halved(&[1.5, 0.5, 2.5, 4.5])[..2], [stays, Some((3, 1.25))]);
    }

    #[test]
    fn an_object_is_no_wider_than_its_cells() {
        assert_eq!(halved(&[1.5, 0.5])[..3], [Some((2, 0.25)), None, None]);
    }

    /// Whether a sample of object 0 that has come to a column of the second pixel is still there, `moved` since the refresh before, after a
    /// ray at half of that time has passed at `ray` and gone on to something twice as far away.
    fn is_there(column: f32, moved: f32, ray: f32) -> bool {
        let poses = [pose(1.0, 0.0), pose(1.0, -moved)];
        let ticks = [Tick(200), Tick(100)];
        let motion = Motion { poses: poses.each_ref(), ticks, is_known: true };
        let mut store = Store::new(Size::new(8, 1), 1, false);
        let mut warp = Warp::default();
        // As at the refresh before; at depth 1.
        let near = Sample { px: [column - moved, 0.5], ..sample_at(column, 50) };
        let near = Sample {
            record: Record::new(store::from_centre(near.px), 1.0, Tick(50), [0.5; 3], 0),
            ..near
        };
        store.insert(&near, false);
        let behind = Record::new(store::from_centre([ray, 0.5]), 2.0, Tick(150), [0.5; 3], 0);
        let far = Sample { object: SCREEN, px: [ray, 0.5], record: behind, ..near };
        let cell = store.layout.of_px(far.px).expect("inside");
        if !store.is_empty(cell) {
            warp.displace(&mut store, cell, &far);
        }
        store.insert(&far, false);
        // What the ray has hit goes away, as a background before which the camera turns.
        store.object[cell] = 1;
        warp.run(&mut store, &motion, 1, |_| false);
        !store.is_empty(store.layout.of_pixel(1, 0))
    }

    #[test]
    fn a_ray_that_has_gone_past_an_object_tells_where_it_ends() {
        // It rests, and the ray went through the centre, or not quite; or farther away from it than twice as far.
        assert!(!is_there(1.2, 0.0, 1.5));
        assert!(!is_there(1.2, 0.0, 1.9));
        assert!(is_there(1.4, 0.0, 1.9));
        // Carried along for half a pixel with the object, the ray's place lies beside the centre, and beyond it.
        assert!(!is_there(1.2, 1.0, 1.1));
        assert!(is_there(1.4, 0.8, 1.4));
    }

    const SIZE: Size = Size { width: 64, height: 48 };
    const FOCAL_PX: f64 = 60.0;
    const MIDDLE: [f64; 2] = [32.0, 24.0];
    /// Of the plane, and of the sphere's centre, before the camera.
    const AWAY: f64 = 5.0;

    /// Where a camera at the origin that looks along −z sees a point.
    fn seen([x, y, z]: [f64; 3], zoom: f64) -> [f64; 2] {
        [MIDDLE[0] - zoom * FOCAL_PX * x / z, MIDDLE[1] + zoom * FOCAL_PX * y / z]
    }

    /// The point that is seen through a pixel's centre: on the plane z = −[`AWAY`], or on the unit sphere before it.
    fn hit(x: u32, y: u32, on_sphere: bool) -> Option<[f64; 3]> {
        let centre = [x, y].map(|p| f64::from(p) + 0.5);
        let ray = [(centre[0] - MIDDLE[0]) / FOCAL_PX, (MIDDLE[1] - centre[1]) / FOCAL_PX, -1.0];
        let length2: f64 = ray.iter().map(|d| d * d).sum();
        // |t · ray − centre|² = 1
        let root = (AWAY * AWAY - length2 * (AWAY * AWAY - 1.0)).sqrt();
        let t = if on_sphere { (AWAY - root) / length2 } else { AWAY };
        t.is_finite().then(|| ray.map(|d| t * d))
    }

    /// Carries what is hit through every second pixel by `projection`, and says how much of what should be inside the picture is found
    /// where `expected` says.
    fn share_found(
        on_sphere: bool,
        projection: [[f64; 4]; 4],
        expected: impl Fn([f64; 3]) -> [f64; 2],
    ) -> f64 {
        let mut store = Store::new(SIZE, 1, false);
        let mut wanted = Vec::new();
        for (x, y) in (0..48).step_by(2).flat_map(|y| (0..64).step_by(2).map(move |x| (x, y))) {
            let Some(point) = hit(x, y, on_sphere) else { continue };
            let cell = store.layout.of_pixel(x as i32, y as i32);
            let surfel = Surfel::new(point.map(|p| p as f32), [0.0; 3]);
            store.set(cell, &Sample { surfel, ..Sample::at([0.0; 2], 0.0, wanted.len() as u32) });
            wanted.push(expected(point));
        }
        let projection = Projection(projection.map(|row| row.map(|number| number as f32)));
        let pose = Pose { picture_from_object: vec![projection], ..Pose::default() };
        Warp::default().run(&mut store, &Motion::unknown(&pose), 1, |_| false);
        let mut found = 0.0;
        for cell in (0..store.layout.len()).filter(|&cell| !store.is_empty(cell)) {
            let ((x, y), offset) = (store.layout.pixel_of(cell), store.record[cell].offset());
            let px = [x as f32 + 0.5 + offset[0], y as f32 + 0.5 + offset[1]];
            let wanted = wanted[store.tick(cell).0 as usize];
            let off = (0..2).map(|k| (f64::from(px[k]) - wanted[k]).abs()).fold(0.0, f64::max);
            assert!(off < 1e-3, "at {px:?} instead of {wanted:?}");
            found += 1.0;
        }
        let inside = |px: &&[f64; 2]| (0.0..64.0).contains(&px[0]) && (0.0..48.0).contains(&px[1]);
        found / wanted.iter().filter(inside).count() as f64
    }

    /// [`seen`] as a matrix, after the camera has moved by `by` to the right and has been turned to the right.
    fn camera(by: f64, turn_rad: f64, zoom: f64) -> [[f64; 4]; 4] {
        let (sin, cos) = turn_rad.sin_cos();
        // Rows of the camera's coordinates from the world's.
        let right = [cos, 0.0, sin, -by * cos];
        let up = [0.0, 1.0, 0.0, 0.0];
        let back = [-sin, 0.0, cos, by * sin];
        let (f, [mx, my]) = (zoom * FOCAL_PX, MIDDLE);
        let sum = |a: f64, row: [f64; 4], b: f64| std::array::from_fn(|k| a * row[k] - b * back[k]);
        [sum(f, right, mx), sum(-f, up, my), sum(0.0, up, 1.0), sum(0.0, up, 1.0)]
    }

    #[test]
    fn samples_of_a_plane_and_a_sphere_go_where_geometry_says() {
        for on_sphere in [false, true] {
            // A step to the right: all that is as far away moves as far to the left.
            let found = share_found(on_sphere, camera(0.25, 0.0, 1.0), |[x, y, z]| {
                let [column, row] = seen([x, y, z], 1.0);
                [column + 0.25 * FOCAL_PX / z, row]
            });
            assert!(found > 0.9, "{found}");
            // A turn to the right takes its angle from that to every point.
            let found = share_found(on_sphere, camera(0.0, 0.1, 1.0), |[x, y, z]| {
                let (angle, distance) = (x.atan2(-z) - 0.1, x.hypot(z));
                seen([distance * angle.sin(), y, -distance * angle.cos()], 1.0)
            });
            assert!(found > 0.9, "{found}");
            // A zoom takes everything away from the middle.
            let found = share_found(on_sphere, camera(0.0, 0.0, 1.3), |point| {
                let px = seen(point, 1.0);
                std::array::from_fn(|k| MIDDLE[k] + 1.3 * (px[k] - MIDDLE[k]))
            });
            assert!(found > 0.9, "{found}");
        }
    }

    #[test]
    fn samples_of_a_turning_sphere_go_where_geometry_says() {
        let turn_rad: f64 = 0.2;
        let (sin, cos) = turn_rad.sin_cos();
        // About its own axis, at z = −AWAY.
        let turned = |k: usize| match k {
            0 => [cos, 0.0, sin, AWAY * sin],
            1 => [0.0, 1.0, 0.0, 0.0],
            2 => [-sin, 0.0, cos, AWAY * cos - AWAY],
            _ => [0.0, 0.0, 0.0, 1.0],
        };
        let camera = camera(0.0, 0.0, 1.0);
        let whole =
            camera.map(|row| std::array::from_fn(|k| (0..4).map(|j| row[j] * turned(j)[k]).sum()));
        let found = share_found(true, whole, |[x, y, z]| {
            // Longitude from the axis towards the camera, and distance from the axis.
            let (longitude, radius) = (x.atan2(z + AWAY) + turn_rad, x.hypot(z + AWAY));
            seen([radius * longitude.sin(), y, radius * longitude.cos() - AWAY], 1.0)
        });
        assert!(found > 0.7, "{found}");
    }
}

//! How much a file may ask for, and what it has asked for so far.

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use super::error::{Fault, Place, Problem};

/// Bounds on what one file may make the loader read, allocate and keep. They are checked before anything is allocated,
/// against what the file *declares*, so that a file of a few bytes cannot claim gigabytes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Limits {
    /// Bytes of the scene file, and of each file that it names.
    pub file_bytes: u64,
    /// Bytes of everything decoded together: JSON, buffers, vertices, triangles, keyframes, texels. But for texels, a 16th part of it may be
    /// made of nothing, and beyond that 32 times the bytes of the files, those that nothing refers to left out: whatever a small file names over and over, it remains small.
    pub decoded_bytes: u64,
    /// Triangles of all meshes together, each mesh counted once however often it is instanced.
    pub triangles: u64,
    /// Vertices of all meshes together, counted likewise.
    pub vertices: u64,
    /// Texels of one image.
    pub image_pixels: u64,
    /// Texels of all images together, as they are in the file. Of those that are kept an eighth of it may come of next to nothing, and beyond
    /// that six of each byte.
    pub total_pixels: u64,
    /// Nodes in the file.
    pub nodes: u64,
    /// Nodes between the scene and its deepest node. The walk is iterative, so that depth costs no stack.
    pub node_depth: u64,
    /// Meshes at nodes.
    pub instances: u64,
    /// Punctual lights at nodes: `direct` looks at every one from every point.
    pub lights: u64,
    /// Boxes of nodes and leaves that a ray meets, on average, where surfaces lie on top of each other: on a line twice as many, and two
    /// thirds until a ray that is seen and one to a light have hit something; a picture of 512×384 takes seconds. Whoever prepares the scene for rays
    /// counts them.
    pub overlap: u64,
    /// Keys of all animation channels together.
    pub keyframes: u64,
    /// Brackets around the innermost JSON value; more than 127 are refused in any case.
    pub json_depth: u64,
    /// Values, keys included, in the JSON document; each takes up to about 100 bytes while the file is read, or 64 of `decoded_bytes`.
    pub json_values: u64,
}

impl Default for Limits {
    /// Room for anything that a workstation can trace interactively; about 4 GiB of memory at most.
    fn default() -> Limits {
        Limits {
            file_bytes: 1 << 30,
            decoded_bytes: 4 << 30,
            triangles: 30_000_000,
            vertices: 60_000_000,
            image_pixels: 16_384 * 16_384,
            total_pixels: 500_000_000,
            nodes: 1_000_000,
            node_depth: 200_000,
            instances: 500_000,
            lights: 300,
            overlap: 3_000,
            keyframes: 20_000_000,
            json_depth: 100,
            json_values: 20_000_000,
        }
    }
}

/// What a file has used of its [`Limits`].
#[derive(Debug)]
pub(super) struct Budget {
    pub(super) limits: Limits,
    /// Of the scene's file and those that it names.
    file_bytes: u64,
    /// Of these, those that say something: JSON, and what accessors and pictures are of.
    telling_bytes: u64,
    /// Those that have been read as they are.
    read_bytes: u64,
    bytes: u64,
    image_bytes: u64,
    void_bytes: u64,
    triangles: u64,
    vertices: u64,
    pixels: u64,
    keyframes: u64,
    /// Files that have been counted.
    files: HashSet<PathBuf>,
    /// Of pictures, as they are in the file: so many speak for their pixels.
    picture_bytes: u64,
    /// Of pictures, each time that they are looked through.
    looked_through: u64,
    /// Instances that EXT_mesh_gpu_instancing places.
    placed: u64,
}

impl Budget {
    pub(super) fn new(limits: &Limits) -> Budget {
        Budget {
            limits: limits.clone(),
            file_bytes: 0,
            telling_bytes: 0,
            read_bytes: 0,
            bytes: 0,
            image_bytes: 0,
            void_bytes: 0,
            triangles: 0,
            vertices: 0,
            pixels: 0,
            keyframes: 0,
            files: HashSet::new(),
            picture_bytes: 0,
            looked_through: 0,
            placed: 0,
        }
    }

    /// There is a file of so many bytes, however often it is named: the scene's own has no path.
    pub(super) fn add_file(&mut self, path: &Path, bytes: usize) {
        if self.files.insert(path.to_owned()) {
            self.file_bytes = self.file_bytes.saturating_add(bytes as u64);
        }
    }

    /// So many bytes say something, of which more may be made.
    pub(super) fn tell(&mut self, bytes: u64) {
        self.telling_bytes = self.telling_bytes.saturating_add(bytes);
    }

    /// So many bytes are about to be read as they are, whether they say anything or not.
    pub(super) fn read(&mut self, pointer: &str, bytes: usize) -> Result<(), Fault> {
        self.read_bytes = self.read_bytes.saturating_add(bytes as u64);
        self.allocate(pointer, bytes, 1)
    }

    /// `count` things of `each` bytes are about to be allocated for what stands at `pointer`.
    pub(super) fn allocate(
        &mut self,
        pointer: &str,
        count: usize,
        each: usize,
    ) -> Result<(), Fault> {
        let bytes = (count as u64).saturating_mul(each as u64);
        let limit = self.limits.decoded_bytes.saturating_sub(self.image_bytes);
        within(self.bytes.saturating_add(bytes), limit, "decoded bytes", pointer)
            .map_err(|fault| fault.telling(|came| came.saturating_add(self.image_bytes)))?;
        let ([of_nothing, of_files], what) = (self.made(), "bytes made of few bytes of file");
        spend(&mut self.bytes, bytes, of_nothing.saturating_add(of_files), what, pointer)
            .map_err(|fault| fault.telling(|came| (came - of_files).saturating_mul(MADE_SHARE)))
    }

    /// What may be made of nothing, and beyond that of files that say so much.
    fn made(&self) -> [u64; 2] {
        // Whoever wants less than usual of all does not want less of small files.
        let most = self.limits.decoded_bytes.max(Limits::default().decoded_bytes);
        let of_files = MADE_PER_BYTE.saturating_mul(self.telling_bytes);
        [most / MADE_SHARE, of_files.saturating_add(self.read_bytes)]
    }

    /// The same of an accessor without data, whose elements are zeros until a sparse one replaces some: morph targets that move little.
    pub(super) fn allocate_zeros(
        &mut self,
        pointer: &str,
        count: usize,
        each: usize,
    ) -> Result<(), Fault> {
        /// Of all bytes: by default 32 MiB, in two seconds. A file of 600 bytes could take a minute and 5 GB otherwise.
        const VOID_SHARE: u64 = 128;
        let bytes = (count as u64).saturating_mul(each as u64);
        let limit = self.limits.decoded_bytes / VOID_SHARE;
        spend(&mut self.void_bytes, bytes, limit, "bytes of zeros without data", pointer)
            .map_err(|fault| fault.telling(|came| came.saturating_mul(VOID_SHARE)))?;
        self.allocate(pointer, count, each)
    }

    pub(super) fn add_triangles(&mut self, pointer: &str, count: usize) -> Result<(), Fault> {
        spend(&mut self.triangles, count as u64, self.limits.triangles, "triangles", pointer)
    }

    pub(super) fn add_vertices(&mut self, pointer: &str, count: usize) -> Result<(), Fault> {
        // Triangles name vertices with 32 bits.
        let limit = self.limits.vertices.min(u64::from(u32::MAX));
        spend(&mut self.vertices, count as u64, limit, "vertices", pointer)
    }

    pub(super) fn add_keyframes(&mut self, pointer: &str, count: usize) -> Result<(), Fault> {
        spend(&mut self.keyframes, count as u64, self.limits.keyframes, "keyframes", pointer)
    }

    /// `count` instances of one node are about to be placed, by accessors that may have no data, or share it.
    pub(super) fn place_instances(&mut self, pointer: &str, count: usize) -> Result<(), Fault> {
        /// Of all instances, those that may come from next to nothing: by default 50,000. A file of 800 bytes could place a million.
        const SHARE: u64 = 10;
        /// A place is three numbers of four bytes, or of two, compressed.
        const BYTES_PER_INSTANCE: u64 = 8;
        within(count as u64, self.limits.instances, "instances", pointer)?;
        let of_files = self.file_bytes / BYTES_PER_INSTANCE;
        let limit = self.limits.instances / SHARE + of_files;
        spend(&mut self.placed, count as u64, limit, "instances from few bytes of file", pointer)
            .map_err(|fault| fault.telling(|came| (came - of_files).saturating_mul(SHARE)))
    }

    /// The `bytes` of a picture are about to be looked through: several pictures may be of the same.
    pub(super) fn look_through(&mut self, pointer: &str, bytes: usize) -> Result<(), Fault> {
        /// Of all bytes: by default 64 MiB, a tenth of a second.
        const SHARE: u64 = 64;
        /// How often each byte of the files may be looked at besides.
        const TIMES: u64 = 4;
        let of_files = TIMES.saturating_mul(self.file_bytes);
        let limit = (self.limits.decoded_bytes / SHARE).saturating_add(of_files);
        let what = "bytes of pictures that share them";
        spend(&mut self.looked_through, bytes as u64, limit, what, pointer)
            .map_err(|fault| fault.telling(|came| (came - of_files).saturating_mul(SHARE)))
    }

    /// A picture is there: refuses one that is too large to be decoded.
    pub(super) fn add_image(&mut self, pointer: &str, size: &PictureSize) -> Result<(), Fault> {
        /// Processors of graphics take 16,384 or twice as many; every column and row takes memory of its own when smaller copies are made.
        const SIDE: u64 = 65_536;
        /// Of what is in memory while a pixel is decoded, so much is not worth counting: 375 MB of them all.
        const BYTES_PER_PIXEL: u64 = 6;
        let &PictureSize { pixels: [width, height], decoded_bytes, working_bytes, encoded_bytes } =
            size;
        within(u64::from(width.max(height)), SIDE, "pixels along a side of an image", pointer)?;
        let pixels = u64::from(width) * u64::from(height);
        within(pixels, self.limits.image_pixels, "pixels in one image", pointer)?;
        // Bytes that several pictures are of speak once.
        let told = (encoded_bytes as u64).min(self.file_bytes.saturating_sub(self.picture_bytes));
        self.picture_bytes += told;
        // Those of 16 bits per channel take as much as two.
        let taken = pixels.max(decoded_bytes / 4);
        // What is told is the limit that it would pass if it were kept.
        self.check_thin(pointer, taken, told, SINGLE_SHARE)
            .or_else(|_| self.check_thin(pointer, taken, told, THIN_SHARE))?;
        self.check_thin(pointer, working_bytes / BYTES_PER_PIXEL, told, THIN_SHARE)?;
        spend(&mut self.pixels, pixels, self.limits.total_pixels, "pixels in all images", pointer)?;
        let limit = self.limits.decoded_bytes.saturating_sub(self.bytes);
        within(working_bytes, limit, "decoded bytes", pointer)
            .map_err(|fault| fault.telling(|came| came.saturating_add(self.bytes)))
    }

    /// Refuses so many pixels in all pictures together, as they are kept.
    pub(super) fn check_pixels(&self, pixels: u64) -> Result<(), Fault> {
        self.check_thin("", pixels, self.picture_bytes, THIN_SHARE)?;
        let limit = self.limits.decoded_bytes.saturating_sub(self.bytes);
        within(image_bytes(pixels), limit, "decoded bytes", "")
            .map_err(|fault| fault.telling(|came| came.saturating_add(self.bytes)))
    }

    fn check_thin(&self, pointer: &str, pixels: u64, bytes: u64, share: u64) -> Result<(), Fault> {
        let thin = pixels.saturating_sub(PIXELS_PER_BYTE.saturating_mul(bytes));
        let limit = self.limits.total_pixels / share;
        within(thin, limit, "pixels in images of few bytes", pointer)
            .map_err(|fault| fault.telling(|came| pixels.max(came.saturating_mul(THIN_SHARE))))
    }

    /// Refuses so much work to decode pictures, in pixels; `all` is what there would be for all of them.
    pub(super) fn check_work(&self, pixels: u64, all: u64) -> Result<(), Fault> {
        let of_files = PIXELS_PER_BYTE.saturating_mul(self.picture_bytes);
        let limit = WORK_EIGHTHS.saturating_mul(self.limits.total_pixels / 8);
        if pixels.saturating_sub(of_files) <= limit {
            return Ok(());
        }
        // Any of them may have to be read twice.
        let enough =
            all.max(pixels).saturating_mul(2).saturating_sub(of_files).div_ceil(WORK_EIGHTHS);
        within(
            all.max(pixels),
            limit.saturating_add(of_files),
            "pixels to decode in all images",
            "",
        )
        .map_err(|fault| fault.telling(|_| enough.saturating_mul(8)))
    }

    /// All pictures together are kept so.
    pub(super) fn keep_pixels(&mut self, pixels: u64) {
        self.image_bytes = image_bytes(pixels);
    }

    /// Refuses so many bytes in memory while pictures are decoded: of those that have been, and of those that are.
    pub(super) fn check_decoders(&self, bytes: u64) -> Result<(), Fault> {
        /// By default 437 MB: nearly twice what a picture takes that is as large as all may be together.
        const BYTES_PER_PIXEL: u64 = 7;
        let thin = bytes.saturating_sub(MADE_PER_BYTE.saturating_mul(self.picture_bytes));
        let limit = self.limits.total_pixels / THIN_SHARE;
        within(thin / BYTES_PER_PIXEL, limit, "pixels in images of few bytes", "")
            .map_err(|fault| fault.telling(|came| came.saturating_mul(THIN_SHARE)))?;
        let limit = self.limits.decoded_bytes.saturating_sub(self.bytes);
        within(bytes, limit, "decoded bytes", "")
            .map_err(|fault| fault.telling(|came| came.saturating_add(self.bytes)))
    }
}

/// Pixels that a byte of a picture's file speaks for: with their smaller copies they take 32 bytes, as much as a byte speaks for elsewhere. JPEGs
/// have 2 to 20, drawings of a few flat colours 10 to 50.
const PIXELS_PER_BYTE: u64 = 6;
/// Of all texels, those that may be kept of next to nothing: by default 62 million, 400 MB with their smaller copies. A file of a few kilobytes
/// could take as much as the largest scenes otherwise.
const THIN_SHARE: u64 = 8;
/// The same of one picture that is decoded, to be halved then or kept as one texel: by default 71 million. One of 8192×8192 has 67.
const SINGLE_SHARE: u64 = 7;
/// Of eight parts of all texels, those that may be decoded of next to nothing, whether they are kept or not: by default 312 million, three seconds
/// of one core. Eighteen pictures of 4096×4096 all of one colour, as baked ones are, are 302 million.
const WORK_EIGHTHS: u64 = 5;
/// Bytes that may be made of one. What is compressed best (EXT_meshopt_compression, quantised to 8 bits) is made into about 20 times as much.
const MADE_PER_BYTE: u64 = 32;

/// Of what may be decoded, the part that may be made of nothing; by default 256 MiB, or two million triangles, which take a second on two cores. Files
/// that show a sphere in a hundred materials have half of it.
const MADE_SHARE: u64 = 16;

/// How large a picture is.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct PictureSize {
    /// Along x and y.
    pub(super) pixels: [u32; 2],
    /// As the decoder says.
    pub(super) decoded_bytes: u64,
    /// What is in memory while it is decoded.
    pub(super) working_bytes: u64,
    /// In the file.
    pub(super) encoded_bytes: usize,
}

/// Four per texel, and a third more for the smaller copies that distance needs; twice that, if a picture is used as colours and as
/// numbers.
fn image_bytes(pixels: u64) -> u64 {
    pixels.saturating_mul(4 * 5) / 3
}

/// Refuses a picture of what is far away that is larger than allowed: each texel has four bytes, and a number to draw it by.
pub(crate) fn check_environment_size(
    width: u32,
    height: u32,
    encoded_bytes: u64,
    limits: &Limits,
) -> Result<(), Problem> {
    const BYTES_PER_TEXEL: u64 = 2 * 4;
    /// Without compression each has four bytes, and photographs little less with it.
    const PIXELS_PER_BYTE: u64 = 4;
    /// Of all texels, those that may come from next to nothing: by default 8 million, a second's work.
    const THIN_SHARE: u64 = 64;
    let pixels = u64::from(width) * u64::from(height);
    let bytes = pixels.saturating_mul(BYTES_PER_TEXEL);
    let thin = pixels.saturating_sub(PIXELS_PER_BYTE.saturating_mul(encoded_bytes));
    let thin_limit = limits.total_pixels / THIN_SHARE;
    within(pixels, limits.image_pixels, "pixels in one image", "")
        .and_then(|()| {
            within(thin, thin_limit, "pixels in images of few bytes", "")
                .map_err(|fault| fault.telling(|came| came.saturating_mul(THIN_SHARE)))
        })
        .and_then(|()| within(bytes, limits.decoded_bytes, "decoded bytes", ""))
        .map_err(|fault| fault.problem)
}

/// The flag of the program `frameless` that raises the limit of what an error speaks of, if there is one.
pub(super) fn flag_of(what: &str) -> Option<&'static str> {
    Some(match what {
        "decoded bytes"
        | "bytes made of few bytes of file"
        | "bytes of zeros without data"
        | "bytes of file"
        | "bytes of pictures that share them"
        | "keyframes"
        | "JSON values" => "--max-memory",
        "triangles" | "vertices" => "--max-triangles",
        "pixels in one image"
        | "pixels in all images"
        | "pixels in images of few bytes"
        | "pixels to decode in all images" => "--max-texture-pixels",
        "nodes" => "--max-nodes",
        "levels of nodes" => "--max-nesting",
        "instances" | "instances from few bytes of file" => "--max-instances",
        "lights" => "--max-lights",
        "boxes of surfaces for the rays to all lights"
        | "boxes of surfaces for what is seen of one pixel"
        | "boxes of surfaces on top of each other for a ray"
        | "boxes of surfaces on top of each other for a ray, as things move" => "--max-overlap",
        _ => return None,
    })
}

/// Adds `more` to `total` unless that would pass `limit`.
fn spend(
    total: &mut u64,
    more: u64,
    limit: u64,
    what: &'static str,
    pointer: &str,
) -> Result<(), Fault> {
    let sum = total.saturating_add(more);
    within(sum, limit, what, pointer)?;
    *total = sum;
    Ok(())
}

/// Refuses more than `limit`.
pub(super) fn within(
    came: u64,
    limit: u64,
    what: &'static str,
    pointer: &str,
) -> Result<(), Fault> {
    if came <= limit {
        return Ok(());
    }
    let place = Place::Pointer(pointer.to_owned());
    Err(Fault { place, problem: Problem::Limit { what, came, limit, enough: None } })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_refused_request_uses_nothing() {
        let mut budget = Budget::new(&Limits { decoded_bytes: 100, ..Limits::default() });
        assert!(budget.allocate("/a", usize::MAX, 16).is_err());
        assert!(budget.allocate("/a", 10, 10).is_ok());
        assert!(budget.allocate("/a", 1, 1).is_err());
    }

    #[test]
    fn what_is_made_is_limited_by_what_it_is_made_of() {
        let mut budget = Budget::new(&Limits::default());
        assert!(budget.allocate("/a", 1 << 28, 1).is_ok());
        let refusal = budget.allocate("/a", 320, 1).unwrap_err().in_file("f").to_string();
        assert!(refusal.contains("--max-memory raises it (4097M or more)"), "{refusal}");
        budget.add_file(Path::new(""), 1 << 40);
        assert!(budget.allocate("/a", 1, 1).is_err(), "bytes that say nothing");
        budget.tell(10);
        assert!(budget.allocate("/a", 320, 1).is_ok());
        assert!(budget.allocate("/a", 1, 1).is_err());
        assert!(budget.read("/a", 1000).is_ok());
        assert!(budget.allocate("/a", 1, 1).is_err());
        // Whoever wants twice as much of all has twice as much of nothing.
        let limits = Limits { decoded_bytes: 8 << 30, ..Limits::default() };
        assert!(Budget::new(&limits).allocate("/a", 1 << 29, 1).is_ok());
    }

    /// For files of so many bytes.
    fn budget_of(limits: &Limits, file_bytes: usize) -> Budget {
        let mut budget = Budget::new(limits);
        budget.add_file(Path::new(""), file_bytes);
        budget
    }

    #[test]
    fn one_image_and_all_images_are_limited() {
        let limits = Limits { image_pixels: 10, total_pixels: 15, ..Limits::default() };
        let mut budget = budget_of(&limits, 400);
        let mut add = |pixels| {
            let size = PictureSize { pixels, encoded_bytes: 99, ..PictureSize::default() };
            budget.add_image("/images/0", &size)
        };
        assert!(add([11, 1]).is_err());
        assert!(add([5, 2]).is_ok());
        assert!(add([3, 2]).is_err());
        assert!(add([u32::MAX, u32::MAX]).is_err());
    }

    #[test]
    fn images_of_few_bytes_are_limited_together() {
        let mut budget = budget_of(&Limits::default(), 2 << 20);
        let add = |budget: &mut Budget, encoded_bytes| {
            let (pixels, decoded_bytes) = ([4096, 4096], 4 << 24);
            let size =
                PictureSize { pixels, decoded_bytes, encoded_bytes, ..PictureSize::default() };
            budget.add_image("/images/0", &size)
        };
        for _ in 0..4 {
            assert!(add(&mut budget, 20_000).is_ok());
        }
        assert!(budget.check_pixels(3 << 24).is_ok());
        let refusal = budget.check_pixels(4 << 24).unwrap_err().in_file("f").to_string();
        assert!(refusal.contains("66628864 pixels in images of few bytes"), "{refusal}");
        assert!(
            refusal.contains("--max-texture-pixels raises it (533030912 or more)"),
            "{refusal}"
        );
        // Whoever has data for it may have more.
        assert!(add(&mut budget, 1 << 20).is_ok());
        assert!(budget.check_pixels(4 << 24).is_ok());
        // But not the same data again.
        assert!(add(&mut budget, 1 << 20).is_ok());
        let most = 62_500_000 + 6 * (2 << 20);
        assert!(budget.check_pixels(most).is_ok());
        assert!(budget.check_pixels(most + 1).is_err());
    }

    #[test]
    fn one_picture_of_8192_squared_is_decoded() {
        let mut budget = budget_of(&Limits::default(), 100);
        let bytes = 4 << 26;
        let size = PictureSize {
            pixels: [8192, 8192],
            decoded_bytes: bytes,
            working_bytes: bytes,
            encoded_bytes: 100,
        };
        assert!(budget.add_image("/images/0", &size).is_ok());
    }

    #[test]
    fn what_a_decoder_needs_meanwhile_counts() {
        let mut budget = budget_of(&Limits::default(), 100);
        let mut add = |bytes_per_pixel: u64| {
            let size = PictureSize {
                pixels: [6000, 6000],
                working_bytes: bytes_per_pixel * 6000 * 6000,
                ..PictureSize::default()
            };
            budget.add_image("/images/0", &size)
        };
        assert!(add(11).is_err());
        assert!(add(10).is_ok());
    }

    #[test]
    fn a_file_that_is_named_twice_counts_once() {
        let mut budget = budget_of(&Limits::default(), 80);
        budget.add_file(Path::new(""), 1 << 40);
        assert!(budget.place_instances("/nodes/0", 50_010).is_ok());
        assert!(budget.place_instances("/nodes/1", 1).is_err());
    }

    #[test]
    fn instances_and_pictures_from_few_bytes_are_limited_together() {
        let mut budget = budget_of(&Limits::default(), 80);
        let refusal = |fault: Fault| fault.in_file("f").to_string();
        assert!(budget.place_instances("/nodes/0", 50_000).is_ok());
        let refused = refusal(budget.place_instances("/nodes/1", 11).unwrap_err());
        assert!(refused.contains("/nodes/1: 50011 instances from few bytes"), "{refused}");
        assert!(refused.contains("--max-instances"), "{refused}");
        assert!(budget.place_instances("/nodes/1", 10).is_ok());
        assert!(budget.look_through("/images/0", (64 << 20) + 320).is_ok());
        let refused = refusal(budget.look_through("/images/1", 1).unwrap_err());
        assert!(refused.contains("--max-memory"), "{refused}");
    }

    #[test]
    fn images_of_16_bits_per_channel_count_twice_among_those_of_few_bytes() {
        let mut budget = budget_of(&Limits::default(), 500);
        // Twice as many are within the limit for 8 bits.
        let mut add = |bytes_per_pixel: u64| {
            let size = PictureSize {
                pixels: [6000, 6000],
                decoded_bytes: bytes_per_pixel * 6000 * 6000,
                encoded_bytes: 100,
                ..PictureSize::default()
            };
            budget.add_image("/images/0", &size)
        };
        assert!(add(8).is_err());
        assert!(add(4).is_ok());
    }
}

//! Embree 4, found and loaded at run time: the peer that our kernel is measured against. The one place of this crate with `unsafe` code.
//!
//! SAFETY, once for all: the declarations are those of Embree 4's C interface (its `rtcore*.h`; enums are `unsigned int`, handles are
//! pointers), and [`Embree::load`] asks for version 4 before it calls anything else. The functions live as long as the library, which
//! [`Embree`] keeps beside them; handles are made and released here only, and scenes borrow their Embree. Buffers that Embree hands out are
//! as long as asked for, and filled within that. Rays and hits have the alignment that the interface wants; hits have room for the member
//! that only builds with instance arrays have, at the end.
#![allow(unsafe_code)]

use std::ffi::{c_char, c_int, c_uint, c_void};
use std::path::{Path, PathBuf};
use std::ptr::{null, null_mut};

use frameless_trace::Ray;
use glam::{Affine3A, Vec3};
use libloading::Library;

type Handle = *mut c_void;

const GEOMETRY_TRIANGLE: c_uint = 0;
const GEOMETRY_INSTANCE: c_uint = 121;
const BUFFER_INDEX: c_uint = 0;
const BUFFER_VERTEX: c_uint = 1;
const FORMAT_UINT3: c_uint = 0x5003;
const FORMAT_FLOAT3: c_uint = 0x9003;
const FORMAT_FLOAT3X4_COLUMN_MAJOR: c_uint = 0x9234;
const PROPERTY_VERSION_MAJOR: c_uint = 1;
const PROPERTY_VERSION_MINOR: c_uint = 2;
const PROPERTY_VERSION_PATCH: c_uint = 3;
const INVALID: u32 = u32::MAX;
const COHERENT: c_uint = 1 << 16;
const ALL_FEATURES: c_uint = u32::MAX;

#[repr(C, align(16))]
struct RtcRay {
    origin: [f32; 3],
    tnear: f32,
    direction: [f32; 3],
    time: f32,
    tfar: f32,
    mask: u32,
    id: u32,
    flags: u32,
}

#[repr(C, align(16))]
struct RtcRayHit {
    ray: RtcRay,
    normal: [f32; 3],
    uv: [f32; 2],
    primitive: u32,
    geometry: u32,
    instance: u32,
    instance_primitive: u32,
}

#[repr(C, align(32))]
struct RtcRayHit8 {
    origin: [[f32; 8]; 3],
    tnear: [f32; 8],
    direction: [[f32; 8]; 3],
    time: [f32; 8],
    tfar: [f32; 8],
    mask: [u32; 8],
    id: [u32; 8],
    flags: [u32; 8],
    normal: [[f32; 8]; 3],
    uv: [[f32; 8]; 2],
    primitive: [u32; 8],
    geometry: [u32; 8],
    instance: [u32; 8],
    instance_primitive: [u32; 8],
}

#[repr(C, align(16))]
struct RtcContext {
    instances: [u32; 8],
}

#[repr(C)]
struct RtcArguments {
    flags: c_uint,
    features: c_uint,
    context: *mut RtcContext,
    filter: *const c_void,
    intersect: *const c_void,
    unused: [u64; 2],
}

macro_rules! functions {
    ($($name:ident: $symbol:literal ($($argument:ty),*) $(-> $result:ty)?;)*) => {
        struct Functions { $($name: unsafe extern "C" fn($($argument),*) $(-> $result)?,)* }

        impl Functions {
            fn of(library: &Library) -> Result<Functions, libloading::Error> {
                // SAFETY: see the module; the types are those of the C interface.
                unsafe { Ok(Functions { $($name: *library.get(concat!($symbol, "\0").as_bytes())?,)* }) }
            }
        }
    };
}

functions! {
    new_device: "rtcNewDevice" (*const c_char) -> Handle;
    device_error: "rtcGetDeviceError" (Handle) -> c_uint;
    device_property: "rtcGetDeviceProperty" (Handle, c_uint) -> isize;
    release_device: "rtcReleaseDevice" (Handle);
    new_scene: "rtcNewScene" (Handle) -> Handle;
    commit_scene: "rtcCommitScene" (Handle);
    release_scene: "rtcReleaseScene" (Handle);
    new_geometry: "rtcNewGeometry" (Handle, c_uint) -> Handle;
    commit_geometry: "rtcCommitGeometry" (Handle);
    release_geometry: "rtcReleaseGeometry" (Handle);
    new_buffer: "rtcSetNewGeometryBuffer" (Handle, c_uint, c_uint, c_uint, usize, usize) -> *mut c_void;
    attach: "rtcAttachGeometry" (Handle, Handle) -> c_uint;
    set_instanced: "rtcSetGeometryInstancedScene" (Handle, Handle);
    set_transform: "rtcSetGeometryTransform" (Handle, c_uint, c_uint, *const c_void);
    intersect1: "rtcIntersect1" (Handle, *mut RtcRayHit, *mut RtcArguments);
    intersect8: "rtcIntersect8" (*const c_int, Handle, *mut RtcRayHit8, *mut RtcArguments);
    occluded1: "rtcOccluded1" (Handle, *mut RtcRay, *mut RtcArguments);
}

/// The library and a device with its default settings.
pub(super) struct Embree {
    functions: Functions,
    device: Handle,
    /// Such as 4.4.0.
    pub(super) version: String,
    /// Last, so that it is closed last.
    _library: Library,
}

/// How to come by it.
pub(super) const HOW_TO_GET: &str = "Embree 4 was not found, so there are no ratios to it: \
    `pip install embreex` into the virtual environment that is active (or any, with --embree FILE: its \
    site-packages/embreex.libs/libembree4-….so.4), or install your system's Embree 4; Debian 12's libembree-dev is version 3, which \
    this benchmark does not load";

impl Embree {
    /// From this file, or from where Python's wheel `embreex` and system packages put it. `None` if it is not there.
    ///
    /// # Errors
    /// In words, if a file is named and is not Embree 4.
    pub(super) fn find(named: Option<&Path>) -> Result<Option<Embree>, String> {
        match named {
            Some(file) => Embree::load(file).map(Some),
            None => Ok(candidates().iter().find_map(|file| Embree::load(file).ok())),
        }
    }

    fn load(file: &Path) -> Result<Embree, String> {
        let said = |error: libloading::Error| format!("{}: {error}", file.display());
        // SAFETY: Embree's initialisers have no preconditions; whatever else the user names is theirs to answer for.
        let library = unsafe { Library::new(file) }.map_err(said)?;
        let functions = Functions::of(&library).map_err(said)?;
        // SAFETY: see the module.
        let (device, version) = unsafe {
            let device = (functions.new_device)(null());
            if device.is_null() {
                return Err(format!("{}: Embree gives no device", file.display()));
            }
            let number = |property| (functions.device_property)(device, property);
            let version = [PROPERTY_VERSION_MAJOR, PROPERTY_VERSION_MINOR, PROPERTY_VERSION_PATCH];
            (device, version.map(number))
        };
        let [major, minor, patch] = version;
        let version = format!("{major}.{minor}.{patch}");
        let embree = Embree { functions, device, version, _library: library };
        if major != 4 {
            return Err(format!("{}: Embree {}, not 4", file.display(), embree.version));
        }
        Ok(embree)
    }

    /// A scene of these meshes.
    pub(super) fn scene(&self, meshes: &[Triangles]) -> EmbreeScene<'_> {
        let f = &self.functions;
        // SAFETY: see the module.
        unsafe {
            let scene = (f.new_scene)(self.device);
            for mesh in meshes {
                let geometry = (f.new_geometry)(self.device, GEOMETRY_TRIANGLE);
                let (vertices, triangles) = (mesh.positions.len(), mesh.triangles.len());
                let to = (f.new_buffer)(geometry, BUFFER_VERTEX, 0, FORMAT_FLOAT3, 12, vertices);
                assert!(!to.is_null(), "Embree gives memory for vertices");
                mesh.positions.as_ptr().copy_to_nonoverlapping(to.cast(), vertices);
                let to = (f.new_buffer)(geometry, BUFFER_INDEX, 0, FORMAT_UINT3, 12, triangles);
                assert!(!to.is_null(), "Embree gives memory for triangles");
                mesh.triangles.as_ptr().copy_to_nonoverlapping(to.cast(), triangles);
                (f.commit_geometry)(geometry);
                (f.attach)(scene, geometry);
                (f.release_geometry)(geometry);
            }
            (f.commit_scene)(scene);
            self.committed(scene, None)
        }
    }

    /// A scene of `one`, as often as there are places.
    pub(super) fn instances<'e>(
        &'e self,
        one: EmbreeScene<'e>,
        at: &[Affine3A],
    ) -> EmbreeScene<'e> {
        let f = &self.functions;
        // SAFETY: see the module; the matrix is twelve floats, column after column, copied during the call.
        unsafe {
            let scene = (f.new_scene)(self.device);
            for place in at {
                let geometry = (f.new_geometry)(self.device, GEOMETRY_INSTANCE);
                (f.set_instanced)(geometry, one.scene);
                let columns = place.to_cols_array();
                let format = FORMAT_FLOAT3X4_COLUMN_MAJOR;
                (f.set_transform)(geometry, 0, format, columns.as_ptr().cast());
                (f.commit_geometry)(geometry);
                (f.attach)(scene, geometry);
                (f.release_geometry)(geometry);
            }
            (f.commit_scene)(scene);
            self.committed(scene, Some(Box::new(one)))
        }
    }

    fn committed<'e>(
        &'e self,
        scene: Handle,
        instanced: Option<Box<EmbreeScene<'e>>>,
    ) -> EmbreeScene<'e> {
        // SAFETY: see the module.
        let error = unsafe { (self.functions.device_error)(self.device) };
        assert_eq!(error, 0, "Embree refuses the scene");
        EmbreeScene { embree: self, scene, _instanced: instanced }
    }
}

impl Drop for Embree {
    fn drop(&mut self) {
        // SAFETY: see the module.
        unsafe { (self.functions.release_device)(self.device) };
    }
}

/// What Embree is given.
pub(super) struct Triangles {
    pub(super) positions: Vec<Vec3>,
    pub(super) triangles: Vec<[u32; 3]>,
}

/// Committed with Embree's default flags and build quality.
pub(super) struct EmbreeScene<'e> {
    embree: &'e Embree,
    scene: Handle,
    _instanced: Option<Box<EmbreeScene<'e>>>,
}

impl EmbreeScene<'_> {
    /// The nearest hit's t; infinite if there is none.
    #[inline]
    pub(super) fn nearest(&self, ray: &Ray) -> f32 {
        let mut query = RtcRayHit {
            ray: rtc_ray(ray, f32::INFINITY),
            normal: [0.0; 3],
            uv: [0.0; 2],
            primitive: INVALID,
            geometry: INVALID,
            instance: INVALID,
            instance_primitive: INVALID,
        };
        // SAFETY: see the module.
        unsafe { (self.embree.functions.intersect1)(self.scene, &mut query, null_mut()) };
        if query.geometry == INVALID { f32::INFINITY } else { query.ray.tfar }
    }

    /// The same of eight neighbours at once, told to be coherent.
    pub(super) fn nearest_of_eight(&self, rays: &[Ray; 8]) -> [f32; 8] {
        let each = |axis: usize| rays.map(|ray| ray.origin[axis]);
        let along = |axis: usize| rays.map(|ray| ray.direction[axis]);
        let mut query = RtcRayHit8 {
            origin: [each(0), each(1), each(2)],
            tnear: [0.0; 8],
            direction: [along(0), along(1), along(2)],
            time: [0.0; 8],
            tfar: [f32::INFINITY; 8],
            mask: [u32::MAX; 8],
            id: [0; 8],
            flags: [0; 8],
            normal: [[0.0; 8]; 3],
            uv: [[0.0; 8]; 2],
            primitive: [INVALID; 8],
            geometry: [INVALID; 8],
            instance: [INVALID; 8],
            instance_primitive: [INVALID; 8],
        };
        let mut context = RtcContext { instances: [INVALID; 8] };
        let mut arguments = RtcArguments {
            flags: COHERENT,
            features: ALL_FEATURES,
            context: &mut context,
            filter: null(),
            intersect: null(),
            unused: [0; 2],
        };
        let valid = [-1; 8];
        #[repr(C, align(32))]
        struct Valid([c_int; 8]);
        let valid = Valid(valid);
        // SAFETY: see the module.
        unsafe {
            let intersect8 = self.embree.functions.intersect8;
            intersect8(valid.0.as_ptr(), self.scene, &mut query, &mut arguments);
        }
        std::array::from_fn(|k| {
            if query.geometry[k] == INVALID { f32::INFINITY } else { query.tfar[k] }
        })
    }

    /// Whether anything is hit before `t_max`.
    #[inline]
    pub(super) fn is_blocked(&self, ray: &Ray, t_max: f32) -> bool {
        let mut query = rtc_ray(ray, t_max);
        // SAFETY: see the module.
        unsafe { (self.embree.functions.occluded1)(self.scene, &mut query, null_mut()) };
        query.tfar < 0.0
    }
}

impl Drop for EmbreeScene<'_> {
    fn drop(&mut self) {
        // SAFETY: see the module.
        unsafe { (self.embree.functions.release_scene)(self.scene) };
    }
}

#[inline]
fn rtc_ray(ray: &Ray, tfar: f32) -> RtcRay {
    RtcRay {
        origin: ray.origin.to_array(),
        tnear: 0.0,
        direction: ray.direction.to_array(),
        time: 0.0,
        tfar,
        mask: u32::MAX,
        id: 0,
        flags: 0,
    }
}

/// Where it may be, the active virtual environment first.
fn candidates() -> Vec<PathBuf> {
    let mut folders = Vec::new();
    let roots = [
        std::env::var_os("VIRTUAL_ENV").map(PathBuf::from),
        Some(PathBuf::from(".venv")),
        Some(PathBuf::from("python/.venv")),
        std::env::home_dir().map(|home| home.join(".local")),
        Some(PathBuf::from("/usr/local")),
    ];
    for root in roots.into_iter().flatten() {
        let pythons = root.join("lib");
        for python in entries(&pythons) {
            folders.push(python.join("site-packages/embreex.libs"));
            folders.push(python.join("dist-packages/embreex.libs"));
        }
    }
    let in_folder = |folder: &PathBuf| {
        let name = |file: &Path| file.file_name().map(|name| name.to_string_lossy().into_owned());
        let is_it = |file: &PathBuf| name(file).is_some_and(|name| name.starts_with("libembree4"));
        entries(folder).into_iter().filter(is_it).collect::<Vec<_>>()
    };
    let mut files: Vec<PathBuf> = folders.iter().flat_map(in_folder).collect();
    files.extend(
        ["libembree4.so.4", "libembree4.so", "libembree4.dylib", "embree4.dll"].map(PathBuf::from),
    );
    files
}

/// In a folder, in the order of their names; none if it cannot be read.
fn entries(folder: &Path) -> Vec<PathBuf> {
    let Ok(entries) = std::fs::read_dir(folder) else { return Vec::new() };
    let mut paths: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
    paths.sort();
    paths
}

//! glTF 2.0 files become checked [`Scene`](crate::Scene)s. <https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html>
//!
//! A scene file comes from strangers. So we walk the JSON ourselves rather than with the crate `gltf`, which panics and
//! allocates what hostile files ask for, and whose errors do not say where: here every value knows its JSON pointer
//! ([`json`]), every count, offset and sum is checked before anything is allocated ([`limits`]), and nothing recurses
//! along what the file says.
//!
//! | read | drawn otherwise, with a warning | ignored with a warning | refused |
//! |---|---|---|---|
//! | `.glb`, `.gltf`, `data:` URIs, files in its folder, EXT_meshopt_compression | images that cannot be decoded: a checker; damaged ones: as far as they go; those for which there is no room: at half their size or less | GLB chunks of other types | a second binary chunk, other versions than 2.x, required extensions that are unknown |
//! | triangles, strips, fans; indexed or not; normalised, quantised, sparse | joint weights that do not sum to 1: scaled; skins with joints elsewhere: rest shape | points, lines | indices and references that lead nowhere |
//! | nodes with TRS or matrix, one scene, EXT_mesh_gpu_instancing | sheared matrices: without shear; matrix and TRS: the matrix; the same mesh many times in one place, the same triangle a thousand times: once | other scenes | loops, two parents |
//! | all of a material with its textures, KHR_texture_transform, EXT_texture_webp, COLOR_0, TEXCOORD_0 to 3, TANGENT | | textures by TEXCOORD_4 and beyond | paths out of the folder |
//! | KHR_materials_emissive_strength, _unlit, _ior, _specular, _transmission, _volume, _clearcoat, _sheen | thickness textures: volumes are as thick as they are modelled | other extensions | |
//! | cameras, KHR_lights_punctual | none in the file: added, with a note | | angles out of range |
//! | skins with any number of joints, morph targets (position, normal, colour) | tangents of what deforms: from its texture coordinates | morphed texture coordinates and tangents | joints and weights that do not match in number |
//! | TRS and weights animation, all interpolations, all animations at once or the first | unusable keys: without them | pointers, what is driven twice | keys and values that do not match in number |

mod accessor;
mod animation;
mod attributes;
mod buffers;
mod camera;
mod choice;
mod coincident;
mod compressed;
mod container;
mod decode;
mod defaults;
mod document;
mod error;
mod extensions;
mod image;
mod influences;
mod instances;
mod json;
mod layers;
mod light;
mod limits;
mod load;
mod lost;
mod material;
mod mesh;
mod node;
mod normals;
mod png_chunks;
mod room;
mod skin;
mod tangents;
mod texture;
mod topology;
mod twins;
mod uri;
mod value;
mod warnings;

pub use choice::{AnimationChoice, Choice, Pick};
pub use error::{LoadError, Place, Problem};
pub use limits::Limits;
pub use load::{load, load_bytes, load_chosen};

pub(crate) use defaults::NO_LIGHT;
pub(crate) use error::one_line;
pub(crate) use limits::check_environment_size;
pub(crate) use load::open_plain;

//! glTF files made by hand: what has to come out of them is known to the byte.

mod compressed;
mod deform;
mod hostile;
mod maker;
mod meshes;
mod motion;
mod nodes;
mod surfaces;

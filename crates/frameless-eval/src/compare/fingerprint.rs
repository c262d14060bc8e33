//! What a scene is, as a short text that changes when the scene does.

use std::collections::BTreeMap;
use std::path::{Component, Path};
use std::sync::Mutex;

use percent_encoding::percent_decode_str;
use serde_json::Value;
use sha2::{Digest, Sha256};

use super::store::hex;
use crate::error::EvalError;
use crate::experiment::SceneSource;

/// SHA-256 of a scene: of a file's bytes and of the files that it names, or of a built-in scene's data.
///
/// # Errors
/// If the file cannot be read.
pub(super) fn fingerprint(source: &SceneSource) -> Result<String, EvalError> {
    match source {
        SceneSource::Builtin(name) => {
            // They do not change while the program runs, and take longer to make than small runs take.
            static KNOWN: Mutex<BTreeMap<String, String>> = Mutex::new(BTreeMap::new());
            let mut known = KNOWN.lock().expect("nobody panics while they are made");
            Ok(known.entry(name.clone()).or_insert_with(|| of_builtin(name)).clone())
        }
        SceneSource::File(path) => of_file(path),
    }
}

fn of_builtin(name: &str) -> String {
    let mut hash = Sha256::new();
    let mut scene = frameless_scene::builtin(name).expect("checked when the experiment was read");
    // Millions of texels would make a long text.
    for image in std::mem::take(&mut scene.images) {
        hash.update(format!("{}x{}\n", image.width, image.height));
        hash.update(image.rgba.as_flattened());
    }
    hash.update(format!("{scene:?}"));
    hex(&hash.finalize())
}

fn of_file(path: &Path) -> Result<String, EvalError> {
    let mut hash = Sha256::new();
    let bytes = std::fs::read(path)
        .map_err(|source| EvalError::Unreadable { path: path.to_path_buf(), source })?;
    let folder = path.parent().unwrap_or(Path::new(""));
    for uri in named_files(&bytes) {
        // What cannot be read is refused, and said so, when the scene is loaded.
        let named = read_below(folder, &uri).unwrap_or_default();
        hash.update(format!("{uri} {}\n", named.len()));
        hash.update(named);
    }
    hash.update(bytes);
    Ok(hex(&hash.finalize()))
}

/// The values of all `uri` keys in a glTF or GLB file, except data inside the file itself.
fn named_files(bytes: &[u8]) -> Vec<String> {
    let json = match bytes {
        // GLB: magic, version, length, then the first chunk's length and type, then the chunk, which is JSON.
        [b'g', b'l', b'T', b'F', ..] if bytes.len() >= 20 => {
            let length = u32::from_le_bytes([bytes[12], bytes[13], bytes[14], bytes[15]]) as usize;
            &bytes[20..bytes.len().min(20 + length)]
        }
        _ => bytes,
    };
    let mut uris = Vec::new();
    // What is no JSON is refused when the scene is loaded.
    if let Ok(value) = serde_json::from_slice(json) {
        collect_uris(&value, &mut uris);
    }
    uris
}

/// The bytes of a file below `folder`; nothing elsewhere is opened, as when the scene is loaded.
fn read_below(folder: &Path, uri: &str) -> Option<Vec<u8>> {
    let path = percent_decode_str(uri).decode_utf8().ok()?;
    let path = Path::new(&*path);
    let leads_down = path.components().all(|step| matches!(step, Component::Normal(_)));
    let path = folder.join(path);
    if leads_down && path.is_file() { std::fs::read(path).ok() } else { None }
}

fn collect_uris(value: &Value, uris: &mut Vec<String>) {
    match value {
        Value::Object(members) => {
            for (key, value) in members {
                match value {
                    Value::String(uri) if key == "uri" && !uri.starts_with("data:") => {
                        uris.push(uri.clone());
                    }
                    value => collect_uris(value, uris),
                }
            }
        }
        Value::Array(items) => items.iter().for_each(|item| collect_uris(item, uris)),
        _ => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn changes_with_the_file_and_with_the_files_it_names() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let scene = folder.path().join("scene.gltf");
        let write = |name: &str, text: &str| {
            std::fs::write(folder.path().join(name), text).expect("writable");
            fingerprint(&SceneSource::File(scene.clone())).expect("readable")
        };
        let first = write("scene.gltf", r#"{"buffers": [{"uri": "a%20b.bin"}]}"#);
        let named = write("a b.bin", "bytes");
        let changed = write("a b.bin", "other");
        let outside =
            write("scene.gltf", r#"{"buffers": [{"uri": "../a"}, {"uri": "/dev/zero"}]}"#);
        let all = [&first, &named, &changed, &outside];
        assert!((0..4).all(|i| (0..i).all(|j| all[i] != all[j])), "{all:?}");
        assert_eq!(write("a b.bin", "again"), outside, "not named any more");
    }

    #[test]
    fn a_glb_names_files_in_its_first_chunk() {
        let json = br#"{"images": [{"uri": "a.png"}, {"uri": "data:,x"}]}"#;
        let mut glb = b"glTF\x02\0\0\0\0\0\0\0".to_vec();
        glb.extend((json.len() as u32).to_le_bytes());
        glb.extend(b"JSON");
        glb.extend(json);
        glb.extend(b"\x04\0\0\0BIN\0\xff\xff\xff\xff");
        assert_eq!(named_files(&glb), ["a.png"]);
        assert!(named_files(b"glTF").is_empty() && named_files(b"").is_empty());
    }

    #[test]
    fn built_in_scenes_differ() {
        let of = |name: &str| fingerprint(&SceneSource::Builtin(name.into())).expect("built in");
        assert_eq!(of("sphere"), of("sphere"));
        assert_ne!(of("sphere"), of("many"));
    }
}

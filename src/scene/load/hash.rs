//! The hash of all that makes a picture what it is.

use super::tree::{Node, Value};
use super::{GeometryCache, SceneError};
use crate::scene::Settings;
use blake3::Hasher;
use std::path::PathBuf;

/// Hash of the document with its overrides, the settings with their preset, and the contents of the files.
///
/// The number of samples is left out: films of one scene with different numbers can be merged. How the document is
/// written (order of keys, comments, TOML or JSON, `2` or `2.0`) does not count either.
pub(super) fn of(
    root: &Node,
    settings: &Settings,
    files: &[PathBuf],
    cache: &mut GeometryCache,
) -> Result<String, SceneError> {
    let mut hasher = Hasher::new();
    add_value(&mut hasher, &root.value, true);
    add_bytes(&mut hasher, b'=', Settings { spp: 1, ..settings.clone() }.to_string().as_bytes());
    for path in files {
        let content =
            cache.hash_of(path).map_err(|source| SceneError::Read { path: path.clone(), source })?;
        add_bytes(&mut hasher, b'@', content.as_bytes());
    }
    Ok(hasher.finalize().to_hex().to_string())
}

/// A tag, a length and bytes: no two values give the same sequence.
fn add_bytes(hasher: &mut Hasher, tag: u8, bytes: &[u8]) {
    hasher.update(&[tag]).update(&(bytes.len() as u64).to_le_bytes()).update(bytes);
}

fn add_value(hasher: &mut Hasher, value: &Value, is_root: bool) {
    match value {
        Value::Null => add_bytes(hasher, b'n', &[]),
        Value::Bool(b) => add_bytes(hasher, b'b', &[u8::from(*b)]),
        Value::Integer(i) => add_bytes(hasher, b'x', &(*i as f64).to_le_bytes()),
        Value::Float(x) => add_bytes(hasher, b'x', &x.to_le_bytes()),
        Value::String(s) => add_bytes(hasher, b's', s.as_bytes()),
        Value::Array(items) => {
            add_bytes(hasher, b'[', &(items.len() as u64).to_le_bytes());
            items.iter().for_each(|item| add_value(hasher, &item.value, false));
        }
        Value::Table(entries) => {
            // The settings of the document are in the resolved ones.
            let mut entries: Vec<_> = entries.iter().filter(|e| !(is_root && e.key == "settings")).collect();
            entries.sort_by(|a, b| a.key.cmp(&b.key));
            add_bytes(hasher, b'{', &(entries.len() as u64).to_le_bytes());
            for entry in entries {
                add_bytes(hasher, b'k', entry.key.as_bytes());
                add_value(hasher, &entry.node.value, false);
            }
        }
    }
}

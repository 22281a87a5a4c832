//! `path.to.key = value`, put into a document before it is read.

use super::error::{Place, did_you_mean, one_of};
use super::tree::{Entry, Node, SyntaxError, Value};
use std::fmt;
use std::str::FromStr;

/// `path.to.key = value`, set in the description before it is read: what `-D` and the other flags become.
///
/// A number in the path is an index into an array, from 0. Later overrides win. Tables at the top of a document
/// (`settings`, `camera`, ...) come into being when they are named; deeper ones must be there. Setting
/// `settings.preset` puts the preset in the place of all that the file says in `[settings]`; other overrides of
/// settings come on top of it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Override {
    /// Keys joined by dots.
    pub path: String,
    /// A TOML value; text that is none is taken as a string, unless it begins with a bracket or a quote.
    pub value: String,
}

impl Override {
    /// The value at `path`.
    pub fn new(path: impl Into<String>, value: impl fmt::Display) -> Self {
        Self { path: path.into(), value: value.to_string() }
    }
}

impl fmt::Display for Override {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}={}", self.path, self.value)
    }
}

impl FromStr for Override {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.split_once('=') {
            Some((path, value)) if !path.trim().is_empty() => Ok(Self::new(path.trim(), value.trim())),
            _ => Err("write path.to.key=value, such as settings.spp=16".into()),
        }
    }
}

const PRESET: &str = "settings.preset";

/// Sets each override in turn; on failure, its number and what is wrong.
pub(super) fn apply(root: &mut Node, overrides: &[Override]) -> Result<(), (usize, String)> {
    let (presets, others): (Vec<_>, Vec<_>) =
        overrides.iter().enumerate().partition(|(_, o)| o.path == PRESET);
    if !presets.is_empty()
        && let Some(settings) = root.field_mut("settings")
    {
        settings.value = Value::Table(vec![]);
    }
    for (index, Override { path, value }) in presets.into_iter().chain(others) {
        let node = node_of(value, Place::Override(index));
        node.and_then(|node| set(root, path, node)).map_err(|message| (index, message))?;
    }
    Ok(())
}

/// The value of an override: TOML if it is, else a string, unless it begins as a table, a list or a quoted string do.
fn node_of(text: &str, place: Place) -> Result<Node, String> {
    let mut node = match Node::from_toml(&format!("value = {text}")).map(|root| root.value) {
        Ok(Value::Table(mut entries)) if entries.len() == 1 => entries.remove(0).node,
        Err(SyntaxError { message, .. }) if text.starts_with(['{', '[', '"', '\'']) => {
            return Err(format!("the value is no TOML: {message}"));
        }
        _ => Node { place, value: Value::String(text.to_owned()) },
    };
    node.set_place(place);
    Ok(node)
}

/// Puts `new` where `path` says.
fn set(root: &mut Node, path: &str, new: Node) -> Result<(), String> {
    let place = new.place;
    let (parents, last) = match path.rsplit_once('.') {
        Some((parents, last)) => (parents.split('.').collect(), last),
        None => (vec![], path),
    };
    let mut node = root;
    for (depth, step) in parents.iter().enumerate() {
        if depth == 0
            && node.field(step).is_none()
            && let Value::Table(entries) = &mut node.value
        {
            let table = Node { place, value: Value::Table(vec![]) };
            entries.push(Entry { key: (*step).to_owned(), place, node: table });
        }
        node = child(node, step, &parents[..depth].join("."))?;
    }
    match &mut node.value {
        Value::Table(entries) if entries.iter().all(|e| e.key != last) => {
            entries.push(Entry { key: last.to_owned(), place, node: new });
        }
        _ => *child(node, last, &parents.join("."))? = new,
    }
    Ok(())
}

/// The part of `node` (which is at `path`) that a step leads to.
fn child<'a>(node: &'a mut Node, step: &str, path: &str) -> Result<&'a mut Node, String> {
    let whole = if path.is_empty() { "the scene".to_owned() } else { format!("`{path}`") };
    match &mut node.value {
        Value::Table(entries) => match entries.iter().position(|e| e.key == step) {
            Some(i) => Ok(&mut entries[i].node),
            None => {
                let keys = || entries.iter().map(|e| e.key.as_str());
                let hint = did_you_mean(step, keys());
                Err(format!("{whole} has no `{step}`{hint} (it has {})", one_of(keys())))
            }
        },
        Value::Array(items) => {
            let count = items.len();
            let item = step.parse::<usize>().ok().and_then(|i| items.get_mut(i));
            item.ok_or_else(|| format!("{whole} has {count} items, counted from 0: `{step}` is none of them"))
        }
        _ => Err(format!("{whole} is a plain value and has no `{step}`")),
    }
}

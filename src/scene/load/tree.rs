//! A parsed document, format forgotten: values that know where they were written.

use super::error::Place;
use serde_json::value::RawValue;
use toml::de::{DeTable, DeValue};

/// A value and where it was written.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Node {
    pub(super) place: Place,
    pub(super) value: Value,
}

/// What a document can hold.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Value {
    Null,
    Bool(bool),
    Integer(i64),
    Float(f64),
    String(String),
    Array(Vec<Node>),
    Table(Vec<Entry>),
}

/// A key, where it was written, and its value.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Entry {
    pub(super) key: String,
    pub(super) place: Place,
    pub(super) node: Node,
}

/// Why text is no document: a message and the byte where it stops making sense.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct SyntaxError {
    pub(super) message: String,
    pub(super) offset: usize,
}

impl Node {
    /// Reads TOML.
    pub(super) fn from_toml(text: &str) -> Result<Self, SyntaxError> {
        let table = DeTable::parse(text).map_err(|e| SyntaxError {
            message: e.message().to_owned(),
            offset: e.span().map_or(0, |span| span.start),
        })?;
        toml_table(table.span().start, table.get_ref())
    }

    /// Reads JSON.
    pub(super) fn from_json(text: &str) -> Result<Self, SyntaxError> {
        let raw: &RawValue = serde_json::from_str(text).map_err(|e| SyntaxError {
            message: strip_position(&e.to_string()),
            offset: offset_of(text, e.line(), e.column()),
        })?;
        json_node(text, raw, DEEPEST)
    }

    /// The value under a key, if this is a table that has it.
    pub(super) fn field(&self, key: &str) -> Option<&Self> {
        match &self.value {
            Value::Table(entries) => entries.iter().find(|e| e.key == key).map(|e| &e.node),
            _ => None,
        }
    }

    /// The same, to be changed.
    pub(super) fn field_mut(&mut self, key: &str) -> Option<&mut Self> {
        match &mut self.value {
            Value::Table(entries) => entries.iter_mut().find(|e| e.key == key).map(|e| &mut e.node),
            _ => None,
        }
    }

    /// Says of the whole value that it was written there.
    pub(super) fn set_place(&mut self, place: Place) {
        self.place = place;
        match &mut self.value {
            Value::Array(items) => items.iter_mut().for_each(|item| item.set_place(place)),
            Value::Table(entries) => {
                for entry in entries {
                    entry.place = place;
                    entry.node.set_place(place);
                }
            }
            _ => {}
        }
    }

    /// Where the deepest part of `path` (keys and indices joined by dots) that is there was written.
    pub(super) fn place_of(&self, path: &str) -> Place {
        let mut node = self;
        for step in path.split('.') {
            let next = match &node.value {
                Value::Array(items) => step.parse::<usize>().ok().and_then(|i| items.get(i)),
                _ => node.field(step),
            };
            match next {
                Some(next) => node = next,
                None => break,
            }
        }
        node.place
    }
}

fn toml_table(offset: usize, table: &DeTable<'_>) -> Result<Node, SyntaxError> {
    let mut entries = Vec::with_capacity(table.len());
    for (key, value) in table {
        entries.push(Entry {
            key: key.get_ref().to_string(),
            place: Place::Offset(key.span().start),
            node: toml_node(value.span().start, value.get_ref())?,
        });
    }
    Ok(Node { place: Place::Offset(offset), value: Value::Table(entries) })
}

fn toml_node(offset: usize, value: &DeValue<'_>) -> Result<Node, SyntaxError> {
    let fail = |message: &str| SyntaxError { message: message.to_owned(), offset };
    let value = match value {
        DeValue::String(s) => Value::String(s.to_string()),
        DeValue::Boolean(b) => Value::Bool(*b),
        DeValue::Integer(i) => Value::Integer(
            i64::from_str_radix(i.as_str(), i.radix()).map_err(|_| fail("this whole number is too large"))?,
        ),
        DeValue::Float(f) => {
            Value::Float(f.as_str().parse().map_err(|_| fail("this is not a number that can be read"))?)
        }
        DeValue::Datetime(_) => return Err(fail("a scene has no dates: put text into quotes")),
        DeValue::Array(items) => Value::Array(
            items.iter().map(|v| toml_node(v.span().start, v.get_ref())).collect::<Result<_, _>>()?,
        ),
        DeValue::Table(table) => return toml_table(offset, table),
    };
    Ok(Node { place: Place::Offset(offset), value })
}

/// How deep JSON may be nested: no scene comes near, and the stack ends far beyond.
const DEEPEST: u32 = 64;

/// The nodes of valid JSON; a raw value is a slice of `text`, so that its address tells its offset.
fn json_node(text: &str, raw: &RawValue, deeper: u32) -> Result<Node, SyntaxError> {
    let source = raw.get();
    let offset = source.as_ptr() as usize - text.as_ptr() as usize;
    let fail = |e: serde_json::Error| SyntaxError { message: strip_position(&e.to_string()), offset };
    let Some(deeper) = deeper.checked_sub(1) else {
        return Err(SyntaxError { message: format!("nested more than {DEEPEST} deep"), offset });
    };
    let value = match source.as_bytes().first() {
        Some(b'{') => {
            let JsonObject(pairs) = serde_json::from_str(source).map_err(fail)?;
            let mut entries: Vec<Entry> = Vec::with_capacity(pairs.len());
            for (key, raw) in pairs {
                let node = json_node(text, raw, deeper)?;
                if entries.iter().any(|e| e.key == key) {
                    return Err(SyntaxError { message: format!("duplicate key `{key}`"), offset });
                }
                entries.push(Entry { key, place: node.place, node });
            }
            Value::Table(entries)
        }
        Some(b'[') => {
            let items: Vec<&RawValue> = serde_json::from_str(source).map_err(fail)?;
            Value::Array(items.into_iter().map(|raw| json_node(text, raw, deeper)).collect::<Result<_, _>>()?)
        }
        Some(b'"') => Value::String(serde_json::from_str(source).map_err(fail)?),
        Some(b't' | b'f') => Value::Bool(source == "true"),
        Some(b'n') => Value::Null,
        _ => match source.parse::<i64>() {
            Ok(integer) => Value::Integer(integer),
            Err(_) => Value::Float(serde_json::from_str(source).map_err(fail)?),
        },
    };
    Ok(Node { place: Place::Offset(offset), value })
}

/// The pairs of an object in their order, duplicates and all.
struct JsonObject<'a>(Vec<(String, &'a RawValue)>);

impl<'de> serde::Deserialize<'de> for JsonObject<'de> {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Pairs;
        impl<'de> serde::de::Visitor<'de> for Pairs {
            type Value = JsonObject<'de>;
            fn expecting(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
                f.write_str("an object")
            }
            fn visit_map<A: serde::de::MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
                let mut pairs = Vec::new();
                while let Some(pair) = map.next_entry()? {
                    pairs.push(pair);
                }
                Ok(JsonObject(pairs))
            }
        }
        deserializer.deserialize_map(Pairs)
    }
}

/// serde_json's message without its own ` at line 1 column 2`.
fn strip_position(message: &str) -> String {
    message.split(" at line ").next().unwrap_or(message).to_owned()
}

/// The byte at a line and a column, both from 1 (a column of 0 is the end of the line before).
fn offset_of(text: &str, line: usize, column: usize) -> usize {
    let start: usize = text.split_inclusive('\n').take(line.saturating_sub(1)).map(str::len).sum();
    (start + column.saturating_sub(1)).min(text.len())
}

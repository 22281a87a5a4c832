//! Reads description types out of a [`Node`], so that every error knows where its value was written.
//!
//! A description enum is derived as serde's externally tagged one; in a document its tag is the key `type`:
//! `{ type = "sphere", radius = 2 }`. Enums without content are strings.

use super::error::{Place, did_you_mean, one_of};
use super::tree::{Entry, Node, Value};
use serde::de::value::SeqDeserializer;
use serde::de::{
    self, DeserializeSeed, EnumAccess, IntoDeserializer, MapAccess, Unexpected, VariantAccess, Visitor,
};
use std::fmt;

/// What is wrong and, once known, where.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Error {
    pub(super) message: String,
    pub(super) place: Option<Place>,
}

impl Error {
    fn new(message: String) -> Self {
        Self { message, place: None }
    }

    /// With a place unless a deeper one is known.
    fn at(self, place: Place) -> Self {
        Self { place: self.place.or(Some(place)), ..self }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for Error {}

impl de::Error for Error {
    fn custom<T: fmt::Display>(message: T) -> Self {
        Self::new(message.to_string())
    }

    fn unknown_field(field: &str, expected: &'static [&'static str]) -> Self {
        let hint = did_you_mean(field, expected.iter().copied());
        let known = one_of(expected.iter().copied());
        Self::new(format!("unknown key `{field}`{hint} (expected {known})"))
    }

    fn unknown_variant(variant: &str, expected: &'static [&'static str]) -> Self {
        let hint = did_you_mean(variant, expected.iter().copied());
        let known = one_of(expected.iter().copied());
        Self::new(format!("unknown value `{variant}`{hint} (expected {known})"))
    }

    fn missing_field(field: &'static str) -> Self {
        Self::new(format!("the key `{field}` is missing"))
    }

    fn invalid_type(unexpected: Unexpected<'_>, expected: &dyn de::Expected) -> Self {
        Self::new(format!("expected {expected}, found {unexpected}"))
    }

    fn invalid_length(length: usize, expected: &dyn de::Expected) -> Self {
        Self::new(format!("expected {expected}, found {length} values"))
    }
}

impl<'de> de::Deserializer<'de> for &'de Node {
    type Error = Error;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        match &self.value {
            Value::Null => visitor.visit_unit(),
            Value::Bool(b) => visitor.visit_bool(*b),
            Value::Integer(i) => visitor.visit_i64(*i),
            Value::Float(x) => visitor.visit_f64(*x),
            Value::String(s) => visitor.visit_str(s),
            Value::Array(items) => read_array(items, visitor),
            Value::Table(entries) => visitor.visit_map(Table::new(entries, false)),
        }
        .map_err(|e| e.at(self.place))
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        match self.value {
            Value::Null => visitor.visit_none(),
            _ => visitor.visit_some(self),
        }
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        visitor: V,
    ) -> Result<V::Value, Error> {
        visitor.visit_newtype_struct(self)
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _: &'static str,
        variants: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Error> {
        let access = match &self.value {
            Value::String(name) => Enum { name, place: self.place, content: None },
            Value::Table(_) => match self.field("type") {
                Some(Node { place, value: Value::String(name) }) => {
                    Enum { name, place: *place, content: Some(self) }
                }
                tag => {
                    let what = if tag.is_some() { "is a name" } else { "is missing" };
                    let known = one_of(variants.iter().copied());
                    let message = format!("the key `type` {what} (expected {known})");
                    return Err(Error::new(message).at(tag.map_or(self.place, |t| t.place)));
                }
            },
            _ => {
                let message = format!("expected {}", one_of(variants.iter().copied()));
                return Err(Error::new(message).at(self.place));
            }
        };
        visitor.visit_enum(access).map_err(|e| e.at(self.place))
    }

    serde::forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf unit unit_struct seq
        tuple tuple_struct map struct identifier ignored_any
    }
}

impl<'de> IntoDeserializer<'de, Error> for &'de Node {
    type Deserializer = Self;

    fn into_deserializer(self) -> Self {
        self
    }
}

/// All items, and no more than the visitor takes.
fn read_array<'de, V: Visitor<'de>>(items: &'de [Node], visitor: V) -> Result<V::Value, Error> {
    let expected = (&visitor as &dyn de::Expected).to_string();
    let mut seq = SeqDeserializer::new(items.iter());
    let value = visitor.visit_seq(&mut seq)?;
    match seq.end() {
        Ok(()) => Ok(value),
        Err(_) => Err(Error::new(format!("expected {expected}, found {} values", items.len()))),
    }
}

/// The entries of a table, without its tag if it has one.
struct Table<'de> {
    entries: std::slice::Iter<'de, Entry>,
    skip_tag: bool,
    value: Option<&'de Node>,
}

impl<'de> Table<'de> {
    fn new(entries: &'de [Entry], skip_tag: bool) -> Self {
        Self { entries: entries.iter(), skip_tag, value: None }
    }
}

impl<'de> MapAccess<'de> for Table<'de> {
    type Error = Error;

    fn next_key_seed<K: DeserializeSeed<'de>>(&mut self, seed: K) -> Result<Option<K::Value>, Error> {
        let skip_tag = self.skip_tag;
        let Some(entry) = self.entries.find(|e| !(skip_tag && e.key == "type")) else { return Ok(None) };
        self.value = Some(&entry.node);
        let key = de::value::StrDeserializer::new(&entry.key);
        seed.deserialize(key).map(Some).map_err(|e: Error| e.at(entry.place))
    }

    fn next_value_seed<V: DeserializeSeed<'de>>(&mut self, seed: V) -> Result<V::Value, Error> {
        let node = self.value.take().expect("serde asks for a key before its value");
        seed.deserialize(node).map_err(|e| e.at(node.place))
    }
}

/// The name of a variant and the table that says the rest.
struct Enum<'de> {
    name: &'de str,
    place: Place,
    content: Option<&'de Node>,
}

impl<'de> EnumAccess<'de> for Enum<'de> {
    type Error = Error;
    type Variant = Self;

    fn variant_seed<V: DeserializeSeed<'de>>(self, seed: V) -> Result<(V::Value, Self), Error> {
        let name = de::value::StrDeserializer::new(self.name);
        let variant = seed.deserialize(name).map_err(|e: Error| e.at(self.place))?;
        Ok((variant, self))
    }
}

impl<'de> VariantAccess<'de> for Enum<'de> {
    type Error = Error;

    fn unit_variant(self) -> Result<(), Error> {
        match self.content {
            None => Ok(()),
            Some(_) => Err(Error::new(format!("write \"{}\", not a table", self.name)).at(self.place)),
        }
    }

    fn newtype_variant_seed<T: DeserializeSeed<'de>>(self, seed: T) -> Result<T::Value, Error> {
        match self.content {
            Some(node) => seed.deserialize(Tagged(node)).map_err(|e| e.at(node.place)),
            None => {
                Err(Error::new(format!("write a table: {{ type = \"{}\", ... }}", self.name)).at(self.place))
            }
        }
    }

    fn tuple_variant<V: Visitor<'de>>(self, _: usize, visitor: V) -> Result<V::Value, Error> {
        Err(de::Error::invalid_type(Unexpected::TupleVariant, &visitor))
    }

    fn struct_variant<V: Visitor<'de>>(
        self,
        _: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Error> {
        Err(de::Error::invalid_type(Unexpected::StructVariant, &visitor))
    }
}

/// A table without its `type`.
struct Tagged<'de>(&'de Node);

impl<'de> de::Deserializer<'de> for Tagged<'de> {
    type Error = Error;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        match &self.0.value {
            Value::Table(entries) => visitor.visit_map(Table::new(entries, true)),
            _ => self.0.deserialize_any(visitor),
        }
    }

    serde::forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf unit unit_struct seq
        tuple tuple_struct map struct identifier ignored_any option newtype_struct enum
    }
}

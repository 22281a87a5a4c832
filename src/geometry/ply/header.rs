//! The header of a PLY file: what the elements are and how many.

use crate::geometry::file_error::{Fault, Place};
use crate::geometry::number::excerpt;

/// How the numbers after the header are written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Format {
    Ascii,
    LittleEndian,
    BigEndian,
}

/// The type of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    fn named(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }

    /// Bytes in a binary file.
    pub(super) fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    pub(super) fn is_integer(self) -> bool {
        !matches!(self, Self::F32 | Self::F64)
    }
}

/// One number or one list of numbers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Scalar(Scalar),
    List { count: Scalar, item: Scalar },
}

/// A named column of an element.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Property {
    pub(super) name: String,
    pub(super) kind: Kind,
}

/// A table: so many rows of the same properties.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Element {
    pub(super) name: String,
    pub(super) count: usize,
    pub(super) properties: Vec<Property>,
}

impl Element {
    /// The place of a property among the others.
    pub(super) fn find(&self, name: &str) -> Option<usize> {
        self.properties.iter().position(|p| p.name == name)
    }
}

/// What a header says.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Header {
    pub(super) format: Format,
    pub(super) elements: Vec<Element>,
    /// Bytes before the first element.
    pub(super) length: usize,
}

const MEND: &str = "mend the header or export the mesh again";

/// Lines of a header: ended by a line feed, with or without a carriage return before it.
struct Lines<'a> {
    bytes: &'a [u8],
    at: usize,
    number: usize,
}

impl<'a> Lines<'a> {
    fn next(&mut self) -> Result<&'a str, Fault> {
        self.number += 1;
        let rest = &self.bytes[self.at..];
        let fault = |what: &str| Fault::new(Place::Line(self.number), what, MEND);
        let end =
            rest.iter().position(|&b| b == b'\n').ok_or_else(|| fault("the header has no `end_header`"))?;
        self.at += end + 1;
        let line = std::str::from_utf8(&rest[..end]).map_err(|_| fault("a header line is not text"))?;
        Ok(line.trim())
    }
}

/// Reads the header at the start of a file.
pub(super) fn parse(bytes: &[u8]) -> Result<Header, Fault> {
    if !(bytes.starts_with(b"ply\n") || bytes.starts_with(b"ply\r\n")) {
        let mend = match bytes {
            [0x1f, 0x8b, ..] => "it is compressed by gzip: unpack it first",
            _ => "give a PLY file, or an OBJ file with the ending .obj",
        };
        return Err(Fault::new(Place::Line(1), "the file does not begin with `ply`", mend));
    }
    let mut lines = Lines { bytes, at: 0, number: 0 };
    lines.next()?;
    let mut format = None;
    let mut elements: Vec<Element> = Vec::new();
    loop {
        let line = lines.next()?;
        let fault = |what: String| Fault::new(Place::Line(lines.number), what, MEND);
        let words: Vec<&str> = line.split_ascii_whitespace().collect();
        match words[..] {
            [] | ["comment" | "obj_info", ..] => {}
            ["format", name, _version] => {
                format = Some(match name {
                    "ascii" => Format::Ascii,
                    "binary_little_endian" => Format::LittleEndian,
                    "binary_big_endian" => Format::BigEndian,
                    _ => return Err(fault(format!("unknown format {}", excerpt(name.as_bytes())))),
                });
            }
            ["element", name, count] => {
                let count =
                    count.parse().map_err(|_| fault(format!("bad count in {}", excerpt(line.as_bytes()))))?;
                if elements.iter().any(|e| e.name == name) {
                    return Err(fault(format!("a second element {}", excerpt(name.as_bytes()))));
                }
                elements.push(Element { name: name.to_owned(), count, properties: Vec::new() });
            }
            ["property", ref words @ ..] => {
                let property = property(words).map_err(fault)?;
                let element =
                    elements.last_mut().ok_or_else(|| fault("a property before any element".to_owned()))?;
                element.properties.push(property);
            }
            ["end_header"] => {
                let format = format.ok_or_else(|| fault("the header names no format".to_owned()))?;
                return Ok(Header { format, elements, length: lines.at });
            }
            _ => return Err(fault(format!("unknown header line {}", excerpt(line.as_bytes())))),
        }
    }
}

/// The words after `property`.
fn property(words: &[&str]) -> Result<Property, String> {
    let scalar = |name: &str| {
        Scalar::named(name).ok_or_else(|| format!("unknown type {} of a property", excerpt(name.as_bytes())))
    };
    match *words {
        ["list", count, item, name] => {
            let (count, item) = (scalar(count)?, scalar(item)?);
            if !count.is_integer() {
                return Err(format!(
                    "the length of the list {} is not a whole number",
                    excerpt(name.as_bytes())
                ));
            }
            Ok(Property { name: name.to_owned(), kind: Kind::List { count, item } })
        }
        [kind, name] => Ok(Property { name: name.to_owned(), kind: Kind::Scalar(scalar(kind)?) }),
        _ => Err(format!(
            "a property is `TYPE NAME` or `list TYPE TYPE NAME`, not {}",
            excerpt(words.join(" ").as_bytes())
        )),
    }
}

//! A run of lines of an OBJ file, read without knowledge of the lines before it.

use crate::geometry::file_error::{Fault, Place};
use crate::geometry::number::{Cursor, excerpt};
use glam::{DVec2, DVec3, Vec2, Vec3};

/// In place of an index that a corner does not give.
pub(super) const NONE: i32 = i32::MIN;

/// What a corner refers to, in the order of `v/vt/vn`; also indexes the arrays below.
pub(super) const V: usize = 0;
pub(super) const VT: usize = 1;
pub(super) const VN: usize = 2;

/// The content of some lines.
#[derive(Debug, Default, PartialEq)]
pub(super) struct Chunk<'a> {
    /// The first byte of the lines in the file.
    pub(super) start: usize,
    pub(super) positions: Vec<DVec3>,
    pub(super) uvs: Vec<Vec2>,
    pub(super) normals: Vec<Vec3>,
    /// For `V`, `VT` and `VN`, an index per corner, three corners a triangle; the first is 0. Empty where no corner
    /// gives one.
    pub(super) corners: [Vec<i32>; 3],
    /// For `V`, `VT` and `VN`, the corners whose indices count from the first element of this chunk (and may be
    /// negative: an element of an earlier one).
    pub(super) relative: [Vec<usize>; 3],
    /// What changes before which triangle.
    pub(super) marks: Vec<(usize, Mark<'a>)>,
}

/// A statement that concerns the faces after it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Mark<'a> {
    /// `o` or `g`
    Name(&'a [u8]),
    /// `usemtl`
    Material(&'a [u8]),
    /// `mtllib`
    Library(&'a [u8]),
}

/// A corner as its line gives it: for `V`, `VT` and `VN` the index, and whether it is a relative one.
type Corner = [(i32, bool); 3];

/// Cuts a file into runs of whole lines of about the given size, as `(start, end)`.
///
/// A backslash joins the next line to its line, so that no cut falls there.
pub(super) fn cuts(bytes: &[u8], size: usize) -> Vec<(usize, usize)> {
    let mut cuts = Vec::new();
    let mut start = if bytes.starts_with(b"\xef\xbb\xbf") { 3 } else { 0 };
    while start < bytes.len() {
        let mut end = start.saturating_add(size.max(1) - 1).min(bytes.len());
        loop {
            end += bytes[end..].iter().position(|&b| b == b'\n').map_or(bytes.len() - end, |i| i + 1);
            let line = &bytes[start..end];
            let joined = line.ends_with(b"\\\n") || line.ends_with(b"\\\r\n");
            if !joined || end == bytes.len() {
                break;
            }
        }
        cuts.push((start, end));
        start = end;
    }
    cuts
}

/// Reads the lines from `start` to `end`. The place of a fault is a byte of the file.
pub(super) fn parse(bytes: &[u8], (start, end): (usize, usize)) -> Result<Chunk<'_>, Fault> {
    let mut chunk = Chunk { start, ..Chunk::default() };
    let mut cursor = Cursor::new(&bytes[..end], start);
    let mut polygon = Vec::new();
    while cursor.at < end {
        cursor.skip_blanks();
        let blank = |i: usize| cursor.bytes.get(cursor.at + i).is_none_or(u8::is_ascii_whitespace);
        match cursor.bytes[cursor.at.min(end)..] {
            [b'v', ..] if blank(1) => chunk.position(&mut cursor)?,
            [b'v', b'n', ..] if blank(2) => chunk.normal(&mut cursor)?,
            [b'v', b't', ..] if blank(2) => chunk.uv(&mut cursor)?,
            [b'f', ..] if blank(1) => chunk.face(&mut cursor, &mut polygon)?,
            [b'o' | b'g' | b'u' | b'm', ..] => chunk.mark(&cursor),
            _ => {}
        }
        let rest = &cursor.bytes[cursor.at.min(end)..];
        cursor.at += rest.iter().position(|&b| b == b'\n').map_or(rest.len(), |i| i + 1);
    }
    Ok(chunk)
}

/// Whether the line, or what of it is no comment, ends here.
#[inline]
fn at_end(cursor: &Cursor) -> bool {
    cursor.at_line_end() || cursor.peek() == b'#'
}

#[cold]
fn line_fault(cursor: &Cursor, expected: &'static str) -> Fault {
    let found = match cursor.word() {
        [] => "the line ends".to_owned(),
        word => format!("{} is there", excerpt(word)),
    };
    Fault::new(Place::Byte(cursor.at), format!("{found} where a number is due"), expected)
}

/// An index that counts from 1, or from the last of so many backwards; `None`, and no move, if there is none.
#[inline]
fn index(cursor: &mut Cursor, count: usize) -> Option<(i32, bool)> {
    let start = cursor.at;
    let number = cursor.integer()?;
    let (index, relative) = if number > 0 { (number - 1, false) } else { (count as i64 + number, true) };
    match i32::try_from(index) {
        Ok(index) if number != 0 && index != NONE => Some((index, relative)),
        _ => {
            cursor.at = start;
            None
        }
    }
}

/// The fault of a corner, with the cursor where the trouble is.
#[cold]
fn corner_fault(cursor: &Cursor) -> Fault {
    let mut ahead = *cursor;
    match ahead.integer() {
        Some(number) => Fault::new(Place::Byte(cursor.at), format!("a corner names number {number}"), CORNER),
        None => line_fault(cursor, CORNER),
    }
}

/// The numbers of a line after its keyword (of `keyword` bytes), and how many they are; those beyond `N` are
/// counted only.
#[inline]
fn numbers<const N: usize>(
    cursor: &mut Cursor,
    keyword: usize,
    expected: &'static str,
) -> Result<([f64; N], usize), Fault> {
    cursor.at += keyword;
    let (mut values, mut count) = ([0.0; N], 0);
    loop {
        cursor.skip_blanks();
        if at_end(cursor) {
            return Ok((values, count));
        }
        let value = cursor.float().ok_or_else(|| line_fault(cursor, expected))?;
        if let Some(place) = values.get_mut(count) {
            *place = value;
        }
        count += 1;
    }
}

impl<'a> Chunk<'a> {
    fn position(&mut self, cursor: &mut Cursor) -> Result<(), Fault> {
        const EXPECTED: &str = "a vertex is `v x y z`, with a weight or a colour after it";
        let start = cursor.at;
        let fault = |what: String| Fault::new(Place::Byte(start), what, EXPECTED);
        let ([x, y, z, w], count) = numbers::<4>(cursor, 1, EXPECTED)?;
        let position = match count {
            4 => DVec3::new(x, y, z) / w,
            3 | 6.. => DVec3::new(x, y, z),
            _ => return Err(fault(format!("a vertex of {count} numbers"))),
        };
        if !position.is_finite() {
            return Err(fault(format!("a vertex at {position}, which is not finite")));
        }
        self.positions.push(position);
        Ok(())
    }

    fn normal(&mut self, cursor: &mut Cursor) -> Result<(), Fault> {
        const EXPECTED: &str = "a normal is `vn x y z`";
        let start = cursor.at;
        let (normal, count) = numbers::<3>(cursor, 2, EXPECTED)?;
        let normal = DVec3::from_array(normal).as_vec3();
        if count != 3 || !normal.is_finite() {
            let what = format!("a normal of {count} numbers, {normal}");
            return Err(Fault::new(Place::Byte(start), what, EXPECTED));
        }
        self.normals.push(normal);
        Ok(())
    }

    fn uv(&mut self, cursor: &mut Cursor) -> Result<(), Fault> {
        const EXPECTED: &str = "a texture coordinate is `vt u v`";
        let start = cursor.at;
        let (uv, count) = numbers::<2>(cursor, 2, EXPECTED)?;
        let uv = DVec2::from_array(uv).as_vec2();
        if !(1..=3).contains(&count) || !uv.is_finite() {
            let what = format!("a texture coordinate of {count} numbers, {uv}");
            return Err(Fault::new(Place::Byte(start), what, EXPECTED));
        }
        self.uvs.push(uv);
        Ok(())
    }

    fn face(&mut self, cursor: &mut Cursor, polygon: &mut Vec<Corner>) -> Result<(), Fault> {
        cursor.at += 1;
        polygon.clear();
        loop {
            cursor.skip_blanks();
            if at_end(cursor) {
                break;
            }
            polygon.push(self.corner(cursor).ok_or_else(|| corner_fault(cursor))?);
        }
        // A fan is right for convex polygons. A point or a line becomes a triangle without area, so that it is
        // counted when those are dropped.
        match polygon[..] {
            [] => return Err(line_fault(cursor, "a face is `f` and three corners or more")),
            [a] => self.triangle([a, a, a]),
            [a, b] => self.triangle([a, b, b]),
            [a, ref rest @ ..] => rest.windows(2).for_each(|w| self.triangle([a, w[0], w[1]])),
        }
        Ok(())
    }

    /// `v`, `v/vt`, `v//vn` or `v/vt/vn`; `None`, with the cursor where the trouble is, if it is something else.
    #[inline]
    fn corner(&self, cursor: &mut Cursor) -> Option<Corner> {
        let mut corner = [(NONE, false); 3];
        corner[V] = index(cursor, self.positions.len())?;
        if cursor.peek() == b'/' {
            cursor.at += 1;
            if cursor.peek() != b'/' {
                corner[VT] = index(cursor, self.uvs.len())?;
            }
            if cursor.peek() == b'/' {
                cursor.at += 1;
                corner[VN] = index(cursor, self.normals.len())?;
            }
        }
        // What follows a backslash is seen to where the next corner is due.
        let ends = cursor.peek().is_ascii_whitespace() || matches!(cursor.peek(), b'\\' | b'#');
        ends.then_some(corner)
    }

    #[inline]
    fn triangle(&mut self, triangle: [Corner; 3]) {
        for corner in triangle {
            let number = self.corners[V].len();
            for (kind, (index, relative)) in corner.into_iter().enumerate() {
                if relative {
                    self.relative[kind].push(number);
                }
                let column = &mut self.corners[kind];
                if kind == V || index != NONE || !column.is_empty() {
                    column.resize(number, NONE);
                    column.push(index);
                }
            }
        }
    }

    fn mark(&mut self, cursor: &Cursor<'a>) {
        let rest = &cursor.bytes[cursor.at..];
        let line = &rest[..rest.iter().position(|&b| b == b'\n').unwrap_or(rest.len())];
        let keyword = line.iter().position(u8::is_ascii_whitespace).unwrap_or(line.len());
        let (keyword, value) = (&line[..keyword], line[keyword..].trim_ascii());
        let mark = match keyword {
            b"o" | b"g" => Mark::Name(value),
            b"usemtl" => Mark::Material(value),
            b"mtllib" => Mark::Library(value),
            _ => return,
        };
        self.marks.push((self.corners[V].len() / 3, mark));
    }
}

const CORNER: &str =
    "a corner is `v`, `v/vt`, `v//vn` or `v/vt/vn`, of numbers that count from 1, or back from -1";

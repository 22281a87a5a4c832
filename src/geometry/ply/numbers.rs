//! Where the numbers of a PLY file come from: text, or bytes of either order.

use super::header::Scalar;
use crate::geometry::file_error::{Fault, Place};
use crate::geometry::number::{Cursor, excerpt, line_of};

/// Numbers one after the other. `None` is the end of the file or something else than a number:
/// [`fault`](Self::fault) then says which.
pub(super) trait Numbers {
    fn float(&mut self, scalar: Scalar) -> Option<f64>;
    fn integer(&mut self, scalar: Scalar) -> Option<i64>;
    /// An upper bound of the numbers of a type that may follow.
    fn most(&self, scalar: Scalar) -> usize;
    /// Moves past so many numbers.
    fn skip(&mut self, count: usize, scalar: Scalar) -> Option<()>;
    /// Where the next number is.
    fn place(&self) -> Place;
    /// Why there is no number, in a row of the name `row`.
    fn fault(&self, row: &str) -> Fault;
    /// Whether anything but padding is left.
    fn is_finished(&mut self) -> bool;
}

const TRUNCATED: &str = "the file is cut short or its header promises too much: export or copy it again";

/// Text: numbers between blanks and line ends.
pub(super) struct Ascii<'a>(pub(super) Cursor<'a>);

impl Numbers for Ascii<'_> {
    #[inline]
    fn float(&mut self, _: Scalar) -> Option<f64> {
        self.0.skip_space();
        self.0.float()
    }

    #[inline]
    fn integer(&mut self, _: Scalar) -> Option<i64> {
        self.0.skip_space();
        let start = self.0.at;
        let value = self.0.integer()?;
        if self.0.peek().is_ascii_whitespace() {
            return Some(value);
        }
        self.0.at = start;
        None
    }

    fn most(&self, _: Scalar) -> usize {
        self.0.bytes.len().saturating_sub(self.0.at) / 2 + 1
    }

    fn skip(&mut self, count: usize, scalar: Scalar) -> Option<()> {
        (0..count).try_for_each(|_| self.float(scalar).map(|_| ()))
    }

    fn place(&self) -> Place {
        Place::Line(line_of(self.0.bytes, self.0.at))
    }

    fn fault(&self, row: &str) -> Fault {
        match self.0.word() {
            [] => Fault::new(self.place(), format!("the file ends in {row}"), TRUNCATED),
            word => {
                let what = format!("{} in {row} is not a number of its type", excerpt(word));
                Fault::new(self.place(), what, "mend the number")
            }
        }
    }

    fn is_finished(&mut self) -> bool {
        self.0.skip_space();
        self.0.at >= self.0.bytes.len()
    }
}

/// Bytes of one order, the most significant first if `BIG`.
pub(super) struct Binary<'a, const BIG: bool> {
    pub(super) bytes: &'a [u8],
    pub(super) at: usize,
}

impl<const BIG: bool> Binary<'_, BIG> {
    #[inline]
    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let mut bytes: [u8; N] = *self.bytes.get(self.at..)?.first_chunk()?;
        self.at += N;
        if BIG {
            bytes.reverse();
        }
        Some(bytes)
    }
}

impl<const BIG: bool> Numbers for Binary<'_, BIG> {
    #[inline]
    fn float(&mut self, scalar: Scalar) -> Option<f64> {
        match scalar {
            Scalar::F32 => self.take().map(|b| f64::from(f32::from_le_bytes(b))),
            Scalar::F64 => self.take().map(f64::from_le_bytes),
            _ => self.integer(scalar).map(|x| x as f64),
        }
    }

    #[inline]
    fn integer(&mut self, scalar: Scalar) -> Option<i64> {
        match scalar {
            Scalar::I8 => self.take().map(|b| i64::from(i8::from_le_bytes(b))),
            Scalar::U8 => self.take().map(|b| i64::from(u8::from_le_bytes(b))),
            Scalar::I16 => self.take().map(|b| i64::from(i16::from_le_bytes(b))),
            Scalar::U16 => self.take().map(|b| i64::from(u16::from_le_bytes(b))),
            Scalar::I32 => self.take().map(|b| i64::from(i32::from_le_bytes(b))),
            Scalar::U32 => self.take().map(|b| i64::from(u32::from_le_bytes(b))),
            Scalar::F32 | Scalar::F64 => None,
        }
    }

    fn most(&self, scalar: Scalar) -> usize {
        self.bytes.len().saturating_sub(self.at) / scalar.size()
    }

    fn skip(&mut self, count: usize, scalar: Scalar) -> Option<()> {
        (count <= self.most(scalar)).then(|| self.at += count * scalar.size())
    }

    fn place(&self) -> Place {
        Place::Byte(self.at)
    }

    fn fault(&self, row: &str) -> Fault {
        Fault::new(self.place(), format!("the file ends in {row}"), TRUNCATED)
    }

    fn is_finished(&mut self) -> bool {
        // Some writers end with a line feed or pad with zeros.
        self.bytes[self.at..].iter().all(|&b| b == 0 || b.is_ascii_whitespace())
    }
}

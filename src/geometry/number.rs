//! Numbers out of text, without a copy: the inner loop of the text readers.

/// Powers of ten that an f64 holds exactly.
const EXACT_POWERS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18,
    1e19, 1e20, 1e21, 1e22,
];

/// A place in a text that moves over numbers and blanks.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cursor<'a> {
    pub(super) bytes: &'a [u8],
    pub(super) at: usize,
}

impl<'a> Cursor<'a> {
    pub(super) fn new(bytes: &'a [u8], at: usize) -> Self {
        Self { bytes, at }
    }

    /// The byte here, or a line feed at the end.
    #[inline]
    pub(super) fn peek(&self) -> u8 {
        self.bytes.get(self.at).copied().unwrap_or(b'\n')
    }

    /// Moves past blanks within a line (and past a backslash that joins the next line to this one).
    #[inline]
    pub(super) fn skip_blanks(&mut self) {
        loop {
            match self.peek() {
                b' ' | b'\t' | b'\r' => self.at += 1,
                b'\\' => match self.bytes.get(self.at + 1..) {
                    Some([b'\n', ..]) => self.at += 2,
                    Some([b'\r', b'\n', ..]) => self.at += 3,
                    _ => return,
                },
                _ => return,
            }
        }
    }

    /// Moves past blanks and line ends.
    #[inline]
    pub(super) fn skip_space(&mut self) {
        while self.bytes.get(self.at).is_some_and(u8::is_ascii_whitespace) {
            self.at += 1;
        }
    }

    /// Whether the line (less its blanks) ends here.
    #[inline]
    pub(super) fn at_line_end(&self) -> bool {
        self.peek() == b'\n'
    }

    /// Everything up to the next blank or line end, which may be nothing; does not move.
    pub(super) fn word(&self) -> &'a [u8] {
        let rest = &self.bytes[self.at.min(self.bytes.len())..];
        let end = rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
        &rest[..end]
    }

    /// The number that starts here and ends at a blank; `None`, and no move, if there is none.
    ///
    /// The same f64 as `str::parse` gives, bit for bit: a mantissa below 2^53 times or over an exact power of ten
    /// is rounded once (Clinger 1990, "How to read floating point numbers accurately"); others go to `str::parse`.
    #[inline]
    pub(super) fn float(&mut self) -> Option<f64> {
        let start = self.at;
        let negative = self.peek() == b'-';
        self.at += usize::from(matches!(self.peek(), b'-' | b'+'));
        let mut mantissa = 0_u64;
        let whole = self.digits(&mut mantissa);
        let mut fraction = 0;
        if self.peek() == b'.' {
            self.at += 1;
            fraction = self.digits(&mut mantissa);
        }
        let digits = whole + fraction;
        let mut power = -(fraction as i64);
        let mut plain = (1..=19).contains(&digits) && mantissa < 1 << 53;
        if matches!(self.peek(), b'e' | b'E') {
            self.at += 1;
            let minus = self.peek() == b'-';
            self.at += usize::from(matches!(self.peek(), b'-' | b'+'));
            let mut exponent = 0;
            plain &= (1..=4).contains(&self.digits(&mut exponent));
            power += if minus { -(exponent as i64) } else { exponent as i64 };
        }
        plain &= self.peek().is_ascii_whitespace() && power.unsigned_abs() <= 22;
        if !plain {
            self.at = start;
            return self.hard_float();
        }
        let scale = EXACT_POWERS[power.unsigned_abs() as usize];
        let value = if power < 0 { mantissa as f64 / scale } else { mantissa as f64 * scale };
        Some(if negative { -value } else { value })
    }

    /// What [`float`](Self::float) leaves to the standard library.
    #[cold]
    fn hard_float(&mut self) -> Option<f64> {
        // A backslash may join the next line.
        let word = self.word();
        let word = word.strip_suffix(b"\\").unwrap_or(word);
        let value = std::str::from_utf8(word).ok()?.parse().ok()?;
        self.at += word.len();
        Some(value)
    }

    /// Moves past digits and returns how many they are; appends them to `value`, which wraps round beyond 19.
    #[inline]
    fn digits(&mut self, value: &mut u64) -> usize {
        let start = self.at;
        while let Some(digit) = self.bytes.get(self.at).map(|b| b.wrapping_sub(b'0')).filter(|&d| d < 10) {
            *value = value.wrapping_mul(10).wrapping_add(u64::from(digit));
            self.at += 1;
        }
        self.at - start
    }

    /// The whole number that starts here, whatever follows; `None`, and no move, if there is none or it does not
    /// fit 15 digits.
    #[inline]
    pub(super) fn integer(&mut self) -> Option<i64> {
        let start = self.at;
        let negative = self.peek() == b'-';
        self.at += usize::from(matches!(self.peek(), b'-' | b'+'));
        let mut value = 0;
        if !(1..=15).contains(&self.digits(&mut value)) {
            self.at = start;
            return None;
        }
        Some(if negative { -(value as i64) } else { value as i64 })
    }
}

/// A piece of a file for a message: readable, and short whatever the file holds.
pub(super) fn excerpt(bytes: &[u8]) -> String {
    const LONGEST: usize = 40;
    let text = String::from_utf8_lossy(&bytes[..bytes.len().min(LONGEST)]);
    let more = if bytes.len() > LONGEST { "..." } else { "" };
    format!("`{}{more}`", text.escape_debug())
}

/// The line of a byte; the first is 1.
pub(super) fn line_of(bytes: &[u8], at: usize) -> usize {
    1 + bytes[..at.min(bytes.len())].iter().filter(|&&b| b == b'\n').count()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn float(text: &str) -> Option<f64> {
        let mut cursor = Cursor::new(text.as_bytes(), 0);
        let value = cursor.float();
        assert_eq!(cursor.at, if value.is_some() { text.len() } else { 0 }, "{text}");
        value
    }

    fn same_as_the_standard_library(text: &str) {
        let bits = |x: Option<f64>| x.map(|x| if x.is_nan() { f64::NAN.to_bits() } else { x.to_bits() });
        assert_eq!(bits(float(text)), bits(text.parse().ok()), "{text}");
    }

    #[test]
    fn floats_are_those_of_the_standard_library() {
        for text in [
            "0",
            "-0",
            "+1",
            ".5",
            "5.",
            ".",
            "-",
            "",
            "e5",
            "1e",
            "1e+",
            "1e5",
            "1E-5",
            "1e400",
            "-1e400",
            "1e-400",
            "9007199254740991",
            "9007199254740993",
            "18446744073709551616",
            "00000000000000000000000000001.5",
            "0.000000000000000000000000000000001",
            "123456789012345678901234567890e-20",
            "1e22",
            "1e23",
            "8.5e22",
            "1e99999",
            "1e00000000022",
            "inf",
            "-Infinity",
            "nan",
            "1.2.3",
            "1x",
            "0x10",
            "1,5",
            "1_000",
            "4.9e-324",
            "2.2250738585072011e-308",
            "0.1",
            "-0.0504344",
            "179769313486231580793e289",
        ] {
            same_as_the_standard_library(text);
        }
    }

    #[test]
    fn lines_are_counted_from_one() {
        assert_eq!([0, 2, 3, 99].map(|at| line_of(b"ab\ncd\n", at)), [1, 1, 2, 3]);
    }

    proptest! {
        #[test]
        fn any_float_is_that_of_the_standard_library(value in any::<f64>(), digits in 0_usize..25) {
            same_as_the_standard_library(&format!("{value}"));
            same_as_the_standard_library(&format!("{value:.digits$e}"));
        }

        #[test]
        fn any_text_is_read_as_the_standard_library_reads_it(text in "[-+]?[0-9]{0,21}\\.?[0-9]{0,21}([eE][-+]?[0-9]{0,5})?") {
            same_as_the_standard_library(&text);
        }
    }
}

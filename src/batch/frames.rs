//! Numbers of frames, as people write them.

use std::str::FromStr;

/// A list of frames: `7`, `1-100`, `1-100x3` (every third, from the first), or several of these with commas between.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Frames(Vec<u32>);

/// More frames than anybody means.
const MOST: usize = 1_000_000;

impl Frames {
    /// The numbers, in the order in which they were written.
    pub fn numbers(&self) -> &[u32] {
        &self.0
    }
}

impl FromStr for Frames {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let mut numbers = vec![];
        for range in text.split(',') {
            let form = || format!("`{range}` is no list of frames: write 7, 1-100 or 1-100x3");
            let number = |s: &str| s.trim().parse::<u32>().map_err(|_| form());
            let (ends, step) = match range.split_once('x') {
                Some((ends, step)) => (ends, number(step)?),
                None => (range, 1),
            };
            let (first, last) = match ends.split_once('-') {
                Some((first, last)) => (number(first)?, number(last)?),
                None => (number(ends)?, number(ends)?),
            };
            if step == 0 || last < first {
                return Err(form());
            }
            if ((last - first) / step) as usize >= MOST - numbers.len().min(MOST) {
                return Err(format!("`{text}` has more than {MOST} frames"));
            }
            numbers.extend((first..=last).step_by(step as usize));
        }
        Ok(Self(numbers))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_are_read_as_written() {
        let frames = |text: &str| text.parse::<Frames>().unwrap().0;
        assert_eq!(frames("7"), [7]);
        assert_eq!(frames("1-10x3"), [1, 4, 7, 10]);
        assert_eq!(frames("5-6, 1"), [5, 6, 1]);
        assert_eq!(frames("4294967290-4294967295x4"), [4_294_967_290, 4_294_967_294]);
        for bad in ["", "x", "3-1", "1-3x0", "-1", "1-", "1,,2", "0-4294967295"] {
            assert!(bad.parse::<Frames>().is_err(), "{bad}");
        }
    }
}

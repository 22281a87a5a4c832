//! Pixels as words of 32 bits, each a channel of the file: the bits come back as they went.

use crate::core::Fixed;
use crate::film::{GuidePixel, Pixel};

/// What a file holds of each pixel in `N` words, each in a channel of its own.
pub(super) trait InWords<const N: usize>: Default {
    /// The sums, each of 4 words, and the count, of one.
    const SUMS: &[&str];
    /// The name of the count.
    const COUNT: &str;

    /// The sums' words and the count, in the order of their names.
    fn to_words(&self) -> [u32; N];

    /// What [`to_words`](Self::to_words) had.
    fn from_words(words: &[u32; N]) -> Self;

    /// The names of the channels: of a sum's words, least significant first, then of the count.
    fn names() -> impl Iterator<Item = String> {
        let words = Self::SUMS.iter().flat_map(|sum| (0..4).map(move |word| format!("{sum}.{word}")));
        words.chain([Self::COUNT.to_owned()])
    }
}

impl InWords<17> for Pixel {
    const SUMS: &[&str] = &["sum.r", "sum.g", "sum.b", "squares"];
    const COUNT: &str = "count";

    fn to_words(&self) -> [u32; 17] {
        let mut words = [0; 17];
        put(&mut words, 0, self.sum);
        put(&mut words, 3, [self.sum_of_squares]);
        words[16] = self.count;
        words
    }

    fn from_words(words: &[u32; 17]) -> Self {
        let ([sum_of_squares], count) = (take(words, 3), words[16]);
        Self { sum: take(words, 0), sum_of_squares, count }
    }
}

impl InWords<41> for GuidePixel {
    const SUMS: &[&str] = &[
        "albedo.r",
        "albedo.g",
        "albedo.b",
        "normal.x",
        "normal.y",
        "normal.z",
        "depth",
        "squares.r",
        "squares.g",
        "squares.b",
    ];
    const COUNT: &str = "met";

    fn to_words(&self) -> [u32; 41] {
        let mut words = [0; 41];
        put(&mut words, 0, self.albedo);
        put(&mut words, 3, self.normal);
        put(&mut words, 6, [self.depth]);
        put(&mut words, 7, self.squares);
        words[40] = self.met;
        words
    }

    fn from_words(words: &[u32; 41]) -> Self {
        let ([depth], met) = (take(words, 6), words[40]);
        Self { albedo: take(words, 0), normal: take(words, 3), depth, squares: take(words, 7), met }
    }
}

/// Writes sums from the sum number `first` on.
fn put<const F: i32, const SUMS: usize>(words: &mut [u32], first: usize, sums: [Fixed<F>; SUMS]) {
    for (four, sum) in words[4 * first..].chunks_exact_mut(4).zip(sums) {
        four.copy_from_slice(&sum.to_words());
    }
}

/// Reads sums from the sum number `first` on.
fn take<const F: i32, const SUMS: usize>(words: &[u32], first: usize) -> [Fixed<F>; SUMS] {
    std::array::from_fn(|sum| {
        let at = 4 * (first + sum);
        Fixed::from_words([words[at], words[at + 1], words[at + 2], words[at + 3]])
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whether each word is a name's, and comes back to the place where it was.
    fn round_trip<const N: usize, T: InWords<N>>() {
        let words: [u32; N] = std::array::from_fn(|i| (i as u32).wrapping_mul(0x9e37_79b9));
        assert_eq!(T::from_words(&words).to_words(), words);
        let names: std::collections::BTreeSet<_> = T::names().collect();
        assert_eq!(names.len(), N);
    }

    #[test]
    fn words_come_back_and_have_names() {
        round_trip::<17, Pixel>();
        round_trip::<41, GuidePixel>();
        assert!(
            <Pixel as InWords<17>>::names().all(|a| <GuidePixel as InWords<41>>::names().all(|b| a != b))
        );
    }
}

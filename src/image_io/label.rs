//! Words and pictures put together: contact sheets and labelled figures, in 8-bit sRGB.
//!
//! The letters are the 8 x 8 bitmap font of the IBM PC's graphics card (public domain), ASCII only.

use super::{Image, ImageError, srgb, write_rgb8};
use std::path::Path;

/// Edge of a letter's cell in pixels at scale 1.
pub const LETTER: u32 = 8;

/// An 8-bit sRGB picture to draw on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Canvas {
    width: u32,
    height: u32,
    bytes: Vec<u8>,
}

impl Canvas {
    /// A canvas of one colour.
    pub fn new(width: u32, height: u32, colour: [u8; 3]) -> Self {
        Self { width, height, bytes: colour.repeat(width as usize * height as usize) }
    }

    /// Linear light made brighter by `exposure` stops, clipped to what sRGB shows.
    pub fn of_image(image: &Image, exposure: f32) -> Self {
        let factor = exposure.exp2();
        let bytes = image.pixels.iter().flat_map(|&p| srgb::encode_8_bit(p * factor)).collect();
        Self { width: image.width, height: image.height, bytes }
    }

    /// Columns and rows.
    pub fn size(&self) -> [u32; 2] {
        [self.width, self.height]
    }

    /// The colour of a pixel; `None` outside.
    pub fn pixel(&self, x: u32, y: u32) -> Option<[u8; 3]> {
        let at = self.offset(i64::from(x), i64::from(y))?;
        self.bytes[at..at + 3].try_into().ok()
    }

    fn offset(&self, x: i64, y: i64) -> Option<usize> {
        let inside = (0..i64::from(self.width)).contains(&x) && (0..i64::from(self.height)).contains(&y);
        inside.then_some(3 * (y as usize * self.width as usize + x as usize))
    }

    fn put(&mut self, x: i64, y: i64, colour: [u8; 3]) {
        if let Some(at) = self.offset(x, y) {
            self.bytes[at..at + 3].copy_from_slice(&colour);
        }
    }

    /// Draws another picture with its upper left corner at `(x, y)`; what lies outside is cut off.
    pub fn draw(&mut self, other: &Self, x: u32, y: u32) {
        for row in 0..other.height {
            for column in 0..other.width {
                let colour = other.pixel(column, row).expect("within the other picture");
                self.put(i64::from(x) + i64::from(column), i64::from(y) + i64::from(row), colour);
            }
        }
    }

    /// Writes a line of text with its upper left corner at `(x, y)`, in letters of `scale` times 8 x 8 pixels.
    ///
    /// What lies outside is cut off; a character that the font lacks is a question mark.
    pub fn text(&mut self, text: &str, x: u32, y: u32, scale: u32, colour: [u8; 3]) {
        for (i, letter) in text.chars().enumerate() {
            let rows =
                font8x8::legacy::BASIC_LEGACY[if letter.is_ascii() { letter as usize } else { '?' as usize }];
            let left = i64::from(x) + i as i64 * i64::from(LETTER * scale);
            for (row, bits) in (0..LETTER).zip(rows) {
                for column in (0..LETTER).filter(|column| bits >> column & 1 == 1) {
                    self.square(left + i64::from(column * scale), i64::from(y + row * scale), scale, colour);
                }
            }
        }
    }

    fn square(&mut self, x: i64, y: i64, edge: u32, colour: [u8; 3]) {
        for dy in 0..i64::from(edge) {
            for dx in 0..i64::from(edge) {
                self.put(x + dx, y + dy, colour);
            }
        }
    }

    /// The picture at most `width` x `height` large with its proportions kept: each pixel the mean of those that it
    /// stands for. A picture that fits is left as it is.
    pub fn shrunk(&self, width: u32, height: u32) -> Self {
        let factor =
            (f64::from(width) / f64::from(self.width)).min(f64::from(height) / f64::from(self.height));
        if factor >= 1.0 {
            return self.clone();
        }
        let side = |n: u32| ((f64::from(n) * factor).round() as u32).max(1);
        let mut small = Self::new(side(self.width), side(self.height), [0; 3]);
        for y in 0..small.height {
            for x in 0..small.width {
                let colour = self.mean(span(x, small.width, self.width), span(y, small.height, self.height));
                small.put(i64::from(x), i64::from(y), colour);
            }
        }
        small
    }

    /// Mean in linear light: a mean of sRGB values would darken fine patterns.
    fn mean(&self, columns: std::ops::Range<u32>, rows: std::ops::Range<u32>) -> [u8; 3] {
        let mut sum = crate::core::Rgb::BLACK;
        let count = columns.len() * rows.len();
        for y in rows {
            for x in columns.clone() {
                let bytes = self.pixel(x, y).expect("a span lies within the picture");
                sum += crate::core::Rgb::from(bytes.map(|b| srgb::decode(f32::from(b) / 255.0)));
            }
        }
        srgb::encode_8_bit(sum * (1.0 / count as f32))
    }

    /// Writes the picture as a PNG.
    ///
    /// # Errors
    /// If the file cannot be written; an older one of that name is then untouched.
    pub fn write_png(&self, path: &Path) -> Result<(), ImageError> {
        write_rgb8(path, self.width, self.height, &self.bytes)
    }
}

/// The pixels of `from` that pixel `i` of `to` stands for: at least one.
fn span(i: u32, to: u32, from: u32) -> std::ops::Range<u32> {
    let cut = |i: u32| (u64::from(i) * u64::from(from) / u64::from(to)) as u32;
    cut(i)..cut(i + 1).max(cut(i) + 1)
}

/// Pictures with a line of text below each, in a grid that is about as wide as high; the cells are as large as the
/// largest picture and as the longest label asks, up to twice the picture's width.
pub fn contact_sheet(pictures: &[(Canvas, String)]) -> Canvas {
    const GAP: u32 = 8;
    let [width, height] = pictures.iter().fold([1, 1], |[w, h], (p, _)| [w.max(p.width), h.max(p.height)]);
    let label = pictures.iter().map(|(_, text)| text.chars().count() as u32 * LETTER).max().unwrap_or(0);
    let cell = [width.max(label.min(2 * width)) + GAP, height + LETTER + 2 * GAP];
    let columns = (1..).find(|n| n * n >= pictures.len() as u32).unwrap_or(1).max(1);
    let rows = (pictures.len() as u32).div_ceil(columns).max(1);
    let mut sheet = Canvas::new(columns * cell[0] + GAP, rows * cell[1], [24; 3]);
    for (i, (picture, text)) in (0..).zip(pictures) {
        let [x, y] = [GAP + i % columns * cell[0], GAP + i / columns * cell[1]];
        sheet.draw(picture, x, y);
        let letters = ((cell[0] - GAP) / LETTER) as usize;
        sheet.text(&cut(text, letters), x, y + height + GAP / 2, 1, [230; 3]);
    }
    sheet
}

/// The end of a text that is too long is what tells it from its neighbours.
fn cut(text: &str, letters: usize) -> String {
    let surplus = text.chars().count().saturating_sub(letters);
    if surplus == 0 {
        text.to_owned()
    } else {
        format!("..{}", text.chars().skip(surplus + 2).collect::<String>())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::Rgb;

    const INK: [u8; 3] = [255; 3];

    fn drawn(canvas: &Canvas) -> String {
        let row = |y| -> String {
            (0..canvas.width).map(|x| if canvas.pixel(x, y) == Some(INK) { '#' } else { '.' }).collect()
        };
        (0..canvas.height).map(row).collect::<Vec<_>>().join("\n")
    }

    #[test]
    fn letters_are_drawn_upright_and_cut_off_at_the_edge() {
        let mut canvas = Canvas::new(12, 8, [0; 3]);
        canvas.text("LL", 0, 0, 1, INK);
        let expected = "####....####\n.##......##.\n.##......##.\n.##......##.\n.##...#..##.\n.##..##..##.\n#######.####\n............";
        assert_eq!(drawn(&canvas), expected);
        canvas.text("\u{e9}", 100, 100, 3, INK);
        assert_eq!(drawn(&canvas), expected);
    }

    #[test]
    fn a_picture_shrinks_by_its_mean_light() {
        let image = Image::from_fn(40, 20, |x, _| Rgb::grey((x % 2) as f32));
        let small = Canvas::of_image(&image, 0.0).shrunk(10, 10);
        assert_eq!(small.size(), [10, 5]);
        assert_eq!(small.pixel(3, 3), Some([188; 3]));
        let large = small.shrunk(100, 100);
        assert_eq!(large, small);
    }

    #[test]
    fn a_sheet_holds_every_picture_and_its_words() {
        let picture = |n: u8| (Canvas::new(20, 10, [n; 3]), format!("a very long label {n}"));
        let sheet = contact_sheet(&[picture(100), picture(101), picture(102)]);
        let found = |n: u8| sheet.bytes.chunks(3).filter(|p| *p == [n; 3]).count();
        assert_eq!([100, 101, 102].map(found), [200; 3]);
        assert!(found(230) > 50);
        assert_eq!(cut("a very long label 7", 7), "..bel 7");
        contact_sheet(&[]);
    }
}

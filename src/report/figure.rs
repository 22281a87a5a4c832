//! Pictures in a page.

use super::escape;
use super::raster::Raster;

/// Pictures with fewer columns than these are enlarged pixel by pixel.
const SMALL: u32 = 480;

fn img(picture: &Raster, class: &str, alt: &str) -> String {
    let small = if picture.width < SMALL { " pixels" } else { "" };
    format!(
        "<img class=\"{class}{small}\" width=\"{}\" height=\"{}\" alt=\"{}\" src=\"{}\">",
        picture.width,
        picture.height,
        escape(alt),
        picture.data_uri()
    )
}

/// A picture and what it is; `caption` is HTML, `alt` is text.
pub fn figure(picture: &Raster, alt: &str, caption: &str) -> String {
    format!("<figure>\n{}\n<figcaption>{caption}</figcaption>\n</figure>\n", img(picture, "plain", alt))
}

/// Two pictures of one size, one over the other, with a handle that the arrow keys move too; names are text.
pub fn slider(pictures: [&Raster; 2], names: [&str; 2], caption: &str) -> String {
    let [under, over] = [0, 1].map(|i| img(pictures[i], ["under", "over"][i], names[i]));
    let [left, right] = names.map(escape);
    // On a narrow screen only the first word has room.
    let tag = |name: &str| match name.split_once(' ') {
        Some((first, rest)) => format!("{} <small>{}</small>", escape(first), escape(rest)),
        None => escape(name),
    };
    let [left_tag, right_tag] = names.map(tag);
    format!(
        "<figure class=\"ab\">\n<div class=\"stack\">{under}{over}<span class=\"edge\" aria-hidden=\"true\"></span>\
         <span class=\"tag left\">{left_tag}</span><span class=\"tag right\">{right_tag}</span>\
         <input type=\"range\" min=\"0\" max=\"100\" value=\"50\" step=\"1\" \
         aria-label=\"Percentage of the width that shows {left}; the rest shows {right}\"></div>\n\
         <figcaption>{caption}</figcaption>\n</figure>\n"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slider_can_be_named_and_moved() {
        let dot = Raster::new(1, 1, vec![0, 0, 0, 255]);
        let html = slider([&dot, &dot], ["A & co", "B"], "c");
        assert_eq!(html.matches("data:image/png;base64,").count(), 2);
        assert!(html.contains("type=\"range\"") && html.contains("shows A &amp; co;"));
        assert!(figure(&dot, "a \"b\"", "c").contains("alt=\"a &quot;b&quot;\""));
    }
}

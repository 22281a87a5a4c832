//! Pieces of reports: one HTML file that needs nothing else, light or dark as the reader's system is, for any width
//! of screen and without a mouse.
//!
//! Knows pictures and numbers, not what they mean. Read [`page`] first; [`Bar`] and [`bars`] draw charts, [`slider`]
//! lays two pictures over each other, [`scatter()`] draws points on logarithmic axes, [`raster`] makes pictures of numbers.

mod bars;
mod figure;
pub mod raster;
mod scatter;

pub use bars::{Bar, bars};
pub use figure::{figure, slider};
pub use scatter::{Point, Scatter, scatter};

/// Text for HTML, inside elements and quoted attributes.
pub fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\'' => escaped.push_str("&#39;"),
            c => escaped.push(c),
        }
    }
    escaped
}

/// A whole page; `body` is HTML, `title` is text.
pub fn page(title: &str, body: &str) -> String {
    scripted_page(title, body, "")
}

/// A [`page`] with a script of its own.
pub fn scripted_page(title: &str, body: &str, own: &str) -> String {
    let (title, style, script) = (escape(title), include_str!("page.css"), include_str!("page.js"));
    // The policy lets the page load nothing: what it shows, it holds.
    format!(
        "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta name=\"color-scheme\" content=\"light dark\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; img-src data:; \
         style-src 'unsafe-inline'; script-src 'unsafe-inline'\">\n\
         <link rel=\"icon\" href=\"data:,\">\n\
         <title>{title}</title>\n<style>\n{style}</style>\n</head>\n<body>\n<main>\n{body}</main>\n\
         <script>\n{script}{own}</script>\n</body>\n</html>\n"
    )
}

/// Data for scripts to read: JSON, kept from ending its element.
pub fn data(id: &str, json: &str) -> String {
    let json = json.replace('<', "\\u003c");
    format!("<script type=\"application/json\" id=\"{}\">{json}</script>\n", escape(id))
}

/// A section with a heading; both the heading and the id are text.
pub fn section(id: &str, heading: &str, body: &str) -> String {
    let (id, heading) = (escape(id), escape(heading));
    format!("<section aria-labelledby=\"{id}\">\n<h2 id=\"{id}\">{heading}</h2>\n{body}</section>\n")
}

/// A table that scrolls sideways where it is too wide; cells are HTML. The first column holds the rows' names.
pub fn table(caption: &str, head: &[String], rows: &[Vec<String>]) -> String {
    let caption = escape(caption);
    let heads: String = head.iter().map(|cell| format!("<th scope=\"col\">{cell}</th>")).collect();
    let row = |cells: &Vec<String>| {
        let cells = cells.iter().enumerate().map(|(i, cell)| match i {
            0 => format!("<th scope=\"row\">{cell}</th>"),
            _ => format!("<td>{cell}</td>"),
        });
        format!("<tr>{}</tr>\n", cells.collect::<String>())
    };
    let rows: String = rows.iter().map(row).collect();
    format!(
        "<div class=\"scroll\" tabindex=\"0\" role=\"region\" aria-label=\"{caption}\"><table>\n\
         <caption>{caption}</caption>\n<thead><tr>{heads}</tr></thead>\n<tbody>\n{rows}</tbody></table></div>\n"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_cannot_become_markup() {
        assert_eq!(escape("<b a=\"1\" c='2'>&"), "&lt;b a=&quot;1&quot; c=&#39;2&#39;&gt;&amp;");
        let page = page("</title><script>", "");
        assert!(page.contains("<title>&lt;/title&gt;&lt;script&gt;</title>"));
    }

    #[test]
    fn data_cannot_end_its_element() {
        let html = data("a", "{\"b\":\"</script>\"}");
        assert_eq!(html.matches("</script>").count(), 1);
        assert!(html.contains(r"\u003c/script>"));
    }

    #[test]
    fn a_page_asks_for_nothing() {
        let page = page("a", &section("b", "c", &table("d", &["e".into()], &[vec!["f".into()]])));
        for outside in ["http:", "https:", "src=\"/", "@import", "url("] {
            assert!(!page.contains(outside), "{outside}");
        }
    }
}

//! Bar charts as lists: each bar says its name and its value, so that nobody has to measure it.

use super::escape;

/// One bar.
#[derive(Clone, Debug)]
pub struct Bar {
    /// What is measured; text.
    pub name: String,
    /// Its number in text, with its unit.
    pub value: String,
    /// Its length, in the same unit as all bars of the chart; at least 0.
    pub length: f64,
    /// Where measurements lay, if there were several.
    pub spread: Option<[f64; 2]>,
    /// Number of its series, which chooses its colour: from 0.
    pub series: usize,
}

/// Colours that `page.css` has.
const COLOURS: usize = 8;

/// A chart with a heading, in text; bars begin at zero, and the longest takes the whole width.
pub fn bars(heading: &str, bars: &[Bar]) -> String {
    let reach = |bar: &Bar| bar.spread.map_or(bar.length, |[_, most]| most.max(bar.length));
    let longest = bars.iter().map(reach).fold(0.0, f64::max);
    let percent = |length: f64| if longest > 0.0 { 100.0 * length / longest } else { 0.0 };
    let item = |bar: &Bar| {
        let spread = bar.spread.map_or_else(String::new, |[least, most]| {
            let (from, to) = (percent(least), percent(most));
            format!("<i style=\"left:{from:.2}%;width:{:.2}%\"></i>", to - from)
        });
        format!(
            "<li><span class=\"name\">{}</span><span class=\"track\" aria-hidden=\"true\">\
             <b class=\"s{}\" style=\"width:{:.2}%\"></b>{spread}</span><span class=\"value\">{}</span></li>\n",
            escape(&bar.name),
            bar.series % COLOURS,
            percent(bar.length),
            escape(&bar.value)
        )
    };
    let items: String = bars.iter().map(item).collect();
    format!("<h3>{}</h3>\n<ul class=\"bars\">\n{items}</ul>\n", escape(heading))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bar(length: f64, spread: Option<[f64; 2]>) -> Bar {
        Bar { name: "a<b".into(), value: "1 s".into(), length, spread, series: 9 }
    }

    #[test]
    fn the_longest_reach_is_the_whole_width() {
        let html = bars("c", &[bar(1.0, Some([0.5, 2.0])), bar(0.5, None)]);
        assert!(html.contains("width:50.00%\"></b><i style=\"left:25.00%;width:75.00%\">"), "{html}");
        assert!(html.contains("class=\"s1\" style=\"width:25.00%\""), "{html}");
        assert!(html.contains("a&lt;b"));
    }

    #[test]
    fn a_chart_of_nothing_has_no_width() {
        assert!(bars("c", &[bar(0.0, None)]).contains("width:0.00%"));
    }
}

//! Points on logarithmic axes as SVG: each can be focused, and names the data that it stands for.

use super::escape;
use std::fmt::Write;

/// One point.
#[derive(Clone, Debug)]
pub struct Point {
    /// Its place, both above 0.
    pub at: [f64; 2],
    /// From where to where it may lie, across and up.
    pub reach: [[f64; 2]; 2],
    /// What stands beside it, in text; may be empty.
    pub label: String,
    /// What it is and shows, in text, for those who do not see it.
    pub name: String,
    /// What a script finds it by.
    pub key: usize,
    /// How it is drawn: words of `page.css` such as `front`, `base`, `faint`, `floor`.
    pub class: &'static str,
}

/// A chart of points.
#[derive(Clone, Debug)]
pub struct Scatter<'a> {
    /// What it shows, in text.
    pub title: &'a str,
    /// Names of the axes.
    pub axes: [&'a str; 2],
    /// The points; later ones are drawn over earlier ones.
    pub points: &'a [Point],
    /// A line through these places, from left to right.
    pub line: &'a [[f64; 2]],
    /// Width and height in its own units, in which text is 13 high.
    pub size: [f64; 2],
}

/// Room around the points for ticks and names.
const LEFT: f64 = 58.0;
const RIGHT: f64 = 14.0;
const TOP: f64 = 12.0;
const BOTTOM: f64 = 46.0;

/// An axis from place to unit.
struct Axis {
    low: f64,
    high: f64,
    from: f64,
    to: f64,
}

impl Axis {
    /// Around the values, in decades with some room.
    fn around(values: impl Iterator<Item = f64>, from: f64, to: f64) -> Self {
        let logs = values.filter(|v| *v > 0.0).map(f64::log10);
        let (low, high) = logs.fold((f64::MAX, f64::MIN), |(l, h), x| (l.min(x), h.max(x)));
        let (low, high) = if low > high { (-1.0, 1.0) } else { (low, high) };
        let room = (0.08 * (high - low)).max(0.08);
        Self { low: low - room, high: high + room, from, to }
    }

    fn at(&self, value: f64) -> f64 {
        let share = (value.max(1e-300).log10() - self.low) / (self.high - self.low);
        self.from + share.clamp(0.0, 1.0) * (self.to - self.from)
    }

    /// Powers of ten, with 2 and 5 between them where there is room.
    fn ticks(&self) -> Vec<f64> {
        let steps: &[f64] = match self.high - self.low {
            wide if wide > 2.5 => &[1.0],
            wide if wide > 1.2 => &[1.0, 3.0],
            _ => &[1.0, 2.0, 5.0],
        };
        let decades = self.low.floor() as i32..=self.high.ceil() as i32;
        let all = decades.flat_map(|d| steps.iter().map(move |s| s * 10f64.powi(d)));
        all.filter(|t| (self.low..=self.high).contains(&t.log10())).collect()
    }
}

/// A number on an axis.
fn tick_text(value: f64) -> String {
    if (1e-3..1e4).contains(&value) {
        format!("{}", (value * 1e6).round() / 1e6)
    } else {
        format!("{value:.0e}")
    }
}

/// The chart. Dashed lines fall by the slope -1: along them, error times time is the same.
pub fn scatter(chart: &Scatter<'_>) -> String {
    let [width, height] = chart.size;
    let xs = chart.points.iter().flat_map(|p| [p.at[0], p.reach[0][0], p.reach[0][1]]);
    let ys = chart.points.iter().flat_map(|p| [p.at[1], p.at[1]]);
    let x = Axis::around(xs, LEFT, width - RIGHT);
    let y = Axis::around(ys, height - BOTTOM, TOP);
    let mut svg = format!(
        "<svg class=\"plot\" viewBox=\"0 0 {width} {height}\" role=\"group\" aria-label=\"{}\">\n",
        escape(chart.title)
    );
    svg += &frame(chart, &x, &y);
    svg += &guides(&x, &y);
    if chart.line.len() > 1 {
        let places: Vec<String> =
            chart.line.iter().map(|p| format!("{:.1},{:.1}", x.at(p[0]), y.at(p[1]))).collect();
        let _ = writeln!(svg, "<polyline class=\"line\" points=\"{}\"/>", places.join(" "));
    }
    let labels = label_heights(chart, &x, &y);
    for (point, label_y) in chart.points.iter().zip(labels) {
        svg += &mark(point, &x, &y, label_y, width);
    }
    svg + "</svg>\n"
}

fn frame(chart: &Scatter<'_>, x: &Axis, y: &Axis) -> String {
    let [width, height] = chart.size;
    let mut svg = String::new();
    for tick in x.ticks() {
        let at = x.at(tick);
        let _ = writeln!(
            svg,
            "<path class=\"grid\" d=\"M{at:.1} {TOP}V{:.1}\"/><text x=\"{at:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>",
            height - BOTTOM,
            height - BOTTOM + 18.0,
            tick_text(tick)
        );
    }
    for tick in y.ticks() {
        let at = y.at(tick);
        let _ = writeln!(
            svg,
            "<path class=\"grid\" d=\"M{LEFT} {at:.1}H{:.1}\"/><text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
            width - RIGHT,
            LEFT - 6.0,
            at + 4.0,
            tick_text(tick)
        );
    }
    let [across, up] = chart.axes.map(escape);
    let middle = 0.5 * (TOP + height - BOTTOM);
    let _ = writeln!(
        svg,
        "<text class=\"axis\" x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{across}</text>\n\
         <text class=\"axis\" transform=\"translate(13 {middle:.1}) rotate(-90)\" text-anchor=\"middle\">{up}</text>",
        0.5 * (LEFT + width - RIGHT),
        height - 8.0
    );
    svg
}

/// Lines of the slope -1 through the middle of the chart and a decade to either side.
fn guides(x: &Axis, y: &Axis) -> String {
    let middle = 0.5 * (x.low + x.high) + 0.5 * (y.low + y.high);
    let mut svg = String::new();
    for offset in [-1.0, 0.0, 1.0] {
        let sum = middle + offset;
        // Both ends of log y = sum - log x within the frame.
        let (from, to) = (x.low.max(sum - y.high), x.high.min(sum - y.low));
        if from < to {
            let [a, b] = [from, to].map(|log| [x.at(10f64.powf(log)), y.at(10f64.powf(sum - log))]);
            let _ = writeln!(
                svg,
                "<path class=\"guide\" d=\"M{:.1} {:.1}L{:.1} {:.1}\"/>",
                a[0], a[1], b[0], b[1]
            );
        }
    }
    svg
}

/// Heights of the labels, moved apart where they would lie over each other.
fn label_heights(chart: &Scatter<'_>, x: &Axis, y: &Axis) -> Vec<f64> {
    const LINE: f64 = 14.0;
    let mut heights: Vec<f64> = chart.points.iter().map(|p| y.at(p.at[1]) + 4.0).collect();
    let mut order: Vec<usize> = (0..heights.len()).filter(|i| !chart.points[*i].label.is_empty()).collect();
    order.sort_by(|a, b| heights[*a].total_cmp(&heights[*b]));
    for i in 1..order.len() {
        for j in 0..i {
            let (above, below) = (order[j], order[i]);
            let far = (x.at(chart.points[above].at[0]) - x.at(chart.points[below].at[0])).abs();
            let reach = 7.5 * chart.points[above].label.chars().count().max(4) as f64;
            if far < reach && (heights[below] - heights[above]).abs() < LINE {
                heights[below] = heights[above] + LINE;
            }
        }
    }
    heights.iter().map(|h| h.min(chart.size[1] - BOTTOM - 2.0)).collect()
}

fn mark(point: &Point, x: &Axis, y: &Axis, label_y: f64, width: f64) -> String {
    let [px, py] = [x.at(point.at[0]), y.at(point.at[1])];
    if point.class == "faint" {
        return format!("<circle class=\"dot faint\" cx=\"{px:.1}\" cy=\"{py:.1}\" r=\"3\"/>\n");
    }
    let [[x0, x1], [y0, y1]] = point.reach;
    let (x0, x1, y0, y1) = (x.at(x0), x.at(x1), y.at(y0), y.at(y1));
    // To the left of points near the right edge.
    let left = px > 0.72 * width;
    let (label_x, anchor) = if left { (px - 9.0, "end") } else { (px + 9.0, "start") };
    format!(
        "<g class=\"point {}\" tabindex=\"0\" role=\"button\" aria-label=\"{}\" data-key=\"{}\">\
         <path class=\"reach\" d=\"M{x0:.1} {py:.1}H{x1:.1}M{px:.1} {y0:.1}V{y1:.1}\"/>\
         <circle class=\"hit\" cx=\"{px:.1}\" cy=\"{py:.1}\" r=\"12\"/>\
         <circle class=\"dot\" cx=\"{px:.1}\" cy=\"{py:.1}\" r=\"5\"/>\
         <text x=\"{label_x:.1}\" y=\"{label_y:.1}\" text-anchor=\"{anchor}\">{}</text></g>\n",
        point.class,
        escape(&point.name),
        point.key,
        escape(&point.label)
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(x: f64, y: f64, class: &'static str) -> Point {
        Point { at: [x, y], reach: [[x, x], [y, y]], label: "<a>".into(), name: "b\"".into(), key: 3, class }
    }

    fn chart(points: &[Point]) -> String {
        let axes = ["time", "error"];
        scatter(&Scatter {
            title: "t",
            axes,
            points,
            line: &[[0.1, 1.0], [10.0, 0.01]],
            size: [400.0, 300.0],
        })
    }

    #[test]
    fn decades_are_even_and_points_can_be_reached() {
        let svg = chart(&[point(0.1, 1.0, "base"), point(1.0, 0.1, "front"), point(10.0, 0.01, "faint")]);
        assert_eq!(svg.matches("tabindex=\"0\"").count(), 2);
        assert!(svg.contains("data-key=\"3\"") && svg.contains("&lt;a&gt;") && svg.contains("b&quot;"));
        let axis = Axis::around([0.1, 1.0, 10.0].into_iter(), 0.0, 100.0);
        assert!((axis.at(1.0) - 50.0).abs() < 1e-9);
        assert!((axis.at(10.0) + axis.at(0.1) - 100.0).abs() < 1e-9);
        assert_eq!(
            axis.ticks().iter().map(|t| tick_text(*t)).collect::<Vec<_>>(),
            ["0.1", "0.3", "1", "3", "10"]
        );
    }

    #[test]
    fn one_point_and_none_make_a_chart() {
        for points in [vec![], vec![point(1.0, 1.0, "")], vec![point(0.0, 0.0, "")]] {
            let svg = chart(&points);
            assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
        }
    }

    #[test]
    fn labels_do_not_lie_over_each_other() {
        let points: Vec<Point> = (0..4).map(|i| point(1.0, 1.0 + 1e-3 * f64::from(i), "")).collect();
        let axes = ["a", "b"];
        let chart = Scatter { title: "t", axes, points: &points, line: &[], size: [400.0, 300.0] };
        let y = Axis::around([0.1, 10.0].into_iter(), 254.0, 12.0);
        let x = Axis::around([0.1, 10.0].into_iter(), 0.0, 400.0);
        let mut heights = label_heights(&chart, &x, &y);
        heights.sort_by(f64::total_cmp);
        assert!(heights.windows(2).all(|w| w[1] - w[0] > 13.9), "{heights:?}");
    }
}

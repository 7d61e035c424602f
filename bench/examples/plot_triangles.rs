//! Plots rays per second over the number of triangles, both on logarithmic scales:
//!
//! ```text
//! cargo run -p rtsl-bench --example plot_triangles -- docs/data/triangles.csv docs/src/images/triangles.svg
//! ```
//!
//! Each line of the table after the first is a point: `series,triangles,million rays a second`. Lines that start with
//! `#` tell when and where the points were measured.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::process::ExitCode;

const WIDTH: f64 = 720.0;
const HEIGHT: f64 = 440.0;
/// The left, right, top and bottom of the plot area.
const FIELD: [f64; 4] = [64.0, 540.0, 24.0, 392.0];
/// Colours of series, which can be distinguished in greyscale and with any colour vision.
const COLORS: [&str; 6] = ["#0072b2", "#d55e00", "#56b4e9", "#e69f00", "#009e73", "#cc79a7"];

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [table, out] = &arguments[..] else {
        eprintln!("plot_triangles TABLE.csv OUT.svg");
        return ExitCode::from(2);
    };
    let plotted = std::fs::read_to_string(table)
        .map_err(|error| format!("cannot read `{table}`: {error}"))
        .and_then(|text| Plot::read(&text))
        .and_then(|plot| {
            std::fs::write(out, plot.to_svg())
                .map_err(|error| format!("cannot write `{out}`: {error}"))
        });
    match plotted {
        Ok(()) => ExitCode::SUCCESS,
        Err(problem) => {
            eprintln!("{problem}");
            ExitCode::from(1)
        }
    }
}

/// Points of several series.
struct Plot {
    /// In the order of their first points.
    names: Vec<String>,
    points: BTreeMap<String, Vec<[f64; 2]>>,
}

impl Plot {
    fn read(text: &str) -> Result<Plot, String> {
        let mut plot = Plot { names: Vec::new(), points: BTreeMap::new() };
        let lines = text.lines().filter(|line| !line.is_empty() && !line.starts_with('#'));
        for line in lines.skip(1) {
            let fields: Vec<&str> = line.split(',').collect();
            let numbers = fields[1..].iter().map(|field| field.parse().ok());
            let numbers: Option<Vec<f64>> = numbers.collect();
            let Some([triangles, rays]) =
                numbers.as_deref().filter(|it| it.iter().all(|x| *x > 0.0))
            else {
                return Err(format!("`{line}` is no point"));
            };
            let name = fields[0].to_owned();
            if !plot.names.contains(&name) {
                plot.names.push(name.clone());
            }
            plot.points.entry(name).or_default().push([*triangles, *rays]);
        }
        if plot.names.is_empty() { Err("there are no points".to_owned()) } else { Ok(plot) }
    }

    fn to_svg(&self) -> String {
        let [left, right, top, bottom] = FIELD;
        let across = Scale::over(self.values(0), [left, right]);
        let up = Scale::over(self.values(1), [bottom, top]);
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" \
             font-family=\"sans-serif\" font-size=\"13\">\n\
             <rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
        );
        for (value, label) in across.marks() {
            let x = across.place(value);
            line(&mut svg, [x, top, x, bottom]);
            text(&mut svg, [x, bottom + 18.0], "middle", &label);
        }
        for (value, label) in up.marks() {
            let y = up.place(value);
            line(&mut svg, [left, y, right, y]);
            text(&mut svg, [left - 8.0, y + 4.0], "end", &label);
        }
        text(&mut svg, [(left + right) * 0.5, bottom + 38.0], "middle", "triangles");
        text(&mut svg, [left - 40.0, top - 9.0], "start", "million rays a second");
        self.series(&mut svg, &across, &up);
        svg + "</svg>\n"
    }

    fn series(&self, svg: &mut String, across: &Scale, up: &Scale) {
        let mut ends = Vec::new();
        for (name, color) in self.names.iter().zip(COLORS.iter().cycle()) {
            let places = self.points[name].iter().map(|[x, y]| [across.place(*x), up.place(*y)]);
            let places: Vec<[f64; 2]> = places.collect();
            let path: Vec<String> = places.iter().map(|[x, y]| format!("{x:.1},{y:.1}")).collect();
            // Writing to a string cannot fail.
            let _ = writeln!(
                svg,
                "<path d=\"M{}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"2\"/>",
                path.join(" L")
            );
            for [x, y] in &places {
                let _ = writeln!(
                    svg,
                    "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"3.5\" fill=\"{color}\"/>"
                );
            }
            if let Some([x, y]) = places.last() {
                ends.push(([*x, *y], name, color));
            }
        }
        // Names are placed beside the last points, without overlaps.
        ends.sort_by(|one, other| one.0[1].total_cmp(&other.0[1]));
        let mut lowest = f64::NEG_INFINITY;
        for ([x, y], name, color) in ends {
            lowest = (y + 4.0).max(lowest + 16.0);
            let _ = writeln!(
                svg,
                "<text x=\"{:.1}\" y=\"{lowest:.1}\" fill=\"{color}\">{name}</text>",
                x + 10.0
            );
        }
    }

    fn values(&self, coordinate: usize) -> impl Iterator<Item = f64> {
        self.points.values().flatten().map(move |point| point[coordinate])
    }
}

fn line(svg: &mut String, [x1, y1, x2, y2]: [f64; 4]) {
    let _ = writeln!(
        svg,
        "<line x1=\"{x1:.1}\" y1=\"{y1:.1}\" x2=\"{x2:.1}\" y2=\"{y2:.1}\" stroke=\"#ddd\"/>"
    );
}

fn text(svg: &mut String, [x, y]: [f64; 2], anchor: &str, text: &str) {
    let _ = writeln!(svg, "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\">{text}</text>");
}

/// A logarithmic scale.
struct Scale {
    least: f64,
    greatest: f64,
    ends: [f64; 2],
}

#[expect(clippy::disallowed_methods, reason = "a plot does not depend on the last bit")]
impl Scale {
    /// A scale over these values with a margin on both sides.
    fn over(values: impl Iterator<Item = f64>, ends: [f64; 2]) -> Scale {
        let (least, greatest) =
            values.fold((f64::MAX, 0.0), |(a, b): (f64, f64), x| (a.min(x), b.max(x)));
        Scale { least: (least * 0.8).ln(), greatest: (greatest * 1.25).ln(), ends }
    }

    fn place(&self, value: f64) -> f64 {
        let part = (value.ln() - self.least) / (self.greatest - self.least);
        self.ends[0] + (self.ends[1] - self.ends[0]) * part
    }

    /// Ticks at 1, 2 and 5 times each power of ten; only at powers of ten if these are many.
    fn marks(&self) -> Vec<(f64, String)> {
        let decades = (self.greatest - self.least) / 10.0_f64.ln();
        let steps: &[f64] = if decades > 2.5 { &[1.0] } else { &[1.0, 2.0, 5.0] };
        let powers = (-3..10).map(|power| 10.0_f64.powi(power));
        let values = powers.flat_map(|power| steps.iter().map(move |step| step * power));
        let inside = values.filter(|value| (self.least..=self.greatest).contains(&value.ln()));
        inside.map(|value| (value, label(value))).collect()
    }
}

fn label(value: f64) -> String {
    if value >= 1e6 {
        format!("{} million", value / 1e6)
    } else if value >= 1e4 {
        format!("{} 000", value / 1e3)
    } else {
        value.to_string()
    }
}

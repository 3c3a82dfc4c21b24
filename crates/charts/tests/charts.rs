//! What a chart's SVG holds.
#![allow(clippy::unwrap_used)]

use pursuit_charts::{Axis, Chart, Color, Series, page_style};

fn chart(series: Series) -> Chart {
    Chart::new("overlap <1>", Axis::new("time (s)").over(0.0, 1.0), Axis::new("score").over(0.0, 1.0)).with(series)
}

/// The paths of the series, as they stand in `d`.
fn paths(svg: &str) -> Vec<&str> {
    svg.split("<g class=\"series ")
        .skip(1)
        .map(|s| s.split("d=\"").nth(1).unwrap().split('"').next().unwrap())
        .collect()
}

#[test]
fn lines_break_where_nothing_is_known() {
    let points = vec![(0.0, 0.0), (0.5, 1.0), (f64::NAN, 0.0), (1.0, 0.5)];
    let element = chart(Series::line("<a>", Color::Number(9), points))
        .with_band(0.2, 0.4, "target away")
        .with_diagonal()
        .sized(520.0, 360.0)
        .to_element();
    let [path] = paths(&element)[..] else { panic!("{element}") };
    assert_eq!((path.matches('M').count(), path.matches('L').count()), (2, 1), "{path}");
    assert!(element.starts_with("<svg class=\"chart\" viewBox=\"0 0 520 360\""), "{element}");
    for part in
        ["&lt;a&gt;", "class=\"series t1\" data-t=\"9\"", "class=\"away\"", "class=\"ideal\"", "target away", "7 4"]
    {
        assert!(element.contains(part), "{part} is not in {element}");
    }
    // The page says itself what is shown.
    assert!(
        !element.contains("<style") && !element.contains("class=\"title\"") && !element.contains("class=\"legend\"")
    );
}

#[test]
fn a_file_has_its_title_legend_and_style() {
    let svg = chart(Series::line("estimate of it", Color::Estimate, vec![(0.0, 0.25), (1.0, 0.5)]))
        .with(Series::points("measured", Color::Measured, vec![(0.0, 0.2), (0.0, 0.2), (1.0, 0.6)]))
        .to_svg()
        .unwrap();
    assert!(svg.starts_with("<svg xmlns=\"http://www.w3.org/2000/svg\"") && svg.ends_with("</svg>\n"));
    assert!(svg.contains("class=\"title\" x=\"14\" y=\"25\">overlap &lt;1&gt;</text>") && svg.contains("<style>"));
    assert_eq!(svg.matches("class=\"legend\"").count(), 2);
    assert_eq!(svg.matches(">measured</text>").count(), 1);
    // Two in the legend, two of the data; equal neighbours are drawn once.
    let paths = paths(&svg);
    assert_eq!(paths.len(), 4);
    assert_eq!(paths[3].matches('M').count(), 2, "{}", paths[3]);
    assert!(!page_style().is_empty() && !svg.contains("var("));
}

#[test]
fn nothing_to_draw_leaves_no_file() {
    let folder = std::env::temp_dir().join(format!("pursuit-charts-{}", std::process::id()));
    let empty = chart(Series::points("p", Color::Truth, vec![(f64::NAN, 1.0)]));
    assert!(empty.is_empty() && empty.to_svg().is_none());
    assert!(!empty.write(&folder).unwrap() && !folder.exists());
    let full = chart(Series::points("p", Color::Truth, vec![(0.0, 1.0)]));
    assert!(!full.is_empty() && full.write(&folder).unwrap());
    assert_eq!(std::fs::read_to_string(&folder).unwrap(), full.to_svg().unwrap());
    std::fs::remove_file(&folder).unwrap();
    assert_eq!(full.title(), "overlap <1>");
}

#[test]
fn named_dots_need_no_legend() {
    let svg = chart(Series::named("kcf", Color::Number(0), vec![(0.5, 0.5)]))
        .with(Series::named("mosse", Color::Number(1), vec![(0.5, 0.52)]))
        .to_svg()
        .unwrap();
    assert!(!svg.contains("class=\"legend\"") && svg.contains("kcf: 0.5, 0.5"));
    let text = |name: &str| {
        let before = svg.split(&format!("\">{name}</text>")).next().unwrap();
        before.rsplit("<text ").next().unwrap().to_owned()
    };
    assert_ne!(text("kcf"), text("mosse"), "they do not lie on each other");
}

#[test]
fn absurd_numbers_do_no_harm() {
    for values in [[1e300, -1e300], [1e300, 1e300], [1e-320, 0.0], [0.0, 0.0]] {
        let points = values.iter().map(|v| (*v, *v)).collect::<Vec<_>>();
        for chart in [
            Chart::new("t", Axis::new("x"), Axis::new("y")),
            Chart::new("t", Axis::new("x").logarithmic(), Axis::new("y").logarithmic()),
            Chart::new("t", Axis::new("x"), Axis::new("y")).with_equal_units(),
        ] {
            let svg = chart.with(Series::line("s", Color::Truth, points.clone())).to_svg().unwrap();
            assert!(svg.len() < 40_000 && !svg.contains("NaN") && !svg.contains("inf"), "{values:?}: {svg}");
        }
    }
}

#[test]
fn areas_are_closed_and_break_where_nothing_is_known() {
    let points = [(0.0, 0.1, 0.3), (0.4, 0.2, 0.5), (0.6, f64::NAN, 0.5), (0.8, 0.2, 0.4), (1.0, 0.3, 0.6)];
    let element = chart(Series::area("± 2 σ", Color::Estimate, &points)).to_element();
    let [path] = paths(&element)[..] else { panic!("{element}") };
    assert_eq!((path.matches('M').count(), path.matches('L').count(), path.matches('Z').count()), (2, 6, 2), "{path}");
    assert!(element.contains("class=\"area\""));
    let empty = chart(Series::area("a", Color::Estimate, &[(0.0, f64::NAN, 1.0)]));
    assert!(empty.is_empty() && empty.to_svg().is_none());
}

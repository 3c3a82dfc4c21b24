//! How everything looks, in light and dark: one list of colours and one set of rules, for pages and for files.

use std::fmt::Write as _;

/// Name, colour on light, colour on dark.
type Named = (&'static str, &'static str, &'static str);

/// What is not a series.
const SURROUNDINGS: [Named; 4] = [
    ("paper", "#ffffff", "#1a1d21"),
    ("ink", "#1c1e21", "#e8eaed"),
    ("soft", "#5b626a", "#a3abb4"),
    ("line", "#e3e5e8", "#2c3137"),
];

/// Series by class.
const SERIES: [(&str, Named); 13] = [
    ("measured", ("measured", "#2b8a3e", "#69db7c")),
    ("predicted", ("predicted", "#d6302a", "#ff8a80")),
    ("estimate", ("estimate", "#1f6fd6", "#6cb0ff")),
    ("truth", ("truth", "#444a51", "#c3c8ce")),
    ("other", ("other", "#8e44ad", "#cf9bea")),
    ("t0", ("c0", "#1f6fd6", "#6cb0ff")),
    ("t1", ("c1", "#d9480f", "#ff9155")),
    ("t2", ("c2", "#2b8a3e", "#69db7c")),
    ("t3", ("c3", "#9c36b5", "#da8cf0")),
    ("t4", ("c4", "#c2255c", "#ff8fb1")),
    ("t5", ("c5", "#0c8599", "#4fd1e0")),
    ("t6", ("c6", "#8f6a00", "#ffd24d")),
    ("t7", ("c7", "#5f3dc4", "#a99bff")),
];

/// What has no colour.
const SHAPES: &str = "svg.chart{display:block;width:100%;height:auto}\
.chart .grid,.chart .frame{stroke-width:1;fill:none}\
.chart .ideal{stroke-width:1;stroke-dasharray:4 4}.chart .away{opacity:.17}\
.chart text{font-size:12.5px;font-family:inherit;stroke:none}\
.chart .title{font-size:15px;font-weight:600}\
.chart .series path{fill:none;stroke-width:1.8;stroke-linejoin:round;stroke-linecap:butt}\
.chart .series path.dots{stroke-width:4.6;stroke-linecap:round;opacity:.75}\
.chart .series path.area{stroke:none;opacity:.22}\
.chart .series circle{stroke:none}.chart .series text{font-weight:560}";

/// The style sheet that a page with [elements](crate::Chart::to_element) needs, once. It also defines the colours as
/// variables on the page's root: `--ink`, `--soft`, `--line`, `--paper`, `--c0` … `--c7` and one for each other colour.
pub fn page_style() -> String {
    let all = || SURROUNDINGS.iter().chain(SERIES.iter().map(|s| &s.1));
    let (mut light, mut dark) = (String::new(), String::new());
    for (name, on_light, on_dark) in all() {
        let _ = write!(light, "--{name}:{on_light};");
        let _ = write!(dark, "--{name}:{on_dark};");
    }
    let colors = rules(|(name, ..)| format!("var(--{name})"));
    format!(":root{{{light}}}\n@media (prefers-color-scheme:dark){{:root{{{dark}}}}}\n{SHAPES}\n{colors}\n")
}

/// The style sheet inside a file. It uses no variables, which not every viewer of SVG knows.
pub(crate) fn file_style() -> String {
    let light = rules(|(_, on_light, _)| on_light.to_owned());
    let dark = rules(|(.., on_dark)| on_dark.to_owned());
    format!(
        "svg.chart{{font-family:system-ui,-apple-system,\"Segoe UI\",Roboto,\"Helvetica Neue\",Arial,sans-serif}}\
         {SHAPES}{light}@media (prefers-color-scheme:dark){{{dark}}}"
    )
}

fn rules(color: impl Fn(Named) -> String) -> String {
    let [paper, ink, soft, line] = SURROUNDINGS.map(&color);
    let mut rules = format!(
        ".chart .paper{{fill:{paper}}}.chart text{{fill:{soft}}}.chart .title,.chart .legend text,.chart .series text{{fill:{ink}}}\
         .chart .grid{{stroke:{line}}}.chart .frame,.chart .ideal{{stroke:{soft}}}.chart .away{{fill:{soft}}}"
    );
    for (class, named) in SERIES {
        let color = color(named);
        let _ = write!(
            rules,
            ".chart .{class} path{{stroke:{color}}}.chart .{class} circle,.chart .{class} path.area{{fill:{color}}}"
        );
    }
    rules
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Color;

    #[test]
    fn every_color_has_its_rules_in_both_sheets() {
        let [page, file] = [page_style(), file_style()];
        for color in [Color::Measured, Color::Predicted, Color::Estimate, Color::Truth, Color::Other, Color::Number(12)]
        {
            let rule = format!(".chart .{} path{{stroke:", color.class());
            assert_eq!((page.matches(&rule).count(), file.matches(&rule).count()), (1, 2), "{rule}");
        }
        assert!(!file.contains("var(") && page.contains("--c7:#5f3dc4;") && page.contains("--c7:#a99bff;"));
        assert!(
            file.contains(".chart .t7 path{stroke:#5f3dc4}")
                && file.contains(".chart .t7 circle,.chart .t7 path.area{fill:#a99bff}")
        );
        for sheet in [page, file] {
            assert_eq!(sheet.matches('{').count(), sheet.matches('}').count());
        }
    }
}

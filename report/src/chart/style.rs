//! Colours and strokes of charts.
//!
//! Programs that are no browsers, such as those that draw figures for papers, know no variables in styles, and
//! then everything is black. So a chart that is a file of its own has the colours of a light page themselves.

/// Colours and strokes of the charts of a page.
pub(crate) const STYLE: &str = include_str!("chart.css");

/// The variable in the stylesheet whose value is the colour of the element's class.
const CLASS_COLOUR: &str = "var(--c)";

/// Returns [`STYLE`] for a light page, without variables.
pub(super) fn file_style() -> String {
    let colours = light_colours();
    let lines = STYLE.lines().filter(|line| line.starts_with('.'));
    let rules = lines.flat_map(|line| line.split_inclusive('}'));
    rules.flat_map(|rule| plain_rules(rule, &colours)).collect::<Vec<_>>().join("\n")
}

/// Returns the names and values of the variables of a light page, which are on the first line.
fn light_colours() -> Vec<(&'static str, &'static str)> {
    let line = STYLE.lines().next().unwrap_or_default();
    let inside = line.trim_start_matches(":root{").trim_end_matches('}');
    inside.split(';').filter_map(|one| one.trim_start_matches("--").split_once(':')).collect()
}

/// Returns a rule with the values of its variables; one that depends on the class of an element, once for each.
fn plain_rules(rule: &str, colours: &[(&str, &str)]) -> Vec<String> {
    // This one gives each class its colour.
    if rule.contains("{--c:") {
        return Vec::new();
    }
    let valued = colours.iter().fold(rule.to_owned(), |rule, (name, value)| {
        rule.replace(&format!("var(--{name})"), value)
    });
    if !valued.contains(CLASS_COLOUR) {
        return vec![valued];
    }
    let classes = colours.iter().filter(|(name, _)| name.starts_with('c'));
    classes
        .map(|(name, value)| {
            valued.replace('{', &format!(".{name}{{")).replace(CLASS_COLOUR, value)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_class_has_its_own_rules_and_no_variable_is_left() {
        let style = file_style();
        for rule in [
            ".chart text{fill:#1a1d21}",
            ".chart .paper{fill:#fff}",
            ".chart .line.c2{stroke:#b84500;fill:none;stroke-width:1.8;stroke-linejoin:round}",
            ".chart .line.c2{stroke-dasharray:7 3}",
            ".chart .mark.c0{fill:#5b6470;stroke:#fff;stroke-width:.8}",
        ] {
            assert!(style.contains(rule), "{rule}: {style}");
        }
        assert!(!style.contains("--") && !style.contains('@'), "{style}");
    }
}

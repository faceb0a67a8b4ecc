//! The figures of a report, each with two sentences on how to read it.

mod comparison;
pub(crate) mod convergence;
mod dispersion;
pub(crate) mod failures;
mod figure;
mod groups;
mod moments;
mod posterior;
mod profiles;
mod sequence;
mod setup;
mod solutions;
mod traces;
mod velocities;
mod wave_image;

use crate::finding::Finding;

pub(crate) use comparison::overlay;
pub use dispersion::dispersion_figure;
pub(crate) use figure::Figure;
pub(crate) use groups::forest;
pub(crate) use setup::setup_figure;
pub(crate) use traces::trace_figures;
pub use wave_image::wave_image_figure;

/// Figures under a heading.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct FigureSection {
    pub(crate) heading: String,
    /// The figures; a section without any is left out.
    pub(crate) figures: Vec<Figure>,
}

/// Returns the sections on what was found from one set of data.
pub(crate) fn finding_sections(finding: &Finding<'_>) -> Vec<FigureSection> {
    let suffix = finding.suffix();
    let section = |heading: &str, figures| {
        let heading = format!("{heading}{suffix}");
        FigureSection { heading, figures }
    };
    let mut velocities = velocities::figures(finding);
    velocities.extend(sequence::figures(finding));
    vec![
        section("Velocities", velocities),
        section("Moments against their number", moments::figures(finding)),
        section("Convergence of the search", convergence::figures(finding)),
        section("What the data say of each parameter", {
            let mut figures = profiles::figures(finding);
            figures.extend(posterior::figures(finding));
            figures
        }),
        section("Several starts", solutions::figures(finding)),
        section("Failed realizations", failures::figures(finding)),
    ]
}

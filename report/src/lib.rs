//! Reports of results: one page of HTML that needs nothing else, and its figures as SVG with their
//! numbers as CSV.
//!
//! [`report`] is a function from parsed results to texts; nothing here reads or writes a file. The same
//! results give the same bytes: there is no time, machine or path in a report, and no order by chance.

#![forbid(unsafe_code)]

mod chart;
mod course;
mod figure_names;
mod figures;
mod finding;
mod input;
mod live;
mod number;
mod page;
mod quantity;
mod sample;
mod table;
mod text;

pub use course::SearchCourse;
pub use figures::{dispersion_figure, wave_image_figure};
pub use input::{JobTables, ReportedRun};
pub use live::{LiveFigure, SCRIPT, STYLES, failure_figure, search_figures};
pub use page::{Report, ReportText, files_of, report};
pub use table::TableError;

//! The page: what it says in words, tables and figures, and in which order.

mod difference;
mod groups;
mod markup;
mod pooling;
mod provenance;
mod results;
mod simulation;
mod trust;

use std::fmt::Write as _;

use crate::chart::STYLE as CHART_STYLE;
use crate::figures::{self, Figure, FigureSection};
use crate::finding::Finding;
use crate::input::{ReportedRun, RunContent};
use crate::page::markup::Numbers;
use crate::sample::VelocitySample;
use crate::text::escape;

pub(crate) const PAGE_STYLE: &str = include_str!("page/page.css");
/// The mark by which a page is known as that of a report.
const GENERATOR: &str = "<meta name=\"generator\" content=\"osteon report\">";
pub(crate) const SCRIPT: &str = include_str!("page/page.js");

/// Most groups of a run that get figures of their own: the page stays below two megabytes.
const DETAILED_GROUPS_MAX: usize = 4;

/// Returns the names of the figures' files that a page refers to; `None` if it is not that of a report.
pub fn files_of(page: &str) -> Option<Vec<String>> {
    if !page.contains(GENERATOR) {
        return None;
    }
    let is_plain = |name: &&str| {
        let (stem, ending) = name.rsplit_once('.').unwrap_or_default();
        let letters = |c: char| c.is_ascii_alphanumeric() || c == '-';
        !stem.is_empty() && stem.chars().all(letters) && ["svg", "csv"].contains(&ending)
    };
    let codes = page.split("<code>").skip(1).filter_map(|rest| rest.split("</code>").next());
    Some(codes.filter(is_plain).map(str::to_owned).collect())
}

/// A report.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Report {
    /// The page.
    pub html: String,
    /// The figures as SVG, and their numbers as CSV.
    pub figures: Vec<ReportText>,
}

/// A file beside the page.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ReportText {
    /// Name of the file.
    pub name: String,
    /// Its content.
    pub text: String,
}

/// A part of the page with a heading.
struct PageSection {
    heading: String,
    body: String,
}

/// Returns the report of one or several runs. Several are laid over each other and compared with the
/// first.
pub fn report(runs: &[ReportedRun]) -> Report {
    let several = runs.len() > 1;
    let (mut sections, mut charts) = (Vec::new(), Vec::new());
    let findings: Vec<Vec<Finding<'_>>> = runs.iter().map(run_findings).collect();
    if several {
        sections.push(comparison(runs, &findings, &mut charts));
    }
    for (number, (run, findings)) in runs.iter().zip(&findings).enumerate() {
        let mut own = Vec::new();
        run_sections(run, number, findings, &mut own, &mut charts, several);
        for mut section in own {
            if several {
                section.heading = format!("{}: {}", run.name, section.heading);
            }
            sections.push(section);
        }
    }
    let names: Vec<&str> = runs.iter().map(|run| run.name.as_str()).collect();
    Report { html: page(&names.join(", "), &sections), figures: charts }
}

fn run_findings(run: &ReportedRun) -> Vec<Finding<'_>> {
    match &run.content {
        RunContent::Identification(result, context) => {
            Finding::from_identification(result, context)
        }
        RunContent::Propagation(result, context) => {
            vec![Finding::from_propagation(result, context)]
        }
        RunContent::Simulation(..) => Vec::new(),
    }
}

/// Adds the sections of one run. Of several runs only words, tables and provenance are shown beside the
/// overlay: the figures of each are in its own report.
fn run_sections(
    run: &ReportedRun,
    number: usize,
    findings: &[Finding<'_>],
    sections: &mut Vec<PageSection>,
    charts: &mut Vec<ReportText>,
    several: bool,
) {
    let numbers = Numbers::for_run(number);
    sections.push(section("In short", trust::trust_list(run, findings)));
    let mut figures = Vec::new();
    match &run.content {
        RunContent::Simulation(result, context) => {
            sections.push(section("Results", simulation::table(&numbers, result)));
            let traces = figures::trace_figures(result, context);
            figures
                .push(FigureSection { heading: "Pressures and times".to_owned(), figures: traces });
            figures.push(setup_section(&context.case.setup));
        }
        RunContent::Identification(_, context) | RunContent::Propagation(_, context) => {
            let grouped = findings.iter().any(|finding| finding.group.is_some());
            if grouped {
                sections.push(section("Results", groups::table(&numbers, findings)));
                if let RunContent::Identification(result, _) = &run.content
                    && let Some(found) = &result.pooling
                {
                    sections.push(section("All groups", pooling::shared(&numbers, found)));
                }
                if let Some(matrix) = groups::differences(context, findings) {
                    sections.push(section("Differences between groups", matrix));
                }
                let heading = "Groups".to_owned();
                figures.push(FigureSection { heading, figures: figures::forest(findings) });
            }
            for finding in findings.iter().take(DETAILED_GROUPS_MAX) {
                let heading = match finding.group {
                    Some(name) => format!("Group {name}"),
                    None => "Results".to_owned(),
                };
                sections.push(section(&heading, results::tables(&numbers, finding)));
                figures.extend(figures::finding_sections(finding));
            }
            figures.push(setup_section(&context.specification.setup));
        }
    }
    if !several {
        sections.extend(figures.into_iter().filter_map(|one| draw_section(one, charts)));
    }
    sections.push(section("Provenance", provenance::origin_table(run)));
}

fn setup_section(setup: &osteon_common::case::Setup) -> FigureSection {
    FigureSection { heading: "Set-up".to_owned(), figures: vec![figures::setup_figure(setup)] }
}

/// Returns the comparison of several runs: their velocities in one figure, and their differences.
fn comparison(
    runs: &[ReportedRun],
    findings: &[Vec<Finding<'_>>],
    charts: &mut Vec<ReportText>,
) -> PageSection {
    let label = |run: usize, finding: &Finding<'_>| match finding.group {
        Some(group) => format!("{} · {group}", runs[run].name),
        None => runs[run].name.clone(),
    };
    let all: Vec<(String, usize, &Finding<'_>)> = findings
        .iter()
        .enumerate()
        .flat_map(|(run, own)| own.iter().map(move |finding| (run, finding)))
        .map(|(run, finding)| (label(run, finding), run, finding))
        .collect();
    let samples: Vec<(String, &VelocitySample)> = all
        .iter()
        .filter_map(|(name, _, finding)| Some((name.clone(), finding.model.velocities.as_ref()?)))
        .collect();
    let mut body = difference::table(&all, runs);
    let heading = "Comparison".to_owned();
    let figures = FigureSection { heading: heading.clone(), figures: figures::overlay(&samples) };
    if let Some(drawn) = draw_section(figures, charts) {
        body.push_str(&drawn.body);
    }
    PageSection { heading, body }
}

fn section(heading: &str, body: String) -> PageSection {
    PageSection { heading: heading.to_owned(), body }
}

/// Returns a section of figures, and adds their files; `None` if there is no figure.
fn draw_section(section: FigureSection, files: &mut Vec<ReportText>) -> Option<PageSection> {
    let FigureSection { heading, figures } = section;
    if figures.is_empty() {
        return None;
    }
    let mut body = "<div class=\"figures\">".to_owned();
    for Figure { chart, reading } in &figures {
        let name = &chart.name;
        let _infallible = write!(
            body,
            "<figure><h3>{}</h3>{}<figcaption>{} <span class=\"files\">Files: \
             <code>{name}.svg</code>, <code>{name}.csv</code></span></figcaption></figure>",
            escape(&chart.title),
            chart.svg(),
            escape(reading),
        );
        files.push(ReportText { name: format!("{name}.svg"), text: chart.svg_file() });
        files.push(ReportText { name: format!("{name}.csv"), text: chart.csv() });
    }
    body.push_str("</div>");
    Some(PageSection { heading, body })
}

fn page(title: &str, sections: &[PageSection]) -> String {
    let (mut contents, mut body) = (String::new(), String::new());
    for (place, PageSection { heading, body: text }) in sections.iter().enumerate() {
        let heading = escape(heading);
        let _infallible = write!(contents, "<li><a href=\"#s{place}\">{heading}</a></li>");
        let _infallible = writeln!(
            body,
            "<section aria-labelledby=\"s{place}\"><h2 id=\"s{place}\">{heading}</h2>{text}</section>"
        );
    }
    let title = escape(title);
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         {GENERATOR}\n\
         <meta name=\"color-scheme\" content=\"light dark\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src \
         'unsafe-inline'; script-src 'unsafe-inline'\">\n\
         <title>{title} – osteon report</title>\n<style>\n{CHART_STYLE}{PAGE_STYLE}</style>\n</head>\n\
         <body>\n<header><p class=\"program\">osteon report</p><h1>{title}</h1></header>\n\
         <nav aria-label=\"Contents\"><ol>{contents}</ol></nav>\n<main>\n{body}</main>\n\
         <footer><p>Every number of a result is that of its <code>result.json</code>, rounded to its \
         error. This page needs no network.</p></footer>\n<script>\n{SCRIPT}</script>\n</body>\n\
         </html>\n"
    )
}

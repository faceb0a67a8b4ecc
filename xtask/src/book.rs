//! Builds the documentation as a book by mdBook, and checks that its links lead somewhere.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context as _, Result, bail};

use crate::places::{programs, root};
use crate::process::cargo;
use crate::terminal::say;
use crate::tools::install;

/// The version of mdBook that builds the book.
const VERSION: &str = "0.5.4";
/// Without its web server, and unoptimised: it builds the book in a second all the same.
const OPTIONS: &[&str] = &["--no-default-features", "--features", "search", "--profile", "dev"];
/// The table of contents.
const CONTENTS: &str = "SUMMARY.md";

/// `cargo xtask docs`.
pub(crate) fn build(words: &[String]) -> Result<()> {
    if !words.is_empty() {
        bail!("usage: cargo xtask docs");
    }
    let book = programs()?.with_file_name("book");
    let (source, html) = (book.join("source"), book.join("html"));
    for directory in [&source, &html] {
        drop(fs::remove_dir_all(directory));
        fs::create_dir_all(directory)
            .with_context(|| format!("cannot create {}", directory.display()))?;
    }
    copy_pages(&root().join("docs"), &source)?;
    let program = install("mdbook", VERSION, OPTIONS)?;
    cargo(Command::new(program).arg("build").arg(&source).arg("--dest-dir").arg(&html))?;
    let (pages, links) = check_links(&html)?;
    say(&format!("{pages} pages, {links} links: {}", html.join("index.html").display()))
}

/// Copies the pages, and fails if the table of contents lacks one. Links to files beside `docs/`, which
/// a book does not contain, become their text.
fn copy_pages(docs: &Path, source: &Path) -> Result<()> {
    let contents = read(&docs.join(CONTENTS))?;
    let entries = fs::read_dir(docs).with_context(|| format!("cannot read {}", docs.display()))?;
    for entry in entries {
        let path = entry?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let mut text = read(&path)?;
        if name.ends_with(".md") {
            if name != CONTENTS && !contents.contains(&format!("]({name})")) {
                bail!("docs/{CONTENTS} lacks the page {name}");
            }
            text = without_links_out(&text);
        }
        let target = source.join(&name);
        fs::write(&target, text).with_context(|| format!("cannot write {}", target.display()))?;
    }
    Ok(())
}

/// Returns Markdown with `[label](../target)` replaced by its label.
fn without_links_out(text: &str) -> String {
    let mut kept = String::with_capacity(text.len());
    let mut rest = text;
    while let Some((before, after)) = rest.split_once("](../") {
        let (label_at, end) = (before.rfind('['), after.find(')'));
        let (Some(label_at), Some(end)) = (label_at, end) else { break };
        kept.push_str(&before[..label_at]);
        kept.push_str(&before[label_at + 1..]);
        rest = &after[end + 1..];
    }
    kept + rest
}

/// Follows every link within the book; returns the number of pages and of links.
fn check_links(html: &Path) -> Result<(usize, usize)> {
    let entries = fs::read_dir(html).with_context(|| format!("cannot read {}", html.display()))?;
    let mut pages: Vec<PathBuf> = Vec::new();
    for entry in entries {
        let path = entry?.path();
        // The page for printing repeats all others, with links of its own.
        if path.extension().is_some_and(|end| end == "html") && !path.ends_with("print.html") {
            pages.push(path);
        }
    }
    pages.sort();
    let mut count = 0;
    let mut broken = BTreeSet::new();
    for page in &pages {
        let text = read(page)?;
        for target in values(&text, "href").chain(values(&text, "src")) {
            if target.contains(':') || target.is_empty() {
                continue;
            }
            count += 1;
            let (file, anchor) = target.split_once('#').unwrap_or((target, ""));
            let linked = if file.is_empty() { page.clone() } else { html.join(file) };
            let has_anchor = |text: &str| values(text, "id").any(|id| id == anchor);
            let found = linked.exists() && (anchor.is_empty() || has_anchor(&read(&linked)?));
            if !found {
                let name = page.file_name().unwrap_or_default().to_string_lossy();
                broken.insert(format!("{name}: {target}"));
            }
        }
    }
    if pages.is_empty() || count == 0 {
        bail!("the book has no pages or no links");
    }
    if !broken.is_empty() {
        let broken: Vec<_> = broken.into_iter().collect();
        bail!("links of the book lead nowhere:\n{}", broken.join("\n"));
    }
    Ok((pages.len(), count))
}

fn values<'a>(html: &'a str, attribute: &str) -> impl Iterator<Item = &'a str> {
    let begin = format!(" {attribute}=\"");
    let mut rest = html;
    std::iter::from_fn(move || {
        let (_, after) = rest.split_once(&begin)?;
        let (value, after) = after.split_once('"')?;
        rest = after;
        Some(value)
    })
}

fn read(path: &Path) -> Result<String> {
    fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn links_out_of_the_book_become_text() {
        let text = "a [b](c.md) [d e](../f.md#g), [h](../i) [j](k.md#l)";
        assert_eq!(without_links_out(text), "a [b](c.md) d e, h [j](k.md#l)");
        assert_eq!(without_links_out("a [b](../c"), "a [b](../c");
    }

    #[test]
    fn broken_links_are_found() -> Result<()> {
        let folder = std::env::temp_dir().join(format!("osteon-book-{}", std::process::id()));
        fs::create_dir_all(&folder)?;
        let page = |links: &str| format!("<h1 id=\"top\">x</h1><a href=\"#top\">y</a>{links}");
        fs::write(folder.join("a.html"), page("<a href=\"b.html#top\">z</a>"))?;
        fs::write(folder.join("b.html"), page(""))?;
        assert_eq!(check_links(&folder)?, (2, 3));
        fs::write(
            folder.join("b.html"),
            page("<a href=\"c.html\"></a><a href=\"a.html#no\"></a>"),
        )?;
        let refused = check_links(&folder).err().map(|error| error.to_string()).unwrap_or_default();
        assert!(refused.contains("b.html: a.html#no\nb.html: c.html"), "{refused}");
        Ok(fs::remove_dir_all(&folder)?)
    }
}

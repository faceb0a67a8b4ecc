//! The stream that keeps a page up to date: server-sent events, at most one update a second, each with
//! those parts only that have changed.

use std::sync::Arc;
use std::time::Duration;

use futures::Stream;
use serde_json::{Value, json};
use tokio::sync::{OwnedSemaphorePermit, mpsc};
use tokio::time::{Instant, sleep_until, timeout};
use tokio_stream::wrappers::ReceiverStream;
use tonic::{Code, Status};

use crate::access::limiter::Caller;
use crate::core::ids::JobId;
use crate::live::course::FollowedSearch;
use crate::live::gate::PageCaller;
use crate::live::json;
use crate::live::overview;
use crate::live::query::Shown;
use crate::live::source::PageSource;

/// Interval of the updates.
const INTERVAL: Duration = Duration::from_secs(1);
/// Number of updates without a change after which a sign of life is sent.
const QUIET_MAX: u32 = 3;
/// A page that reads nothing for this long is dropped.
const PATIENCE: Duration = Duration::from_secs(30);
/// Path whose requirement every update has.
const PATH: &str = "/events";

/// Returns the updates for a page.
pub(crate) fn updates(
    source: Arc<PageSource>,
    shown: Shown,
    caller: PageCaller,
    reader: Caller,
    permit: OwnedSemaphorePermit,
) -> impl Stream<Item = Result<String, std::convert::Infallible>> {
    let (sender, receiver) = mpsc::channel(1);
    let mut feed =
        PageFeed { source, shown, caller, reader, sent: SentParts::default(), search: None };
    tokio::spawn(async move {
        let _permit = permit;
        feed.run(&sender).await;
    });
    ReceiverStream::new(receiver)
}

/// The updates of one open page: its choices, its access, and the parts that were sent last.
struct PageFeed {
    source: Arc<PageSource>,
    shown: Shown,
    caller: PageCaller,
    reader: Caller,
    sent: SentParts,
    search: Option<FollowedSearch>,
}

impl PageFeed {
    /// Sends updates until the page has gone, may not see them any more, or the coordinator has stopped.
    async fn run(&mut self, sender: &mpsc::Sender<Result<String, std::convert::Infallible>>) {
        let mut quiet = 0;
        loop {
            let begun = Instant::now();
            if self.caller.may(PATH).is_err() {
                return;
            }
            let Ok(parts) = self.parts().await else { return };
            let mut text = String::new();
            for (name, part) in parts {
                text.push_str(&self.sent.change_event(name, part));
            }
            quiet = if text.is_empty() { quiet + 1 } else { 0 };
            if quiet >= QUIET_MAX {
                quiet = 0;
                text = ": nothing new\n\n".to_owned();
            }
            if !text.is_empty() {
                match timeout(PATIENCE, sender.send(Ok(text))).await {
                    Ok(Ok(())) => {}
                    Ok(Err(_)) | Err(_) => return,
                }
            }
            tokio::select! {
                () = sleep_until(begun + INTERVAL) => {}
                () = sender.closed() => return,
            }
        }
    }

    /// Returns the parts of an update, in the order in which they are shown.
    async fn parts(&mut self) -> Result<Vec<(&'static str, Arc<str>)>, Status> {
        let may_cancel = self.caller.may_cancel();
        let (snapshots, more_after) = self.source.list(&self.shown).await?;
        let jobs = json::jobs(&snapshots, more_after.map(|job| job.to_string()));
        let mut parts = vec![
            ("caller", json!({ "may_cancel": may_cancel }).to_string().into()),
            ("overview", overview::newest(&self.source).await?),
            ("jobs", jobs.to_string().into()),
        ];
        if let Some(job) = self.shown.job {
            match self.detail(job).await {
                Ok((detail, figures)) => {
                    parts.push(("job", detail.to_string().into()));
                    parts.push(("figures", figures));
                }
                Err(refusal) if refusal.code() == Code::Unavailable => return Err(refusal),
                Err(refusal) => {
                    let refusal = json!({ "job": job.to_string(), "error": refusal.message() });
                    parts.push(("job", refusal.to_string().into()));
                }
            }
        }
        Ok(parts)
    }

    async fn detail(&mut self, job: JobId) -> Result<(Value, Arc<str>), Status> {
        let detail = detail(&self.source, job).await?;
        let wanted = self.shown.group;
        let known = self.search.take().filter(|search| search.is_of(job, wanted));
        let search = self.search.insert(known.unwrap_or_else(|| FollowedSearch::new(job, wanted)));
        let figures = search.figures(&self.source, self.reader.clone()).await?;
        Ok((detail, figures.to_string().into()))
    }
}

/// The newest text of each part that was sent.
#[derive(Default)]
struct SentParts(Vec<(&'static str, Arc<str>)>);

impl SentParts {
    /// Returns the event of a part, empty if it has not changed.
    fn change_event(&mut self, name: &'static str, text: Arc<str>) -> String {
        match self.0.iter_mut().find(|(known, _)| *known == name) {
            Some((_, known)) if *known == text => return String::new(),
            Some((_, known)) => *known = Arc::clone(&text),
            None => self.0.push((name, Arc::clone(&text))),
        }
        // JSON has no line breaks.
        format!("event: {name}\ndata: {text}\n\n")
    }
}

/// Returns a job with what decides how fast it is.
pub(crate) async fn detail(source: &PageSource, job: JobId) -> Result<Value, Status> {
    let (snapshot, explained) = source.job(job).await?;
    let mut detail = json::job(&snapshot);
    detail["explain"] = json::explanation(&explained);
    Ok(detail)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_is_sent_when_it_has_changed() {
        let mut sent = SentParts::default();
        for (name, text, expected) in [
            ("jobs", "1", "event: jobs\ndata: 1\n\n"),
            ("jobs", "1", ""),
            ("job", "1", "event: job\ndata: 1\n\n"),
            ("jobs", "2", "event: jobs\ndata: 2\n\n"),
            ("job", "1", ""),
        ] {
            assert_eq!(sent.change_event(name, text.into()), expected, "{name} {text}");
        }
    }
}

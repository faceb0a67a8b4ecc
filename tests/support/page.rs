//! The live page as a browser asks for it.

use std::fs;
use std::io::{BufRead as _, BufReader, Read as _, Write as _};
use std::net::TcpStream;
use std::path::Path;

use serde_json::Value;

use crate::support::DEADLINE;

/// The live page of one coordinator.
pub(crate) struct Page {
    pub(crate) address: String,
}

/// An answer.
#[derive(Debug)]
pub(crate) struct PageAnswer {
    pub(crate) status: u16,
    pub(crate) head: String,
    pub(crate) body: String,
}

impl PageAnswer {
    /// Checks that the status is 200; returns the body as JSON.
    pub(crate) fn json(&self) -> Value {
        assert_eq!(self.status, 200, "{self:?}");
        serde_json::from_str(&self.body).unwrap()
    }
}

impl Page {
    /// Returns the page of the coordinator with this store.
    pub(crate) fn of_store(store: &Path) -> Self {
        let url = fs::read_to_string(store.join("http-address")).unwrap();
        let url = url.trim_end().split_once("://").unwrap().1;
        Self { address: url.strip_suffix('/').unwrap().to_owned() }
    }

    /// Sends a request. A `host` among the headers replaces the page's own.
    pub(crate) fn request(&self, method: &str, path: &str, headers: &[(&str, &str)]) -> PageAnswer {
        let mut stream = self.send(method, path, headers, "close").unwrap();
        let mut answer = String::new();
        stream.read_to_string(&mut answer).unwrap();
        let (head, body) = answer.split_once("\r\n\r\n").unwrap();
        let status = head.split(' ').nth(1).unwrap().parse().unwrap();
        PageAnswer { status, head: head.to_owned(), body: body.to_owned() }
    }

    /// Gets a path.
    pub(crate) fn get(&self, path: &str) -> PageAnswer {
        self.request("GET", path, &[])
    }

    /// Opens a stream of updates.
    ///
    /// # Errors
    /// The status, if it is not 200; 0 if nothing answers.
    pub(crate) fn events(&self, query: &str, headers: &[(&str, &str)]) -> Result<Updates, u16> {
        let sent = self.send("GET", &format!("/events?{query}"), headers, "keep-alive");
        let mut lines = BufReader::new(sent.map_err(|_| 0_u16)?);
        let mut line = String::new();
        lines.read_line(&mut line).map_err(|_| 0_u16)?;
        match line.split(' ').nth(1).and_then(|status| status.parse().ok()) {
            Some(200) => Ok(Updates { lines }),
            status => Err(status.unwrap_or(0)),
        }
    }

    fn send(
        &self,
        method: &str,
        path: &str,
        headers: &[(&str, &str)],
        connection: &str,
    ) -> std::io::Result<TcpStream> {
        let mut stream = TcpStream::connect(&self.address)?;
        stream.set_read_timeout(Some(DEADLINE))?;
        let mut request = format!("{method} {path} HTTP/1.1\r\nconnection: {connection}\r\n");
        if !headers.iter().any(|(name, _)| *name == "host") {
            request.push_str(&format!("host: {}\r\n", self.address));
        }
        for (name, value) in headers {
            request.push_str(&format!("{name}: {value}\r\n"));
        }
        request.push_str("content-length: 0\r\n\r\n");
        stream.write_all(request.as_bytes())?;
        Ok(stream)
    }
}

/// An open stream of updates.
pub(crate) struct Updates {
    lines: BufReader<TcpStream>,
}

impl Updates {
    /// Returns the next line; `None` at the end.
    fn line(&mut self) -> Option<String> {
        let mut line = String::new();
        let length = self.lines.read_line(&mut line).ok()?;
        (length > 0).then(|| line.trim_end().to_owned())
    }

    /// Returns the next event; `None` at the end of the stream.
    pub(crate) fn next(&mut self) -> Option<(String, Value)> {
        loop {
            let Some(name) = self.line()?.strip_prefix("event: ").map(str::to_owned) else {
                continue;
            };
            let data = self.line()?;
            let data = serde_json::from_str(data.strip_prefix("data: ")?).unwrap();
            return Some((name, data));
        }
    }

    /// Reads until an event is as `wanted`.
    pub(crate) fn until(&mut self, event: &str, wanted: impl Fn(&Value) -> bool) -> Value {
        let start = std::time::Instant::now();
        loop {
            let (name, data) = self.next().expect("the stream ended");
            if name == event && wanted(&data) {
                return data;
            }
            assert!(
                start.elapsed() < DEADLINE,
                "no such {event}; the last event was {name} {data}"
            );
        }
    }

    /// Reads to the end of the stream.
    pub(crate) fn end(&mut self) {
        while self.next().is_some() {}
    }
}

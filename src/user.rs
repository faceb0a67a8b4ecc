//! The user as the listener of clients: notes appear on stderr, above a bar of progress if there is one.

use std::sync::Arc;

use osteon_client::client::{Client, ClientError, Remote};
use osteon_client::environment::COORDINATOR;
use osteon_client::listener::RunListener;
use osteon_proto::spans::SpanRecorder;

use crate::progress::say;
use crate::telemetry;

#[derive(Debug)]
struct User;

impl RunListener for User {
    fn note(&self, text: &str) {
        say(text);
    }

    fn spans(&self) -> Option<Arc<dyn SpanRecorder>> {
        telemetry::recorder()
    }
}

/// Returns the user as a listener.
pub(crate) fn listener() -> Arc<dyn RunListener> {
    Arc::new(User)
}

/// Connects to a coordinator; the user is told what is waited for.
pub(crate) async fn connect(remote: &Remote) -> Result<Client, ClientError> {
    Client::connect(remote, listener()).await
}

/// Prints the coordinator's address, unless it was given on the command line.
pub(crate) fn announce(remote: &Remote) {
    if remote.from_environment {
        say(&format!("running on {} ({COORDINATOR})", remote.endpoint));
    }
}

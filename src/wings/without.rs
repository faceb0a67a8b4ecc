//! The options of wings in commands of the core, without these wings: none.

#[cfg(not(feature = "live"))]
mod live {
    use std::net::SocketAddr;

    use clap::Args;
    use osteon_coordinator::Listener;

    use crate::exit_status::CommandFailure;

    /// No page.
    #[derive(Debug, Clone, PartialEq, Eq, Args)]
    pub(crate) struct RunPageOption {}

    impl RunPageOption {
        pub(crate) fn address(&self) -> Option<SocketAddr> {
            None
        }
    }

    /// No page.
    #[derive(Debug, Args)]
    pub(crate) struct PageOptions {}

    impl PageOptions {
        pub(crate) async fn add_to(
            &self,
            to: Listener,
            _: bool,
        ) -> Result<Listener, CommandFailure> {
            Ok(to)
        }
    }
}

#[cfg(not(feature = "report"))]
mod report {
    use std::path::Path;

    use clap::Args;

    use crate::exit_status::CommandFailure;

    /// No report.
    #[derive(Debug, Clone, PartialEq, Eq, Args)]
    pub(crate) struct ReportOption {}

    impl ReportOption {
        pub(crate) fn write(&self, _: Option<&Path>) -> Result<(), CommandFailure> {
            Ok(())
        }
    }
}

/// No figure.
#[cfg(not(feature = "report"))]
pub(crate) fn dispersion_figure(_: &[(&'static str, Vec<[f64; 2]>)]) -> Option<String> {
    None
}

/// No figure.
#[cfg(not(feature = "report"))]
pub(crate) fn wave_image_figure(
    _: (&[f64], &[f64], Vec<Vec<f64>>),
    _: &[(&'static str, Vec<[f64; 2]>)],
    _: &[[f64; 2]],
) -> Option<String> {
    None
}

#[cfg(not(feature = "live"))]
pub(crate) use self::live::{PageOptions, RunPageOption};
#[cfg(not(feature = "report"))]
pub(crate) use self::report::ReportOption;

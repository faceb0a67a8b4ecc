//! Notes from which commit the program is built. This is a build script of the program, not of
//! `common`, so that a commit builds this package anew and not all of them.

use std::env;
use std::path::Path;
use std::process::Command;

/// Files and directories of the program's source. A change in any of them runs this script again, so
/// that it notices a modified tree.
const SOURCES: [&str; 38] = [
    ".cargo",
    "Cargo.lock",
    "Cargo.toml",
    "build.rs",
    "client/Cargo.toml",
    "client/src",
    "common/Cargo.toml",
    "common/src",
    "coordinator/Cargo.toml",
    "coordinator/src",
    "files/Cargo.toml",
    "files/src",
    "http/Cargo.toml",
    "http/src",
    "local/Cargo.toml",
    "local/src",
    "proto/Cargo.toml",
    "proto/build.rs",
    "proto/osteon",
    "proto/src",
    "report/Cargo.toml",
    "report/src",
    "rust-toolchain.toml",
    "search/Cargo.toml",
    "search/src",
    "signals/Cargo.toml",
    "signals/src",
    "slurm/Cargo.toml",
    "slurm/src",
    "solver/Cargo.toml",
    "solver/src",
    "src",
    "transport/Cargo.toml",
    "transport/src",
    "umbridge/Cargo.toml",
    "umbridge/src",
    "worker/Cargo.toml",
    "worker/src",
];

fn main() -> Result<(), String> {
    println!("cargo:rerun-if-env-changed=OSTEON_COMMIT");
    for source in SOURCES.into_iter().filter(|source| Path::new(source).exists()) {
        println!("cargo:rerun-if-changed={source}");
    }
    let given = env::var("OSTEON_COMMIT").ok().filter(|given| !given.is_empty());
    let commit = match given {
        Some(given) if is_plain(&given) => Some(given),
        Some(given) => {
            return Err(format!(
                "OSTEON_COMMIT is {given:?}; it must have 1 to 100 ASCII letters, digits, '-' and '.'"
            ));
        }
        None => checked_out(),
    };
    if let Some(commit) = commit {
        println!("cargo:rustc-env=OSTEON_BUILD_COMMIT={commit}");
    }
    Ok(())
}

fn is_plain(text: &str) -> bool {
    let plain = |byte: u8| byte.is_ascii_alphanumeric() || byte == b'-' || byte == b'.';
    text.len() <= 100 && text.bytes().all(plain)
}

/// The commit of this repository, if this is one.
fn checked_out() -> Option<String> {
    // Sources that were unpacked inside another repository are not of its commits.
    git(&["rev-parse", "--show-prefix"]).filter(String::is_empty)?;
    watch();
    let commit = git(&["rev-parse", "HEAD"])?;
    let status = ["--no-optional-locks", "status", "--porcelain", "--untracked-files=no", "--"];
    let modified = git(&[&status[..], &SOURCES].concat())?;
    Some(if modified.is_empty() { commit } else { format!("{commit}-dirty") })
}

/// Runs this script again after a commit, and when another one is checked out.
fn watch() {
    let names = [Some("HEAD".to_owned()), git(&["symbolic-ref", "--quiet", "HEAD"])];
    for name in names.into_iter().flatten() {
        // `.git` is a file in a work tree beside the first: git knows where its files are.
        let Some(path) = git(&["rev-parse", "--git-path", &name]) else { continue };
        // A branch that was packed has no file until its next commit, which makes it. Cargo would
        // run the script at each call for one that is missing, and looks into directories.
        let present = Path::new(&path).ancestors().find(|path| path.exists());
        println!("cargo:rerun-if-changed={}", present.unwrap_or(Path::new(&path)).display());
    }
}

/// The output of git for these arguments, without its last line end; `None` if git fails or is not
/// installed.
fn git(arguments: &[&str]) -> Option<String> {
    let output = Command::new("git").args(arguments).output().ok()?;
    let text = String::from_utf8(output.stdout).ok().filter(|_| output.status.success())?;
    Some(text.trim_end().to_owned())
}

//! The build script: it records the right commit, and never fails a build because there is none.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on should say where")]

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

/// Compiles the script to `directory`.
fn compiled(directory: &Path) -> std::path::PathBuf {
    let script = directory.join("script");
    let compiler = std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let status = Command::new(compiler)
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .args(["--edition", "2024", "build.rs", "-o"])
        .arg(&script)
        .status();
    assert!(status.unwrap().success());
    script
}

fn run(script: &Path, directory: &Path, given: &str) -> Output {
    let mut command = Command::new(script);
    command.current_dir(directory).env("OSTEON_COMMIT", given);
    // The environment may point to a repository other than that of the directory.
    for name in ["GIT_DIR", "GIT_WORK_TREE", "GIT_INDEX_FILE"] {
        command.env_remove(name);
    }
    command.output().unwrap()
}

/// Returns the commit that a successful run records.
fn noted(output: &Output) -> Option<String> {
    assert!(output.status.success(), "{output:?}");
    let text = String::from_utf8(output.stdout.clone()).unwrap();
    let line = text.lines().find_map(|line| line.strip_prefix("cargo:rustc-env="));
    line.map(|line| line.strip_prefix("OSTEON_BUILD_COMMIT=").unwrap().to_owned())
}

fn git(directory: &Path, arguments: &[&str]) -> String {
    let own = ["-c", "user.name=test", "-c", "user.email=test@localhost"];
    let mut command = Command::new("git");
    for name in ["GIT_DIR", "GIT_WORK_TREE", "GIT_INDEX_FILE"] {
        command.env_remove(name);
    }
    let output = command.current_dir(directory).args(own).args(arguments).output().unwrap();
    assert!(output.status.success(), "git {arguments:?}: {output:?}");
    String::from_utf8(output.stdout).unwrap().trim().to_owned()
}

/// Returns the files and directories whose changes run the script again.
fn watched(output: &Output) -> Vec<String> {
    let text = String::from_utf8(output.stdout.clone()).unwrap();
    let lines = text.lines().filter_map(|line| line.strip_prefix("cargo:rerun-if-changed="));
    lines.map(str::to_owned).collect()
}

#[test]
fn the_commit_is_that_of_the_tree_with_a_mark_where_it_was_modified() {
    let scratch = tempfile::tempdir().unwrap();
    let script = compiled(scratch.path());
    let tree = scratch.path().join("tree");
    fs::create_dir_all(tree.join("src")).unwrap();
    fs::write(tree.join("src/main.rs"), "fn main() {}\n").unwrap();
    fs::write(tree.join("README.md"), "").unwrap();
    git(&tree, &["init", "--quiet"]);
    assert_eq!(noted(&run(&script, &tree, "")), None, "without a commit");
    git(&tree, &["add", "."]);
    git(&tree, &["commit", "--quiet", "--message", "one"]);
    let commit = git(&tree, &["rev-parse", "HEAD"]);
    assert_eq!(noted(&run(&script, &tree, "")), Some(commit.clone()));
    // Files that the program is not built from do not count.
    fs::write(tree.join("README.md"), "more\n").unwrap();
    assert_eq!(noted(&run(&script, &tree, "")), Some(commit.clone()));
    fs::write(tree.join("src/main.rs"), "fn main() { }\n").unwrap();
    assert_eq!(noted(&run(&script, &tree, "")), Some(format!("{commit}-dirty")));
    git(&tree, &["checkout", "--quiet", "src/main.rs"]);
    // In a linked work tree `.git` is a file.
    git(&tree, &["worktree", "add", "--quiet", "../beside", "-b", "other"]);
    let beside = scratch.path().join("beside");
    let output = run(&script, &beside, "");
    assert_eq!(noted(&output), Some(commit.clone()));
    let watched = watched(&output);
    assert!(watched.iter().any(|path| path.ends_with("refs/heads/other")), "{watched:?}");
    assert!(watched.iter().any(|path| path.ends_with("worktrees/beside/HEAD")), "{watched:?}");
    assert!(watched.iter().all(|path| beside.join(path).exists()), "{watched:?}");
    // A packed branch has no file, so its directory is watched.
    git(&beside, &["pack-refs", "--all"]);
    let output = run(&script, &beside, "");
    assert_eq!(noted(&output), Some(commit));
    let watched = self::watched(&output);
    assert!(watched.iter().any(|path| path.ends_with("refs/heads")), "{watched:?}");
    assert!(watched.iter().all(|path| beside.join(path).exists()), "{watched:?}");
    // Sources inside another repository do not belong to its commits.
    assert_eq!(noted(&run(&script, &tree.join("src"), "")), None);
}

#[test]
fn without_a_repository_there_is_no_commit_unless_one_is_given() {
    let scratch = tempfile::tempdir().unwrap();
    let script = compiled(scratch.path());
    assert_eq!(noted(&run(&script, scratch.path(), "")), None);
    assert_eq!(noted(&run(&script, scratch.path(), "v1.2-3")), Some("v1.2-3".to_owned()));
    let refused = run(&script, scratch.path(), "two words");
    assert!(!refused.status.success());
    assert!(String::from_utf8_lossy(&refused.stderr).contains("OSTEON_COMMIT is"), "{refused:?}");
}

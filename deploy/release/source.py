"""The sources that a release is made of: version, commit, files."""

import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
VERSION = re.search(r'^version = "(.+)"$', (ROOT / "Cargo.toml").read_text(), re.MULTILINE)[1]


def refuse_unless_clean():
    """Ends the program if the files are not those of a commit, or of one whose tag names another version."""
    if not is_clean():
        sys.exit("the tree has changes or files that are in no commit: commit them, or say --dirty to try things out")
    tags = [tag for tag in git("tag", "--points-at", "HEAD").split() if tag.startswith("v")]
    if tags and f"v{VERSION}" not in tags:
        sys.exit(f"the commit has the tag {tags[0]}, but the version in Cargo.toml is {VERSION}")


def is_clean():
    """Whether all files are those of the commit."""
    return not git("status", "--porcelain")


def commit():
    """The commit that is checked out."""
    return git("rev-parse", "HEAD")


def commit_time():
    """Its time, s since 1970: the time of all files, so that a commit has one archive."""
    return int(git("log", "-1", "--format=%ct"))


def files(*places):
    """The files of the repository at or below these places, in order."""
    return git("ls-files", "--", *places).splitlines()


def git(*arguments):
    """What git says, without its last line end."""
    done = subprocess.run(["git", *arguments], cwd=ROOT, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        sys.exit(f"git {arguments[0]} failed: {done.stderr.strip()}")
    return done.stdout.rstrip()

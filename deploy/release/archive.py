"""The archive of the program for one processor: unpacked it runs where it is, and in `/usr/local` or `~/.local` shells
and man find its `bin` and `share`. The same files give the same bytes."""

import gzip
import pathlib
import shutil
import tarfile

from source import ROOT, VERSION, commit_time, files

DOCUMENTS = ("README.md", "CHANGELOG.md", "CITATION.cff", "LICENSE-APACHE", "LICENSE-MIT", "SECURITY.md")
FOLDERS = ("docs", "examples")
"""What README.md links to, beside the documents."""

PLACES = {
    "man": "share/man/man1",
    "completions/osteon.bash": "share/bash-completion/completions/osteon",
    "completions/_osteon": "share/zsh/site-functions/_osteon",
    "completions/osteon.fish": "share/fish/vendor_completions.d/osteon.fish",
}
"""Where the pages and scripts of the program belong."""


def name_of(processor):
    """The name of the archive, and of the folder in it, without an ending."""
    return f"osteon-{VERSION}-{processor}-linux"


def pack(processor, program, pages, licences, work, out):
    """Packs the program, its manual pages and completions in the folder `pages`, and the licences of others."""
    folder = work / name_of(processor)
    shutil.rmtree(folder, ignore_errors=True)
    for name in files(*DOCUMENTS, *FOLDERS):
        copy(ROOT / name, folder / name)
    copy(program, folder / "bin" / "osteon")
    copy(licences, folder / licences.name)
    for source, place in PLACES.items():
        copy(pages / source, folder / place)
    write(folder, out / f"{folder.name}.tar.gz")


def copy(source, target):
    """Copies a file or a folder."""
    target.parent.mkdir(parents=True, exist_ok=True)
    (shutil.copytree if source.is_dir() else shutil.copy)(source, target)


def write(folder, path):
    """Writes a folder to an archive without whatever differs from one machine to the next."""
    time = commit_time()

    def plain(entry):
        runs = entry.isdir() or entry.name.endswith("/bin/osteon")
        entry.mode, entry.mtime = 0o755 if runs else 0o644, time
        entry.uid = entry.gid = 0
        entry.uname = entry.gname = "root"
        return entry

    with open(path, "wb") as file, gzip.GzipFile("", "wb", 9, file, time) as compressed:
        with tarfile.open(fileobj=compressed, mode="w", format=tarfile.PAX_FORMAT) as archive:
            # Folders are added with their contents in the order of the names.
            archive.add(pathlib.Path(folder), folder.name, filter=plain)

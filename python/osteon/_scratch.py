"""Directories that live as long as an object."""

from __future__ import annotations

import weakref
from pathlib import Path


class Scratch:
    """A new directory; it is removed with this object, or at the end of the interpreter."""

    def __init__(self) -> None:
        # Imported here, because they would take a tenth of the time of `import osteon`.
        import shutil
        import tempfile

        self.path = Path(tempfile.mkdtemp(prefix="osteon-"))
        self.remove = weakref.finalize(self, shutil.rmtree, self.path, ignore_errors=True)

"""Makes the modules of the package that follow from other files of the repository; none of them is committed."""

import json
import pathlib

from . import messages, results, sections

PYTHON = pathlib.Path(__file__).resolve().parent.parent.parent
ROOT = PYTHON.parent
PACKAGE = PYTHON / "osteon"


def write():
    """Writes all of them."""
    (PACKAGE / "sections.py").write_text(sections.module(schema("job")), encoding="utf-8")
    (PACKAGE / "results.py").write_text(results.module(schema("result")), encoding="utf-8")
    messages.write(ROOT / "proto", PYTHON)


def schema(file):
    """A JSON Schema; the tests compare it with the one that the program prints."""
    return json.loads((ROOT / "docs" / f"{file}.schema.json").read_text(encoding="utf-8"))


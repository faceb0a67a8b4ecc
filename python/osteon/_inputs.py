"""What users pass in, as the plain values of a JSON document."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Union

import numpy as np

from osteon import _native
from osteon.errors import refuse

# At run time, too: `X | Y` of these needs no Python newer than 3.10, but mypy wants one spelling.
CaseLike = Union[str, "os.PathLike[str]", Mapping[str, Any], _native.Case]
"""A case: the path of a case file, a dictionary with the same keys, or a :class:`osteon.Case`."""


def case_of(case: CaseLike) -> _native.Case:
    """The checked case that a path, a dictionary or a case stands for."""
    if isinstance(case, _native.Case):
        return case
    if isinstance(case, (str, os.PathLike)):
        return _native.Case.read(case)
    # Callers without a type checker may pass anything.
    given: object = case
    if isinstance(given, Mapping):
        return _native.Case.parse(document(given), "json")
    found = type(given).__name__
    refuse("case", f"is a {found}; give a path, a dictionary or an osteon.Case")


def document(table: Mapping[str, Any]) -> str:
    """A dictionary as the text of a JSON file, with arrays as lists."""
    return json.dumps(plain(table, ""), allow_nan=False)


def plain(value: Any, field: str) -> Any:
    """A value as JSON knows it; `field` is its name for messages."""
    if value is None or isinstance(value, (str, bool)):
        return value
    if isinstance(value, (int, np.integer)):
        return int(value)
    if isinstance(value, (float, np.floating)):
        number = float(value)
        if not math.isfinite(number):
            refuse(field, f"is {number}; it must be a finite number")
        return number
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    if np.ma.isMaskedArray(value) and np.ma.getmaskarray(value).any():
        refuse(field, "has masked values; leave them out (array.compressed())")
    if isinstance(value, np.ndarray):
        if hasattr(value, "unit") or hasattr(value, "units"):
            refuse(field, "carries a unit; give its numbers in SI units")
        return array(value, field)
    if isinstance(value, Mapping):
        return {str(key): plain(entry, entry_path(field, key)) for key, entry in value.items()}
    if isinstance(value, Sequence):
        return [plain(entry, f"{field}[{index}]") for index, entry in enumerate(value)]
    if hasattr(value, "to_numpy"):
        return array(np.asarray(value.to_numpy()), field)
    refuse(field, f"is a {type(value).__name__}; give numbers, texts, lists or dictionaries")


def array(values: np.ndarray[Any, Any], field: str) -> Any:
    """An array of finite numbers, or of texts, as lists."""
    if values.dtype.kind in "fc" and values.ndim >= 1:
        wrong = np.argwhere(~np.isfinite(values))
        if len(wrong):
            place = "".join(f"[{index}]" for index in wrong[0])
            number = values[tuple(wrong[0])]
            more = f" ({len(wrong)} values are not finite)" if len(wrong) > 1 else ""
            refuse(f"{field}{place}", f"is {number}; it must be a finite number{more}")
    if values.dtype.kind == "O":
        return plain(values.tolist(), field)
    if values.dtype.kind not in "fiuUb":
        refuse(field, f"is an array of {values.dtype}; it must have numbers")
    return values.tolist()


def entry_path(field: str, key: object) -> str:
    """The path of an entry of a table."""
    return f"{field}.{key}" if field else str(key)


def out_directory(out: str | os.PathLike[str] | None) -> Path | None:
    """The directory for results, if there is one."""
    return None if out is None else Path(out)

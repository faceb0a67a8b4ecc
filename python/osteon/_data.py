"""Measured velocities: frames of pandas or polars, arrays, or what a job file has."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, TypedDict, Union, cast

import numpy as np

from osteon._inputs import plain
from osteon.errors import refuse

DataLike = Union["Data", Mapping[str, Any], Sequence[float], np.ndarray[Any, Any], Any]
"""Velocities: an array or a list in m/s, a frame of pandas or polars with a column `velocity`, or a
dictionary like the section `[data]` of a job file, whose `velocities` may be any of these."""

QUANTITIES = ("bone_thickness", "bone_quality_factor", "coupling_sound_speed")


class Data(TypedDict, total=False):
    """The section `[data]`: measured velocities, or their moments."""

    velocities: Any
    """Velocities in m/s: an array, a frame with a column `velocity`, or the path of a CSV file."""

    group: str
    """Name of the column that holds the group (bone, patient, site) of each velocity."""

    subject: str
    """Name of the column that holds the subject of each velocity: several of one are not independent."""

    known: Mapping[str, str]
    """Quantities of the setup that are known of each group: names of the columns with their values."""

    groups: Mapping[str, Any]
    """Instead of a frame: the velocities of each group by its name."""

    subjects: Sequence[int]
    """With an array: the subject of each velocity."""

    mean: float
    """Instead of velocities: their mean, m/s; requires `coefficient_of_variation`."""

    coefficient_of_variation: float
    """Coefficient of variation of the velocities, above 0."""

    count: int
    """Number of independent velocities behind the moments."""

    repeatability: float
    """Standard deviation of repeated measurements of one place, m/s."""


def is_frame(value: object) -> bool:
    """Whether this is a table with named columns."""
    return hasattr(value, "columns") and hasattr(value, "__getitem__")


def section(data: DataLike) -> dict[str, Any]:
    """The section `[data]` as plain values."""
    given: dict[str, Any]
    given = dict(data) if isinstance(data, Mapping) else {"velocities": data}
    velocities = given.get("velocities")
    if velocities is not None and is_frame(velocities):
        given = from_frame(velocities, given)
    elif velocities is not None and not isinstance(velocities, (str, bytes)):
        given["velocities"] = one_list(velocities)
    return cast("dict[str, Any]", plain(given, "data"))


def one_list(velocities: Any) -> Any:
    """Velocities that are no frame: an array of one axis, or a path."""
    if hasattr(velocities, "__fspath__"):
        return velocities
    if hasattr(velocities, "__next__"):
        refuse("data.velocities", "is an iterator; give a list of it: list(…)")
    velocities = in_si(velocities, "data.velocities")
    array = np.asarray(unmasked(velocities, "data.velocities"))
    if array.ndim != 1:
        refuse("data.velocities", f"has {array.ndim} axes; it must be a list of velocities (m/s)")
    if array.size == 0:
        refuse("data.velocities", "is empty; it must have velocities (m/s)")
    return array


def column(frame: Any, name: object, field: str) -> np.ndarray[Any, Any]:
    """A column of a frame."""
    names = [str(known) for known in frame.columns]
    if name not in names:
        import difflib

        near = difflib.get_close_matches(str(name), names, n=1)
        hint = f"did you mean {near[0]!r}?" if near else f"the columns are: {', '.join(names)}"
        refuse(field, f"the frame has no column {name!r}; {hint}")
    found = frame[name]
    dtype = str(getattr(found, "dtype", ""))
    if dtype.startswith("pint["):
        refuse(field, f"the column {name!r} has the unit {dtype[5:-1]}; give its numbers in SI units")
    return np.asarray(unmasked(found.to_numpy(), field))


def from_frame(frame: Any, given: Mapping[str, Any]) -> dict[str, Any]:
    """The section of a frame, whose columns it names."""
    if len(frame) == 0:
        refuse("data.velocities", "the frame is empty; it must have a row for each velocity")
    velocities = numbers(column(frame, "velocity", "data.velocities"), "velocity")
    section = {key: value for key, value in given.items() if key not in ("velocities", "group")}
    by_subject = section.pop("subject", None)
    subjects = None
    if by_subject is not None:
        names = column(frame, by_subject, "data.subject")
        present(names, by_subject, "data.subject")
        order: dict[Any, int] = {}
        subjects = np.array([order.setdefault(name, len(order)) for name in names.tolist()])
    known = section.pop("known", {})
    if "group" not in given:
        if known:
            refuse("data.known", "requires data.group")
        if subjects is not None:
            section["subjects"] = subjects
        return {**section, "velocities": velocities}
    groups = column(frame, given["group"], "data.group")
    present(groups, given["group"], "data.group")
    values = {}
    for quantity, name in known.items():
        if quantity not in QUANTITIES:
            refuse(f"data.known.{quantity}", f"unknown key; known here: {', '.join(QUANTITIES)}")
        field = f"data.known.{quantity}"
        values[quantity] = numbers(column(frame, name, field), name)
    return {**section, "groups": by_group(groups, velocities, subjects, values)}


def by_group(
    groups: np.ndarray[Any, Any],
    velocities: np.ndarray[Any, Any],
    subjects: np.ndarray[Any, Any] | None,
    known: Mapping[str, np.ndarray[Any, Any]],
) -> dict[str, Any]:
    """The velocities of each group, in the order of their first rows."""
    texts = np.array([str(name) for name in groups.tolist()])
    sections: dict[str, Any] = {}
    for name in dict.fromkeys(texts.tolist()):
        rows = texts == name
        group: dict[str, Any] = {"velocities": velocities[rows]}
        if subjects is not None:
            group["subjects"] = subjects[rows]
        for quantity, values in known.items():
            of_group = np.unique(values[rows])
            if len(of_group) > 1:
                found = ", ".join(str(value) for value in of_group[:3].tolist())
                refuse(f"data.known.{quantity}", f"the group {name!r} has several values: {found}")
            group[quantity] = float(of_group[0])
        sections[name] = group if len(group) > 1 else group["velocities"]
    return sections


def numbers(values: np.ndarray[Any, Any], name: object) -> np.ndarray[Any, Any]:
    """A column of finite numbers."""
    # NumPy makes numbers of texts, durations and truth values, too, and drops imaginary parts.
    entries = values.tolist() if values.dtype.kind == "O" else []
    if values.dtype.kind not in "fiuO" or any(is_no_number(entry) for entry in entries):
        refuse("data.velocities", f"the column {name!r} has values that are no numbers")
    try:
        found = values.astype(np.float64)
    except (TypeError, ValueError):
        refuse("data.velocities", f"the column {name!r} has values that are no numbers")
    wrong = np.flatnonzero(~np.isfinite(found))
    if len(wrong):
        more = f" (and {len(wrong) - 1} more rows)" if len(wrong) > 1 else ""
        message = f"the column {name!r} is {found[wrong[0]]} in row {wrong[0]}{more}; "
        refuse("data.velocities", message + "leave such rows out (frame.dropna())")
    return found


def is_no_number(entry: object) -> bool:
    """Whether this is something of which NumPy would make a number without being asked."""
    return isinstance(entry, (str, bytes, bool, np.bool_, complex, np.datetime64, np.timedelta64))


def unmasked(values: Any, field: str) -> Any:
    """The values; refused if some are masked, because what is behind a mask is no value."""
    if np.ma.isMaskedArray(values):
        count = int(np.ma.getmaskarray(values).sum())
        if count > 0:
            refuse(field, f"has {count} masked values; leave them out (array.compressed())")
        return values.data
    return values


def in_si(values: Any, field: str) -> Any:
    """The numbers of velocities that carry a unit, in m/s; others as they are."""
    unit = getattr(values, "units", getattr(values, "unit", None))
    if unit is None and isinstance(getattr(values, "attrs", None), Mapping):
        unit = values.attrs.get("units")
        if unit is not None and str(unit) not in ("m/s", "m s-1", "m s^-1", "m s**-1", "meter / second"):
            refuse(field, f"has the unit {unit}; give it in m/s")
        return values
    if unit is None or not hasattr(values, "to"):
        return values
    try:
        converted = values.to("m/s")
    # Every library of units has its own exception for units of something else.
    except Exception as error:
        refuse(field, f"has the unit {unit}, which is none of velocities: {error}")
    return getattr(converted, "magnitude", getattr(converted, "value", converted))


def present(values: np.ndarray[Any, Any], name: object, field: str) -> None:
    """Refuses a column of names in which some are missing."""
    # What is not equal to itself is NaN, or a missing value of pandas.
    wrong = [row for row, value in enumerate(values.tolist()) if value is None or value != value]
    if wrong:
        refuse(field, f"the column {name!r} is empty in row {wrong[0]}; every row needs a name")

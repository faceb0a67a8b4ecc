"""Results as tables in a notebook: first whether to trust them, last the digest."""

from __future__ import annotations

import html
import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from osteon._objects import Moments
    from osteon._results import Estimate, Part

GOOD, DOUBTFUL, BAD = "#d9ead9", "#fbecc4", "#f6d6d0"
"""Backgrounds of cells; each also says in words what it means."""

CELL = "padding:2px 8px;text-align:right;border-bottom:1px solid #ccc;color:#111"

UNITS = {
    "bulk_velocity": "m/s",
    "density": "kg/m³",
    "longitudinal_young_modulus": "Pa",
    "longitudinal_shear_modulus": "Pa",
    "transverse_young_modulus": "Pa",
    "bone_thickness": "m",
    "coupling_sound_speed": "m/s",
}

STATUS = {
    "converged": (GOOD, "Converged: the model matches the data."),
    "done": (GOOD, "Done."),
    "not_matched": (BAD, "Not matched: no point within the bounds matches the data."),
    "max_evaluations": (DOUBTFUL, "Not converged: the evaluations were used up."),
    "cancelled": (BAD, "Cancelled."),
    "failed": (BAD, "Failed."),
}


def part(found: Part) -> str:
    """The table of a result or of one of its groups."""
    color, words = STATUS.get(found.status, (DOUBTFUL, found.status))
    if found.reason:
        words += " " + found.reason
    rows = [f'<tr><td colspan="4" style="{CELL};text-align:left;background:{color}">{text(words)}</td></tr>']
    groups = getattr(found, "groups", {})
    if groups:
        rows += of_groups(list(groups.values()))
    else:
        rows += free(found) + moments(found) + estimates(found) + failures(found)
    digest = getattr(found, "digest", None)
    if digest is not None:
        rows.append(
            f'<tr><td colspan="4" style="{CELL};text-align:left;font-size:85%">digest '
            f"<code>{text(digest)}</code></td></tr>"
        )
    return f'<table style="border-collapse:collapse">{"".join(rows)}</table>'


def free(found: Part) -> list[str]:
    """What the data leave open; nothing if they determine all."""
    count = len(found.free_directions)
    if count == 0:
        return []
    names = [name for name, entry in found.estimates.items() if not entry.is_determined]
    listed = ", ".join(label(name) for name in names)
    directions = "one direction is" if count == 1 else f"{count} directions are"
    words = (
        f"Of the parameters, {directions} not fixed by your data; many other sets match them as "
        f"well. Not determined: {listed}."
    )
    style = f"{CELL};text-align:left;background:{DOUBTFUL}"
    return [f'<tr><td colspan="4" style="{style}">{text(words)}</td></tr>']


def moments(found: Part) -> list[str]:
    """Moments of model and data."""
    model, data = found.velocity, found.data
    rows = [header("", "model", "data", "")]
    for key, name, unit in (
        ("mean", "mean velocity", "m/s"),
        ("coefficient_of_variation", "coefficient of variation", ""),
    ):
        rows.append(row(name, moment(model, key), "" if data is None else moment(data, key), unit))
    return rows


def moment(of: Moments, key: str) -> str:
    """A moment with its error."""
    return with_error(getattr(of, key), getattr(of, f"{key}_standard_error"))


def estimates(found: Part) -> list[str]:
    """What was identified: value, interval and whether it is determined."""
    known = found.estimates
    if not known:
        return []
    rows = [header("", "value", "95 % interval", "")]
    for name, entry in known.items():
        rows.append(
            row(label(name), with_error(entry.value, entry.standard_error), interval(entry),
                UNITS.get(name, ""), GOOD if entry.is_determined else DOUBTFUL)
        )  # fmt: skip
    return rows


def interval(entry: Estimate) -> str:
    """An interval, rounded to the error."""
    if entry.interval is None:
        return "not determined"
    low, high = entry.interval
    error = entry.standard_error or (high - low) / 4
    return f"{rounded(low, error)} to {rounded(high, error)}"


def failures(found: Part) -> list[str]:
    """The realizations that failed, if any."""
    if not found.failures:
        return []
    listed = ", ".join(f"{count} {kind}" for kind, count in found.failures.items())
    style = f"{CELL};text-align:left;background:{DOUBTFUL}"
    return [f'<tr><td colspan="4" style="{style}">failed realizations: {text(listed)}</td></tr>']


def of_groups(groups: list[Part]) -> list[str]:
    """A row for each group."""
    rows = [header("group", "√(c1111/ρ), m/s", "dispersion", "status")]
    for group in groups:
        known = group.estimates
        cells = []
        for name in ("bulk_velocity", "dispersion"):
            entry = known.get(name)
            cells.append("" if entry is None else with_error(entry.value, entry.standard_error))
        color = STATUS.get(group.status, (DOUBTFUL, ""))[0]
        name = str(getattr(group, "name", ""))
        rows.append(row(name, cells[0], cells[1], group.status, color))
    return rows


def header(*cells: str) -> str:
    """A row of headings."""
    return "<tr>" + "".join(f'<th style="{CELL}">{text(cell)}</th>' for cell in cells) + "</tr>"


def row(name: str, first: str, second: str, unit: str, color: str = "#fff") -> str:
    """A row: what it is, two numbers, the unit."""
    cells = (name, first, second, unit)
    style = f"{CELL};background:{color}"
    return "<tr>" + "".join(f'<td style="{style}">{text(cell)}</td>' for cell in cells) + "</tr>"


def label(name: str) -> str:
    """A name for people."""
    return "√(c1111/ρ)" if name == "bulk_velocity" else name.replace("_", " ")


def text(plain: str) -> str:
    """A text without marks of HTML."""
    return html.escape(plain)


def with_error(value: float | None, error: float | None) -> str:
    """A number rounded to its error, which has two digits; three digits where there is no error."""
    if value is None or not math.isfinite(value):
        return "–"
    if error is None or not error > 0.0:
        return f"{value:.4g}" if error is None else f"{value:.6g}"
    if max(abs(value), error) >= 1e7:
        power = math.floor(math.log10(max(abs(value), error)))
        scale = 10.0**power
        return f"({rounded(value / scale, error / scale)} ± {two_digits(error / scale)}) · 10^{power}"
    return f"{rounded(value, error)} ± {two_digits(error)}"


def decimals(error: float) -> int:
    """The decimals that leave two digits of an error."""
    return max(0, 1 - math.floor(math.log10(float(f"{error:.1e}"))))


def two_digits(error: float) -> str:
    """An error with two digits."""
    return f"{error:.{decimals(error)}f}"


def rounded(value: float, error: float) -> str:
    """A number with the decimals of its error."""
    if max(abs(value), error) >= 1e7 and error > 0.0:
        return f"{value:.{max(1, math.floor(math.log10(abs(value) / error)) + 1)}e}"
    return f"{value:.{decimals(error)}f}"

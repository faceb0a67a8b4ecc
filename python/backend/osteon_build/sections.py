"""Makes `osteon.sections`, the types of the sections of a job, from the JSON Schema of job files."""

import json

from .layout import docstring, sentence, title

HEAD = '''\
"""The sections of a job: the keyword arguments of :class:`osteon.Job`.

Every key may be left out unless it says otherwise; units are SI.

Made from docs/job.schema.json when the package is built."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal, TypedDict
'''

WRITTEN_BY_HAND = "data"
"""`[data]` also takes frames and arrays; its type is in `osteon/_data.py`."""

PLAIN = {"number": "float", "integer": "int", "boolean": "bool", "string": "str"}

LIMITS = {
    "exclusiveMinimum": "above",
    "minimum": "at least",
    "exclusiveMaximum": "below",
    "maximum": "at most",
}


def module(schema):
    """The text of the module."""
    lines = []
    for name, section in schema["properties"].items():
        if name != WRITTEN_BY_HAND:
            add_class(lines, title(name), section)
    return HEAD + "\n".join(lines) + "\n"


def add_class(lines, name, table):
    """Adds the type of a table, after those of the tables in it."""
    fields = [
        (key, kind(lines, name + title(key), value), described(value))
        for key, value in table["properties"].items()
    ]
    lines += ["", "", f"class {name}(TypedDict, total=False):"]
    lines += docstring(sentence(table["description"]), 4)
    for key, of, description in fields:
        lines += ["", f"    {key}: {of}", *docstring(description, 4)]


def kind(lines, name, value):
    """The type of a value; those of tables are added."""
    if "enum" in value:
        return f"Literal[{', '.join(map(json.dumps, value['enum']))}]"
    if "anyOf" in value:
        forms = [{"description": value["description"], **form} for form in value["anyOf"]]
        return " | ".join(kind(lines, name, form) for form in forms)
    if value["type"] == "array":
        return f"Sequence[{kind(lines, name, value['items'])}]"
    if value["type"] == "object":
        add_class(lines, name, value)
        return name
    return PLAIN[value["type"]]


def described(value):
    """The description of a value with its range and default."""
    text = sentence(value["description"])
    limits = [f"{words} {value[key]}" for key, words in LIMITS.items() if value.get(key) is not None]
    if limits:
        text += f" Range: {', '.join(limits)}."
    if "default" in value:
        default = value["default"]
        shown = str(default) if isinstance(default, (bool, float)) else json.dumps(default)
        text += f" Default: {shown}."
    return text

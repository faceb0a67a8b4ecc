"""Makes `osteon.results`, a class for each object of `result.json`, from its JSON Schema.

A key of the result needs no line in Python: it is a property with its type and description. What a class has
beyond its keys is written by hand in its base, and so are a few properties in another form than the file's."""

import dataclasses

from .layout import docstring, sentence, title

HEAD = '''\
"""The objects of `result.json` as classes: :class:`osteon.Result` has them as attributes.

Units are SI; what is null in the file, or not there, is None. docs/results.md explains the keys.

Made from docs/result.schema.json when the package is built."""

from __future__ import annotations

from typing import Literal

from osteon import _objects
'''

KINDS = ("Identification", "Propagation")
"""The results of jobs. That of a case is an `osteon.Simulation`, with arrays and without a file."""

MOMENTS = {"mean", "coefficient_of_variation"}
WRITTEN_BY_HAND = {
    "Moments": MOMENTS,
    "Velocity": MOMENTS,
    "Data": MOMENTS,
    "PartKeys": {"parameters", "status"},
    "ResultKeys": {"evaluations", "groups"},
}
"""Keys that have another form in Python: properties of `osteon/_objects.py` and `osteon/_results.py`."""

BASES = {"Moments": "Moments", "Velocity": "Moments", "Data": "Moments"}
"""Classes of `osteon/_objects.py` that others than `Object` are derived from."""

PLAIN = {"number": "float", "integer": "int", "boolean": "bool", "string": "str"}


@dataclasses.dataclass(frozen=True)
class Key:
    """A key of an object."""

    value: dict
    is_required: bool
    only: str = ""
    """Where it is, if not in every form of the object."""


@dataclasses.dataclass(frozen=True)
class Kind:
    """The type of a value, and the expression that makes it of the JSON in `{}`."""

    name: str
    made: str = "{}"
    is_container: bool = False

    def of(self, expression):
        return self.made.replace("{}", expression)


def module(schema):
    """The text of the module."""
    classes = Classes(schema["$defs"])
    classes.add_results([variant_of(schema, kind) for kind in KINDS], schema)
    return HEAD + "\n".join(classes.lines) + "\n"


def variant_of(schema, kind):
    """The form of the document for results of a kind."""
    [variant] = [form for form in schema["oneOf"] if form["$ref"].endswith(f"/{kind}")]
    return variant


class Classes:
    """The classes that were written so far."""

    def __init__(self, definitions):
        self.definitions = definitions
        self.lines = []
        self.names = set()

    def add_results(self, variants, document):
        """Adds what all results and their groups have, and what only either has."""
        forms = [self.definitions[kind] for kind in KINDS]
        forms = [
            {"properties": form["properties"] | variant["properties"], "required": form["required"] + ["kind"]}
            for form, variant in zip(forms, variants)
        ]
        result = keys_of({"oneOf": forms} | {key: document[key] for key in ("properties", "required")})
        group = keys_of(self.definitions["Group"])
        both = {
            name: dataclasses.replace(key, is_required=key.is_required and group[name].is_required)
            for name, key in result.items() if name in group
        }  # fmt: skip
        for name, key in both.items():
            if self.kind(key.value, True).name != self.kind(group[name].value, True).name:
                raise ValueError(f"the key {name} of a result has another type than that of a group")
        words = "Keys of what a job found from one set of data."
        self.add_class("PartKeys", words, both)
        self.add_class("ResultKeys", "Keys of a result that its groups do not have.", without(result, both))
        self.add_class("GroupKeys", "Keys of a group that a result does not have.", without(group, both))

    def add_class(self, name, description, keys):
        """Adds a class, after those of the objects in it."""
        self.names.add(name)
        written = WRITTEN_BY_HAND.get(name, set())
        if written - keys.keys():
            raise ValueError(f"{name} has no keys {written - keys.keys()}, which are written by hand")
        body = []
        for key, of in keys.items():
            if key not in written:
                body += self.property(key, of)
        self.lines += ["", "", f"class {name}(_objects.{BASES.get(name, 'Object')}):"]
        self.lines += [*docstring(sentence(description), 4), *body]

    def property(self, key, of):
        """The lines of a property."""
        kind = self.kind(of.value, not of.is_required)
        if kind.name.endswith("None"):
            found = f'self._values.get("{key}")'
        elif kind.is_container and not of.is_required:
            found = f'self._values.get("{key}") or {{}}'
        else:
            # Its absence is an error that names it.
            found = f'self._values["{key}"]'
        lines = ["", "    @property", f"    def {key}(self) -> {kind.name}:"]
        lines += docstring(sentence(of.value.get("description", title(key))) + of.only, 8)
        if kind.made == "{}":
            return [*lines, f"        return {found}"]
        return [*lines, f"        found = {found}", f"        return {kind.of('found')}"]

    def kind(self, value, may_be_absent, depth=0):
        """The type of a value; the classes of objects are added."""
        plain, is_nullable = without_null(value)
        kind = self.kind_of_present(plain, depth)
        if is_nullable or (may_be_absent and not kind.is_container):
            made = kind.made if kind.made == "{}" else f"None if {{}} is None else {kind.made}"
            return Kind(f"{kind.name} | None", made)
        return kind

    def kind_of_present(self, value, depth):
        choices = choices_of(value)
        if choices:
            return Kind(f"Literal[{', '.join(map(quoted, choices))}]")
        if "$ref" in value:
            name = value["$ref"].rsplit("/", 1)[1]
            if choices := choices_of(self.definitions[name]):
                return self.kind_of_present(self.definitions[name], depth)
            if name not in self.names:
                self.add_class(name, self.definitions[name]["description"], keys_of(self.definitions[name]))
            return Kind(name, f"{name}({{}})")
        if value["type"] == "array" and value.get("minItems", 0) == value.get("maxItems"):
            inner = self.kind(value["items"], False, depth + 1)
            if inner.made != "{}":
                raise ValueError(f"a list of a fixed number of {inner.name} has no counterpart")
            return Kind(f"tuple[{', '.join([inner.name] * value['maxItems'])}]", "tuple({})")
        entry = f"entry{depth or ''}"
        if value["type"] == "array":
            inner = self.kind(value["items"], False, depth + 1)
            made = f"[{inner.of(entry)} for {entry} in {{}}]"
            return Kind(f"list[{inner.name}]", "list({})" if inner.made == "{}" else made, True)
        if value["type"] == "object":
            inner = self.kind(value["additionalProperties"], False, depth + 1)
            made = f"{{name: {inner.of(entry)} for name, {entry} in {{}}.items()}}"
            return Kind(f"dict[str, {inner.name}]", "dict({})" if inner.made == "{}" else made, True)
        return Kind(PLAIN[value["type"]])


def keys_of(definition):
    """The keys of an object; if it has several forms, those of all of them."""
    required = definition.get("required", [])
    keys = {name: Key(value, name in required) for name, value in definition.get("properties", {}).items()}
    forms = definition.get("oneOf", [])
    names = dict.fromkeys(name for form in forms for name in form["properties"])
    for name in names:
        having = [form for form in forms if name in form["properties"]]
        values = [form["properties"][name] for form in having]
        value = values[0]
        if "const" in value:
            value = {"enum": [value["const"] for value in values]} | value
        everywhere = len(having) == len(forms)
        is_required = everywhere and all(name in form["required"] for form in having)
        keys[name] = Key(value, is_required, "" if everywhere else only_of(forms, having))
    return keys


def only_of(forms, having):
    """Which forms have a key, in words."""
    [tag] = [name for name, value in forms[0]["properties"].items() if "const" in value]
    names = [form["properties"][tag]["const"] for form in having]
    return f" Only of {' and '.join(f'`{name}`' for name in names)}."


def choices_of(value):
    """The texts that a value is one of; empty if it is no such text."""
    if "enum" in value:
        return value["enum"]
    if value.get("type") == "string" and "const" in value:
        return [value["const"]]
    forms = value.get("oneOf", [])
    return [form["const"] for form in forms] if all("const" in form for form in forms) else []


def without_null(value):
    """The value without null, and whether it could be."""
    if "anyOf" in value:
        [plain] = [form for form in value["anyOf"] if form.get("type") != "null"]
        return plain, True
    if isinstance(value.get("type"), list):
        [plain] = [name for name in value["type"] if name != "null"]
        return value | {"type": plain}, True
    return value, False


def without(keys, others):
    return {name: key for name, key in keys.items() if name not in others}


def quoted(text):
    return f'"{text}"'

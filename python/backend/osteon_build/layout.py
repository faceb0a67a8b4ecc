"""Layout of generated code: docstrings in lines of limited length, names of types."""

import textwrap

WIDTH = 99
"""Longest line, characters."""


def docstring(text, indent):
    """The lines of a docstring."""
    space = " " * indent
    end = ' """' if text.endswith('"') else '"""'
    # The last line has room for the end.
    lines = textwrap.wrap(
        f'"""{text}', WIDTH - len(end), initial_indent=space, subsequent_indent=space,
        break_long_words=False, break_on_hyphens=False,
    )  # fmt: skip
    return [*lines[:-1], lines[-1] + end]


def sentence(text):
    """A description as a sentence."""
    end = "" if text.endswith(".") else "."
    return f"{text[:1].upper()}{text[1:]}{end}"


def title(key):
    """A key as the name of a type."""
    return "".join(word[:1].upper() + word[1:] for word in key.split("_"))

"""The examples of docs/umbridge.md, to be executed as they stand there."""

import pathlib

PAGE = pathlib.Path(__file__).resolve().parents[2] / "docs" / "umbridge.md"


def execute(first_line, replaced):
    """Executes the example that begins with a line, with texts replaced; returns its variables."""
    [code] = [code for code in examples() if code.startswith(f"{first_line}\n")]
    for old, new in replaced.items():
        assert code.count(old) == 1, f"{PAGE.name} has {code.count(old)} times {old!r} in\n{code}"
        code = code.replace(old, new)
    variables = {}
    exec(compile(code, str(PAGE), "exec"), variables)
    return variables


def examples():
    """Everything between fences of Python."""
    parts = PAGE.read_text().split("```python\n")[1:]
    return [part.partition("```")[0] for part in parts]

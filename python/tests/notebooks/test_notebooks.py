"""The notebooks of examples/notebooks, executed with small sizes."""

from __future__ import annotations

import base64
import os
import unittest
from pathlib import Path
from typing import Any

import nbclient
import nbformat

ROOT = Path(__file__).resolve().parents[3]
NOTEBOOKS = ROOT / "examples" / "notebooks"
LONGEST_CELL_S = 300

SMALL = {
    "identification": {"realizations": 64},
    "paper-figures": {"realizations": 800},
    "sensitivity": {"samples": 32},
    "posterior": {"realizations": 32, "steps": 30, "burn_in": 10, "draws_of_job": 250},
}
"""Values of the cell of parameters."""

FIGURES = {"identification": 4, "paper-figures": 6, "sensitivity": 1, "posterior": 1}
"""How many figures each shows."""

CHECKED_SHOW = """
def _check_labels_first(show):
    import matplotlib.pyplot as plt

    def checked():
        for number in plt.get_fignums():
            for axes in plt.figure(number).axes:
                below = axes.get_shared_x_axes().get_siblings(axes)
                assert any(sibling.get_xlabel() for sibling in below), "an axis x has no label"
                words = any(label.get_text().strip("0123456789.-−") for label in axes.get_yticklabels())
                assert axes.get_ylabel() or words, "an axis y has no label"
                for label in (axes.get_xlabel(), axes.get_ylabel()):
                    named = "(" in label or label in UNITLESS or not label
                    assert named, f"{label} has no unit"
        show()

    return checked


UNITLESS = {"patient", "number of the measurement", "evaluation of the patient's search", "number N of velocities"}
import matplotlib.pyplot

matplotlib.pyplot.show = _check_labels_first(matplotlib.pyplot.show)
"""
"""Makes every figure fail whose axes lack a label or a unit."""


class Notebooks(unittest.TestCase):
    def executed(self, name: str) -> Any:
        """The notebook after its execution."""
        book = nbformat.read(NOTEBOOKS / f"{name}.ipynb", as_version=4)
        nbformat.validate(book)
        [place] = [
            number for number, cell in enumerate(book.cells) if "parameters" in cell.metadata.get("tags", [])
        ]
        for key in SMALL[name]:
            self.assertIn(f"{key} = ", book.cells[place].source)
        values = "\n".join(f"{key} = {value}" for key, value in SMALL[name].items())
        cell = nbformat.v4.new_code_cell(f"{values}\n{CHECKED_SHOW}")
        book.cells.insert(place + 1, cell)
        client = nbclient.NotebookClient(
            book, timeout=LONGEST_CELL_S, kernel_name="python3", resources={"metadata": {"path": NOTEBOOKS}}
        )
        return client.execute()

    def test_each_of_them_is_tested_and_has_no_output(self) -> None:
        found = {path.stem: path for path in NOTEBOOKS.glob("*.ipynb")}
        self.assertEqual(set(found), set(SMALL))
        for path in found.values():
            book = nbformat.read(path, as_version=4)
            for cell in book.cells:
                if cell.cell_type == "code":
                    self.assertEqual((cell.outputs, cell.execution_count), ([], None), path)

    def check(self, name: str) -> None:
        """Executes a notebook and counts its figures."""
        book = self.executed(name)
        images = [
            output.data["image/png"]
            for cell in book.cells
            if cell.cell_type == "code"
            for output in cell.outputs
            if "image/png" in output.get("data", {})
        ]
        self.assertEqual(len(images), FIGURES[name])
        # For a look at them.
        if folder := os.environ.get("OSTEON_FIGURES"):
            for number, image in enumerate(images):
                Path(folder, f"{name}-{number}.png").write_bytes(base64.b64decode(image))

    def test_identification(self) -> None:
        self.check("identification")

    def test_paper_figures(self) -> None:
        self.check("paper-figures")

    def test_sensitivity(self) -> None:
        self.check("sensitivity")

    def test_posterior(self) -> None:
        self.check("posterior")


if __name__ == "__main__":
    unittest.main()

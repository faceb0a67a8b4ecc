"""What a result says."""

from __future__ import annotations

import copy
import re
import unittest
from collections.abc import Iterator
from html.parser import HTMLParser

import numpy as np
import osteon
from osteon import _html
from osteon._objects import Object
from support import EXAMPLES, SEARCHED, TestCase, small_job


class WellFormed(HTMLParser):
    """Fails unless every element is closed in order."""

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.words: list[str] = []

    def handle_starttag(self, tag: str, attrs: object) -> None:
        self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag, tag

    def handle_data(self, data: str) -> None:
        self.words.append(data)


def words(html: str) -> str:
    """The text of a page."""
    parser = WellFormed()
    parser.feed(html)
    assert parser.open == [], parser.open
    return " | ".join(parser.words)


def without_attribute(found: object, path: str) -> Iterator[str]:
    """The keys of a result that its classes do not have as attributes."""
    if isinstance(found, Object):
        for key in found.json:
            if not isinstance(getattr(type(found), key, None), property):
                yield f"{path}.{key}"
            else:
                yield from without_attribute(getattr(found, key), f"{path}.{key}")
    elif isinstance(found, (list, dict)):
        for entry in found.values() if isinstance(found, dict) else found:
            yield from without_attribute(entry, path)


class Search(TestCase):
    """One search of each kind for all tests."""

    free: osteon.Result
    groups: osteon.Result
    posterior: osteon.Result

    @classmethod
    def setUpClass(cls) -> None:
        cls.free = small_job().identify(progress=False)
        cls.groups = osteon.Job.read(EXAMPLES / "groups.toml").identify(progress=False)
        job = osteon.Job(
            parameters=SEARCHED,
            data={"mean": 3908.0, "coefficient_of_variation": 0.0267, "count": 100},
            monte_carlo={"sampling": "sobol", "realizations": 64},
            search={"method": "newton"},
            posterior={"draws": 200, "max_evaluations": 60},
        )
        cls.posterior = job.identify(progress=False)

    def test_attributes_are_those_of_the_file(self) -> None:
        result, values = self.free, self.free.json
        self.assertEqual(result.parameters, values["parameters"])
        self.assertEqual(result.velocity.mean, values["velocity"]["mean"])
        self.assertEqual(result.velocity.mean_standard_error, values["velocity"]["standard_error"]["mean"])
        data = result.data
        assert data is not None
        self.assertEqual(data.mean, values["data"]["mean"])
        self.assertEqual(len(result.free_directions), 5)
        self.assertFalse(result.estimates["density"].is_determined)
        self.assertEqual(result.estimates["density"].value, result.parameters["density"])
        group = next(iter(self.groups.groups.values()))
        self.assertTrue(group.estimates["bulk_velocity"].is_determined)

    def test_every_key_of_the_file_is_an_attribute(self) -> None:
        propagation = osteon.Job(parameters=SEARCHED, monte_carlo={"realizations": 5}).propagate(progress=False)
        for result in (self.free, self.groups, self.posterior, propagation):
            self.assertEqual(list(without_attribute(result, "result")), [])

    def test_keys_are_objects_and_what_is_not_there_is_none(self) -> None:
        identified = self.free.identified
        assert identified is not None
        self.assertEqual(identified.bulk_velocity.value, self.free.json["identified"]["bulk_velocity"]["value"])
        self.assertEqual(self.free.velocity, self.free.velocity)
        self.assertNotEqual(self.free.velocity, self.posterior.velocity)
        self.assertIsNone(self.free.posterior)
        self.assertEqual(self.free.profiles["density"].values, self.free.json["profiles"]["density"]["values"])
        failed = osteon.Moments({"mean": None, "coefficient_of_variation": None})
        self.assertTrue(np.isnan(failed.mean))
        self.assertIsNone(failed.mean_standard_error)

    def test_tables_are_arrays_and_frames(self) -> None:
        history = self.free.table("history")
        self.assertEqual(history["evaluation"].tolist(), list(range(self.free.evaluations)))
        tables = self.groups.to_pandas()
        assert tables.groups is not None
        assert tables.realizations is not None
        assert tables.comparison is not None
        self.assertEqual(list(tables.groups["group"]), list(self.groups.groups))
        self.assertEqual(len(tables.realizations), 256 * len(self.groups.groups))
        pairs = len(self.groups.groups) * (len(self.groups.groups) - 1) // 2
        self.assertEqual(len(tables.comparison), pairs)
        self.assertIsNone(self.free.to_pandas().groups)
        self.refused_table("histroy")
        self.refused_table("groups")

    def refused_table(self, name: str) -> None:
        with self.assertRaises(osteon.InputError) as caught:
            self.free.table(name)
        self.assertIn("history, realizations", str(caught.exception))

    def test_a_page_says_first_what_is_not_fixed_and_last_the_digest(self) -> None:
        text = words(self.free._repr_html_())
        order = ["Converged", "5 directions are not fixed by your data", "mean velocity", "digest"]
        places = [text.index(word) for word in order]
        self.assertEqual(places, sorted(places))
        self.assertIn("not determined", text)
        mean = re.search(r"mean velocity \| ([^|]*) \|", text)
        assert mean is not None
        self.assertRegex(mean[1], r"^39\d\d\.\d{2,5} ± 0\.\d+$")
        for name in self.groups.groups:
            self.assertIn(name, words(self.groups._repr_html_()))
        self.assertIn("√(c1111/ρ)", words(self.posterior._repr_html_()))

    def test_a_page_escapes_what_users_wrote(self) -> None:
        values = copy.deepcopy(self.free.json)
        values["reason"] = "<script>alert(1)</script>"
        page = osteon.Result(values)._repr_html_()
        self.assertNotIn("<script>", page)
        self.assertIn("<script>alert(1)</script>", words(page))

    def test_a_posterior_goes_to_arviz(self) -> None:
        tree = self.posterior.to_arviz()
        self.assertEqual(tree["posterior"]["dispersion"].shape, (1, 200))
        self.assertIn("bulk_velocity", tree["posterior"])
        self.assertTrue(self.posterior.estimates["dispersion"].is_determined)
        with self.assertRaises(osteon.InputError):
            self.free.to_arviz()
        with self.assertRaises(osteon.InputError):
            self.groups.to_arviz()

    def test_a_result_goes_to_matlab(self) -> None:
        from scipy.io import loadmat

        path = self.scratch() / "result.mat"
        self.groups.to_mat(path)
        found = loadmat(path, squeeze_me=True)
        self.assertEqual(found["result"]["digest"].item(), self.groups.digest)
        velocities = found["realizations"]["velocity"].item()
        np.testing.assert_array_equal(velocities, self.groups.table("realizations")["velocity"])

    def test_files_live_as_long_as_the_result(self) -> None:
        result = osteon.Job(parameters=SEARCHED, monte_carlo={"realizations": 5}).propagate(progress=False)
        directory = result.directory
        assert directory is not None
        self.assertTrue((directory / "realizations.csv").is_file())
        del result
        self.assertFalse(directory.exists())


class Numbers(unittest.TestCase):
    def test_a_number_has_the_digits_of_its_error(self) -> None:
        for value, error, expected in (
            (3907.68683, 0.00634, "3907.6868 ± 0.0063"),
            (0.026706279, 9.4997e-6, "0.0267063 ± 0.0000095"),
            (0.1029, 0.0995, "0.10 ± 0.10"),
            (1598.8, 120.0, "1599 ± 120"),
            (17.717e9, 0.52e9, "(1.772 ± 0.052) · 10^10"),
            (1721.905, None, "1722"),
            (None, None, "–"),
            (float("nan"), 1.0, "–"),
        ):
            self.assertEqual(_html.with_error(value, error), expected)


class Stored(TestCase):
    def test_what_is_no_result_is_refused(self) -> None:
        directory = self.scratch()
        with self.assertRaises(OSError):
            osteon.Result.read(directory)
        for text in ("", "[]", "{}"):
            (directory / "result.json").write_text(text)
            with self.assertRaises(osteon.InputError):
                osteon.Result.read(directory)


if __name__ == "__main__":
    unittest.main()

"""Renders the chart, without a cluster."""

import functools
import json
import pathlib

import helm_python as helm
import yaml

HERE = pathlib.Path(__file__).resolve().parent.parent
NAME = "osteon"
NAMESPACE = "bones"
# The oldest version that Chart.yaml allows, and the newest whose schemas the checks have.
KUBERNETES = ("1.27", "1.37")


@functools.cache
def loaded():
    return helm.Chart.load(HERE)


@functools.cache
def variants():
    """Values by name: the default ones, and each file in ci/."""
    files = sorted((HERE / "ci").glob("*.yaml"))
    return {"default": {}, **{file.stem: yaml.safe_load(file.read_text()) for file in files}}


def merged(values):
    """The values that a release has which sets some of them."""
    return loaded().merge_values(values)


def objects(values=None, name=NAME, namespace=NAMESPACE):
    """What a release consists of: objects by kind and name."""
    rendered = loaded().render(values or {}, name=name, namespace=namespace)
    found = {}
    for file, text in rendered.items():
        if file.endswith(".txt"):
            continue
        for document in yaml.load_all(text, Loader=UniqueKeys):
            if document is not None:
                key = (document["kind"], document["metadata"]["name"])
                if key in found:
                    raise AssertionError(f"{file} defines {key} again")
                found[key] = document
    return found


def notes(values=None):
    rendered = loaded().render(values or {}, name=NAME, namespace=NAMESPACE)
    return next(text for file, text in rendered.items() if file.endswith("NOTES.txt"))


def one(kind, values=None, called=None, **release):
    """The only object of a kind, or the one of a name."""
    found = objects(values, **release)
    fitting = [o for (k, n), o in found.items() if k == kind and called in (None, n)]
    if len(fitting) != 1:
        raise AssertionError(f"{len(fitting)} objects of kind {kind}, name {called}, in {sorted(found)}")
    return fitting[0]


def pod(found):
    """The specification of the pods that an object makes; None if it makes none."""
    if found["kind"] == "Pod":
        return found["spec"]
    return found["spec"].get("template", {}).get("spec") if "spec" in found else None


def container(found):
    (only,) = pod(found)["containers"]
    return only


def argument(found, option):
    """The value of an option in the arguments of an object's container; None without the option."""
    arguments = container(found)["args"]
    return arguments[arguments.index(option) + 1] if option in arguments else None


def refusal(values):
    """Why Helm refuses values; fails if it takes them."""
    try:
        objects(values)
    except helm.HelmError as error:
        return str(error)
    raise AssertionError(f"the chart takes {json.dumps(values)}")


class UniqueKeys(yaml.SafeLoader):
    """Refuses a mapping that has a key twice, as Kubernetes does."""

    def construct_mapping(self, node, deep=False):
        keys = [self.construct_object(key, deep) for key, _ in node.value]
        twice = {key for key in keys if keys.count(key) > 1}
        if twice:
            raise AssertionError(f"{twice} occur twice in a mapping at {node.start_mark}")
        return super().construct_mapping(node, deep)

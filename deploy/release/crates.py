"""The crates that are in the program and in Python's native module: a bill of materials (CycloneDX), and their
licences. Runs in the environment of requirements.txt."""

import argparse
import datetime
import json
import pathlib
import subprocess
import uuid

from cyclonedx.contrib.license.factories import LicenseFactory
from cyclonedx.model import ExternalReference, ExternalReferenceType, XsUri
from cyclonedx.model.bom import Bom
from cyclonedx.model.component import Component, ComponentType
from cyclonedx.output.json import JsonV1Dot6
from packageurl import PackageURL
from source import ROOT, VERSION, commit, commit_time

SHIPPED = ("osteon", "osteon-python")
"""The packages whose programs and modules are shipped."""

TEXTS = ("LICEN[CS]E*", "COPYING*", "NOTICE*", "UNLICENSE*")
"""Names of files with licences."""


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--bill", required=True, type=pathlib.Path, help="where to write the bill of materials")
    parser.add_argument("--licences", required=True, type=pathlib.Path, help="where to write the licences")
    parser.add_argument("targets", nargs="+", help="the targets of rustc for which the crates are linked")
    arguments = parser.parse_args()
    edges = linked(arguments.targets)
    platforms = [word for target in arguments.targets for word in ("--filter-platform", target)]
    packages = json.loads(cargo("metadata", "--format-version=1", *platforms))["packages"]
    known = {(package["name"], package["version"]): package for package in packages}
    crates = {crate: known[crate] for crate in sorted(edges)}
    arguments.bill.write_text(bill(crates, edges))
    arguments.licences.write_text(licences(crates))
    print(f"{arguments.bill}: {len(crates)} crates")


def linked(targets):
    """Names and versions of the crates that are linked, each with those that it uses."""
    tree = ["tree", "--edges", "normal,no-proc-macro", "--prefix", "depth", "--format", "\t{p}"]
    tree += [word for name in SHIPPED for word in ("--package", name)]
    tree += [word for target in targets for word in ("--target", target)]
    edges, above = {}, []
    for line in filter(None, cargo(*tree).splitlines()):
        depth, crate = line.split("\t")
        name, version, *_ = crate.split()
        above[int(depth) :] = [(name, version.removeprefix("v"))]
        edges.setdefault(above[-1], set())
        if len(above) > 1:
            edges[above[-2]].add(above[-1])
    return edges


def bill(crates, edges):
    """The bill of materials as JSON; a commit has one."""
    made = Bom()
    components = {crate: component(package) for crate, package in crates.items()}
    for crate, found in components.items():
        made.components.add(found)
        made.register_dependency(found, [components[used] for used in edges[crate]])
    release = Component(name="osteon", version=VERSION, type=ComponentType.APPLICATION, bom_ref="release")
    made.metadata.component = release
    made.register_dependency(release, [components[name, VERSION] for name in SHIPPED])
    made.metadata.timestamp = datetime.datetime.fromtimestamp(commit_time(), datetime.timezone.utc)
    made.serial_number = uuid.uuid5(uuid.NAMESPACE_OID, f"osteon {VERSION} {commit()}")
    return JsonV1Dot6(made).output_as_string(indent=1) + "\n"


def component(package):
    """The entry of a crate."""
    name, version = package["name"], package["version"]
    locator = PackageURL("cargo", name=name, version=version)
    found = Component(name=name, version=version, type=ComponentType.LIBRARY, purl=locator, bom_ref=str(locator))
    found.licenses.add(LicenseFactory().make_from_string(package["license"].replace("/", " OR ")))
    if package["repository"]:
        address = XsUri(package["repository"])
        found.external_references.add(ExternalReference(type=ExternalReferenceType.VCS, url=address))
    return found


def licences(crates):
    """The licences of the crates of others, each text once."""
    owners, without = {}, []
    for (name, version), package in crates.items():
        folder = pathlib.Path(package["manifest_path"]).parent
        if folder.is_relative_to(ROOT):
            continue
        crate = f"{name} {version} ({package['license']})"
        paths = sorted({path for pattern in TEXTS for path in folder.glob(pattern) if path.is_file()})
        for path in paths:
            owners.setdefault(path.read_text(errors="replace").strip(), []).append(crate)
        without += [] if paths else [crate]
    parts = ["osteon contains these crates of others under the licences that follow."]
    parts += ["Crates that name a licence and bring no text:\n\n" + "\n".join(without)] if without else []
    parts += ["\n".join(dict.fromkeys(names)) + f"\n\n{text}" for text, names in owners.items()]
    return f"\n\n{'=' * 80}\n\n".join(parts) + "\n"


def cargo(*arguments):
    """What cargo says of the locked dependencies."""
    return subprocess.run(["cargo", *arguments, "--locked"], cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True).stdout


if __name__ == "__main__":
    main()

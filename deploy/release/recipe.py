"""Renders the recipe for conda as its builder does; the packages that it names are not looked for. Runs in the
environment of requirements.txt."""

import sys

from rattler_build import Stage0Recipe, VariantConfig
from source import ROOT, VERSION

RECIPE = ROOT / "deploy" / "conda" / "recipe.yaml"
COMPILERS = {"c_compiler": ["gcc"], "c_stdlib": ["sysroot"], "c_stdlib_version": ["2.17"], "rust_compiler": ["rust"]}
"""What a channel chooses for all its recipes."""


def main():
    [rendered] = Stage0Recipe.from_file(RECIPE).render(VariantConfig(COMPILERS))
    package = rendered.recipe.package
    if str(package.version) != VERSION:
        sys.exit(f"{RECIPE} is of version {package.version} instead of {VERSION}")
    for name in rendered.recipe.about.to_dict()["license_file"]:
        if not (ROOT / name).is_file():
            sys.exit(f"{RECIPE} names {name}, which is not there")
    print(f"{RECIPE}: {package.name} {package.version}")


if __name__ == "__main__":
    main()

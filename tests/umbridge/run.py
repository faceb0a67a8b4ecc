"""Tests `osteon umbridge` by the conformity suite of UM-Bridge and by its Python clients, which are in
`upstream/` as they stand in its repository, by emcee and by PyMC. Uses the standard library only; what it runs,
two environments."""

import argparse
import os
import pathlib
import subprocess
import sys

HERE = pathlib.Path(__file__).resolve().parent
UPSTREAM = HERE / "upstream"
sys.path.insert(0, str(HERE.parent / "python"))
from environment import check_version, make, run  # noqa: E402

PYMC_OLDEST = (3, 11)
"""The oldest Python for which there is the PyMC of pymc.txt."""

# Seven free parameters, so that all models are there; few realizations, so that it is quick.
JOB = """
[data]
mean = 3906.0
coefficient_of_variation = 0.0271
count = 1000
[parameters]
density                    = { start = 1598.8, bounds = [1500.0, 2000.0] }
longitudinal_young_modulus = { start = 17.717e9, bounds = [12.0e9, 25.0e9] }
longitudinal_poisson_ratio = { start = 0.3816, bounds = [0.2, 0.45] }
longitudinal_shear_modulus = { start = 4.795e9, bounds = [3.0e9, 6.5e9] }
transverse_young_modulus   = { start = 9.8254e9, bounds = [8.0e9, 16.0e9] }
transverse_poisson_ratio   = { start = 0.4495, bounds = [0.2, 0.5] }
dispersion                 = { start = 0.1029, bounds = [0.02, 0.3] }
[monte_carlo]
realizations = 20
"""


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--osteon", required=True, type=pathlib.Path, help="the program to test")
    parser.add_argument("--work", required=True, type=pathlib.Path, help="where to install to")
    arguments = parser.parse_args()
    check_version()
    python = make(arguments.work / "venv", HERE / "requirements.txt")
    with_pymc = None
    if sys.version_info >= PYMC_OLDEST:
        with_pymc = make(arguments.work / "venv-pymc", HERE / "pymc.txt")
    else:
        print("PyMC is not tested: it needs Python 3.11 or later")
    job = arguments.work / "job.toml"
    job.write_text(JOB)
    variables = {name: value for name, value in os.environ.items() if name != "OSTEON_COORDINATOR"}
    # The tests stay on this machine.
    variables |= {"no_proxy": "127.0.0.1", "PYTHONDONTWRITEBYTECODE": "1"}
    # PyMC compiles nothing in C, for which there may be no compiler, and keeps its files below ours.
    compiled = arguments.work.resolve() / "pytensor"
    variables |= {"PYTENSOR_FLAGS": f"cxx=,base_compiledir={compiled}", "MPLBACKEND": "agg"}
    command = [arguments.osteon.resolve(), "umbridge", job, "--port", "0"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=variables) as server:
        try:
            url = server.stdout.readline().strip()
            check(python, url, variables)
            if with_pymc:
                run([with_pymc, HERE / "sampling_by_pymc.py", url], HERE, variables)
        finally:
            server.terminate()
    if server.returncode != 0:
        sys.exit(f"the server ended with {server.returncode}")


def check(python, url, variables):
    suite = [UPSTREAM / "test_model_schema.py", f"--model_url={url}", "--input_value=1.0"]
    run([python, "-m", "pytest", "-q", "-p", "no:cacheprovider", *suite], UPSTREAM, variables)
    run([python, UPSTREAM / "raw-client.py", url], UPSTREAM, variables)
    run([python, HERE / "clients.py", url], HERE, variables)


if __name__ == "__main__":
    main()

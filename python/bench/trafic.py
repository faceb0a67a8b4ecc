"""Compares osteon with TraFiC (E. Ducasse, EUPL-1.2, github.com/eric-ducasse/TraFiC; tried with its commit
75eb1cf), general software for transient waves in plates:

    python trafic.py --trafic CHECKOUT --osteon PROGRAM

prints the velocity of two bones by both, TraFiC's with a very fine sampling, and a table in Markdown: errors
and processor time of osteon's default settings, and of TraFiC at samplings with errors below 1e-4 or so. Both
compute in turns, so that other load of the machine meets both, and the least times count. It takes minutes.

Nothing of TraFiC is in this file, and nothing is written into the checkout. It is used in the leanest way we
know: for pairs of a Laplace variable s and a wavenumber k it gives the waves of the layers and the matrix of
the conditions at the interfaces, of which one right-hand side yields the reflection of a plane wave. The
direct wave and negative k are left out; pressures are summed at the receivers alone. Pulse, sums and picking
are done here, as docs/physics.md states them. TraFiC's samplings were selected by hand from thousands, on
other bones than those that measure the errors; osteon selects its own, within its time.
Needs Python 3.11 or later, and what TraFiC needs: NumPy, SciPy and Matplotlib."""

import argparse
import json
import os
import pathlib
import resource
import subprocess
import sys
import time
import tomllib
import types
import warnings
from collections import namedtuple

# Before NumPy is loaded: all times are of one thread.
os.environ.update(OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1", MKL_NUM_THREADS="1", MPLBACKEND="Agg")

import numpy as np  # noqa: E402
from scipy.interpolate import CubicSpline  # noqa: E402
from scipy.special import wofz  # noqa: E402

Sampling = namedtuple("Sampling", "period band length wavenumber mirror taper_s taper_k")
"""How TraFiC samples s and k: signals repeat after `period` (s), and after twice `length` (m); `band` (Hz) and
`wavenumber` (1/m) are the largest. `mirror` leaves out the wave that a free surface in place of the bone
would reflect. The last parts `taper_s` and `taper_k` of the samples are faded out."""

OPTIMUM = '[parameters]\nmaterial = "human-radius-desceliers"'
GRADED = "[bone]\nporosity = { surface = 0.05, marrow = 0.15, sublayers = 8 }"
RANDOM = """
bone.porosity = { surface = 0.085, marrow = 0.175, sublayers = 8 }
random.surface_porosity = { standard_deviation = 0.0375, distribution = "uniform" }
random.marrow_porosity = { standard_deviation = 0.07, distribution = "uniform" }"""
FINE = Sampling(10e-6, 16e6, 30e-3, 25e3, True, 0.4, 0.3)
ONE_LAYER = [
    Sampling(5.5e-6, 2e6, 25e-3, 10e3, False, 0, 0),
    Sampling(7e-6, 3e6, 25e-3, 12e3, False, 0.25, 0.25),
    Sampling(8e-6, 5e6, 25e-3, 12e3, False, 0.4, 0.3),
]
EIGHT = [Sampling(5.5e-6, 2e6, 25e-3, 10e3, True, 0, 0), Sampling(6e-6, 3e6, 25e-3, 12e3, False, 0.4, 0.3)]
BONES = {
    "one layer": (OPTIMUM, OPTIMUM, 10, ONE_LAYER),
    "eight sublayers": (GRADED, RANDOM, 5, EIGHT),
}
"""Of each: the bone's job file, that of random ones, how many of those to draw, and TraFiC's samplings."""

DISPERSION = 0.1029  # Of the elasticity of random bones: the paper's.
NONE = 1e-9  # A dispersion that osteon accepts, of bones that do not differ.
DAMPING = 1e-5  # What remains of a signal after a period.
PAIRS = 1000  # Pairs (s, k) in one call of TraFiC: it is fastest so, and memory is bounded.
LIMIT = 600  # Seconds that a run of osteon may take.
MANDEL = np.sqrt(np.outer([1, 1, 1, 2, 2, 2], [1, 1, 1, 2, 2, 2]))


def osteon(program, text, *words):
    """Runs osteon with `text` on its standard input: its standard output, and its seconds on processors."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    try:
        done = subprocess.run([program, *words], input=text, capture_output=True, text=True, timeout=LIMIT)
    except (OSError, subprocess.TimeoutExpired) as error:
        sys.exit(f"osteon {words[0]}: {error}")
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode != 0:
        sys.exit(f"osteon {words[0]} ended with {done.returncode}: {done.stderr.strip()}")
    return done.stdout, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def draw(program, job, dispersion, index):
    """The text of the case file of a random bone of a job."""
    words = ["draw", "-", "--seed=12", f"--index={index}", "--set=monte_carlo.realizations=100"]
    return osteon(program, job, *words, f"--set=parameters.dispersion.fixed={dispersion}")[0]


def simulate(program, case, refinement):
    """osteon's velocity of a case, and the number of pairs (s, k)."""
    words = ["simulate", "-", "--json", f"--set=solver.refinement={refinement}"]
    result = json.loads(osteon(program, case, *words)[0])
    if result["velocity"] is None:
        sys.exit(f"osteon found no velocity: {result['failure']}")
    return result["velocity"], result["solver"]["pairs_computed"]


def seconds_of_osteon(program, job):
    """Seconds on processors for a bone: what 3,000 more of them add to a run with one worker of one thread.
    They include the coordinator, but not the start. The bones differ by a small dispersion."""
    words = ["propagate", "-", "--workers=1", "--threads=1", "--set=parameters.dispersion.fixed=0.02"]
    few, many = (osteon(program, job, *words, f"--set=monte_carlo.realizations={n}")[1] for n in (500, 3500))
    if many <= few:
        sys.exit("osteon's times scatter too much")
    return (many - few) / 3000


def load(checkout):
    """TraFiC's modules of materials and of plates. They expect a module that its installer would write."""
    sys.dont_write_bytecode = True
    root = checkout.resolve() / "TraFiC"
    sys.path += [str(root), *(str(folder) for folder in sorted(root.iterdir()) if folder.is_dir())]
    sys.modules["TraFiC_init"] = types.SimpleNamespace(root=str(root))
    warnings.simplefilter("ignore", SyntaxWarning)
    import MaterialClasses
    import USMultilayerPlate
    return MaterialClasses, USMultilayerPlate


PLATES = []
"""TraFiC knows materials by the address of their plate, and forgets none: no plate may be freed."""


def plate_of(trafic, case):
    """TraFiC's plate of a case, between fluids without end. Its third axis points down: half a turn about the
    first, by which stiffnesses with one of the indices 31 and 12 change sign."""
    materials, plates = trafic
    plate, turned = None, np.array([1, 1, 1, 1, -1, -1])
    for layer in case["bone"].get("sublayers") or [{**case["layers"]["bone"], **case["bone"]}]:
        voigt = np.array(layer["mandel"]) / MANDEL * np.outer(turned, turned)
        values = {f"c{i + 1}{j + 1}": float(voigt[i, j]) for i in range(6) for j in range(i, 6)}
        solid = materials.AnisotropicElasticSolid({**values, "rho": layer["density"]}, "bone")
        if plate is None:
            plate = plates.USMultilayerPlate(layer["thickness"], solid)
        else:
            plate.appendLayer(layer["thickness"], solid)
    coupling, marrow = (case["layers"][name] for name in ("coupling", "marrow"))
    for fluid, add in ((coupling, plate.setTopHalfSpace), (marrow, plate.setBottomHalfSpace)):
        add(materials.Fluid({"rho": fluid["density"], "c": fluid["sound_speed"]}, "fluid"))
    PLATES.append(plate)
    return plate


def reflection(plate, s, k):
    """The bone's reflection of a wave of unit pressure at its face, for each s and k."""
    found = np.empty((len(s), len(k)), complex)
    rows = max(1, PAIRS // len(k))
    for start in range(0, len(s), rows):
        part = slice(start, start + rows)
        plate.update(s[part], k, buildM=False)
        plate.rebuildM(forced=True)
        right = np.zeros((*plate.M.shape[:-1], 1), complex)
        # Displacement and stresses of the wave that goes down.
        right[..., :4, 0] = plate.topUSmat.fieldComponents(0.0, 0.0)[..., -4:, 1]
        found[part] = np.linalg.solve(plate.M, right)[..., 0, 0]
    plate.clearSK()
    return found


def pulse(s, probe):
    """The Laplace transform of the paper's pulse, by Faddeeva's function."""
    fc = probe["center_frequency"]
    turn = 2j * np.pi * fc
    parts = [wofz(1j * (s + sign * turn - 8 * fc) / (4 * fc)) for sign in (-1, 1)]
    return probe["amplitude"] * np.exp(-4) * np.sqrt(np.pi) / (4 * fc) * (parts[0] - parts[1]) / 2j


def weights(count, taper):
    """Weights of samples: the first counts once, others for both signs; the last are faded out by a cosine."""
    faded = np.clip((np.arange(count) / count - 1) / taper + 1, 0, 1) if taper else np.zeros(count)
    return np.where(np.arange(count) == 0, 1, 2) * (1 + np.cos(np.pi * faded)) / 2


def compute(trafic, case, sampling):
    """A case's velocity by TraFiC, NaN without one, and the number of pairs (s, k)."""
    probe, coupling = case["probe"], case["layers"]["coupling"]
    receivers, source = probe["receivers"], probe["source"]
    x = receivers["first_x1"] - source["x1"] + receivers["pitch"] * np.arange(receivers["count"])
    s_count, k_count = sampling.band * sampling.period, sampling.wavenumber * sampling.length / np.pi
    s = (2j * np.pi * np.arange(round(s_count) + 1) - np.log(DAMPING)) / sampling.period
    k = np.arange(round(k_count) + 1) * np.pi / sampling.length
    across = np.sqrt(k**2 + (s[:, None] / coupling["sound_speed"]) ** 2)
    field = (reflection(plate_of(trafic, case), s, k) + sampling.mirror) * coupling["density"] / (2 * across)
    field *= np.exp(-across * (source["x3"] + receivers["x3"]))
    field *= weights(len(k), sampling.taper_k) / (2 * sampling.length)
    field *= (weights(len(s), sampling.taper_s) * pulse(s, probe) / sampling.period)[:, None]
    # No wave through a bone comes earlier, and none is picked later.
    times = np.arange(3.6e-6, min(3.6e-6 + sampling.period, 10e-6), 10e-9)
    pressures = ((field @ np.cos(np.outer(k, x))).T @ np.exp(np.outer(s, times))).real
    return pick(x, times, pressures, case), len(s) * len(k)


def pick(x, times, pressures, case):
    """The velocity of the first extremum, by the rules of docs/physics.md; NaN without one."""
    extrema, ratios = [], []
    for distance, pressure in zip(x, pressures, strict=True):
        spline = CubicSpline(times, pressure)
        at = spline.derivative().roots(extrapolate=False)
        at = at[at < distance / case["layers"]["coupling"]["sound_speed"]]
        size = np.abs(spline(at))
        at, size = np.array([at, size])[:, size > 1e-3 * size.max(initial=0)]
        ends = at + 1.2 / case["probe"]["center_frequency"]
        ratios.append([size[i] / size[i:][at[i:] <= end].max() for i, end in enumerate(ends)])
        extrema.append(at)
    for rank in range(min(map(len, extrema))):
        if np.median([ratio[rank] for ratio in ratios]) > case["picking"]["threshold"]:
            return np.polyfit([at[rank] for at in extrema], x, 1)[0]
    return np.nan


def row(name, velocities, exact, pairs, seconds, unit):
    """Prints a row of the table. A bone without a velocity counts as an error of 1."""
    errors = np.nan_to_num(np.abs(np.array(velocities) / exact - 1), nan=1.0)
    cells = f"{pairs:,} | {np.quantile(errors, 0.9):.1e} | {errors.max():.1e} | {1e3 * seconds:.3g}"
    print(f"| {name} | {cells} | {seconds / unit:.0f} |", flush=True)


def measure(trafic, program, name, turns):
    """Prints the rows of a bone."""
    job, random, draws, samplings = BONES[name]
    mean = draw(program, job, NONE, 0)
    read, ours, theirs = tomllib.loads(mean), [], [[] for _ in samplings]
    for _ in range(turns):
        ours.append(seconds_of_osteon(program, job))
        for times, sampling in zip(theirs, samplings, strict=True):
            begun = time.process_time()
            compute(trafic, read, sampling)
            times.append(time.process_time() - begun)
    cases = [draw(program, random, DISPERSION, index) for index in range(draws)]
    exact = np.array([simulate(program, case, 5)[0] for case in cases])
    found = [simulate(program, case, 1)[0] for case in cases]
    row(f"{name} | osteon", found, exact, simulate(program, mean, 1)[1], min(ours), min(ours))
    for times, sampling in zip(theirs, samplings, strict=True):
        found, pairs = zip(*(compute(trafic, tomllib.loads(case), sampling) for case in cases), strict=True)
        row(" | TraFiC", found, exact, pairs[0], min(times), min(ours))


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--trafic", required=True, type=pathlib.Path, help="a checkout of TraFiC")
    parser.add_argument("--osteon", required=True, help="the program osteon, built in release mode")
    parser.add_argument("--turns", type=int, choices=range(1, 101), default=5, metavar="N", help="1 to 100 (5)")
    arguments = parser.parse_args()
    if not (arguments.trafic / "TraFiC").is_dir():
        parser.error(f"{arguments.trafic} is no checkout of TraFiC")
    trafic, program = load(arguments.trafic), arguments.osteon
    print("| bone | osteon, refinement 16, m/s | TraFiC, m/s | its pairs | difference |\n|---|--:|--:|--:|--:|")
    for name, (job, *_) in BONES.items():
        case = draw(program, job, NONE, 0)
        ours, _ = simulate(program, case, 16)
        theirs, pairs = compute(trafic, tomllib.loads(case), FINE)
        print(f"| {name} | {ours:.4f} | {theirs:.4f} | {pairs:,} | {theirs / ours - 1:+.1e} |", flush=True)
    print("\n| bone | program | pairs (s, k) | error, 90th percentile | worst | ms a bone | ratio |")
    print("|---|---|--:|--:|--:|--:|--:|")
    for name in BONES:
        measure(trafic, program, name, arguments.turns)


if __name__ == "__main__":
    main()

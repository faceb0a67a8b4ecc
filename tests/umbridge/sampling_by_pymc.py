"""Executes the example of docs/umbridge.md for PyMC with the server at the URL given, and compares what PyMC
computes with what the server answers."""

import sys

import numpy as np
import umbridge
from documented import execute

URL = sys.argv[1]
CONFIG = {"inputs": "bounds"}
TUNE, DRAWS = 40, 60


def main():
    variables = execute(
        "import numpy as np",
        {
            "http://127.0.0.1:4242": URL,
            "tune=100, draws=400": f"tune={TUNE}, draws={DRAWS}, random_seed=1, progressbar=False",
        },
    )
    model, samples = variables["model"], variables["samples"]
    server = umbridge.HTTPModel(URL, "posterior")
    draws = samples.posterior["parameters"].to_numpy()
    assert draws.shape[1:] == (DRAWS, 7), draws.shape
    # Outside the bounds the density is -1e300: a chain that begins inside never goes there.
    assert ((draws > 0.0) & (draws < 1.0)).all(), draws
    for chain in draws:
        moves = (np.diff(chain, axis=0) != 0.0).any(axis=1).mean()
        assert 0.02 < moves < 0.98, moves
    density, gradient = model.compile_logp(), model.compile_dlogp()
    for point in [np.full(7, 0.5), *draws[:, -1], np.full(7, 2.0)]:
        [[expected]] = server([point.tolist()], CONFIG)
        # The digits of the server's answer, once: not multiplied by the number of parameters.
        assert float(density({"parameters": point})) == expected, (point, expected)
        slopes = server.gradient(0, 0, [point.tolist()], [1.0], CONFIG)
        assert gradient({"parameters": point}).tolist() == slopes, (point, slopes)
    start = server([[0.5] * 7], CONFIG)[0][0]
    ends = [server([point.tolist()], CONFIG)[0][0] for point in draws[:, -1]]
    # The middle of the bounds is far from the data: a chain climbs.
    assert min(ends) > start > -1e300, (start, ends)
    print(f"PyMC: ok, {draws.shape[0]} chains from {start:.1f} to {', '.join(f'{end:.1f}' for end in ends)} nats")


main()

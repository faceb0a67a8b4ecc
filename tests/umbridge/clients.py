"""Uses the models of the server at the URL given, by the Python client of UM-Bridge and by emcee, and executes
the examples of docs/umbridge.md for both."""

import sys
from concurrent.futures import ThreadPoolExecutor

import emcee
import numpy as np
import umbridge
from documented import execute
from umbridge.emcee import UmbridgeLogProb

URL = sys.argv[1]


def values():
    """The same point gives the same bits, alone, among others, and in SI units."""
    assert umbridge.supported_models(URL) == ["forward", "forward-si", "velocity", "posterior"]
    model = umbridge.HTTPModel(URL, "forward")
    assert model.get_input_sizes() == [7]
    assert model.get_output_sizes() == [2]
    inputs = [[1.0 + 0.01 * (k % 4)] * 6 + [1.0] for k in range(8)]
    inputs = [[one[0], one[1], 1.0, 1.0, 1.0, 1.0, 1.0] for one in inputs]
    with ThreadPoolExecutor(8) as pool:
        together = list(pool.map(lambda one: model([one]), inputs))
    assert together[:4] == together[4:], together
    si = umbridge.HTTPModel(URL, "forward-si")
    job = [1598.8, 17.717e9, 0.3816, 4.795e9, 9.8254e9, 0.4495, 0.1029]
    assert si([job]) == together[0], together[0]
    assert si([job], {"seed": 2}) != together[0]


def derivatives():
    """Gradients are products with the Jacobian."""
    model = umbridge.HTTPModel(URL, "velocity")
    at = [[1.0] * 6]
    gradient = model.gradient(0, 0, at, [1.0])
    columns = [model.apply_jacobian(0, 0, at, row)[0] for row in np.eye(6).tolist()]
    assert np.allclose(gradient, columns, rtol=1e-12), (gradient, columns)
    assert not model.supports_apply_hessian()


def errors():
    """Errors are exceptions that say what is allowed."""
    model = umbridge.HTTPModel(URL, "forward")
    for inputs, config, expected in [
        ([[1.0] * 6], {}, "must have the length 7"),
        ([[1.0] * 6 + [9.0]], {}, "(dispersion): is"),
        ([[1.0] * 7], {"level": 1}, "its keys are"),
    ]:
        try:
            model(inputs, config)
        except Exception as error:  # noqa: BLE001 (the client raises no other)
            assert "InvalidInput" in str(error) and expected in str(error), error
        else:
            raise AssertionError(f"{inputs} {config} was not refused")


def sampling():
    """emcee walks through the posterior, and meets numbers wherever it goes."""
    posterior = UmbridgeLogProb(URL, "posterior", {"inputs": "bounds"})
    sampler = emcee.EnsembleSampler(2 * posterior.ndim, posterior.ndim, posterior)
    generator = np.random.default_rng(1)
    sampler.run_mcmc(generator.random((2 * posterior.ndim, posterior.ndim)), 3)
    density = sampler.get_log_prob()
    assert density.shape == (3, 2 * posterior.ndim) and np.isfinite(density).all(), density
    assert density.max() > -1e6, density
    # The unmodified sample starts in units of its own, where little has a density.
    outside = UmbridgeLogProb(URL, "posterior")
    assert outside(np.full(7, 100.0)) == -1e300


def documentation():
    """The examples of the page run."""
    at = {"http://127.0.0.1:4242": URL}
    found = execute("import umbridge  # pip install umbridge", at)
    assert 3000.0 < found["mean"] < 5000.0, found["mean"]
    assert 0.0 < found["coefficient_of_variation"] < 0.1, found["coefficient_of_variation"]
    sampler = execute("import emcee", at | {"posterior.ndim), 100)": "posterior.ndim), 2)"})["sampler"]
    assert sampler.get_chain().shape == (2, 32, 7)
    assert np.isfinite(sampler.get_log_prob()).all(), sampler.get_log_prob()


for check in (values, derivatives, errors, sampling, documentation):
    check()
    print(f"{check.__name__}: ok")

"""Writes the files beside it: the same signals in each kind of file that `osteon pick` reads.

    osteon simulate examples/cases/A.toml --set probe.receivers.count=4 --time-step 62.5e-9 --out out
    python make_fixtures.py out/traces.csv

Needs numpy, scipy, h5py and hdf5storage, and the program octave-cli. The signals are whole numbers, so that each type
of numbers holds them exactly: two series of four receivers with 160 samples every 62.5 ns; the second series is three
quarters of the first one, upside down.
"""

import os
import struct
import subprocess
import sys

import h5py
import hdf5storage
import numpy as np
import scipy.io
import scipy.sparse

CALLED_FROM = os.getcwd()
os.chdir(os.path.dirname(os.path.abspath(__file__)))

STEP = 62.5e-9

traces = np.loadtxt(os.path.join(CALLED_FROM, sys.argv[1]), delimiter=",", skiprows=1)[:160, 1:].T
largest = np.abs(traces).max()

# Series, receiver, time; and in MATLAB's usual order: time, receiver, series.
signals = np.rint(np.stack([traces, -0.75 * traces]) / largest * 32000).astype(np.int16)
by_columns = np.asfortranarray(signals.transpose(2, 1, 0))
noise = np.array([[1, -1, 2], [0, 3, -2]], dtype=np.int16)
mixture = np.array([[1 + 2j, 3 - 4j], [5j, 6]])

np.save("signals.npy", signals)
np.savez_compressed("signals.npz", signals=signals.astype(np.float32), noise=noise, gains=np.arange(4.0),
                    label=np.array("a text"))

variables = {
    "rf": by_columns,
    "noise": noise,
    "gain": 20.0,
    "label": "a text",
    "mixture": mixture,
    "cells": np.array([[noise, "text"]], dtype=object),
    "sparse": scipy.sparse.csc_matrix(noise.astype(float)),
    "flags": noise > 0,
    "probe": {"count": 4.0, "data": {"rf": by_columns.astype(np.float64)}},
}
scipy.io.savemat("scipy-7.mat", variables, do_compression=True)
scipy.io.savemat("scipy-6.mat", {"rf": by_columns, "label": "a text"}, do_compression=False)

# A file of Octave has what is in the workspace; its structures are nested deeper than any that is read.
subprocess.run(["octave-cli", "--quiet", "--norc", "--eval", """
load("scipy-7.mat"); rf = single(rf); deep = rf(1:2, 1:2);
for level = 1:30, deep = struct("in", deep); end
many = struct("x", {1, 2, 3}); probe = struct("rf", rf, "count", 4);
save("-v7", "octave-7.mat", "probe", "many", "deep", "label", "mixture", "cells");
save("-v6", "octave-6.mat", "rf");
"""], check=False)

options = hdf5storage.Options(matlab_compatible=True, store_python_metadata=False, oned_as="row", compress=True,
                              compress_size_threshold=1024, gzip_compression_level=9)
if os.path.exists("matlab-7.3.mat"):
    os.remove("matlab-7.3.mat")
hdf5storage.writes({"/probe": {"rf": by_columns, "label": "a text"}},
                   filename="matlab-7.3.mat", options=options)

with h5py.File("arrays.h5", "w", libver="latest") as file:
    raw = file.create_group("raw")
    raw.create_dataset("rf", data=signals, chunks=(1, 4, 80), compression="gzip", shuffle=True, fletcher32=True)
    raw.create_dataset("time_first", data=signals.transpose(2, 1, 0).astype(">f4"), compression="gzip")
    raw.create_dataset("label", data="a text")
    raw.create_dataset("mixture", data=mixture)
    raw.create_dataset("half", data=noise.astype(np.float16))

# Three hundred billion samples, none of which was ever written; none at all; a compression of h5py's own; a loop.
with h5py.File("odd.h5", "w") as file:
    file.create_dataset("huge", shape=(20_000_000, 4, 4000), dtype="<f8", chunks=(1, 4, 4000), compression="gzip")
    file.create_dataset("none", shape=(0, 4, 160), dtype="<i2")
    file.create_dataset("lzf", data=signals[:1, :, :128], compression="lzf")
    file["again"] = file["/"]

# As SimSonic2D writes its arrays of receivers; the grid has steps of 0.02 mm.
with open("receivers.rcv2D", "wb") as file:
    file.write(struct.pack("<c5i", b"2", 4, 550, 100, 40, 10))
    file.write(struct.pack("<d", 0.02) + struct.pack("<i", 160) + struct.pack("<d", STEP * 1e6))
    file.write(signals[0].astype("<f8").tobytes())

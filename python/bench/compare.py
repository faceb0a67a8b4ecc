"""Measures what Python adds: the velocities of 1,000 tensors a call by `osteon.velocities`, and by a
program in Rust (bulk.rs) that is sent the same tensors; and the time of `import osteon`.

Both sides compute in turns, so that other load of the machine meets both, on one thread and on all cores;
the smallest time of all rounds is printed, and the smallest time of processors, which depends less on other load. `cargo xtask bench python` builds both in release
mode, installs the wheel in a virtual environment, and runs this there."""

import argparse
import contextlib
import os
import pathlib
import struct
import subprocess
import sys
import time

CASE = pathlib.Path(__file__).resolve().parents[2] / "examples" / "cases" / "A.toml"
TENSORS = 1000
MASK = 2**64 - 1


@contextlib.contextmanager
def rust(command, tensors, threads):
    """The program in Rust, which has got the tensors; a function that runs a round."""
    words = [*command, CASE, str(threads), str(len(tensors))]
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    with subprocess.Popen(words, **pipes) as process:
        process.stdin.write(tensors.tobytes())

        # The clock of a process's processor time, as Linux encodes it.
        clock = (~process.pid << 3) | 2

        def measured():
            begun = time.clock_gettime(clock)
            process.stdin.write(b".")
            process.stdin.flush()
            answer = process.stdout.read(16)
            if len(answer) != 16:
                sys.exit("the program in Rust ended")
            seconds, bits = struct.unpack("=dQ", answer)
            return seconds, time.clock_gettime(clock) - begun, bits

        yield measured
        process.stdin.close()


def python(tensors, threads):
    """Seconds of a call, of them on processors, and the sum of the bits of the velocities."""
    import osteon

    begun = time.perf_counter(), time.process_time()
    found = osteon.velocities(tensors, setup=CASE, threads=threads)
    seconds, busy = time.perf_counter() - begun[0], time.process_time() - begun[1]
    return seconds, busy, int(found.view("uint64").sum(dtype="uint64")) & MASK


def compare(command, tensors, threads, rounds):
    """Prints a row: both sides in turns."""
    times = {"Rust": [], "Python": []}
    with rust(command, tensors, threads) as measured:
        # The tables for the tensors are made in the first round of each side, which does not count.
        for _ in range(rounds + 1):
            *of_rust, expected = measured()
            *of_python, bits = python(tensors, threads)
            if bits != expected:
                sys.exit("Rust and Python computed different velocities")
            times["Rust"].append(of_rust)
            times["Python"].append(of_python)
    cells = [f"{threads:7}"]
    for kind in (0, 1):
        least = [1e6 * min(found[kind] for found in times[side][1:]) / len(tensors) for side in times]
        cells += [*(f"{each:9.1f}" for each in least), f"{100 * (least[1] / least[0] - 1):+6.2f} %"]
    print(f"| {' | '.join(cells)} |", flush=True)


def imported(rounds):
    """Seconds that `import osteon` adds to the start of Python: the smallest of all rounds."""
    least = {}
    for statement in ("pass", "import numpy", "import osteon") * rounds:
        begun = time.perf_counter()
        subprocess.run([sys.executable, "-c", statement], check=True)
        seconds = time.perf_counter() - begun
        least[statement] = min(seconds, least.get(statement, seconds))
    return least["import osteon"] - least["pass"], least["import osteon"] - least["import numpy"]


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=20, help="how often each side computes (20)")
    parser.add_argument("command", nargs="+", help="the program in Rust, after --")
    arguments = parser.parse_args()
    import osteon

    tensors = osteon.ensemble(CASE, dispersion=0.1, seed=1).draw(TENSORS)
    print(f"{TENSORS} tensors a call, µs a tensor, {arguments.rounds} rounds in turns\n")
    print("| threads | Rust | Python | added | Rust, on processors | Python | added |")
    print("|---|---|---|---|---|---|---|")
    for threads in sorted({1, len(os.sched_getaffinity(0))}):
        compare(arguments.command, tensors, threads, arguments.rounds)
    whole, beyond = imported(arguments.rounds)
    print(f"\nimport osteon: {whole:.3f} s, of which {beyond:.3f} s beyond NumPy's")


if __name__ == "__main__":
    main()

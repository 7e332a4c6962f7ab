"""Seconds of a million walks with every kind of function, over those of a closure of Rust: python tests/speed.py.

The equation is u(x) = ½ ∫∫ exp(−|x − y|²) u(y) dy + 1 + x₁ on [0, 1]², with 4 × 4 cells of degree 3, on one thread.
"""

import math
import subprocess
import warnings
from pathlib import Path

import numpy as np

import fredholm

SETTINGS = {"mean": True, "cells": 4, "degree": 3, "threads": 1, "progress": False}


def seconds(u: fredholm.Problem, walks: int = 1_000_000) -> float:
    """The least of three runs; of as many walks, if fewer are made."""
    runs = 3 if walks == 1_000_000 else 1
    least = min(u.solve(walks=walks, **SETTINGS).to_dict()["walk_seconds"] for _ in range(runs))
    return least * 1_000_000 / walks


def main() -> None:
    warnings.simplefilter("ignore", fredholm.ScalarFunctionWarning)
    kinds = {"formula": (fredholm.Cube("0.5 * exp(-((x1-y1)*(x1-y1) + (x2-y2)*(x2-y2)))", "1 + x1", dimension=2), 1_000_000)}
    try:
        from numba import cfunc, types

        pointer = types.CPointer(types.float64)

        @cfunc(types.float64(pointer, pointer))
        def kernel(x, y):
            a, b = x[0] - y[0], x[1] - y[1]
            return 0.5 * math.exp(-(a * a + b * b))

        @cfunc(types.float64(pointer))
        def source(x):
            return 1.0 + x[0]

        kinds["compiled by numba"] = (fredholm.Cube(kernel, source, dimension=2), 1_000_000)
    except ImportError:
        print("numba is not installed")
    blocks = fredholm.Cube(
        lambda x, y: 0.5 * np.exp(-((x - y) ** 2).sum(axis=1)), lambda x: 1.0 + x[:, 0], dimension=2
    )
    kinds["arrays"] = (blocks, 1_000_000)
    scalar = fredholm.Cube(
        lambda x, y: 0.5 * math.exp(-((x[0] - y[0]) ** 2 + (x[1] - y[1]) ** 2)),
        lambda x: 1.0 + x[0],
        dimension=2,
        vectorized=False,
    )
    kinds["one point at a time"] = (scalar, 50_000)
    command = ["cargo", "run", "-q", "--release", "--example", "closure"]
    folder = Path(__file__).resolve().parents[1]
    closure = float(subprocess.run(command, cwd=folder, check=True, capture_output=True, text=True).stdout)
    print(f"{'closure of Rust':20} {closure:8.3f} s")
    for name, (u, walks) in kinds.items():
        taken = seconds(u, walks)
        print(f"{name:20} {taken:8.3f} s  {taken / closure:7.2f}")


if __name__ == "__main__":
    main()

"""Equations of any norm beside a Nyström script: value, error bar, z and seconds of every target of the file of cases.

FREDHOLM=target/release/fredholm python runners/python/tests/nystrom.py [CASES]

The script doubles its Gauss points until no target moves by the error asked for, or until there are 4,096.
"""

import json
import os
import re
import subprocess
import sys
import tempfile
import time
import tomllib
from pathlib import Path

import numpy as np
from scipy.special import exp1, expn

CASES = Path(__file__).parents[2] / "cli" / "verify" / "equations.toml"
MOST = 4096
NAMES = {name: getattr(np, name) for name in ("abs", "cos", "exp", "log", "pi", "sin", "sqrt")}
NAMES |= {"where": np.where, "E1": exp1, "E2": lambda x: expn(2, x), "ln": np.log, "min": np.minimum, "max": np.maximum}


def formula(text: str, *arguments: str):
    """The formula as a function of arrays."""
    text = re.sub(r"^(.*) \? (.*) : (.*)$", r"where(\1, \2, \3)", text.replace("^", "**"))
    return eval(f"lambda {', '.join(arguments)}: 0 * {arguments[0]} + ({text})", dict(NAMES))


def rule(points: int, low: float, high: float):
    """Gauss nodes and weights of an interval, of which an end may be infinite."""
    t, w = np.polynomial.legendre.leggauss(points)
    if np.isfinite(high):
        return low + 0.5 * (high - low) * (t + 1), 0.5 * (high - low) * w
    if np.isfinite(low):
        return low + (1 + t) / (1 - t), w * 2 / (1 - t) ** 2
    return t / (1 - t * t), w * (1 + t * t) / (1 - t * t) ** 2


def by_rule(file: dict, points: int) -> np.ndarray:
    """All targets by a Nyström rule of so many points."""
    [[low, high]] = file["problem"].get("domain", [[0, 1]])
    kernel, source = formula(file["problem"]["kernel"], "x", "y"), formula(file["problem"]["source"], "x")
    y, w = rule(points, float(low), float(high))
    with np.errstate(all="ignore"):
        # Where the kernel has no value, as at x = y, it counts for nothing.
        matrix = np.nan_to_num(kernel(y[:, None], y[None, :]), nan=0, posinf=0, neginf=0) * w
        u = np.linalg.solve(np.eye(points) - matrix, source(y))
        values = []
        for target in file["target"]:
            if "at" in target:
                x = np.full(1, float(target["at"]))
                values.append((source(x) + np.nan_to_num(kernel(x, y), posinf=0) @ (w * u))[0])
            else:
                weight = formula(str(target.get("weight", 1 / (high - low))), "x")
                values.append(w @ (weight(y) * u))
    return np.array(values)


def nystrom(file: dict, error: float):
    """All targets, the number of points, and the seconds."""
    start, points, before = time.perf_counter(), 8, np.inf
    while True:
        values = by_rule(file, points)
        if points >= MOST or np.all(np.abs(values - before) < error):
            return values, points, time.perf_counter() - start
        points, before = 2 * points, values


def main() -> None:
    cases = tomllib.loads(Path(sys.argv[1] if len(sys.argv) > 1 else CASES).read_text())["case"]
    program = os.environ.get("FREDHOLM", "fredholm")
    print(f"{'equation':<60} {'value':>16} {'± error':>9} {'z':>5} {'s':>6}   Nyström: {'off by':>9} {'s':>7} points")
    largest, seconds = 0.0, 0.0
    for case in cases:
        file = tomllib.loads(case["file"])
        with tempfile.NamedTemporaryFile("w", suffix=".toml") as saved:
            saved.write(case["file"])
            saved.flush()
            start = time.perf_counter()
            ran = subprocess.run([program, "solve", saved.name, "--json"], capture_output=True, text=True, check=True)
            own = time.perf_counter() - start
        seconds += own
        targets = {target["name"]: target["preconditioned"] for target in json.loads(ran.stdout)["targets"]}
        error = file["walk"]["target_error"]
        if file["walk"].get("relative"):
            error *= min(abs(right) for _, right in case["numbers"])
        values, points, other = nystrom(file, error)
        names = [target["name"] for target in file["target"]]
        for name, right in case["numbers"]:
            value, bar = targets[name]["estimate"], targets[name]["std_error"]
            z = (value - right) / bar
            largest = max(largest, abs(z))
            off = values[names.index(name)] - right
            title = f"{case['name']}: {name}"[:60]
            print(f"{title:<60} {value:>16.10g} {bar:>9.1e} {z:>5.1f} {own:>6.2f}            {off:>9.1e} {other:>7.3f} {points:>6}")
    print(f"largest |z| {largest:.2f}, {seconds:.1f} s in all")


if __name__ == "__main__":
    main()

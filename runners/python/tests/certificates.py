"""Certificates of solutions with known errors: what is found beside the truth. Run it by hand; it takes some seconds.

    python runners/python/tests/certificates.py
"""

from __future__ import annotations

import pathlib
import tempfile
import time
from typing import Any, Callable

import fredholm
import numpy as np


def gauss(n: int, a: float = 0.0, b: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    x, w = np.polynomial.legendre.leggauss(n)
    return a + (b - a) * (x + 1) / 2, w * (b - a) / 2


def nystrom(kernel: Callable[..., Any], source: Callable[..., Any], n: int) -> Callable[[Any], float]:
    """Nyström's solution with its own interpolation, on [0, 1]."""
    y, w = gauss(n)
    u = np.linalg.solve(np.eye(n) - kernel(y[:, None], y[None, :]) * w, source(y))
    return lambda x: float(source(np.asarray(x)) + (kernel(np.asarray(x), y) * w) @ u)


def nystrom2(kernel: Callable[..., Any], source: Callable[..., Any], n: int) -> Callable[[Any], float]:
    """The same on [0, 1]²; kernel and source take arrays whose last axis is that of coordinates."""
    t, w = gauss(n)
    y = np.stack(np.meshgrid(t, t, indexing="ij"), axis=-1).reshape(-1, 2)
    weights = np.outer(w, w).ravel()
    u = np.linalg.solve(np.eye(n * n) - kernel(y[:, None, :], y[None, :, :]) * weights, source(y))
    return lambda x: float(source(np.asarray(x)) + (kernel(np.asarray(x), y) * weights) @ u)


def network(x: np.ndarray, u: np.ndarray) -> Callable[[float], float]:
    """A net of one hidden layer, trained by Adam on points of a solution."""
    rng = np.random.default_rng(1)
    p = [rng.normal(size=12) * 3, rng.normal(size=12), rng.normal(size=12) * 0.3, np.zeros(1)]
    m, s = [np.zeros_like(a) for a in p], [np.zeros_like(a) for a in p]
    for step in range(1, 4001):
        h = np.tanh(np.outer(x, p[0]) + p[1])
        r = h @ p[2] + p[3] - u
        back = (r[:, None] * p[2]) * (1 - h**2)
        gradients = [(back * x[:, None]).mean(0), back.mean(0), (h * r[:, None]).mean(0), np.array([r.mean()])]
        for i, g in enumerate(gradients):
            m[i] = 0.9 * m[i] + 0.1 * g
            s[i] = 0.999 * s[i] + 0.001 * g * g
            p[i] = p[i] - 0.01 * (m[i] / (1 - 0.9**step)) / (np.sqrt(s[i] / (1 - 0.999**step)) + 1e-8)
    return lambda t: float(np.tanh(p[0] * t + p[1]) @ p[2] + p[3][0])


def patches(per_wall: int) -> np.ndarray:
    """Means of u over the four walls of a unit square, ρ = 0.6, whose floor emits 1, by equal patches and crossed strings."""
    t = np.linspace(0, 1, per_wall + 1)
    corners = [np.array([[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]][i], dtype=float) for i in range(5)]
    ends = [[corners[k] + s * (corners[k + 1] - corners[k]) for s in t] for k in range(4)]
    segments = [(ends[k][i], ends[k][i + 1]) for k in range(4) for i in range(per_wall)]
    a, b = (np.array([segment[i] for segment in segments]) for i in (0, 1))
    length = lambda p, q: np.linalg.norm(p[:, None, :] - q[None, :, :], axis=-1)
    factors = (length(a, a) + length(b, b) - length(a, b) - length(b, a)) / 2 * per_wall
    wall = np.repeat(np.arange(4), per_wall)
    factors = np.abs(factors) * (wall[:, None] != wall[None, :])
    u = np.linalg.solve(np.eye(4 * per_wall) - 0.6 * factors, (wall == 0).astype(float))
    return u.reshape(4, per_wall).mean(1)


WALLS = {
    "floor": (0.2, 0.0, [0, 0, 0], [4, 0, 0], [0, 3, 0]),
    "ceiling": (0.8, 0.0, [0, 0, 2.5], [0, 3, 0], [4, 0, 0]),
    "front": (0.5, 0.0, [0, 0, 0], [0, 0, 2.5], [4, 0, 0]),
    "back": (0.5, 0.0, [0, 3, 0], [4, 0, 0], [0, 0, 2.5]),
    "left": (0.6, 1.0, [0, 0, 0], [0, 3, 0], [0, 0, 2.5]),
    "right": (0.3, 0.0, [4, 0, 0], [0, 0, 2.5], [0, 3, 0]),
}


def box(n: int, folder: str) -> pathlib.Path:
    """A file of a room in space, each of whose walls is n × n surfaces."""
    text = "[problem]\nkind = 'scene'\n"
    for name, (reflectance, emission, *vectors) in WALLS.items():
        origin, a, b = (np.array(vector, dtype=float) for vector in vectors)
        for i in range(n):
            for j in range(n):
                at = origin + (a * i + b * j) / n
                polygon = [list(map(float, point)) for point in (at, at + a / n, at + (a + b) / n, at + b / n)]
                own = name if n == 1 else f"{name} {i} {j}"
                text += f"[[problem.surface]]\nname = '{own}'\npolygon = {polygon}\nreflectance = {reflectance}\nemission = {emission}\n"
    path = pathlib.Path(folder) / f"box{n}.toml"
    path.write_text(text + "[[target]]\nover = 'floor'\n" if n == 1 else text + "[[target]]\nover = 'all'\n")
    return path


def deck(n: int, folder: str) -> np.ndarray:
    """Means of u over the walls, by n × n patches on each and exact factors, as users of view-factor codes solve it."""
    found = fredholm.factors(box(n, folder))
    wall = np.repeat(np.arange(len(WALLS)), n * n)
    own = list(WALLS.values())
    reflectance, emission = (np.array([walls[i] for walls in own])[wall] for i in (0, 1))
    u = np.linalg.solve(np.eye(len(wall)) - reflectance[:, None] * np.asarray(found.matrix), emission)
    return u.reshape(len(WALLS), n * n).mean(1)


def show(name: str, certificate: fredholm.Certificate, truth: np.ndarray, seconds: float) -> float:
    """A row: the largest error that was found, and the truth there."""
    errors, bars = certificate.errors, certificate.std_errors
    i = int(np.nanargmax(np.abs(errors)))
    z = float(np.nanmax(np.abs((errors - truth) / bars)))
    verdict = "right" if certificate else "wrong"
    print(f"{name:28} {verdict:6} {errors[i]: .6e} ± {bars[i]:.1e}  {truth[i]: .6e}  {z:6.2f}  {seconds:6.2f}")
    return z


def main() -> None:
    print(f"{'solution':28} {'is':6} {'largest error found':24} {'truth there':>14} {'max |z|':>7} {'s':>7}")
    grid = np.linspace(0, 1, 256)

    def of_function(name: str, problem: fredholm.Problem, given: Callable[[float], float], exact: Callable[[float], float], x: np.ndarray = grid) -> None:
        start = time.perf_counter()
        certificate = problem.certify([given(float(t)) for t in x], at=[float(t) for t in x])
        seconds = time.perf_counter() - start
        show(name, certificate, np.array([given(float(t)) - exact(float(t)) for t in x]), seconds)

    wave = lambda x, y: 0.3 * (np.cos(25 * (x - y)) + np.cos(7 * (x - y)))
    sines = lambda x: np.sin(25 * x) + np.sin(7 * x)
    u8 = fredholm.Cube("0.3*(cos(25*(x-y)) + cos(7*(x-y)))", "sin(25*x) + sin(7*x)")
    exact8 = nystrom(wave, sines, 60)
    of_function("published 20/17 (…)", u8, lambda x: 20 / 17 * float(sines(x)), exact8)
    for n in (8, 12, 16):
        of_function(f"Nyström, {n} nodes", u8, nystrom(wave, sines, n), exact8)

    bell = lambda x, y: np.exp(-4 * (x - y) ** 2)
    one = lambda x: 1 + np.asarray(x)
    u1 = fredholm.Cube("exp(-4*(x-y)^2)", "1 + x")
    exact1 = nystrom(bell, one, 40)
    nodes = np.linspace(0, 1, 21)
    at_nodes = np.array([exact1(t) for t in nodes])
    of_function("linear elements, 21 nodes", u1, lambda t: float(np.interp(t, nodes, at_nodes)), exact1)
    of_function("neural network", u1, network(grid[::4], np.array([exact1(t) for t in grid[::4]])), exact1)
    bump = lambda t: exact1(t) + (1e-4 if 0.37 <= t < 0.38 else 0.0)
    of_function("bump of 1e-4 in one cell", u1, bump, exact1)
    of_function("exact", u1, exact1, exact1)

    square = lambda x, y: 0.7 * np.exp(-((x - y) ** 2).sum(-1) * 3)
    hill = lambda x: 1 + np.asarray(x)[..., 0] * np.asarray(x)[..., 1]
    u2 = fredholm.Cube("0.7*exp(-3*((x1-y1)^2 + (x2-y2)^2))", "1 + x1*x2", dimension=2)
    exact2 = nystrom2(square, hill, 20)
    places = [[float(a), float(b)] for a in np.linspace(0, 1, 12) for b in np.linspace(0, 1, 12)]
    for n in (2, 3, 4):
        given = nystrom2(square, hill, n)
        start = time.perf_counter()
        certificate = u2.certify([given(x) for x in places], at=places, target_error=1e-7)
        seconds = time.perf_counter() - start
        show(f"Nyström, {n} × {n} nodes", certificate, np.array([given(x) - exact2(x) for x in places]), seconds)

    corners = [[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]]
    names = ["floor", "right", "top", "left"]
    walls = [{"name": names[k], "points": corners[k : k + 2], "reflectance": 0.6, "emission": 1.0 if k == 0 else 0.0} for k in range(4)]
    room = fredholm.Room(walls)
    # Richardson's value of patches of 100 and 200 a wall, whose error falls like their size squared.
    exact = (4 * patches(200) - patches(100)) / 3
    for n in (1, 2, 8):
        given = patches(n)
        start = time.perf_counter()
        certificate = room.certify(list(given), over=names, target_error=1e-6)
        seconds = time.perf_counter() - start
        show(f"{n} patches a wall", certificate, given - exact, seconds)

    with tempfile.TemporaryDirectory() as folder:
        all_patches = {n: deck(n, folder) for n in (1, 2, 4, 8, 16)}
        # Aitken's value: errors fall by one factor with every halving.
        low, middle, high = (all_patches[n] for n in (4, 8, 16))
        exact = high - (high - middle) ** 2 / (high - 2 * middle + low)
        scene = fredholm.load(box(1, folder))
        for n in (1, 2, 4, 8):
            given = all_patches[n]
            start = time.perf_counter()
            certificate = scene.certify(list(given), over=list(WALLS), target_error=1e-4)
            seconds = time.perf_counter() - start
            show(f"deck, {n} × {n} patches a wall", certificate, given - exact, seconds)


if __name__ == "__main__":
    main()

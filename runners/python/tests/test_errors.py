"""Bad input: one clear error each, of the right class, and no crash."""

import math
from typing import Any, Callable

import numpy as np
import pytest

import fredholm

CUBE = fredholm.Cube("0.5 * x * y", "x")
WALLS = [
    {"name": "floor", "points": [[0, 0], [1, 0]], "reflectance": 0.5, "emission": 1.0},
    {"name": "rest", "points": [[1, 0], [1, 1], [0, 1], [0, 0]], "reflectance": 0.5, "emission": 0.0},
]


def raises(x: Any, *_: Any) -> Any:
    raise RuntimeError("no value here")


def late(x: Any, *_: Any) -> Any:
    """A function that raises where walks come, but not where it is tried."""
    if np.ndim(x) and len(x) > 100:
        raise LookupError("too many")
    return 0.1 * np.asarray(x)


CASES: dict[str, tuple[Callable[[], object], type, str]] = {
    "unknown name in a formula": (lambda: fredholm.Cube("0.5*z", "x"), fredholm.InputError, "z"),
    "a formula that ends early": (lambda: fredholm.Cube("0.5*(x", "x"), fredholm.InputError, "kernel"),
    "dimension 0": (lambda: fredholm.Cube("0.5", "1", dimension=0), fredholm.InputError, "dimension"),
    "dimension 7": (lambda: fredholm.Cube("0.5", "1", dimension=7), fredholm.InputError, "dimension"),
    "dimension of functions": (lambda: fredholm.Cube(np.minimum, np.sqrt, dimension=9), fredholm.InputError, "dimension"),
    "a domain that is empty": (lambda: fredholm.Cube("0.5", "1", domain=[[1, 1]]), fredholm.InputError, "domain"),
    "a domain of another dimension": (
        lambda: fredholm.Cube("0.5", "1", dimension=2, domain=[[0, 1]]),
        fredholm.InputError,
        "domain",
    ),
    "NaN in a domain": (lambda: fredholm.Cube("0.5", "1", domain=[[0, math.nan]]), fredholm.InputError, "finite"),
    "a formula and a function": (lambda: fredholm.Cube("0.5", np.sqrt), fredholm.InputError, "both"),
    "a function and a formula": (lambda: fredholm.Cube(np.minimum, "x"), fredholm.InputError, "function"),
    "no function": (lambda: fredholm.Cube(None, np.sqrt), fredholm.InputError, "kernel"),  # type: ignore[arg-type]
    "an infinite constant": (lambda: fredholm.Cube(math.inf, np.sqrt), fredholm.InputError, "finite"),
    "a point outside": (lambda: CUBE.solve(at=1.5), fredholm.InputError, "1.5"),
    "a point of another dimension": (lambda: CUBE.solve(at=[[0.1, 0.2]]), fredholm.InputError, "shape"),
    "NaN for a point": (lambda: CUBE.solve(at=math.nan), fredholm.InputError, "finite"),
    "a word for a point": (lambda: CUBE.solve(at="middle"), fredholm.InputError, "point"),
    "two targets of one name": (
        lambda: CUBE.solve(target=[{"name": "a", "at": 0.1}, {"name": "a", "at": 0.2}]),
        fredholm.InputError,
        "a",
    ),
    "unknown pairs": (lambda: CUBE.solve(pairs="all"), fredholm.InputError, "one of"),
    "an absorption of 2": (lambda: CUBE.solve(absorption=2.0), fredholm.InputError, "absorption"),
    "a word for a number": (lambda: CUBE.solve(cells="many"), fredholm.InputError, "cells"),  # type: ignore[arg-type]
    "fewer than no walks": (lambda: CUBE.solve(walks=-1), fredholm.InputError, "walks"),
    "an error of 0": (lambda: CUBE.solve(target_error=0.0), fredholm.InputError, "target_error"),
    "too many threads": (lambda: CUBE.solve(threads=10**6), fredholm.InputError, "threads"),
    "a time before now": (lambda: CUBE.solve(time_limit=-1.0), fredholm.InputError, "time_limit"),
    "an unknown setting": (lambda: CUBE.predict(1e-3, cell=5), fredholm.InputError, "cell"),
    "huge cells": (lambda: fredholm.Cube("0.1*x1*y1", "1", dimension=3).solve(cells=100_000), fredholm.FredholmError, ""),
    "no contraction for walks of a chain": (
        lambda: fredholm.Cube("3", "1").solve(target_error=1e-3, method="walks"),
        fredholm.InfiniteVarianceError,
        "variance",
    ),
    "no solution": (lambda: fredholm.Cube("1", "1").solve(target_error=1e-3, method="resolvent"), fredholm.FredholmError, ""),
    "an infinite variance": (
        lambda: fredholm.Cube("0.99", "1").solve(absorption=0.5, cells=4),
        fredholm.InfiniteVarianceError,
        "variance",
    ),
    "a kernel that is not finite": (lambda: fredholm.Cube("1/(x-x)", "1").solve(cells=4), fredholm.FredholmError, ""),
    "a function that raises": (lambda: fredholm.Cube(raises, raises, vectorized=True).solve(cells=4), RuntimeError, "no value"),
    "a function that raises one by one": (
        lambda: fredholm.Cube(raises, raises, vectorized=False).solve(cells=4),
        RuntimeError,
        "no value",
    ),
    "a function that raises late": (lambda: fredholm.Cube(late, late, vectorized=True).solve(cells=20), LookupError, "too many"),
    "a function of another shape": (
        lambda: fredholm.Cube(lambda x, y: np.ones((len(x), 2)), lambda x: x, vectorized=True).solve(cells=4),
        fredholm.InputError,
        "shape",
    ),
    "a function of words": (
        lambda: fredholm.Cube(lambda x, y: "a", lambda x: x, vectorized=True).solve(cells=4),
        ValueError,
        "",
    ),
    "a function of NaN": (
        lambda: fredholm.Cube(lambda x, y: np.full(len(x), np.nan), lambda x: x, vectorized=True).solve(cells=4),
        fredholm.FredholmError,
        "",
    ),
    "a complex function of arrays": (lambda: fredholm.Cube(lambda x, y: 1j * x * y, np.sin), fredholm.InputError, "fredholm.System"),
    "a complex function of one point": (
        lambda: fredholm.Cube(lambda x, y: complex(0.1, x * y), lambda x: float(x)),
        fredholm.InputError,
        "fredholm.System",
    ),
    "a function that is complex late": (
        lambda: fredholm.Cube(lambda x, y: x * y * (1j if len(x) > 100 else 0.1), np.sin).solve(),
        fredholm.InputError,
        "fredholm.System",
    ),
    "a complex source": (lambda: fredholm.Cube(lambda x, y: 0.1 * x * y, lambda x: np.exp(1j * x)), fredholm.InputError, "source has"),
    "a complex constant": (lambda: fredholm.Cube("0.5*x*y", 1j), fredholm.InputError, "source has"),  # type: ignore[arg-type]
    "a complex weight": (lambda: CUBE.solve(weight=lambda x: 1j * x), fredholm.InputError, "weight has"),
    "a function in a system": (lambda: fredholm.System([[np.sin]], ["1"]), fredholm.InputError, "formula"),  # type: ignore[list-item]
    "a system that is not square": (lambda: fredholm.System([["1", "x"]], ["1"]), fredholm.InputError, "as many"),
    "a source too few": (lambda: fredholm.System([["0", "x"], ["x", "0"]], ["1"]), fredholm.InputError, "2 formulas"),
    "a component too many": (
        lambda: fredholm.System([["0.1"]], ["1"]).solve(at=0.5, component=2),
        fredholm.InputError,
        "component",
    ),
    "a matrix for the value at a point": (
        lambda: fredholm.Cube(lambda x, y: np.ones((2, 2)), lambda x: float(x)).solve(),
        fredholm.InputError,
        "shape",
    ),
    "a text for the value at a point": (
        lambda: fredholm.Cube(lambda x, y: "a", lambda x: float(x)).solve(),
        fredholm.InputError,
        "must be a number",
    ),
    "a weight that raises": (lambda: CUBE.solve(weight=raises), RuntimeError, "no value"),
    "a weight of another shape": (lambda: CUBE.solve(weight=lambda x: [1.0, 2.0]), fredholm.InputError, "shape"),
    "a number for a domain": (lambda: fredholm.Cube("0.5", "1", domain=5), fredholm.InputError, "domain"),  # type: ignore[arg-type]
    "an interval of three ends": (lambda: fredholm.Cube("0.5", "1", domain=[[0, 1, 2]]), fredholm.InputError, "domain"),
    "a number for edges": (lambda: fredholm.Cube("0.5", "1", edges=0.5), fredholm.InputError, "edges"),  # type: ignore[arg-type]
    "an edge outside": (lambda: fredholm.Cube("0.5", "1", edges=[2.0]), fredholm.InputError, "edge"),
    "a number for parameters": (lambda: fredholm.Cube("a", "1", parameters=1), fredholm.InputError, "parameters"),  # type: ignore[arg-type]
    "points of different lengths": (lambda: CUBE.solve(at=[[0.1], [0.1, 0.2]]), fredholm.InputError, "at"),
    "points of a field of different lengths": (lambda: CUBE.field(at=[[0.1, 0.2]]), fredholm.InputError, "at"),
    "a word for a grid": (lambda: CUBE.field("many"), fredholm.InputError, "grid"),  # type: ignore[arg-type]
    "a number for a part": (lambda: CUBE.solve(over=3), fredholm.InputError, "over"),  # type: ignore[arg-type]
    "numbers for parts": (lambda: fredholm.Circle(0.5, 1.0).solve(over=[1, 2, 3]), fredholm.InputError, "over"),
    "a number for a weight": (lambda: CUBE.solve(weight=3), fredholm.InputError, "weight"),  # type: ignore[arg-type]
    "a number for a target": (lambda: CUBE.solve(target=3), fredholm.InputError, "target"),
    "a number for a sweep": (lambda: CUBE.sweep(5), fredholm.InputError, "cells"),  # type: ignore[arg-type]
    "a number for surfaces": (lambda: fredholm.Room(5), fredholm.InputError, "surfaces"),  # type: ignore[arg-type]
    "an unknown method": (lambda: CUBE.solve(method="none"), fredholm.InputError, "one of"),
    "a room with a gap": (lambda: fredholm.Room(WALLS[:1]).solve(), fredholm.InputError, "floor"),
    "a surface without a name": (lambda: fredholm.Room([{"points": [[0, 0], [1, 0]]}]).solve(), fredholm.InputError, "name"),
    "an unknown surface": (lambda: fredholm.Room(WALLS).solve(over="roof"), fredholm.InputError, "roof"),
    "a reflectance of 2": (lambda: fredholm.Circle(2.0, 1.0).solve(), fredholm.InputError, "reflectance"),
    "no such file": (lambda: fredholm.load("nowhere.toml"), fredholm.InputError, "nowhere.toml"),
    "form factors of a cube": (lambda: CUBE.factors(), fredholm.InputError, "rooms"),
}


@pytest.mark.parametrize("name", CASES)
@pytest.mark.filterwarnings("ignore::fredholm.ScalarFunctionWarning")
def test_bad_input(name: str) -> None:
    call, kind, text = CASES[name]
    with pytest.raises(kind) as error:
        call()
    assert text in str(error.value)
    assert "panic" not in str(error.value)


def test_any_norm_is_solved() -> None:
    # u = 1/(1 - 3).
    assert fredholm.Cube("3", "1").solve(at=0.5, target_error=1e-6).values == pytest.approx([-0.5], abs=1e-5)


def test_places_are_shown() -> None:
    with pytest.raises(fredholm.InputError) as error:
        fredholm.Cube("0.5 * exp(q)", "x")
    assert "<Cube>:4" in str(error.value) or "<Cube>" in str(error.value)
    assert "^" in str(error.value)


@pytest.mark.parametrize("settings", [{"method": "walks", "cells": 4}, {"method": "resolvent", "cells": 2, "degree": 0}])
def test_what_was_not_reached_has_a_result(settings: dict) -> None:
    with pytest.raises(fredholm.NotReachedError) as error:
        fredholm.Cube("1 / (2 + (x - y)^2)", "exp(x)").solve(mean=True, target_error=1e-12, walks=5000, **settings)
    result = error.value.result
    assert not result.reached
    # Nets of resolvent walks have powers of two of points.
    assert 4000 < result["mean"].walks <= 5000

"""Kernels and sources of every kind give the same walks."""

import ctypes
import math

import numpy as np
import pytest

import fredholm

SETTINGS = {"at": [0.3, 0.9], "mean": True, "cells": 8, "degree": 2, "walks": 3000, "batch": 1000}


def kernel(x, y):
    return 0.5 / (1.0 + (x - y) * (x - y))


def source(x):
    return 1.0 + 0.5 * x


def formula() -> fredholm.Result:
    return fredholm.Cube("0.5 / (1 + (x - y)*(x - y))", "1 + 0.5 * x").solve(**SETTINGS)


def test_blocks_and_scalars_have_the_bits_of_each_other() -> None:
    blocks = fredholm.Cube(kernel, source).solve(**SETTINGS)
    with pytest.warns(fredholm.ScalarFunctionWarning, match="one point at a time"):
        scalar = fredholm.Cube(kernel, source, vectorized=False)
    scalar = scalar.solve(**SETTINGS)
    assert blocks.values.tobytes() == scalar.values.tobytes()
    assert blocks.std_errors.tobytes() == scalar.std_errors.tobytes()
    # Another function of the same value up to rounding has other bits, but the same walks.
    np.testing.assert_allclose(blocks.values, formula().values, rtol=1e-13)


@pytest.mark.parametrize("settings", [{"target_error": 1e-5}, {"pairs": "paper", "cells": 5, "walks": 2000}, {"estimator": "collision", "cells": 6, "walks": 2000}])
def test_blocks_choose_as_scalars_do(settings: dict) -> None:
    with pytest.warns(fredholm.ScalarFunctionWarning):
        scalar = fredholm.Cube(kernel, source, vectorized=False)
    both = [u.solve(mean=True, batch=256, **settings) for u in (fredholm.Cube(kernel, source), scalar)]
    assert both[0].values.tobytes() == both[1].values.tobytes()
    keys = ["method", "cells", "degree", "absorption", "estimator", "states"]
    assert [both[0].to_dict().get(key) for key in keys] == [both[1].to_dict().get(key) for key in keys]


def test_blocks_of_several_dimensions_on_a_domain() -> None:
    box = [[-1.0, 1.0], [0.0, 2.0]]
    u = fredholm.Cube(
        lambda x, y: 0.1 * np.exp(-((x - y) ** 2).sum(axis=1)), lambda x: x[:, 0] + x[:, 1], dimension=2, domain=box
    )
    text = fredholm.Cube("0.1 * exp(-(x1-y1)^2 - (x2-y2)^2)", "x1 + x2", dimension=2, domain=box)
    asked = {"at": [[0.5, 0.5], [-0.5, 1.5]], "cells": 4, "degree": 1, "walks": 5000}
    np.testing.assert_allclose(u.solve(method="walks", **asked).values, text.solve(method="walks", **asked).values, rtol=1e-12)
    # What resolvent walks choose depends on the time that functions are taken to need.
    values, others = u.solve(**asked), text.solve(**asked)
    assert (abs(values.values - others.values) < 5 * (values.std_errors + others.std_errors)).all()


def test_a_function_that_looks_at_its_whole_block_is_not_called_with_blocks() -> None:
    with pytest.warns(fredholm.ScalarFunctionWarning):
        fredholm.Cube(lambda x, y: 0.1 * np.asarray(x) / np.max(x), lambda x: np.asarray(x) * 1.0)
    # A row of seven points is no point of two coordinates.
    with pytest.warns(fredholm.ScalarFunctionWarning):
        fredholm.Cube(lambda x, y: 0.1 * x[0] * y[1], lambda x: x[0] + x[1], dimension=2)


def test_functions_of_ctypes() -> None:
    double = ctypes.POINTER(ctypes.c_double)
    of_points = ctypes.CFUNCTYPE(ctypes.c_double, double, double)
    of_point = ctypes.CFUNCTYPE(ctypes.c_double, double)
    k = of_points(lambda x, y: kernel(x[0], y[0]))
    f = of_point(lambda x: source(x[0]))
    u = fredholm.Cube(k, f).solve(**{**SETTINGS, "walks": 500, "threads": 1})
    blocks = fredholm.Cube(kernel, source).solve(**{**SETTINGS, "walks": 500})
    np.testing.assert_allclose(u.values, blocks.values, rtol=1e-13)
    wrong = ctypes.CFUNCTYPE(ctypes.c_int, double, double)(lambda x, y: 0)
    with pytest.raises(fredholm.InputError, match="restype"):
        fredholm.Cube(wrong, f)


def test_functions_of_numba() -> None:
    numba = pytest.importorskip("numba")
    pointer = numba.types.CPointer(numba.types.float64)

    @numba.cfunc(numba.types.float64(pointer, pointer))
    def k(x, y):
        return 0.5 / (1.0 + (x[0] - y[0]) ** 2)

    @numba.cfunc(numba.types.float64(pointer))
    def f(x):
        return 1.0 + 0.5 * x[0]

    u = fredholm.Cube(k, f).solve(**SETTINGS)
    np.testing.assert_allclose(u.values, formula().values, rtol=1e-13)

    @numba.cfunc(numba.types.float64(numba.types.float64, numba.types.float64))
    def wrong(x, y):
        return x * y

    with pytest.raises(fredholm.InputError, match="signature"):
        fredholm.Cube(wrong, f)


def test_constants_and_weights() -> None:
    # u = 1/(1 - ½) with a constant kernel and source.
    u = fredholm.Cube(0.5, lambda x: np.ones_like(x)).solve(mean=True, weight={"first": lambda x: x}, walks=2000, cells=4)
    assert u["mean"].value == pytest.approx(2.0, abs=1e-12)
    assert abs(u["first"].value - 1.0) < 5 * u["first"].std_error < 0.1
    v = fredholm.Cube("0.5 * x * y", "x").solve(weight=["x", lambda x: math.sqrt(x)], walks=2000, cells=4, degree=1)
    assert v.names == ["x", "weight 1"]
    assert v.values == pytest.approx([0.4, 0.48], abs=1e-4)


def test_functions_of_arrays_are_called_with_many_points() -> None:
    calls: list[int] = []

    def counted(x, y):
        calls.append(len(x))
        return 2.0 * np.exp(-((x - y) ** 2))

    u = fredholm.Cube(counted, lambda x: 1.0 + x)
    calls.clear()
    asked = {"at": 0.3, "mean": True, "target_error": 1e-7}
    result = u.solve(**asked)
    text = fredholm.Cube("2 * exp(-(x - y)^2)", "1 + x").solve(**asked)
    np.testing.assert_allclose(result.values, text.values, rtol=1e-10)
    # A call takes some microseconds more than its points do.
    assert sum(calls) > 100 * len(calls), (sum(calls), len(calls))
    calls.clear()
    field = u.field(101)
    assert sum(calls) > 100 * len(calls), (sum(calls), len(calls))
    assert field.values[0] == pytest.approx(u.solve(at=0.0, target_error=1e-6).values[0], abs=1e-4)


def test_a_jump_of_a_function_of_arrays_is_found() -> None:
    calls: list[int] = []

    def source(x):
        calls.append(len(x))
        return np.where(x < 0.37, 3.0, 1.0)

    u = fredholm.Cube(lambda x, y: 0.1 * np.where(y < 0.6, x, 1.0), source)
    formula = fredholm.Cube("0.1 * (y < 0.6 ? x : 1)", "x < 0.37 ? 3 : 1").solve(mean=True, target_error=1e-8)
    assert u.solve(mean=True, target_error=1e-8)["mean"].value == pytest.approx(formula["mean"].value, abs=1e-6)
    assert sum(calls) > 10 * len(calls), (sum(calls), len(calls))


def test_domains_edges_and_parameters() -> None:
    # u = 1 + 2 [x < 0.001] needs to be told where.
    for kernel, source in (("0", "x < 0.001 ? 3 : 1"), (0.0, lambda x: np.where(x < 0.001, 3.0, 1.0))):
        u = fredholm.Cube(kernel, source, edges=[0.001])
        assert u.solve(mean=True)["mean"].value == pytest.approx(1.002, abs=1e-9)
    # u = a x + b: u(x) = x/2 on [0, 2k] with k = 1/2.
    u = fredholm.Cube("a", "x/2 - a/4", domain=[0, "2*k"], parameters={"k": 0.5, "a": "k/2"})
    assert u.solve(at=0.8, target_error=1e-7).values == pytest.approx([0.4], abs=1e-6)
    # u = e^-x 4/3 on [0, inf).
    for kernel, source in (("0.5 * exp(-x - y)", "exp(-x)"), (lambda x, y: 0.5 * np.exp(-x - y), lambda x: np.exp(-x))):
        u = fredholm.Cube(kernel, source, domain=(0, math.inf))
        assert u.solve(at=0.0, target_error=1e-6).values == pytest.approx([4 / 3], abs=1e-5)


def test_a_complex_equation_is_a_system() -> None:
    # u = x + 2i ∫ u: the mean m is 1/2 + 2i m, so that m = (1 + 2i)/10.
    u = fredholm.System([["0", "-2"], ["2", "0"]], ["x", "0"])
    result = u.solve(at=0.25, mean=True, target_error=1e-7)
    assert result.names == ["mean of u1", "mean of u2", "u1(0.25)", "u2(0.25)"]
    assert result.values == pytest.approx([0.1, 0.2, 0.25 - 0.4, 0.2], abs=1e-6)
    assert u.solve(at=0.25, component=2, target_error=1e-6).names == ["u2(0.25)"]
    assert u.solve(target_error=1e-5).names == ["mean of u1", "mean of u2"]

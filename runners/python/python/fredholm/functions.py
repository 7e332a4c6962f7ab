"""What a kernel or a source may be besides a formula."""

from __future__ import annotations

import ctypes
import time
import warnings
from typing import Any, Callable, Optional, Union

import numpy as np
import numpy.typing as npt

from . import _fredholm
from .errors import InputError, ScalarFunctionWarning, complex_error

__all__ = ["Function", "compiled_functions"]

Array = npt.NDArray[np.float64]
#: A formula, a number, a compiled function (numba's ``cfunc``, of ctypes, an address) or a Python function.
Function = Union[str, float, int, Callable[..., Any]]

#: What all functions of ctypes are instances of.
_OF_CTYPES: Any = ctypes.CFUNCTYPE(None).__mro__[1]
#: Points of a trial. More than there are axes, so that no row is taken for a point.
TRIAL = 7
#: Seconds that a state of a walk takes with a formula.
FORMULA = 30e-9


def _address(function: Any, arguments: int, name: str) -> Optional[int]:
    """The address of a compiled function, if it is one."""
    wanted = f"double {name}({', '.join(['const double *'] * arguments)})"
    if isinstance(function, _OF_CTYPES):
        types = function.argtypes
        double = ctypes.POINTER(ctypes.c_double)
        good = [t in (double, ctypes.c_void_p) for t in types] if types is not None else []
        if function.restype is not ctypes.c_double or good != [True] * arguments:
            raise InputError(f"{name}: the function of ctypes must have restype and argtypes of {wanted}")
        return ctypes.cast(function, ctypes.c_void_p).value
    address = getattr(function, "address", None)
    if isinstance(address, int) and hasattr(function, "native_name"):
        signature = str(getattr(function, "_sig", "")).replace(" ", "")
        pointers = ",".join(["float64*"] * arguments)
        if signature and signature.replace(",)", ")") != f"({pointers})->float64":
            raise InputError(
                f"{name}: numba's cfunc has the signature {signature}: it must be "
                f"float64({', '.join(['CPointer(float64)'] * arguments)})"
            )
        return address
    return None


def _points(count: int, domain: Array, number: int) -> Array:
    """Points of the domain: numbers in one dimension, rows of coordinates in more."""
    step = np.array([0.618034, 0.754878, 0.819173, 0.856675, 0.881271, 0.898654])[: len(domain)]
    unit = (0.5 + (np.arange(count)[:, None] + 1 + 10 * number) * step) % 1.0
    points: Array = np.empty(unit.shape)
    for axis, (low, high) in enumerate(domain):
        t = unit[:, axis]
        if np.isfinite(low) and np.isfinite(high):
            points[:, axis] = low + t * (high - low)
        elif np.isfinite(low):
            points[:, axis] = low + t / (1 - t)
        elif np.isfinite(high):
            points[:, axis] = high - t / (1 - t)
        else:
            points[:, axis] = np.log(t / (1 - t))
    return points[:, 0] if len(domain) == 1 else points


def _is_in_blocks(function: Callable[..., Any], blocks: list[Array], name: str) -> bool:
    """Whether a function takes arrays of points: whether the value at a point does not depend on the others."""
    try:
        found = [function(*blocks)] + [function(*[block[i : i + 1] for block in blocks]) for i in range(TRIAL)]
        is_complex = any(np.iscomplexobj(value) for value in found)
        whole, *parts = [np.asarray(value if is_complex else np.asarray(value, dtype=float)) for value in found]
    except Exception:
        return False
    if is_complex:
        raise complex_error(name)
    if whole.shape != (TRIAL,) or any(part.shape != (1,) for part in parts):
        return False
    return bool(np.allclose(whole, np.concatenate(parts), rtol=1e-12, atol=0.0, equal_nan=True))


def _kind(
    function: Any, arguments: int, name: str, domain: Array, vectorized: Optional[bool]
) -> tuple[str, Any]:
    if isinstance(function, bool) or isinstance(function, str):
        raise InputError(f"{name} = {function!r}: it must be a number or a function where the other one is a function")
    if isinstance(function, (complex, np.complexfloating)):
        raise complex_error(name)
    if isinstance(function, (int, float, np.floating, np.integer)):
        if not np.isfinite(function):
            raise InputError(f"{name} = {function!r}: it must be finite")
        return "constant", float(function)
    address = _address(function, arguments, name)
    if address is not None:
        return "compiled", address
    if not callable(function):
        raise InputError(f"{name} = {function!r}: it must be a formula, a number or a function")
    if vectorized is None:
        blocks = [_points(TRIAL, domain, i) for i in range(arguments)]
        vectorized = _is_in_blocks(function, blocks, name)
    if vectorized:
        return "blocks", function
    _warn(function, [_points(1, domain, i)[0] for i in range(arguments)], name)
    return "scalar", function


def _warn(function: Callable[..., Any], point: list[Any], name: str) -> None:
    """Says once what a function costs that is called for one point at a time. What it raises is raised later."""
    try:
        begin = time.perf_counter()
        values = [function(*point) for _ in range(20)]
        seconds = (time.perf_counter() - begin) / 20
    except Exception:
        return
    if np.iscomplexobj(values[0]):
        raise complex_error(name)
    warnings.warn(
        f"{name} is called for one point at a time, on one thread: about {max(1.0, seconds / FORMULA):.0f} times as "
        "long as a formula. A function of arrays of points, of numba.cfunc or a formula is faster",
        ScalarFunctionWarning,
        stacklevel=5,
    )


def compiled_functions(
    kernel: Any, source: Any, domain: Array, vectorized: Optional[bool]
) -> _fredholm.Functions:
    """The kernel and the source of a cube, each of any kind but a formula."""
    return _fredholm.Functions(
        len(domain),
        _kind(kernel, 2, "kernel", domain, vectorized),
        _kind(source, 1, "source", domain, vectorized),
    )

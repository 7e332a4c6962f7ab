"""Fredholm integral equations of the second kind, with an error bar.

>>> import fredholm
>>> u = fredholm.Cube("0.5 * exp(-(x - y)^2)", "x")
>>> result = u.solve(at=0.3, mean=True, target_error=1e-7)
>>> bool(abs(result["mean"].value - 0.8794682) < 1e-6)
True

The equation is u(x) = ∫ K(x, y) u(y) dy + F(x). Random walks estimate u at a point, its mean, or any other functional,
without a bias; a Galerkin solution takes most of their noise away (S. Heinrich, 1995).
"""

from __future__ import annotations

from .errors import (
    ConvergenceError,
    FredholmError,
    InfiniteVarianceError,
    InputError,
    Interrupted,
    NotReachedError,
    ReportWarning,
    ScalarFunctionWarning,
    TooLargeError,
    TooLongError,
)
from .problems import Channels, Circle, Cube, Problem, Room, Sphere, System, Tube, factors, load
from .result import Certificate, Diagnosis, Factors, Field, Fit, Prediction, Result, Sensitivities, Sweep, Times, Value
from .scene import FaceResult, Scene

__version__ = "0.1.0"

__all__ = [
    "Certificate",
    "Channels",
    "Circle",
    "ConvergenceError",
    "Cube",
    "Diagnosis",
    "FaceResult",
    "Factors",
    "Field",
    "Fit",
    "FredholmError",
    "InfiniteVarianceError",
    "InputError",
    "Interrupted",
    "NotReachedError",
    "Prediction",
    "Problem",
    "ReportWarning",
    "Result",
    "Room",
    "ScalarFunctionWarning",
    "Scene",
    "Sensitivities",
    "Sphere",
    "Sweep",
    "System",
    "Times",
    "TooLargeError",
    "TooLongError",
    "Tube",
    "Value",
    "factors",
    "load",
]

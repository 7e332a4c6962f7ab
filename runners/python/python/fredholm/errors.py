"""Exceptions of fredholm. All but :class:`Interrupted` are a :class:`FredholmError`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Optional, Union

if TYPE_CHECKING:
    from .result import Result
    from .scene import FaceResult

__all__ = [
    "ConvergenceError",
    "FredholmError",
    "InfiniteVarianceError",
    "InputError",
    "Interrupted",
    "NotReachedError",
    "ReportWarning",
    "ScalarFunctionWarning",
    "TooLargeError",
    "TooLongError",
]


class FredholmError(Exception):
    """Any error of fredholm."""


class InputError(FredholmError, ValueError):
    """The problem, or what is asked of it, is not as it must be; the text says what, where, and what would be right."""


def complex_error(name: str) -> InputError:
    """The error of a function whose values are complex numbers."""
    return InputError(
        f"{name} has complex values: a complex equation is a system of two real ones, for the real and the imaginary part of u; "
        "fredholm.System(kernels=[[Re K, -Im K], [Im K, Re K]], sources=[Re F, Im F]) takes them as formulas"
    )


class ConvergenceError(FredholmError, ArithmeticError):
    """The Galerkin system has no solution that serves: the equation is no contraction."""


class InfiniteVarianceError(FredholmError, ArithmeticError):
    """Walks would have an infinite variance or no mean, so that their error bars would mean nothing."""


class TooLargeError(FredholmError, MemoryError):
    """There is too little memory; nothing was begun."""


class TooLongError(FredholmError):
    """It would take longer than an hour, or more than is reasonable; nothing was begun."""


class NotReachedError(FredholmError):
    """The walks ended before the error was reached that was asked for.

    Attributes
    ----------
    result : Result or FaceResult
        The results so far.
    """

    def __init__(self, message: str, result: Union[Result, FaceResult]) -> None:
        super().__init__(message)
        self.result = result


class Interrupted(KeyboardInterrupt):
    """Ctrl-C was pressed.

    Attributes
    ----------
    result : Result or None
        The results so far, if walks had begun.
    """

    def __init__(self, message: str, result: Optional[Result]) -> None:
        super().__init__(message)
        self.result = result


class ReportWarning(UserWarning):
    """A remark on a result: error bars that may mean little, for instance."""


class ScalarFunctionWarning(UserWarning):
    """A function is called for one point at a time, which is slow."""

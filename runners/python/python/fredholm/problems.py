"""Equations, and what can be asked of them."""

from __future__ import annotations

import json
import os
import sys
import time
import warnings
from typing import Any, Callable, Mapping, Optional, Sequence, Union, cast

import numpy as np

from . import _fredholm
from .errors import InputError, Interrupted, NotReachedError, ReportWarning
from .functions import Function, compiled_functions
from .result import Diagnosis, Factors, Field, Prediction, Result, Sweep

__all__ = ["Circle", "Cube", "Problem", "Room", "Sphere", "factors", "load"]

#: What is asked for at one place: coordinates, or a surface of a room with the share of its length.
Place = Union[float, Sequence[float], np.ndarray, Mapping[str, Any]]
#: One place, several ones, or places by their names.
Places = Union[Place, Sequence[Place], Mapping[str, Place]]
#: One word or interval, several ones, or such by their names.
Parts = Union[str, Sequence[Any], Mapping[str, Any]]
#: A formula or a function of a point, several ones, or such by their names.
Weights = Union[str, Callable[..., float], Sequence[Any], Mapping[str, Any]]
#: True, False, or a function of the walks so far and those that are expected (0: not known).
Shown = Union[bool, Callable[[int, int], None]]

#: Seconds before progress is shown.
PATIENCE = 2.0


def _plain(value: Any) -> Any:
    """A value with arrays as lists and NumPy's numbers as Python's, for JSON."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items() if item is not None}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    return value


def _json(value: Any) -> str:
    try:
        return json.dumps(_plain(value), allow_nan=False)
    except ValueError:
        raise InputError("a number is not finite: NaN and infinity have no meaning here") from None
    except TypeError as error:
        raise InputError(f"{error}: give numbers, texts, lists and dicts") from None


def _text(x: Any) -> str:
    return ", ".join(format(float(v), ".10g") for v in np.atleast_1d(np.asarray(x, dtype=float)))


class _Targets:
    """What is asked for, as targets of a problem file, and weights that are functions."""

    def __init__(self) -> None:
        self.tables: list[dict[str, Any]] = []
        self.weights: list[tuple[str, Callable[..., float]]] = []

    def add(self, name: str, **what: Any) -> None:
        self.tables.append({"name": name, **what})

    def at(self, places: Places, dimension: int) -> None:
        if isinstance(places, Mapping) and "surface" not in places:
            for name, place in places.items():
                self.add(str(name), at=_place(place, dimension))
            return
        for place in _several(places, dimension):
            is_wall = isinstance(place, Mapping)
            text = f"{place['surface']}, {_text(place.get('t', 0.5))}" if is_wall else _text(place)
            self.add(f"u({text})", at=_place(place, dimension))

    def over(self, parts: Parts) -> None:
        if isinstance(parts, Mapping):
            for name, part in parts.items():
                self.add(str(name), over=part)
        elif isinstance(parts, str):
            self.add(parts, over=parts)
        elif len(parts) == 2 and all(isinstance(end, (int, float)) for end in parts):
            self.add(f"mean of {_text(parts)}", over=list(parts))
        else:
            for part in parts:
                self.over(part if isinstance(part, str) else tuple(part))

    def weight(self, weights: Weights) -> None:
        named: list[tuple[str, Any]]
        if isinstance(weights, Mapping):
            named = list(weights.items())
        elif isinstance(weights, str) or callable(weights):
            named = [(weights if isinstance(weights, str) else "weight", weights)]
        else:
            named = [(w if isinstance(w, str) else f"weight {i}", w) for i, w in enumerate(weights)]
        weight: Any
        for name, weight in named:
            if isinstance(weight, str):
                self.add(str(name), weight=weight)
            elif callable(weight):
                self.weights.append((str(name), cast("Callable[..., float]", weight)))
            else:
                raise InputError(f"weight = {weight!r}: it must be a formula or a function")


def _several(places: Any, dimension: int) -> list[Any]:
    """The places in a list of them, or one."""
    if isinstance(places, Mapping):
        return [places]
    if isinstance(places, Sequence) and places and isinstance(places[0], Mapping):
        return list(places)
    try:
        array = np.asarray(places, dtype=float)
    except (TypeError, ValueError):
        raise InputError(f"at = {places!r}: it must be a point, a list of points, or a dict of points") from None
    if array.ndim == 0 or (array.ndim == 1 and dimension > 1):
        return [array]
    if array.ndim == 1 or (array.ndim == 2 and (dimension > 1 or array.shape[1] == 1)):
        return list(array)
    raise InputError(f"at has the shape {array.shape}: it must be a point or a row of points of {dimension} coordinates")


def _place(place: Any, dimension: int) -> Any:
    """A place as a problem file has it."""
    if isinstance(place, Mapping):
        return dict(place)
    try:
        x = np.atleast_1d(np.asarray(place, dtype=float))
    except (TypeError, ValueError):
        raise InputError(f"at = {place!r}: it must be a point") from None
    if x.shape != (dimension,):
        raise InputError(f"at = {x.tolist()}: it must have {dimension} coordinate{'s' if dimension > 1 else ''}")
    return float(x[0]) if dimension == 1 else x.tolist()


class _Shows:
    """Progress on stderr, for whoever waits longer than two seconds."""

    def __init__(self) -> None:
        self.begin = time.monotonic()
        self.width = 0

    def __call__(self, walks: int, expected: int) -> None:
        seconds = time.monotonic() - self.begin
        if seconds < PATIENCE:
            return
        of = f" of about {expected:,}" if expected else ""
        text = f"fredholm: {walks:,}{of} walks, {seconds:.0f} s" if walks else f"fredholm: set-up, {seconds:.0f} s"
        self.width = max(self.width, len(text))
        print(f"\r{text.ljust(self.width)}", end="", file=sys.stderr, flush=True)

    def end(self) -> None:
        if self.width:
            print(f"\r{' ' * self.width}\r", end="", file=sys.stderr, flush=True)


class Problem:
    """An equation u(x) = ∫ K(x, y) u(y) dy + F(x).

    Made by :class:`Cube`, :class:`Circle`, :class:`Room`, :class:`Sphere` and :func:`load`.
    """

    def __init__(
        self,
        name: str,
        text: str,
        dimension: int,
        functions: Optional[_fredholm.Functions] = None,
        drawing: Optional[dict[str, Any]] = None,
    ) -> None:
        self._name = name
        self._text = text
        self._dimension = dimension
        self._functions = functions
        self._drawing = drawing

    @property
    def text(self) -> str:
        """The problem file that says the same, for the program ``fredholm``."""
        return self._text

    def __repr__(self) -> str:
        return f"<{self._name}>\n{self._text.rstrip()}"

    def check(self) -> list[str]:
        """Checks the problem; remarks on what is allowed and hardly meant."""
        task = self._task(_Targets())
        return task.check({})[2]

    def _task(self, targets: _Targets) -> _fredholm.Task:
        asked = _json({"target": targets.tables}) if targets.tables else None
        if not targets.tables and targets.weights:
            asked = ""
        if asked is None and "target" not in self._text:
            asked = _json({"target": [{"name": "mean", "over": "all"}]})
        elif asked == "":
            asked = "{}"
        return _fredholm.Task(self._name, self._text, asked, self._functions, targets.weights)

    def _targets(self, at: Any, mean: bool, over: Any, weight: Any, grid: Any, target: Any) -> _Targets:
        asked = _Targets()
        if mean:
            asked.add("mean", over="all")
        if over is not None:
            asked.over(over)
        if weight is not None:
            asked.weight(weight)
        if at is not None:
            asked.at(at, self._dimension)
        if grid is not None:
            if isinstance(grid, Mapping):
                for surface, points in grid.items():
                    asked.add(str(surface), grid=points, surface=str(surface))
            else:
                asked.add("u", grid=grid)
        if target is not None:
            for table in [target] if isinstance(target, Mapping) else target:
                asked.tables.append(dict(table))
        return asked

    def solve(
        self,
        *,
        at: Optional[Places] = None,
        mean: bool = False,
        over: Optional[Parts] = None,
        weight: Optional[Weights] = None,
        grid: Optional[Any] = None,
        target: Optional[Any] = None,
        target_error: Optional[float] = None,
        relative: bool = False,
        walks: Optional[int] = None,
        cells: Optional[int] = None,
        degree: Optional[int] = None,
        pairs: Optional[str] = None,
        lift: Optional[int] = None,
        absorption: Optional[float] = None,
        estimator: Optional[str] = None,
        form: Optional[str] = None,
        sequence: Optional[str] = None,
        forced_steps: Optional[int] = None,
        last_step: Optional[bool] = None,
        adjoint: Optional[bool] = None,
        global_: Optional[bool] = None,
        scalar: Optional[str] = None,
        allow_infinite_variance: bool = False,
        seed: Optional[int] = None,
        batch: Optional[int] = None,
        threads: Optional[int] = None,
        time_limit: Optional[float] = None,
        progress: Shown = True,
    ) -> Result:
        """Estimates functionals of u, with standard errors.

        Settings that are not given are chosen if ``target_error`` is given, and have a default otherwise. The same problem,
        settings and seed give the same bits on every machine and for any number of threads.

        Parameters
        ----------
        at : point, list of points or dict of points
            Where u is wanted: an angle of a circle, coordinates of a cube or the sphere, ``{"surface": "floor", "t": 0.3}``
            or the two coordinates of a point in the air of a room.
        mean : bool
            Whether the mean of u over the whole space is wanted. It is if nothing else is asked for.
        over : str, interval or list
            Parts over which means are wanted: surfaces of a room by their names, intervals of angles of a circle.
        weight : str, callable, list or dict
            Formulas or functions w of a point: ∫ w u is wanted.
        grid : int, list of int, or dict of int
            Equally spaced points; of each axis of a cube, or of each surface of a room by its name.
        target : dict or list of dict
            Targets as problem files have them.
        target_error : float
            The largest standard error, in the unit of u; with ``relative``, as a share of each estimate.
        relative : bool
            Whether ``target_error`` is relative.
        walks : int
            The number of walks of a target; with ``target_error``, the most.
        cells, degree : int
            Cells (of a cube, per axis) and degree of the Galerkin solution.
        pairs, form, sequence, scalar : str
            Pairs of cells ("default", "paper", "pointwise", "rays"), "residual" or "product", "random" or "sobol", "f64" or
            "f32".
        lift : int
            The degree to which the Galerkin solution is lifted; 0 for none.
        absorption : float
            The probability that a walk is absorbed in a state; walks end by roulette if it is not given.
        estimator : str
            What walks with a constant absorption score: "absorption" or "collision".
        forced_steps : int
            The number of first states in which walks are not absorbed.
        last_step, adjoint, global_ : bool
            Whether the last step leads to the light, whether walks go from the sources to the receivers, and whether one set of
            walks answers all targets.
        allow_infinite_variance : bool
            Whether walks of infinite variance are made, whose error bars mean nothing.
        seed, batch : int
            The seed of all draws, and the walks of a batch.
        threads : int
            Threads; all cores if it is not given. Results do not depend on it.
        time_limit : float
            Seconds after which walks end.
        progress : bool or callable
            Whether progress is shown on stderr after two seconds, or a function of the walks so far and those expected.

        Returns
        -------
        Result

        Raises
        ------
        InputError
            Something is not as it must be; the text says what and where.
        NotReachedError
            The walks ended before ``target_error`` was reached; the exception has the result so far.
        Interrupted
            Ctrl-C; the exception has the result so far.

        Examples
        --------
        >>> import fredholm
        >>> u = fredholm.Cube("0.5 * x * y", "x")  # the solution is 6x/5
        >>> result = u.solve(at=[0.25, 0.5], target_error=1e-6)
        >>> [round(float(x), 5) for x in result.values]
        [0.3, 0.6]
        """
        options = {
            "target_error": target_error,
            "relative": relative,
            "walks": walks,
            "cells": cells,
            "degree": degree,
            "pairs": pairs,
            "lift": lift,
            "absorption": absorption,
            "estimator": estimator,
            "form": form,
            "sequence": sequence,
            "forced_steps": forced_steps,
            "last_step": last_step,
            "adjoint": adjoint,
            "global_": global_,
            "scalar": scalar,
            "allow_infinite_variance": allow_infinite_variance or None,
            "seed": seed,
            "batch": batch,
            "threads": threads,
            "time_limit": time_limit,
        }
        if not relative:
            options["relative"] = None
        task = self._task(self._targets(at, mean, over, weight, grid, target))
        shows = _Shows() if progress is True else None
        call = shows if shows is not None else (progress if callable(progress) else None)
        try:
            outcome, report, table, remarks, interrupt = task.solve(options, call)
        finally:
            if shows is not None:
                shows.end()
        result = Result(json.loads(report), table, self._drawing) if report else None
        for remark in remarks:
            warnings.warn(remark, ReportWarning, stacklevel=2)
        if interrupt is not None and not isinstance(interrupt, KeyboardInterrupt):
            raise interrupt
        if outcome == "cancelled" or result is None:
            text = "interrupted; the exception has partial results" if result else "interrupted before the walks"
            raise Interrupted(text, result) from interrupt
        if outcome == "not reached":
            why = result.to_dict().get("reason")
            text = f"the error {target_error} was not reached: {why or 'the walks or the time ended before'}"
            raise NotReachedError(text, result)
        return result

    def predict(self, target_error: float, *, at: Optional[Places] = None, mean: bool = False, **options: Any) -> Optional[Prediction]:
        """The settings that would be chosen for an error, and their time, without the walks.

        Parameters
        ----------
        target_error : float
            The standard error that would be asked for.
        at, mean
            What would be asked for, as in :meth:`solve`.
        **options
            Settings that are given, as in :meth:`solve`.

        Returns
        -------
        Prediction or None
            None if ``cells`` is given, so that nothing is chosen.

        Examples
        --------
        >>> import fredholm
        >>> prediction = fredholm.Cube("0.5 * exp(-(x - y)^2)", "x").predict(1e-8)
        >>> prediction.seconds < 60
        True
        """
        targets, settings = self._split(at, mean, options)
        return Prediction.of(self._task(targets).predict({**settings, "target_error": target_error}))

    def diagnose(self, *, at: Optional[Places] = None, mean: bool = False, **options: Any) -> Diagnosis:
        """The predicted variance of every target, where it comes from, and advice.

        Examples
        --------
        >>> import fredholm
        >>> diagnosis = fredholm.Cube("0.5 * x * y", "x").diagnose(mean=True, cells=10)
        >>> 0 < diagnosis.std_devs["mean"] < 0.1
        True
        """
        targets, settings = self._split(at, mean, options)
        return Diagnosis(*self._task(targets).diagnose(settings))

    def sweep(self, cells: Sequence[int], *, walks: int = 100_000, **options: Any) -> Sweep:
        """How fast the standard deviation of the mean falls with the number of cells.

        Examples
        --------
        >>> import fredholm
        >>> sweep = fredholm.Cube("0.5 * exp(-(x - y)^2)", "x").sweep([5, 10, 20], walks=10_000)
        >>> bool(sweep.std_devs[2] < sweep.std_devs[0] / 2)
        True
        """
        targets, settings = self._split(None, True, options)
        return Sweep(*self._task(targets).sweep([int(n) for n in cells], int(walks), settings))

    def field(self, grid: Optional[int] = None, *, at: Optional[Any] = None, **options: Any) -> Field:
        """The global estimate: u at many points from one set of walks, with a band that holds at all of them together.

        Functions of arrays are called for one point at a time here, which is slow.

        Parameters
        ----------
        grid : int
            Equally spaced points; of a cube, of every axis.
        at : list of points
            Points in place of a grid.
        **options
            Settings as in :meth:`solve`; with ``target_error``, walks are made until no standard error is above it.

        Examples
        --------
        >>> import fredholm
        >>> field = fredholm.Cube("0.5 * x * y", "x").field(11, cells=4, walks=10_000)
        >>> bool(abs(field.values - 1.2 * field.points[:, 0]).max() < field.bands.max())
        True
        """
        if (grid is None) == (at is None):
            raise InputError("field: give a number of points or the points")
        points = [] if at is None else [[float(v) for v in np.atleast_1d(x)] for x in _several(at, self._dimension)]
        targets, settings = self._split(None, True, options)
        found = self._task(targets).field(grid, points, settings)
        numbers = [[np.nan if x is None else x for x in list_] for list_ in (found.std_errors, found.bands)]
        return Field(
            np.array(found.points, dtype=float).reshape(len(found.estimates), -1),
            np.array(found.estimates),
            np.array(numbers[0], dtype=float),
            np.array(numbers[1], dtype=float),
            np.array(found.iterates),
            json.loads(found.summary),
        )

    def factors(self) -> Factors:
        """Form factors between the surfaces of a room."""
        names, rows = self._task(_Targets()).factors({})
        return Factors(names, np.array(rows).reshape(len(names), len(names)))

    def _split(self, at: Any, mean: bool, options: Mapping[str, Any]) -> tuple[_Targets, dict[str, Any]]:
        """What is asked for, and the settings among some options."""
        asked = {key: options.get(key) for key in ("over", "weight", "grid", "target")}
        settings = {key: value for key, value in options.items() if key not in asked}
        unknown = set(settings) - _SETTINGS
        if unknown:
            raise InputError(f"{', '.join(sorted(unknown))}: unknown; settings are {', '.join(sorted(_SETTINGS))}")
        if not settings.get("relative"):
            settings.pop("relative", None)
        return self._targets(at, mean, **asked), settings


_SETTINGS = {
    "absorption",
    "adjoint",
    "allow_infinite_variance",
    "batch",
    "cells",
    "degree",
    "estimator",
    "forced_steps",
    "form",
    "global_",
    "last_step",
    "lift",
    "pairs",
    "relative",
    "scalar",
    "seed",
    "sequence",
    "target_error",
    "threads",
    "time_limit",
    "walks",
}


class Cube(Problem):
    """An equation on [0, 1]^d, or on another product of intervals.

    Parameters
    ----------
    kernel, source : str, float or callable
        K(x, y) and F(x). Formulas in x and y, or x1 … xd and y1 … yd, are evaluated by all threads, with the bits of the
        program. So are compiled functions: numba's ``cfunc`` of the signature
        ``float64(CPointer(float64), CPointer(float64))``, or a function of ctypes; they are called with pointers to the d
        coordinates and must be safe on any thread. A Python function is called with arrays: of n numbers in one dimension,
        of shape (n, d) in more, for which it returns n values. If it takes one point only, it works and is slow. A list of d
        formulas in x and y is a product kernel.
    dimension : int
        d, from 1 to 6.
    domain : list of pairs
        The interval of every axis, whose ends may be infinite; [0, 1] if it is not given.
    solution : str
        A formula of u, where it is known: results are compared with it.
    vectorized : bool
        Whether Python functions take arrays; they are tried if it is not given.

    Examples
    --------
    >>> import fredholm, numpy as np
    >>> u = fredholm.Cube(lambda x, y: 0.5 * np.exp(-((x - y) ** 2).sum(-1)), lambda x: 1 + x[:, 0], dimension=3)
    >>> bool(abs(u.solve(mean=True, target_error=1e-3)["mean"].value - 2.209) < 5e-3)
    True
    """

    def __init__(
        self,
        kernel: Union[Function, Sequence[str]],
        source: Function,
        *,
        dimension: int = 1,
        domain: Optional[Sequence[Sequence[float]]] = None,
        solution: Optional[str] = None,
        vectorized: Optional[bool] = None,
    ) -> None:
        is_text = isinstance(kernel, (str, list, tuple))
        if isinstance(kernel, (int, float)) and isinstance(source, (str, int, float)):
            kernel, is_text = repr(float(kernel)), True
        if is_text and isinstance(source, (int, float)) and not isinstance(source, bool):
            source = repr(float(source))
        problem: dict[str, Any] = {"kind": "cube", "dimension": dimension}
        if domain is not None:
            domain = [[float(end) for end in interval] for interval in domain]
            problem["domain"] = domain
        functions = None
        if is_text:
            if not isinstance(source, str):
                raise InputError("the kernel is a formula and the source a function: both must be formulas, or both functions")
            problem["kernel" if isinstance(kernel, str) else "kernel_factors"] = kernel
            problem["source"] = source
            if solution is not None:
                problem["solution"] = solution
        else:
            if solution is not None:
                raise InputError("`solution` is a formula, which goes with a kernel that is a formula")
            problem.update(kernel="0", source="0")
        text = _fredholm.Task.text_of(_json({"problem": problem}))
        # What is wrong with the dimension and the domain is said first.
        _fredholm.Task("<Cube>", text, _json({"target": [{"name": "mean", "over": "all"}]})).check({})
        if not is_text:
            box = np.array(domain if domain is not None else [[0.0, 1.0]] * dimension)
            functions = compiled_functions(kernel, source, box, vectorized)
        super().__init__("<Cube>", text, dimension, functions)


class Circle(Problem):
    """Light in a circle: u(x) = ρ(x) ∫ |sin((x − y)/2)|/4 u(y) dy + F(x).

    Parameters
    ----------
    reflectance : float or list of float
        ρ, one value or one of each of several equal arcs.
    emission : float, list of float, or dict
        F: a value, one of each of several equal arcs, or as problem files have it.

    Examples
    --------
    >>> import fredholm
    >>> u = fredholm.Circle(reflectance=[0.3, 0.7], emission=[1, 0, 0, 0])
    >>> bool(u.solve(at=3.0, target_error=1e-4).std_errors[0] <= 1e-4)
    True
    """

    def __init__(self, reflectance: Union[float, Sequence[float]], emission: Any, **more: Any) -> None:
        several = [reflectance] if isinstance(reflectance, (int, float)) else reflectance
        light = [float(emission)] if isinstance(emission, (int, float)) else emission
        problem = {"kind": "circle", "reflectance": several, "emission": light, **more}
        super().__init__("<Circle>", _fredholm.Task.text_of(_json({"problem": problem})), 1)


class Room(Problem):
    """Light or heat in a room of walls in the plane.

    Parameters
    ----------
    surfaces : list of dict
        Surfaces, each with ``name``, ``points`` (metres, the room on the left) and ``reflectance`` and ``emission``, or
        ``emissivity`` and ``temperature``, as problem files have them.
    **more
        Whatever else problem files say of a room.

    Examples
    --------
    >>> import fredholm
    >>> u = fredholm.Room([
    ...     {"name": "floor", "points": [[0, 0], [1, 0]], "reflectance": 0.5, "emission": 1.0},
    ...     {"name": "rest", "points": [[1, 0], [1, 1], [0, 1], [0, 0]], "reflectance": 0.5, "emission": 0.0},
    ... ])
    >>> result = u.solve(over=["floor", "rest"], walks=50_000)
    >>> bool(result["floor"].value > result["rest"].value)
    True
    """

    def __init__(self, surfaces: Sequence[Mapping[str, Any]], **more: Any) -> None:
        problem = {"kind": "room", **more, "surface": list(surfaces)}
        text = _fredholm.Task.text_of(_json({"problem": problem}))
        super().__init__("<Room>", text, 2, drawing={"surfaces": [dict(s) for s in surfaces]})


class Sphere(Problem):
    """Light that is scattered on a sphere, by the law of Henyey and Greenstein.

    Parameters
    ----------
    albedo : float
        The share of light that is scattered and not absorbed.
    emission : list of float
        F: a constant and the three coefficients of the coordinates.
    asymmetry : float
        The mean cosine of the angle of scattering.
    **more
        Whatever else problem files say of a sphere.

    Examples
    --------
    >>> import fredholm
    >>> u = fredholm.Sphere(albedo=0.6, asymmetry=0.3, emission=[1.0, 0.5, -0.7, 0.4])
    >>> bool(abs(u.solve(mean=True, walks=20_000)["mean"].value - 2.5) < 0.01)
    True
    """

    def __init__(
        self, albedo: float, emission: Sequence[float], *, asymmetry: Optional[float] = None, **more: Any
    ) -> None:
        problem = {"kind": "sphere", "albedo": albedo, "asymmetry": asymmetry, "emission": emission, **more}
        super().__init__("<Sphere>", _fredholm.Task.text_of(_json({"problem": problem})), 2)


def load(path: Union[str, os.PathLike[str]]) -> Problem:
    """The problem of a file, with the targets and settings that stand in it.

    Targets and settings that are given to :meth:`Problem.solve` are in the place of the file's.

    Parameters
    ----------
    path : str or path
        A problem file of the program ``fredholm``.

    Returns
    -------
    Problem
    """
    name = os.fspath(path)
    text = _fredholm.Task.read(name)
    kind, dimension, _ = _fredholm.Task(name, text).check({})
    if dimension is None:
        dimension = 1 if kind == "circle" else 2
    return Problem(name, text, dimension)


def factors(path: Union[str, os.PathLike[str]], *, error: float = 1e-9, open: bool = False) -> Factors:
    """Form factors between the surfaces of a scene in space (OBJ, STL, PLY, .vs3, a scene file) or of a room.

    Parameters
    ----------
    path : str or path
        The file.
    error : float
        The error to which form factors behind obstacles are computed.
    open : bool
        Whether the scene may be open.

    Returns
    -------
    Factors
    """
    name = os.fspath(path)
    if not _fredholm.is_scene(name):
        return load(name).factors()
    names, areas, rows, largest = _fredholm.scene_factors(name, error, open)
    return Factors(names, np.array(rows).reshape(len(names), len(names)), np.array(areas), largest)

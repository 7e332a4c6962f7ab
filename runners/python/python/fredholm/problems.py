"""Equations, and what can be asked of them."""

from __future__ import annotations

import json
import os
import re
import sys
import time
import warnings
from typing import Any, Callable, Mapping, Optional, Sequence, Union, cast

import numpy as np

from . import _fredholm
from .errors import InputError, Interrupted, NotReachedError, ReportWarning, complex_error
from .functions import Function, compiled_functions
from .result import Certificate, Diagnosis, Factors, Field, Fit, Prediction, Result, Sensitivities, Sweep, Times

__all__ = ["Circle", "Cube", "Problem", "Room", "Sphere", "System", "factors", "load"]

#: What is asked for at one place: coordinates, or a surface of a room with the share of its length.
Place = Union[float, Sequence[float], np.ndarray, Mapping[str, Any]]
#: One place, several ones, or places by their names.
Places = Union[Place, Sequence[Place], Mapping[str, Place]]
#: One word or interval, several ones, or such by their names.
Parts = Union[str, Sequence[Any], Mapping[str, Any]]
#: A formula or a function of a point, several ones, or such by their names.
Weights = Union[str, Callable[..., float], Sequence[Any], Mapping[str, Any]]
#: True, False, None (where stderr is a terminal), or a function of the walks so far and those that are expected (0: not known).
Shown = Union[bool, None, Callable[[int, int], None]]
#: The interval of every axis, or of the only one. An end is a number or a formula of parameters.
Domain = Union[Sequence[Union[float, str]], Sequence[Sequence[Union[float, str]]]]
#: Coordinates on every axis, or on the only one.
Edges = Union[Sequence[Union[float, str]], Sequence[Sequence[Union[float, str]]]]

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
            text = _text(place) if not isinstance(place, Mapping) else ", ".join(
                _text(own) if key in ("t", "point", "facing") else str(own) for key, own in place.items()
            )
            self.add(f"u({text})", at=_place(place, dimension))

    def over(self, parts: Parts) -> None:
        if isinstance(parts, Mapping):
            for name, part in parts.items():
                self.add(str(name), over=part)
        elif isinstance(parts, str):
            self.add(parts, over=parts)
        elif not _is_list(parts):
            raise InputError(f"over = {parts!r}: it must be a name, an interval, or a list of these")
        elif len(parts) == 2 and all(isinstance(end, (int, float)) for end in parts):
            self.add(f"mean of {_text(parts)}", over=list(parts))
        else:
            for part in parts:
                if not isinstance(part, str) and not (_is_list(part) and len(part) == 2):
                    raise InputError(f"over = {part!r}: a part is a name or an interval of two ends")
                self.over(part if isinstance(part, str) else tuple(part))

    def weight(self, weights: Weights) -> None:
        named: list[tuple[str, Any]]
        if isinstance(weights, Mapping):
            named = list(weights.items())
        elif isinstance(weights, str) or callable(weights):
            named = [(weights if isinstance(weights, str) else "weight", weights)]
        elif not _is_list(weights):
            raise InputError(f"weight = {weights!r}: it must be a formula, a function, or a list or dict of these")
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


def _is_list(value: Any) -> bool:
    """Whether a value is a sequence and no text."""
    return isinstance(value, (Sequence, np.ndarray)) and not isinstance(value, (str, bytes))


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


def _coordinates(place: Any, dimension: int) -> list[float]:
    """The coordinates of a point."""
    try:
        x = np.atleast_1d(np.asarray(place, dtype=float))
    except (TypeError, ValueError):
        raise InputError(f"at = {place!r}: it must be a point") from None
    if x.shape != (dimension,):
        raise InputError(f"at = {x.tolist()}: it must have {dimension} coordinate{'s' if dimension > 1 else ''}")
    return [float(v) for v in x]


def _place(place: Any, dimension: int) -> Any:
    """A place as a problem file has it."""
    if isinstance(place, Mapping):
        return dict(place)
    x = _coordinates(place, dimension)
    return x[0] if dimension == 1 else x


def _number(value: Any) -> Any:
    """NumPy's numbers as Python's."""
    return value.item() if isinstance(value, np.generic) else value


def _axes(name: str, value: Any, dimension: Any, length: Optional[int]) -> list[list[Any]]:
    """One list of numbers, or of formulas of parameters, for every axis: an interval of two ends, or edges."""
    axes = list(value) if _is_list(value) else None
    if axes is not None and all(isinstance(item, (int, float, str, np.number)) for item in axes):
        axes = [axes]
    wanted = "an interval `[from, to]` for each axis" if length else "a list of numbers for each axis"
    wrong = InputError(f"{name} = {value!r}: it must be {wanted}")
    if axes is None or not all(_is_list(axis) and (length is None or len(axis) == length) for axis in axes):
        raise wrong
    numbers = [[_number(end) for end in axis] for axis in axes]
    if not all(isinstance(end, (int, float, str)) and not isinstance(end, bool) for axis in numbers for end in axis):
        raise wrong
    if isinstance(dimension, int) and len(numbers) != dimension:
        raise InputError(f"{name} = {value!r}: it must be {wanted}, and there are {dimension}")
    if any(isinstance(end, float) and np.isnan(end) for axis in numbers for end in axis):
        raise InputError(f"{name} = {value!r}: an end must be no NaN, and an edge finite")
    return numbers


def _space(dimension: int, domain: Any, edges: Any, parameters: Optional[Mapping[str, Any]]) -> dict[str, Any]:
    """What a problem file says of a product of intervals."""
    space: dict[str, Any] = {"dimension": _number(dimension)}
    if domain is not None:
        space["domain"] = _axes("domain", domain, space["dimension"], 2)
    if edges is not None:
        space["edges"] = _axes("edges", edges, space["dimension"], None)
    if parameters is not None:
        if not isinstance(parameters, Mapping):
            raise InputError(f"parameters = {parameters!r}: it must be a dict of numbers by their names")
        space["parameters"] = dict(parameters)
    return space


def _columns(times: Any) -> tuple[str, str]:
    """The name and the text of a CSV file, or of a table with columns."""
    if isinstance(times, (str, os.PathLike)):
        path = os.fspath(times)
        try:
            with open(path, encoding="utf-8") as file:
                return path, file.read()
        except (OSError, UnicodeDecodeError) as error:
            raise InputError(f"times: {path}: {error}") from None
    if not hasattr(times, "keys"):
        raise InputError(f"times: give the path of a CSV file, a dict of columns, or a DataFrame, not a {type(times).__name__}")
    columns = {str(key): list(times[key]) for key in times.keys()}
    if len({len(own) for own in columns.values()}) > 1:
        lengths = ", ".join(f"{key} {len(own)}" for key, own in columns.items())
        raise InputError(f"times: all columns must be equally long, not {lengths}")

    def field(key: str, at: int, x: Any) -> str:
        if key == "time":
            return '"' + " ".join(str(x).replace('"', "'").split()) + '"'
        try:
            return repr(float(x))
        except (TypeError, ValueError):
            raise InputError(f"times[{key!r}][{at}] = {x!r}: it must be a number") from None

    fields = [[field(key, at, x) for at, x in enumerate(own)] for key, own in columns.items()]
    return "<times>", "\n".join([",".join(columns)] + [",".join(row) for row in zip(*fields)])


def _problem_text(problem: dict[str, Any]) -> str:
    """The text of a problem file. JSON has no infinity: a domain's ends go by their names."""
    ends = problem.get("domain")
    if ends is None:
        return _fredholm.Task.text_of(_json({"problem": problem}))
    name = {float("inf"): "inf", float("-inf"): "-inf"}
    named = [[name.get(end, end) if isinstance(end, float) else end for end in axis] for axis in ends]
    lines = _fredholm.Task.text_of(_json({"problem": {**problem, "domain": named}})).splitlines()
    bare = [re.sub(r'"(-?inf)"', r"\1", line) if line.startswith("domain = ") else line for line in lines]
    return "\n".join(bare) + "\n"


class _Shows:
    """Progress on stderr, after two seconds."""

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


def _of_components(tables: list[dict[str, Any]], components: range) -> list[dict[str, Any]]:
    """Targets of every unknown function of a system, but for those that name theirs."""

    def named(table: dict[str, Any], number: int) -> dict[str, Any]:
        name = table["name"]
        name = f"u{number}{name[1:]}" if name == "u" or name.startswith("u(") else f"{name} of u{number}"
        return {**table, "name": name, "component": number}

    if not components:
        return tables
    numbers = [i + 1 for i in components]
    all_of = [[named(table, i) for i in ([table["component"]] if "component" in table else numbers)] for table in tables]
    return [table for tables in all_of for table in tables]


class Problem:
    """An equation u(x) = ∫ K(x, y) u(y) dy + F(x).

    Made by :class:`Cube`, :class:`System`, :class:`Circle`, :class:`Room`, :class:`Sphere`, :class:`Tube`, :class:`Channels` and
    :func:`load`.
    """

    def __init__(
        self,
        name: str,
        text: str,
        dimension: int,
        functions: Optional[_fredholm.Functions] = None,
        drawing: Optional[dict[str, Any]] = None,
        components: int = 0,
    ) -> None:
        self._name = name
        self._text = text
        self._dimension = dimension
        self._functions = functions
        self._drawing = drawing
        self._components = components

    @property
    def text(self) -> str:
        """The problem file that says the same, for the program ``fredholm``."""
        return self._text

    def __repr__(self) -> str:
        return f"<{self._name}>\n{self._text.rstrip()}"

    def check(self) -> list[str]:
        """Checks the problem; remarks on what is allowed and hardly meant."""
        return self._task(self._targets()).check({})[2]

    def _task(self, targets: _Targets) -> _fredholm.Task:
        asked = _json({"target": targets.tables}) if targets.tables else None
        if not targets.tables and targets.weights:
            asked = ""
        if asked is None and "target" not in self._text:
            asked = _json({"target": _of_components([{"name": "mean", "over": "all"}], range(self._components))})
        elif asked == "":
            asked = "{}"
        return _fredholm.Task(self._name, self._text, asked, self._functions, targets.weights, self._mesh())

    def _mesh(self) -> Optional[_fredholm.Mesh]:
        """The faces of a scene of arrays."""
        return None

    def _targets(
        self,
        at: Any = None,
        mean: bool = False,
        over: Any = None,
        weight: Any = None,
        grid: Any = None,
        target: Any = None,
        component: Optional[int] = None,
        ask: Optional[str] = None,
    ) -> _Targets:
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
        if asked.weights and self._components:
            raise InputError("weights of a system are formulas")
        if component is not None:
            asked.tables = [{**table, "component": component} for table in asked.tables]
        if ask is not None:
            asked.tables = [{**table, "ask": ask} for table in asked.tables]
        asked.tables = _of_components(asked.tables, range(self._components))
        if target is not None:
            tables = [target] if isinstance(target, Mapping) else target
            if not _is_list(tables) or not all(isinstance(table, Mapping) for table in tables):
                raise InputError(f"target = {target!r}: it must be a dict or a list of dicts, as problem files have them")
            asked.tables += [dict(table) for table in tables]
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
        component: Optional[int] = None,
        ask: Optional[str] = None,
        method: Optional[str] = None,
        walks: Optional[int] = None,
        cells: Optional[int] = None,
        degree: Optional[int] = None,
        pairs: Optional[str] = None,
        lift: Optional[int] = None,
        points: Optional[int] = None,
        grading: Optional[float] = None,
        shadow_cuts: Optional[bool] = None,
        absorption: Optional[float] = None,
        estimator: Optional[str] = None,
        form: Optional[str] = None,
        sequence: Optional[str] = None,
        forced_steps: Optional[int] = None,
        last_step: Optional[bool] = None,
        adjoint: Optional[bool] = None,
        global_: Optional[bool] = None,
        score_degree: Optional[int] = None,
        scalar: Optional[str] = None,
        allow_infinite_variance: bool = False,
        seed: Optional[int] = None,
        batch: Optional[int] = None,
        threads: Optional[int] = None,
        time_limit: Optional[float] = None,
        progress: Shown = None,
    ) -> Result:
        """Estimates functionals of u, with standard errors.

        Settings that are not given are chosen. The same problem, settings and seed give the same bits on every machine and for any number of threads.

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
        component : int
            The unknown function of a system, from 1, that is asked for; all of them if it is not given.
        ask : str
            "irradiance" or "net_flux", of rooms and scenes, in the place of u: values and ``target_error`` are of that.
        method : str
            "resolvent", of cubes and systems, whatever the norm of K; "walks" of a chain; or "paper", these as in Heinrich 1995.
        walks : int
            The number of walks of a target; with ``target_error``, the most.
        cells, degree : int
            Cells (of a cube, per axis) and degree of the Galerkin solution.
        points : int
            Quadrature points of a cell and axis.
        grading, shadow_cuts : float, bool
            How cells shrink towards the corners of a room, and whether its walls are cut at the edges of shadows.
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
        score_degree : int
            The degree of the polynomials on whose coefficients walks of a chain score, with ``global_``.
        allow_infinite_variance : bool
            Whether walks of infinite variance are made, whose error bars mean nothing.
        seed, batch : int
            The seed of all draws, and the walks of a batch.
        threads : int
            Threads; all cores if it is not given. Results do not depend on it.
        time_limit : float
            Seconds after which walks end.
        progress : bool or callable
            Whether progress is shown on stderr after two seconds, or a function of the walks so far and those expected. If it is
            not given, it is shown where stderr is a terminal.

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
            "method": method,
            "walks": walks,
            "cells": cells,
            "degree": degree,
            "pairs": pairs,
            "lift": lift,
            "points": points,
            "grading": grading,
            "shadow_cuts": shadow_cuts,
            "absorption": absorption,
            "estimator": estimator,
            "form": form,
            "sequence": sequence,
            "forced_steps": forced_steps,
            "last_step": last_step,
            "adjoint": adjoint,
            "global_": global_,
            "score_degree": score_degree,
            "scalar": scalar,
            "allow_infinite_variance": allow_infinite_variance or None,
            "seed": seed,
            "batch": batch,
            "threads": threads,
            "time_limit": time_limit,
        }
        if not relative:
            options["relative"] = None
        task = self._task(self._targets(at, mean, over, weight, grid, target, component, ask))
        if progress is None:
            progress = sys.stderr is not None and sys.stderr.isatty()
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
            asked = "that was asked for" if target_error is None else f"{target_error}"
            text = f"the error {asked} was not reached: {why or 'the walks or the time ended before'}"
            raise NotReachedError(text, result)
        return result

    def predict(
        self, target_error: Optional[float] = None, *, at: Optional[Places] = None, mean: bool = False, **options: Any
    ) -> Optional[Prediction]:
        """The settings that would be chosen for an error, or for the walks that are made without one, and their time, without the walks.

        Parameters
        ----------
        target_error : float
            The standard error that would be asked for, if one would.
        at, mean
            What would be asked for, as in :meth:`solve`.
        **options
            Settings that are given, as in :meth:`solve`.

        Returns
        -------
        Prediction or None
            None if pilots choose nothing: with a ``lift``, or where nothing is open.

        Examples
        --------
        >>> import fredholm
        >>> prediction = fredholm.Cube("0.5 * exp(-(x - y)^2)", "x").predict(1e-8)
        >>> prediction.seconds < 60
        True
        >>> fredholm.Circle(0.5, [1.0, 0.0]).predict(mean=True, walks=2000).walks
        2000.0
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
        try:
            numbers = [int(n) for n in cells]
        except (TypeError, ValueError):
            numbers = [-1]
        if min(numbers, default=-1) < 1:
            raise InputError(f"cells = {cells!r}: it must be a list of whole numbers, 1 or more")
        if not isinstance(walks, (int, np.integer)) or walks < 1:
            raise InputError(f"walks = {walks!r}: it must be a whole number, 1 or more")
        return Sweep(*self._task(targets).sweep(numbers, int(walks), settings))

    def field(self, grid: Optional[int] = None, *, at: Optional[Any] = None, **options: Any) -> Field:
        """The global estimate: u at many points from one set of walks, with a band that holds at all of them together.

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
        if grid is not None and (not isinstance(grid, (int, np.integer)) or grid < 1):
            raise InputError(f"grid = {grid!r}: it must be a number of points, 1 or more")
        points = [] if at is None else [_coordinates(x, self._dimension) for x in _several(at, self._dimension)]
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

    def certify(
        self,
        solution: Union[str, Callable[..., float], Sequence[Any], np.ndarray],
        *,
        at: Optional[Places] = None,
        mean: bool = False,
        **options: Any,
    ) -> Certificate:
        """How wrong a solution is that somebody else has found: its errors, with a band that holds for all of them together.

        Parameters
        ----------
        solution : str, list of str, callable or array
            A formula, or one for each channel or component; a function of a point; or values, one for each target in their order, of a
            system those of all components of a point next to each other.
        at, mean
            Where it is compared, as in :meth:`solve`. Formulas and functions are compared at some 256 points all over the space, too.
        **options
            Targets and settings as in :meth:`solve`: ``target_error`` says how exact u is.

        Examples
        --------
        >>> import fredholm
        >>> u = fredholm.Cube("0.5 * x * y", "x")  # the solution is 6x/5
        >>> u.certify("1.2 * x").is_right
        True
        >>> wrong = u.certify([0.3, 0.61], at=[0.25, 0.5])
        >>> wrong.is_right, round(float(wrong.errors[1]), 6)
        (False, 0.01)
        """
        formulas: list[str] = []
        values: list[float] = []
        function = None
        if isinstance(solution, str):
            formulas = [solution]
        elif callable(solution):
            function = solution
        elif _is_list(solution) and len(solution) > 0 and all(isinstance(one, str) for one in solution):
            formulas = list(solution)
        else:
            numbers = np.asarray(solution)
            if np.iscomplexobj(numbers):
                raise complex_error("solution")
            try:
                values = [float(x) for x in numbers.astype(float).ravel()]
            except (TypeError, ValueError):
                raise InputError(f"solution = {solution!r}: it must be a formula, a function of a point, or numbers") from None
            if not values:
                raise InputError("solution: there are no values")
        targets, settings = self._split(at, mean, options)
        report, table = self._task(targets).certify(formulas, function, values, settings)
        return Certificate(report, table)

    def sensitivities(self, *, at: Optional[Places] = None, mean: bool = False, **options: Any) -> Sensitivities:
        """How targets depend on what the problem knows by name: derivatives, with error bars.

        Of rooms and scenes these are reflectances, emissions, emissivities, temperatures and net fluxes of surfaces, of formulas their
        ``parameters``.

        Parameters
        ----------
        at, mean
            What is asked for, as in :meth:`solve`.
        **options
            Targets and settings as in :meth:`solve`.

        Examples
        --------
        >>> import fredholm
        >>> u = fredholm.Cube("a * x * y", "x", parameters={"a": 0.5})  # the solution is x/(1 - a/3)
        >>> found = u.sensitivities(at=0.5)
        >>> round(found["u(0.5)", "a"], 6)
        0.24
        """
        targets, settings = self._split(at, mean, options)
        report, table = self._task(targets).sensitivities(settings)
        return Sensitivities(report, table)

    def fit(
        self,
        quantities: Union[str, Sequence[str], None] = None,
        *,
        measured: Optional[Mapping[str, tuple[float, float]]] = None,
        temperatures: Optional[Mapping[str, tuple[float, float]]] = None,
        at: Optional[Places] = None,
        mean: bool = False,
        **options: Any,
    ) -> Fit:
        """Finds quantities, such as emissivities or parameters of formulas, from measured targets, by least squares.

        Parameters
        ----------
        quantities : str or list of str
            What is looked for, from its value in the problem on; what the file says in its ``[fit]`` otherwise.
        measured, temperatures : dict
            By the name of a target what it was measured as, and the standard error: u, or the temperature in kelvin that follows from it.
        at, mean
            Targets, as in :meth:`solve`.
        **options
            Targets and settings as in :meth:`solve`.

        Examples
        --------
        >>> import fredholm
        >>> u = fredholm.Cube("a * x * y", "x", parameters={"a": 0.2})  # the solution is x/(1 - a/3)
        >>> found = u.fit("a", measured={"u(0.5)": (0.6, 0.006)}, at=0.5)
        >>> round(found["a"], 6), round(found.std_error("a"), 6)
        (0.5, 0.025)
        """
        if isinstance(quantities, str):
            quantities = [quantities]
        numbers = []
        for argument, given, kelvin in (("measured", measured, False), ("temperatures", temperatures, True)):
            for name, one in (given or {}).items():
                try:
                    value, error = (float(x) for x in one)
                except (TypeError, ValueError):
                    raise InputError(f"{argument}[{name!r}] = {one!r}: give a number and its standard error") from None
                numbers.append((name, value, error, kelvin))
        targets, settings = self._split(at, mean, options)
        report, table = self._task(targets).fit(list(quantities or []), numbers, settings)
        return Fit(report, table)

    def times(
        self,
        times: Union[str, os.PathLike[str], Mapping[str, Any]],
        *,
        at: Optional[Places] = None,
        mean: bool = False,
        **options: Any,
    ) -> Times:
        """Targets of a scene under suns and skies over time, from one set of walks.

        Parameters
        ----------
        times : path of a CSV file, dict of columns, or pandas.DataFrame
            ``altitude`` and ``azimuth`` of the sun in degrees, from north, the axis y, over east, or ``x``, ``y``, ``z`` towards it, and
            ``beam``, the irradiance of a surface that faces it; ``diffuse``, that of a horizontal one by the sky; and ``time``, a name.
        at, mean
            What is asked for, as in :meth:`solve`.
        **options
            Targets as in :meth:`solve`, and ``walks`` (4096 for each target, if neither this nor ``target_error`` is given),
            ``target_error``, ``relative``, ``seed``, ``scalar``, ``threads``.

        Examples
        --------
        >>> import fredholm
        >>> ground = fredholm.Scene([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], reflectance=0.5, emission=0.0, open=True)
        >>> suns = {"time": ["morning", "noon"], "altitude": [30, 90], "azimuth": [90, 180], "beam": [400, 800]}
        >>> found = ground.times(suns, over="faces")
        >>> found["faces"].round(6).tolist()
        [100.0, 400.0]
        """
        targets, settings = self._split(at, mean, options)
        known = {"walks", "target_error", "relative", "seed", "scalar", "threads"}
        unknown = set(settings) - known
        if unknown:
            raise InputError(f"{', '.join(sorted(unknown))}: no setting of times; settings are {', '.join(sorted(known))}")
        settings.setdefault("walks", 4096 if settings.get("target_error") is None else 1024)
        name, text = _columns(times)
        report, table = self._task(targets).times(name, text, settings)
        return Times(report, table)

    def factors(self) -> Factors:
        """Form factors between the surfaces of a room."""
        names, rows = self._task(_Targets()).factors({})
        return Factors(names, np.array(rows).reshape(len(names), len(names)))

    def _split(self, at: Any, mean: bool, options: Mapping[str, Any]) -> tuple[_Targets, dict[str, Any]]:
        """What is asked for, and the settings among some options."""
        asked = {key: options.get(key) for key in ("over", "weight", "grid", "target", "component", "ask")}
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
    "grading",
    "last_step",
    "lift",
    "method",
    "pairs",
    "points",
    "relative",
    "scalar",
    "score_degree",
    "seed",
    "sequence",
    "shadow_cuts",
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
        The interval of every axis, or of the only one, whose ends may be infinite; [0, 1] if it is not given.
    edges : list of lists of float
        Coordinates of every axis, or of the only one, at which cells end, besides those where jumps are found.
    parameters : dict of float or str
        Numbers that all formulas know by their names, the ends of the domain among them; or formulas of those before.
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
        domain: Optional[Domain] = None,
        edges: Optional[Edges] = None,
        parameters: Optional[Mapping[str, Union[float, str]]] = None,
        solution: Optional[str] = None,
        vectorized: Optional[bool] = None,
    ) -> None:
        kernel, source = _number(kernel), _number(source)
        for name, value in (("kernel", kernel), ("source", source)):
            if isinstance(value, complex):
                raise complex_error(name)
        is_text = isinstance(kernel, (str, list, tuple))
        if isinstance(kernel, (int, float)) and isinstance(source, (str, int, float)):
            kernel, is_text = repr(float(kernel)), True
        if is_text and isinstance(source, (int, float)) and not isinstance(source, bool):
            source = repr(float(source))
        problem: dict[str, Any] = {"kind": "cube", **_space(dimension, domain, edges, parameters)}
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
        text = _problem_text(problem)
        # What is wrong with the dimension and the domain is said first.
        target = {"name": "target", **({"over": "all"} if domain is None else {"weight": "1"})}
        _fredholm.Task("<Cube>", text, _json({"target": [target]})).check({})
        if not is_text:
            ends = problem.get("domain", [[0.0, 1.0]] * dimension)
            if any(isinstance(end, str) for axis in ends for end in axis):
                raise InputError("the ends of the domain of a function are numbers")
            functions = compiled_functions(kernel, source, np.array(ends, dtype=float), vectorized)
        super().__init__("<Cube>", text, problem["dimension"], functions)


class System(Problem):
    """Equations u_i(x) = Σ_j ∫ K_ij(x, y) u_j(y) dy + F_i(x) for as many unknown functions, on a product of intervals.

    A complex equation is one of two, for the real and the imaginary part of u.

    Parameters
    ----------
    kernels : list of lists of str
        The formulas K_ij, a row for each equation.
    sources : list of str
        The formulas F_i.
    dimension : int
        d, from 1 to 3.
    domain, edges, parameters
        As of :class:`Cube`.
    solutions : list of str
        The formulas of u_i, where they are known.

    Examples
    --------
    >>> import fredholm
    >>> # u = 1 + (1 + 2i) ∫ u on [0, 1], whose solution is i/2.
    >>> u = fredholm.System([["1", "-2"], ["2", "1"]], ["1", "0"])
    >>> result = u.solve(at=0.5, target_error=1e-8)
    >>> result.names, [round(float(x), 6) + 0.0 for x in result.values]
    (['u1(0.5)', 'u2(0.5)'], [0.0, 0.5])
    """

    def __init__(
        self,
        kernels: Sequence[Sequence[Union[str, float]]],
        sources: Sequence[Union[str, float]],
        *,
        dimension: int = 1,
        domain: Optional[Domain] = None,
        edges: Optional[Edges] = None,
        parameters: Optional[Mapping[str, Union[float, str]]] = None,
        solutions: Optional[Sequence[Union[str, float]]] = None,
    ) -> None:
        rows = kernels if _is_list(kernels) else []
        given = [sources] if solutions is None else [sources, solutions]
        if not rows or not all(_is_list(row) and len(row) == len(rows) for row in rows):
            raise InputError("kernels: they must be formulas, as many rows of as many, one row for each equation")
        if not all(_is_list(column) and len(column) == len(rows) for column in given):
            raise InputError(f"sources and solutions: there must be {len(rows)} formulas, one for each equation")
        equations: list[dict[str, Any]] = []
        for i, row in enumerate(rows):
            equation: dict[str, Any] = {
                "kernel": [_formula(f"kernels[{i}][{j}]", k) for j, k in enumerate(row)],
                "source": _formula(f"sources[{i}]", sources[i]),
            }
            if solutions is not None:
                equation["solution"] = _formula(f"solutions[{i}]", solutions[i])
            equations.append(equation)
        text = _problem_text({"kind": "system", **_space(dimension, domain, edges, parameters), "equation": equations})
        super().__init__("<System>", text, int(dimension), components=len(rows))
        if domain is None:
            self.check()


def _formula(name: str, value: Any) -> str:
    """A formula, or a number as one."""
    value = _number(value)
    if isinstance(value, complex):
        raise complex_error(name)
    if isinstance(value, (int, float)) and not isinstance(value, bool):
        return repr(float(value))
    if not isinstance(value, str):
        raise InputError(f"{name} = {value!r}: it must be a formula; functions of a system are those of Rust")
    return value


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
        reflectance, emission = _number(reflectance), _number(emission)
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
        if not _is_list(surfaces) or not all(isinstance(surface, Mapping) for surface in surfaces):
            raise InputError(f"surfaces = {surfaces!r}: it must be a list of dicts, one for each surface")
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


class Tube(Problem):
    """Light, heat or molecules in a circular tube with black ends, whose radius is the unit of length.

    Parameters
    ----------
    length : float
        L/R.
    reflectance : float
        ρ of the wall, from 0 to 1.
    ends : list of float
        What the end at 0 and that at ``length`` send in.
    emission : float
        What the wall emits.

    Examples
    --------
    >>> import fredholm
    >>> # Of what comes into a white tube as long as its radius 0.671983901919 passes (Clausing 1932).
    >>> u = fredholm.Tube(length=1, reflectance=1, ends=[0, 1])
    >>> bool(abs(u.solve(over="left", target_error=1e-6)["left"].value - 0.671984) < 1e-5)
    True
    """

    def __init__(self, length: float, reflectance: float, ends: Sequence[float], *, emission: float = 0.0) -> None:
        problem = {"kind": "tube", "length": length, "reflectance": reflectance, "ends": ends, "emission": emission}
        super().__init__("<Tube>", _fredholm.Task.text_of(_json({"problem": problem})), 1)


class Channels(Problem):
    """An equation in several channels, each of which is an equation of its own on the same space.

    Results have a value in every channel, "mean red", and one for their sum, "mean sum"; of red, green and blue their luminance.

    Parameters
    ----------
    problems : dict of Problem
        The equations by the names of their channels: circles, cubes and systems of formulas, spheres or tubes, all of one kind.

    Examples
    --------
    >>> import fredholm
    >>> cloud = {"near": fredholm.Sphere(0.9, [1, 0, 0, 0]), "far": fredholm.Sphere(0.5, [1, 0, 0, 0])}
    >>> result = fredholm.Channels(cloud).solve(mean=True, target_error=1e-3)
    >>> result.names, [round(float(x)) for x in result.values]
    (['mean near', 'mean far', 'mean sum'], [10, 2, 12])
    """

    def __init__(self, problems: Mapping[str, Problem]) -> None:
        if not isinstance(problems, Mapping) or not problems or not all(isinstance(p, Problem) for p in problems.values()):
            raise InputError(f"problems = {problems!r}: it must be a dict of problems by the names of their channels")
        every = list(problems.values())
        if any(type(p) is not type(every[0]) or type(p) in (Problem, Room, Channels) or p._functions for p in every):
            raise InputError("channels are circles, cubes and systems of formulas, spheres or tubes, all of one kind")
        kind = re.compile(r"^kind = .*\n", re.MULTILINE)
        head = kind.search(every[0].text)
        parts = [f"[problem]\n{head[0] if head else ''}"]
        for name, problem in problems.items():
            table = rf"\1problem.channels.{_json(str(name))}"
            parts.append(re.sub(r"^(\[+)problem", lambda found: found.expand(table), kind.sub("", problem.text, 1), flags=re.MULTILINE))
        super().__init__("<Channels>", "\n".join(parts), every[0]._dimension, components=every[0]._components)
        self.check()


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
        dimension = {"circle": 1, "tube": 1, "scene": 3}.get(kind, 2)
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

"""Results: plain data with arrays, tables and pictures."""

from __future__ import annotations

import html
import json
from dataclasses import dataclass, field
from importlib import import_module
from typing import TYPE_CHECKING, Any, Iterator, Optional, Union

import numpy as np
import numpy.typing as npt

from .errors import TooLargeError

if TYPE_CHECKING:
    import pandas
    import xarray
    from matplotlib.axes import Axes

__all__ = ["Diagnosis", "Factors", "Field", "Prediction", "Result", "Sweep", "Value"]

Array = npt.NDArray[np.float64]

#: Half of the width of an interval of 95 % in standard errors.
NORMAL = 1.96


def _number(x: Optional[float]) -> float:
    return float("nan") if x is None else float(x)


@dataclass(frozen=True)
class Value:
    """An estimate of one functional of u.

    Attributes
    ----------
    name : str
        The name of the target.
    value : float
        The preconditioned estimate, in the unit of u.
    std_error : float
        The standard error of the estimate; NaN if there were too few walks for one.
    plain, plain_std_error : float
        The estimate of the same walks without a control variate, and the standard error; NaN of resolvent walks, which have none.
    galerkin : float
        The Galerkin solution, of unknown error.
    walks : int
        The number of walks.
    unit : str or None
        The unit of u, if it has one.
    raw : dict
        Everything that the report says of the target.
    """

    name: str
    value: float
    std_error: float
    plain: float
    plain_std_error: float
    galerkin: float
    walks: int
    unit: Optional[str]
    raw: dict[str, Any] = field(repr=False)

    @property
    def interval(self) -> tuple[float, float]:
        """The interval that holds the true value with probability 95 %."""
        half = NORMAL * self.std_error
        return self.value - half, self.value + half

    def __float__(self) -> float:
        return self.value

    def __str__(self) -> str:
        unit = f" {self.unit}" if self.unit else ""
        return f"{self.name} = {self.value:.10g} ± {self.std_error:.2g}{unit}"

    @staticmethod
    def of(target: dict[str, Any]) -> Value:
        """The value that a report says of a target."""
        own, plain = target["preconditioned"], target["plain"]
        return Value(
            name=target["name"],
            value=_number(own["estimate"]),
            std_error=_number(own["std_error"]),
            plain=_number(plain["estimate"]),
            plain_std_error=_number(plain["std_error"]),
            galerkin=_number(target.get("galerkin")),
            walks=int(target["walks"]),
            unit=own.get("unit"),
            raw=target,
        )


class Result:
    """Estimates of all targets, with their errors.

    ``result["mean"]`` and ``result[0]`` are a :class:`Value`; ``result.values`` and ``result.std_errors`` are arrays.

    Attributes
    ----------
    names : list of str
        The names of the targets; points of a grid are numbered.
    values, std_errors : numpy.ndarray
        The estimates and their standard errors, one for each target.
    reached : bool
        Whether the walks went on to their end, or to the error that was asked for.
    """

    def __init__(self, report: dict[str, Any], table: str, drawing: Optional[dict[str, Any]] = None) -> None:
        self._report = report
        self._table = table
        self._drawing = drawing
        self._values = [Value.of(target) for target in report["targets"]]
        self.names = [value.name for value in self._values]
        self.values: Array = np.array([value.value for value in self._values])
        self.std_errors: Array = np.array([value.std_error for value in self._values])
        self.reached: bool = report["stop"] == "done"

    def __len__(self) -> int:
        return len(self._values)

    def __iter__(self) -> Iterator[Value]:
        return iter(self._values)

    def __getitem__(self, key: Union[str, int]) -> Value:
        if isinstance(key, str):
            try:
                return self._values[self.names.index(key)]
            except ValueError:
                raise KeyError(f"there is no target {key!r}: there are {', '.join(self.names)}") from None
        return self._values[key]

    def table(self) -> str:
        """The table that the program prints."""
        return self._table

    def to_dict(self) -> dict[str, Any]:
        """Everything that the report has: the program's JSON."""
        return dict(self._report)

    def to_pandas(self) -> pandas.DataFrame:
        """A table with a row for each target; needs pandas."""
        import pandas

        columns = ["value", "std_error", "plain", "plain_std_error", "galerkin", "walks"]
        rows = [[getattr(value, column) for column in columns] for value in self._values]
        frame = pandas.DataFrame(rows, columns=columns, index=pandas.Index(self.names, name="target"))
        for number, (name, column) in enumerate(self._columns_of_places().items()):
            frame.insert(number, name, column)
        return frame

    def to_xarray(self) -> xarray.Dataset:
        """A dataset along the dimension ``target``; needs xarray."""
        import xarray

        variables: dict[str, Any] = {
            "value": ("target", self.values),
            "std_error": ("target", self.std_errors),
            "plain": ("target", np.array([value.plain for value in self._values])),
            "plain_std_error": ("target", np.array([value.plain_std_error for value in self._values])),
            "galerkin": ("target", np.array([value.galerkin for value in self._values])),
        }
        coordinates: dict[str, Any] = {"target": self.names}
        for name, column in self._columns_of_places().items():
            coordinates[name] = ("target", column)
        kept = {k: v for k, v in self._report.items() if isinstance(v, (str, int, float))}
        return xarray.Dataset(variables, coordinates, attrs=kept)

    def _places(self) -> Optional[Array]:
        """The coordinates of all targets, if all are points of one space."""
        places: list[Any] = [value.raw.get("at") for value in self._values]
        if any(place is None or isinstance(place, dict) for place in places) or not places:
            return None
        return np.array([np.atleast_1d(place) for place in places], dtype=np.float64)

    def _columns_of_places(self) -> dict[str, Any]:
        """Where the targets lie: the coordinates of points; those on surfaces of a room have these, and t from one end to the other. What
        has no place has NaN, and none have columns of NaN alone."""
        raw = [value.raw for value in self._values]
        columns: dict[str, Any] = {}
        on_surfaces = [at if isinstance(at, dict) else {} for at in (told.get("at") for told in raw)]
        if any(on_surfaces):
            columns["surface"] = [at.get("surface") for at in on_surfaces]
            columns["t"] = np.array([_number(at.get("t")) for at in on_surfaces])
        places = [told.get("position", told.get("at")) for told in raw]
        points = [np.atleast_1d(place) if isinstance(place, (list, float, int)) else np.empty(0) for place in places]
        for axis in range(max((len(point) for point in points), default=0)):
            columns[f"x{axis + 1}"] = np.array([point[axis] if axis < len(point) else np.nan for point in points], dtype=float)
        return columns

    def plot(self, ax: Optional[Axes] = None) -> Axes:
        """Draws the estimates with intervals of 95 %; needs matplotlib.

        Points along a line are a curve with a band, points of two coordinates a map, surfaces of a room the room in the
        colours of their means, all else points with error bars.
        """
        from .pictures import plot_result

        return plot_result(self, ax)

    def __repr__(self) -> str:
        return self._table.rstrip()

    def _repr_html_(self) -> str:
        # Resolvent walks have no plain estimates.
        has_plain = not all(np.isnan(value.plain) for value in self._values)
        titles = ["target", "value", "± error", *(["plain", "± error"] if has_plain else []), "without walks", "walks"]
        head = "".join(f"<th>{name}</th>" for name in titles)
        rows = []
        for value in self._values:
            cells = [
                html.escape(value.name),
                f"<b>{value.value:.10g}</b>",
                f"{value.std_error:.2g}",
                *([f"{value.plain:.6g}", f"{value.plain_std_error:.2g}"] if has_plain else []),
                f"{value.galerkin:.8g}",
                f"{value.walks:,}",
            ]
            rows.append("<tr>" + "".join(f"<td>{cell}</td>" for cell in cells) + "</tr>")
        told = self._report
        how = f"{told['pairs']} pairs" if "pairs" in told else f"{told['method']} walks"
        note = f"{told['problem']}, {told['cells']} cells, degree {told['degree']}, {how}, seed {told['seed']}"
        state = "" if self.reached else f" <b>{html.escape(str(told['stop']))}</b>"
        return f"<table><thead><tr>{head}</tr></thead><tbody>{''.join(rows)}</tbody></table><small>{html.escape(note)}{state}</small>"


@dataclass(frozen=True)
class Prediction:
    """The settings that would be chosen, with their time; ``raw`` is everything that is known of them.

    ``absorption`` is None where walks end by roulette, and ``pairs`` and ``estimator`` are None of resolvent walks, which have none.
    """

    method: str
    cells: int
    degree: int
    pairs: Optional[str]
    absorption: Optional[float]
    estimator: Optional[str]
    seconds: float
    walks: float
    raw: dict[str, Any] = field(repr=False)

    @staticmethod
    def of(text: str) -> Optional[Prediction]:
        """The prediction in a report; None if nothing was open."""
        raw = json.loads(text)
        if raw is None:
            return None
        seconds = raw["predicted_setup_seconds"] + raw["predicted_walk_seconds"]
        return Prediction(
            method=raw["method"],
            cells=raw["cells"],
            degree=raw["degree"],
            pairs=raw["pairs"],
            absorption=raw["absorption"],
            estimator=raw["estimator"],
            seconds=seconds,
            walks=raw["predicted_walks"],
            raw=raw,
        )


class _Report:
    """A report with a text for people."""

    def __init__(self, text: str, table: str) -> None:
        self._raw: dict[str, Any] = json.loads(text)
        self._table = table

    def to_dict(self) -> dict[str, Any]:
        """Everything that the report has."""
        return dict(self._raw)

    def __repr__(self) -> str:
        return self._table.rstrip()


class Diagnosis(_Report):
    """Predicted variances, and what limits them."""

    @property
    def std_devs(self) -> dict[str, float]:
        """The predicted standard deviation of a walk, by the name of the target; NaN where it is infinite."""
        return {t["name"]: _number(t["preconditioned"]) for t in self._raw["targets"]}


class Certificate(_Report):
    """How wrong a given solution is, with error bars.

    ``bool(certificate)`` is whether it is right to within the band.
    """

    @property
    def is_right(self) -> bool:
        """Whether no value is farther from u than its band."""
        return bool(self._raw["verdict"] == "right")

    def __bool__(self) -> bool:
        return self.is_right

    @property
    def errors(self) -> Array:
        """The given values minus u, targets first; NaN where nothing was compared."""
        return self._column("error")

    @property
    def std_errors(self) -> Array:
        """The standard errors of these."""
        return self._column("std_error")

    @property
    def bands(self) -> Array:
        """Half of the widths of the bands, which hold for all values together with probability 95 %."""
        return self._column("band")

    @property
    def bound(self) -> float:
        """With that probability no error is larger."""
        return float(self._raw["bound"])

    def _column(self, name: str) -> Array:
        return np.array([_number(value[name]) for value in self._raw["values"]])


class Times(_Report):
    """Targets of a scene under suns and skies over time: ``found["desk"]`` are the values of one at all times."""

    @property
    def names(self) -> list[str]:
        """The names of the times."""
        return list(self._raw["times"])

    def __getitem__(self, target: str) -> Array:
        return np.array(self._one(target)["values"])

    def std_errors(self, target: str) -> Array:
        """The standard errors of a target's values."""
        return np.array(self._one(target)["std_errors"])

    def mean(self, target: str) -> tuple[float, float]:
        """The mean of a target over all times, and its standard error."""
        own = self._one(target)
        return float(own["mean"]), float(own["mean_std_error"])

    def to_pandas(self) -> pandas.DataFrame:
        """A table with a row for every time, and two columns for every target."""
        import pandas

        columns = {}
        for own in self._raw["targets"]:
            columns[own["name"]] = own["values"]
            columns[f"{own['name']} std_error"] = own["std_errors"]
        return pandas.DataFrame(columns, index=pandas.Index(self.names, name="time"))

    def _one(self, target: str) -> dict[str, Any]:
        for own in self._raw["targets"]:
            if own["name"] == target:
                return dict(own)
        names = ", ".join(own["name"] for own in self._raw["targets"])
        raise KeyError(f"there is no target {target!r}: there are {names}")


class Sensitivities(_Report):
    """Derivatives of targets, with error bars: ``found["floor", "wall reflectance"]`` is one of them."""

    def __getitem__(self, names: tuple[str, str]) -> float:
        return float(self._one(names)["derivative"])

    def std_error(self, target: str, quantity: str) -> float:
        """The standard error of a derivative."""
        return _number(self._one((target, quantity))["std_error"])

    def _one(self, names: tuple[str, str]) -> dict[str, Any]:
        target, quantity = names
        for own in self._raw["derivatives"]:
            if (own["target"], own["quantity"]) == (target, quantity):
                return dict(own)
        raise KeyError(f"there is no derivative of {target!r} by {quantity!r}")

    def to_pandas(self) -> pandas.DataFrame:
        """A table with a row for each derivative; needs pandas."""
        import pandas

        return pandas.DataFrame(self._raw["derivatives"])


class Fit(_Report):
    """Quantities that were found from measurements: ``found["load emissivity"]`` is one of them."""

    def __getitem__(self, quantity: str) -> float:
        return float(self._one(quantity)["value"])

    def std_error(self, quantity: str) -> float:
        """The standard error of a quantity, by measurements, walks and uncertain quantities."""
        return float(self._one(quantity)["std_error"])

    def _one(self, quantity: str) -> dict[str, Any]:
        for own in self._raw["quantities"]:
            if own["name"] == quantity:
                return dict(own)
        raise KeyError(f"there is no quantity {quantity!r}")

    @property
    def covariance(self) -> Array:
        """The covariance of the quantities, in their order."""
        return np.array(self._raw["covariance"], dtype=float)

    @property
    def deviations(self) -> dict[str, float]:
        """By the name of every measured target what was measured less what was fitted, in standard errors."""
        return {own["name"]: float(own["deviation"]) for own in self._raw["targets"]}

    def to_pandas(self) -> pandas.DataFrame:
        """A table with a row for each quantity; needs pandas."""
        import pandas

        return pandas.DataFrame(self._raw["quantities"])


class Sweep(_Report):
    """How the standard deviation of the mean falls with the number of cells."""

    @property
    def cells(self) -> Array:
        """The numbers of cells."""
        return np.array([row["cells"] for row in self._raw["rows"]], dtype=float)

    @property
    def std_devs(self) -> Array:
        """The standard deviation of a preconditioned walk, by the number of cells."""
        return np.array([_number(row["std_dev"]) for row in self._raw["rows"]])


@dataclass(frozen=True)
class Field:
    """The global estimate: u at points, from one set of walks.

    Attributes
    ----------
    points : numpy.ndarray
        The coordinates, a row for each point.
    values, std_errors : numpy.ndarray
        The estimates and their standard errors.
    bands : numpy.ndarray
        Half of the width of the band that holds at all points together with probability 95 %.
    iterates : numpy.ndarray
        The deterministic part F + T_K v, without an error bar.
    summary : dict
        How it was computed.
    """

    points: Array
    values: Array
    std_errors: Array
    bands: Array
    iterates: Array
    summary: dict[str, Any] = field(repr=False)

    def to_pandas(self) -> pandas.DataFrame:
        """A table with a row for each point: its coordinates, the value, and its errors; needs pandas."""
        import pandas

        return pandas.DataFrame({**self._coordinates(), **self._columns()})

    def to_xarray(self) -> xarray.Dataset:
        """A dataset along the dimension ``point``; needs xarray."""
        import xarray

        variables = {name: ("point", column) for name, column in self._columns().items()}
        return xarray.Dataset(variables, {name: ("point", x) for name, x in self._coordinates().items()})

    def _coordinates(self) -> dict[str, Array]:
        return {f"x{axis + 1}": x for axis, x in enumerate(self.points.T)}

    def _columns(self) -> dict[str, Array]:
        return {"value": self.values, "std_error": self.std_errors, "band": self.bands, "iterate": self.iterates}

    def plot(self, ax: Optional[Axes] = None) -> Axes:
        """Draws the curve with its band, or the map; needs matplotlib."""
        from .pictures import plot_points

        return plot_points(self.points, self.values, self.bands, ax)


#: The most surfaces of a table of form factors with its zeros.
MOST_OF_TABLE = 20_000


class Factors:
    """Form factors: of the energy that leaves surface I, ``matrix[I, J]`` is the share that arrives at J.

    Attributes
    ----------
    names : list of str
        The names of the surfaces.
    areas : numpy.ndarray or None
        The areas of the surfaces, of scenes in space.
    error : float or None
        The largest error that a form factor between two polygons is estimated to have.
    """

    def __init__(
        self,
        names: list[str],
        matrix: Optional[Array] = None,
        areas: Optional[Array] = None,
        error: Optional[float] = None,
    ) -> None:
        self.names = names
        self.areas = areas
        self.error = error
        self._matrix = matrix
        self._triplets: Optional[tuple[npt.NDArray[np.int64], npt.NDArray[np.int64], Array]] = None

    @staticmethod
    def sparse_of(
        names: list[str],
        triplets: tuple[npt.NDArray[np.int64], npt.NDArray[np.int64], Array],
        areas: Array,
        error: float,
    ) -> Factors:
        """Form factors by rows, columns and values of those that are not 0."""
        own = Factors(names, None, areas, error)
        own._triplets = triplets
        return own

    def __repr__(self) -> str:
        kept = f"{len(self._triplets[2]):,} of them not 0, " if self._triplets else ""
        return f"<Factors between {len(self.names):,} surfaces, {kept}error {self.error or 0.0:.1g}>"

    @property
    def triplets(self) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64], Array]:
        """The rows, the columns, and the values of all factors that are not 0."""
        if self._triplets is None:
            rows, columns = np.nonzero(self.matrix)
            self._triplets = (rows, columns, self.matrix[rows, columns])
        return self._triplets

    @property
    def matrix(self) -> Array:
        """All factors as a table."""
        if self._matrix is None:
            n = len(self.names)
            if n > MOST_OF_TABLE:
                raise TooLargeError(f"a table of {n:,} × {n:,} numbers is too large: use `triplets`, or `sparse()`")
            rows, columns, values = self.triplets
            self._matrix = np.zeros((n, n))
            self._matrix[rows, columns] = values
        return self._matrix

    def sparse(self) -> Any:
        """The factors as a ``scipy.sparse.csr_array``; needs scipy."""
        rows, columns, values = self.triplets
        n = len(self.names)
        return import_module("scipy.sparse").csr_array((values, (rows, columns)), shape=(n, n))

    def to_pandas(self) -> pandas.DataFrame:
        """A table with rows and columns of names; needs pandas."""
        import pandas

        return pandas.DataFrame(self.matrix, index=self.names, columns=self.names)

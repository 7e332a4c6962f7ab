"""Pictures with matplotlib, for those who have it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Optional

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from .result import Result

__all__ = ["plot_points", "plot_result"]

Array = npt.NDArray[np.float64]
#: Half of the width of an interval of 95 % in standard errors.
NORMAL = 1.96


def _axes(ax: Optional[Axes]) -> Axes:
    if ax is not None:
        return ax
    import matplotlib.pyplot as plt

    return plt.subplots(layout="constrained")[1]


def plot_points(points: Array, values: Array, half: Array, ax: Optional[Axes] = None) -> Axes:
    """A curve with its band over points of one coordinate, a map over points of two."""
    ax = _axes(ax)
    if points.shape[1] == 1:
        order = np.argsort(points[:, 0])
        x, u, width = points[order, 0], values[order], half[order]
        ax.plot(x, u)
        ax.fill_between(x, u - width, u + width, alpha=0.3, label="95 %")
        ax.set(xlabel="x", ylabel="u")
        ax.legend()
    elif points.shape[1] == 2:
        shown = ax.tricontourf(points[:, 0], points[:, 1], values, levels=32)
        ax.figure.colorbar(shown, ax=ax, label="u")
        ax.set(xlabel="x1", ylabel="x2", aspect="equal")
    else:
        _bars(ax, [str(i) for i in range(len(values))], values, half)
    return ax


def _bars(ax: Axes, names: list[str], values: Array, half: Array) -> None:
    at = np.arange(len(values))
    ax.errorbar(values, at, xerr=half, fmt="o", capsize=3)
    ax.set_yticks(at, names)
    ax.invert_yaxis()
    ax.set(xlabel="u, with intervals of 95 %")


def _room(ax: Axes, surfaces: list[dict[str, Any]], result: Result) -> None:
    """The walls in the colours of their means."""
    import matplotlib
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    means = {value.name: value for value in result if value.raw.get("over") == value.name}
    numbers = [value.value for value in means.values()]
    norm, inferno = Normalize(min(numbers), max(numbers)), matplotlib.colormaps["inferno"]
    for surface in surfaces:
        points = np.array(surface["points"], dtype=float)
        value = means.get(surface["name"])
        colour = inferno(norm(value.value)) if value else "lightgrey"
        ax.plot(points[:, 0], points[:, 1], color=colour, linewidth=5, solid_capstyle="round")
        if value:
            longest = np.argmax(np.linalg.norm(np.diff(points, axis=0), axis=1))
            middle = points[longest : longest + 2].mean(axis=0)
            text = f"{value.name}\n{value.value:.4g} ± {value.std_error:.1g}"
            ax.annotate(text, middle, ha="center", va="center", fontsize=8, bbox={"fc": "white", "alpha": 0.7, "ec": "none"})
    unit = next(iter(means.values())).unit
    ax.figure.colorbar(ScalarMappable(norm, inferno), ax=ax, label=f"mean of u{f' in {unit}' if unit else ''}")
    ax.set(xlabel="m", ylabel="m", aspect="equal")
    ax.margins(0.15)


def plot_result(result: Result, ax: Optional[Axes] = None) -> Axes:
    """The picture that says most of a result."""
    places = result._places()
    half = NORMAL * result.std_errors
    if places is not None and len(places) > 2 and places.shape[1] <= 2:
        return plot_points(places, result.values, half, ax)
    ax = _axes(ax)
    drawing = result._drawing
    names = {surface["name"] for surface in drawing["surfaces"]} if drawing else set()
    if drawing and any(value.raw.get("over") in names for value in result):
        _room(ax, drawing["surfaces"], result)
    else:
        _bars(ax, result.names, result.values, half)
    return ax

"""Scenes from arrays: vertices, faces, and what they are made of."""

from __future__ import annotations

from dataclasses import dataclass, field
from importlib import import_module
from typing import TYPE_CHECKING, Any, Mapping, Optional, Sequence, Union

import numpy as np
import numpy.typing as npt

from . import _fredholm
from .errors import InputError, NotReachedError
from .problems import Problem, _is_list, _json, _number
from .result import NORMAL, Factors, Times

if TYPE_CHECKING:
    import pandas

__all__ = ["FaceResult", "Scene"]

Array = npt.NDArray[np.float64]
#: A number, one for every face, or numbers by the names of groups.
PerFace = Union[float, Sequence[float], np.ndarray, Mapping[str, float]]

#: What a surface may be made of, with the least and the largest number.
MATERIAL = {
    "reflectance": (0.0, 1.0),
    "emission": (-np.inf, np.inf),
    "emissivity": (0.0, 1.0),
    "temperature": (0.0, 1e6),
    "net_flux": (-np.inf, np.inf),
    "specular": (0.0, 1.0),
    "absorptance": (0.0, 1.0),
}
#: The group of all faces, if there are no others.
ALONE = "faces"
#: More surfaces have no table of net fluxes: each takes walks of its own.
MOST_FLUXES = 64


def _numbers(name: str, value: Any, shape: str, kind: type = float) -> np.ndarray:
    """An array of numbers, or an error that names the argument."""
    try:
        array = np.asarray(value)
        if array.dtype.kind not in "biuf":
            raise InputError(f"{name}: it must be {shape}, of real numbers, not {array.dtype}")
        numbers: np.ndarray = array.astype(kind)
    except (TypeError, ValueError, OverflowError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{name}: it must be {shape}, of numbers") from None
    if kind is int and array.dtype.kind == "f" and not np.array_equal(numbers, array):
        raise InputError(f"{name}: it must be {shape}, of whole numbers")
    return numbers


def _first(wrong: np.ndarray) -> str:
    """The index of the first that is wrong: "[3]" or "[3, 1]"."""
    return str([int(i) for i in np.argwhere(wrong)[0]])


def _vertices(value: Any) -> Array:
    vertices = _numbers("vertices", value, "an array of shape (n, 3)")
    if vertices.ndim != 2 or vertices.shape[1] != 3:
        raise InputError(f"vertices: it must be an array of shape (n, 3), not {vertices.shape}")
    wrong = ~np.isfinite(vertices)
    if wrong.any():
        raise InputError(f"vertices{_first(wrong)}: it must be a finite number")
    return np.ascontiguousarray(vertices)


def _ragged(faces: Any) -> tuple[np.ndarray, np.ndarray]:
    """The numbers of all faces' vertices, and how many each face has."""
    shape = "an array of shape (m, 3) or (m, 4), or a list of lists of the numbers of vertices"
    if isinstance(faces, np.ndarray) or not _is_list(faces):
        array = _numbers("faces", faces, shape, int)
        if array.ndim != 2 or array.shape[1] < 3:
            raise InputError(f"faces: it must be {shape}, not of the shape {array.shape}")
        return np.ascontiguousarray(array.ravel()), np.full(len(array), array.shape[1], dtype=np.int64)
    rows = [_numbers(f"faces[{i}]", face, "a list of the numbers of at least three vertices", int) for i, face in enumerate(faces)]
    for i, row in enumerate(rows):
        if row.ndim != 1 or len(row) < 3:
            raise InputError(f"faces[{i}]: it must be a list of the numbers of at least three vertices")
    counts = np.array([len(row) for row in rows], dtype=np.int64)
    return np.concatenate(rows) if rows else np.empty(0, np.int64), counts


def _of_object(mesh: Any) -> tuple[Any, Any]:
    """Vertices and faces of a mesh of trimesh, meshio or pyvista, by what it has."""
    if hasattr(mesh, "vertices") and hasattr(mesh, "faces"):  # trimesh
        return np.asarray(mesh.vertices), np.asarray(mesh.faces)
    if hasattr(mesh, "points") and hasattr(mesh, "cells") and not hasattr(mesh, "n_points"):  # meshio
        flat = [block.data for block in mesh.cells if block.type in ("triangle", "quad", "polygon")]
        if not flat:
            kinds = ", ".join(sorted({block.type for block in mesh.cells})) or "none"
            raise InputError(f"vertices: this mesh has no cells that are triangles, quads or polygons: its cells are {kinds}")
        return np.asarray(mesh.points), [face for block in flat for face in np.asarray(block)]
    if hasattr(mesh, "points") and not hasattr(mesh, "faces") and hasattr(mesh, "extract_surface"):  # volumes of pyvista
        mesh = mesh.extract_surface()
    if hasattr(mesh, "points") and hasattr(mesh, "faces"):  # pyvista
        padded, at, faces = np.asarray(mesh.faces), 0, []
        while at < len(padded):
            faces.append(padded[at + 1 : at + 1 + padded[at]])
            at += 1 + int(padded[at])
        return np.asarray(mesh.points), faces
    raise InputError(
        f"vertices: a {type(mesh).__name__} has no vertices and faces; give an array of shape (n, 3) and `faces`, "
        "or a mesh of trimesh, meshio or pyvista"
    )


def _groups(groups: Any, faces: int) -> tuple[list[str], np.ndarray]:
    """The names of groups, and the number of that of every face."""
    if groups is None:
        return [ALONE], np.zeros(faces, dtype=np.int64)
    if isinstance(groups, Mapping):
        of = np.full(faces, -1, dtype=np.int64)
        for number, (name, own) in enumerate(groups.items()):
            numbers = _numbers(f"groups[{name!r}]", own, "a list of the numbers of faces", int)
            if numbers.dtype == bool or (numbers < 0).any() or (numbers >= faces).any():
                raise InputError(f"groups[{name!r}]: it must be a list of the numbers of faces, from 0 to {faces - 1}")
            taken = np.asarray(numbers)[of[numbers] >= 0]
            if taken.size:
                raise InputError(f"groups[{name!r}]: face {int(taken.flat[0])} is in another group, too")
            of[numbers] = number
        if (of < 0).any():
            raise InputError(f"groups: face {int(np.argmax(of < 0))} is in no group")
        return [str(name) for name in groups], of
    if not _is_list(groups) or len(groups) != faces:
        found = f"{len(groups)}" if _is_list(groups) else f"{groups!r}"
        raise InputError(f"groups: there must be one for every face, {faces}, not {found}; or a dict of lists of faces by name")
    known: dict[Any, int] = {}
    of = np.array([known.setdefault(_number(name), len(known)) for name in groups], dtype=np.int64)
    return [str(name) for name in known], of


def _per_face(name: str, value: Any, names: list[str], of: np.ndarray) -> np.ndarray:
    """A number for every face; NaN where a dict says nothing of the group."""
    if isinstance(value, Mapping):
        unknown = [str(group) for group in value if str(group) not in names]
        if unknown:
            raise InputError(f"{name}: there is no group {unknown[0]!r}: there are {', '.join(names)}")
        given = {str(group): _number(own) for group, own in value.items()}
        numbers = _numbers(name, [given.get(group, np.nan) for group in names], "a dict of numbers by groups")
        if numbers.ndim != 1:
            raise InputError(f"{name}: it must be a dict of numbers, one for each group")
        for group, own in given.items():
            if own is None or not np.isfinite(own):
                raise InputError(f"{name}[{group!r}]: it must be a finite number")
        return np.asarray(numbers[of])
    numbers = _numbers(name, value, f"a number, or {len(of)} of them, one for every face")
    if numbers.ndim == 0:
        numbers = np.full(len(of), float(numbers))
    if numbers.shape != of.shape:
        raise InputError(f"{name}: there must be one for every face, {len(of)}, not an array of shape {numbers.shape}")
    wrong = ~np.isfinite(numbers)
    if wrong.any():
        raise InputError(f"{name}{_first(wrong)}: it must be a finite number")
    return numbers


def _materials(given: Mapping[str, Any], names: list[str], of: np.ndarray) -> Array:
    """The numbers of every face, in the order of MATERIAL, NaN where one is not given."""
    columns = np.full((len(of), len(MATERIAL)), np.nan)
    for at, (name, (least, most)) in enumerate(MATERIAL.items()):
        if given[name] is None:
            continue
        column = _per_face(name, given[name], names, of)
        wrong = (column < least) | (column > most) | ((column == 0.0) & (name == "emissivity"))
        if wrong.any():
            bound = "more than 0 and at most 1" if name == "emissivity" else f"from {least:g} to {most:g}"
            raise InputError(f"{name}{_first(wrong)} = {column[wrong][0]:g}: it must be {bound}")
        columns[:, at] = column
    light, grey, temperature, flux, sunlight = (
        ~np.isnan(columns[:, own]).all(axis=1) for own in ([0, 1], [2, 3], [3], [4], [6])
    )
    for both, message in (
        (light & (grey | flux), "give either `reflectance` and `emission`, or `emissivity` and `temperature`, or `net_flux`"),
        (sunlight & ~(grey | flux), "`absorptance` is what a surface of temperature or net flux absorbs of sunlight: of light `reflectance` says it"),
        (temperature & flux, "give either `temperature` or `net_flux`: one follows from the other"),
    ):
        if both.any():
            face = int(np.argmax(both))
            raise InputError(f"face {face}, of the group {names[int(of[face])]!r}: {message}")
    return columns


class Scene(Problem):
    """Light or heat between polygons in space, from arrays.

    Parameters
    ----------
    vertices : array of shape (n, 3), or a mesh
        The coordinates of all vertices; or a mesh of trimesh, meshio or pyvista, which has the faces, too.
    faces : array of shape (m, 3) or (m, 4), or list of lists
        The numbers of the vertices of every face, counter-clockwise seen from its active side.
    groups : list of m names, or dict
        The name of the surface of every face; or by the names of surfaces lists of their faces. One surface, "faces", if it is not given.
    reflectance, emission : number, m numbers, or dict
        ρ and F, of all faces, of every face, or by groups. Faces of a group that differ are surfaces of their own, "group 1" and so on.
    emissivity, temperature, net_flux : number, m numbers, or dict
        ε, the temperature in kelvin, and the net flux in W/m², in their place.
    specular : number, m numbers, or dict
        ρ_s, below 1, the part of what arrives that leaves as from a mirror, besides ρ or ε: there `ask` for irradiances, net fluxes or
        temperatures.
    absorptance : number, m numbers, or dict
        α, the part that is absorbed of the light of the sun and of a sky with an `emission`, if it is not ε.
    two_sided : bool or dict
        Whether faces are seen from both sides: their backs are a surface "group (back)".
    sky : float or dict
        What a uniform sky emits, in the unit of u; or a sky as problem files have it. The scene is open then.
    sun : dict or list of dict
        ``{"towards": [x, y, z], "irradiance": E}``, or lamps ``{"at": [x, y, z], "intensity": I}``.
    period : dict
        ``{"x": 6.0, "y": 4.0}``: with which periods the scene, which is open then, repeats without end along these axes.
    open : bool
        Whether light may leave.
    net_fluxes : bool
        Whether results of heat have the net flux of every surface: by default where there are at most 64.

    Examples
    --------
    >>> import fredholm, numpy as np
    >>> corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
    >>> sides = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    >>> cube = fredholm.Scene(corners, [side[::-1] for side in sides], reflectance=0.5, emission=1.0)
    >>> mean = cube.solve(mean=True, walks=2000)["mean"]
    >>> bool(abs(mean.value - 2.0) <= 5 * mean.std_error + 1e-9)
    True
    >>> lit = cube.irradiance(walks=1000)
    >>> lit.values.shape, bool((abs(lit.values - 2.0) <= 5 * lit.std_errors + 1e-9).all())
    ((6,), True)
    """

    def __init__(
        self,
        vertices: Any,
        faces: Optional[Any] = None,
        *,
        groups: Optional[Any] = None,
        reflectance: Optional[PerFace] = None,
        emission: Optional[PerFace] = None,
        emissivity: Optional[PerFace] = None,
        temperature: Optional[PerFace] = None,
        net_flux: Optional[PerFace] = None,
        specular: Optional[PerFace] = None,
        absorptance: Optional[PerFace] = None,
        two_sided: Union[bool, Mapping[str, bool]] = False,
        sky: Optional[Any] = None,
        sun: Optional[Any] = None,
        period: Optional[Mapping[str, float]] = None,
        open: Optional[bool] = None,
        net_fluxes: Optional[bool] = None,
    ) -> None:
        if faces is None:
            vertices, faces = _of_object(vertices)
        self.vertices = _vertices(vertices)
        corners, counts = _ragged(faces)
        wrong = (corners < 0) | (corners >= len(self.vertices))
        if wrong.any():
            at = int(np.argmax(wrong))
            face = int(np.searchsorted(np.cumsum(counts), at, side="right"))
            raise InputError(f"faces[{face}]: there is no vertex {int(corners[at])}: there are {len(self.vertices)}")
        if not len(counts):
            raise InputError("faces: there are none")
        self._corners, self._counts = corners.astype(np.int64), counts
        names, of = _groups(groups, len(counts))
        given = dict(
            reflectance=reflectance,
            emission=emission,
            emissivity=emissivity,
            temperature=temperature,
            net_flux=net_flux,
            specular=specular,
            absorptance=absorptance,
        )
        self._has_material = any(own is not None for own in given.values())
        columns = _materials(given, names, of)
        if isinstance(two_sided, Mapping):
            unknown = [str(name) for name in two_sided if str(name) not in names]
            if unknown:
                raise InputError(f"two_sided: there is no group {unknown[0]!r}: there are {', '.join(names)}")
            both = {str(name): bool(own) for name, own in two_sided.items()}
        elif isinstance(two_sided, (bool, np.bool_)):
            both = dict.fromkeys(names, bool(two_sided))
        else:
            raise InputError(f"two_sided = {two_sided!r}: it must be True or False, or a dict of these by groups")
        # Faces of one group and one material are a surface; no number is infinite, and NaN would differ from itself.
        told = np.column_stack([of, np.where(np.isnan(columns), np.inf, columns)])
        kinds, surface_of = np.unique(told, axis=0, return_inverse=True)
        kinds = np.where(np.isinf(kinds), np.nan, kinds)
        of_group = kinds[:, 0].astype(int)
        counts_of = np.bincount(of_group, minlength=len(names))
        # They are sorted by groups.
        first = np.concatenate([[0], np.cumsum(counts_of)])
        self._surfaces = []
        for number, kind in enumerate(kinds):
            group = names[of_group[number]]
            name = f"{group} {number - first[of_group[number]] + 1}" if counts_of[of_group[number]] > 1 else group
            self._surfaces.append((name, both.get(group, False), [float(own) for own in kind[1:]]))
        self._surface_of = surface_of.ravel().astype(np.int64)
        self.groups, self.group_of = names, of
        problem: dict[str, Any] = {"kind": "scene"}
        if sky is not None:
            problem["sky"] = dict(sky) if isinstance(sky, Mapping) else {"emission": self._real("sky", sky)}
        if period is not None:
            problem["period"] = dict(period)
        if open is not None:
            problem["open"] = bool(open)
        if net_fluxes is None and len(self._surfaces) > MOST_FLUXES and np.isfinite(columns[:, 2:5]).any():
            net_fluxes = False
        if net_fluxes is not None:
            problem["net_fluxes"] = bool(net_fluxes)
        if sun is not None:
            lights = [sun] if isinstance(sun, Mapping) else sun
            if not _is_list(lights) or not all(isinstance(light, Mapping) for light in lights):
                raise InputError(f"sun = {sun!r}: it must be a dict such as {{'towards': [0, 0, 1], 'irradiance': 800}}, or a list of these")
            problem["light"] = [dict(light) for light in lights]
        super().__init__("<Scene>", _fredholm.Task.text_of(_json({"problem": problem})), 3)
        self.check()

    @staticmethod
    def _real(name: str, value: Any) -> float:
        if isinstance(value, bool) or not isinstance(_number(value), (int, float)):
            raise InputError(f"{name} = {value!r}: it must be a number, or a dict")
        return float(value)

    @property
    def faces(self) -> list[np.ndarray]:
        """The numbers of the vertices of every face."""
        return np.split(self._corners, np.cumsum(self._counts)[:-1])

    @property
    def surfaces(self) -> list[str]:
        """The names of the surfaces, of which results are."""
        return [name for name, _, _ in self._surfaces]

    def _mesh(self) -> _fredholm.Mesh:
        return _fredholm.Mesh(self.vertices, self._corners, self._counts, self._surface_of, self._surfaces)

    def solve(self, **asked: Any) -> Any:
        """Estimates u, or another quantity, at points or over surfaces.

        ``ask="irradiance"``, ``ask="net_flux"`` and ``ask="temperature"`` are the others: ``target_error`` is then that of them, of a
        temperature in kelvin.

        ``over`` takes names of groups: a group of several surfaces is asked for as all of them. All else is as in
        :meth:`Problem.solve`.
        """
        return super().solve(**self._of_groups(asked))

    def times(self, times: Any, **asked: Any) -> Times:
        """Targets under suns and skies over time, as :meth:`Problem.times`; ``over`` takes names of groups."""
        return super().times(times, **self._of_groups(asked))

    def _of_groups(self, asked: dict[str, Any]) -> dict[str, Any]:
        """What is asked for, with the surfaces of groups."""
        self._need_material()
        over = asked.get("over")
        if isinstance(over, str) and over != "all":
            over = [over]
        if over is not None and _is_list(over):
            asked["over"] = {name: self._parts(name) for name in over}
        return asked

    def _parts(self, group: Any) -> Any:
        """The surfaces of a group, or what is a surface by itself."""
        if group in self.groups:
            number = self.groups.index(group)
            kinds = np.unique(self._surface_of[self.group_of == number])
            names = [self._surfaces[kind][0] for kind in kinds]
            return names if len(names) > 1 else names[0]
        return group

    def _need_material(self) -> None:
        if not self._has_material:
            raise InputError(
                "this scene has no materials, and serves form factors: give `reflectance` and `emission`, or `emissivity` and `temperature`"
            )

    def radiosity(self, **options: Any) -> FaceResult:
        """u of every face, as :meth:`irradiance` has that."""
        return self._faces("u", options)

    def net_flux(self, **options: Any) -> FaceResult:
        """The net flux out of every face in W/m², as :meth:`irradiance` has what arrives."""
        return self._faces("net_flux", options)

    def irradiance(self, **options: Any) -> FaceResult:
        """The irradiance of every face, without bias, with an error bar each.

        Parameters
        ----------
        walks : int
            Walks of each face, 256 by default; with ``target_error`` the first ones, which tell how many it takes, 32 by default.
        target_error : float
            The standard error that every face shall have; with ``relative`` as a share of the largest value.
        cells : int
            With cells a neighbour equation is solved first, which takes some time and most of the noise; without, walks are plain.
        **options
            ``degree``, ``seed``, ``scalar``, ``threads``, ``relative``.

        Returns
        -------
        FaceResult
        """
        return self._faces("irradiance", options)

    def _faces(self, quantity: str, options: dict[str, Any]) -> FaceResult:
        self._need_material()
        known = {"walks", "target_error", "relative", "cells", "degree", "seed", "scalar", "threads"}
        unknown = set(options) - known
        if unknown:
            raise InputError(f"{', '.join(sorted(unknown))}: unknown; options are {', '.join(sorted(known))}")
        options.setdefault("walks", 256 if options.get("target_error") is None else 32)
        if not options.get("relative"):
            options.pop("relative", None)
        found = self._task(self._targets(mean=True)).faces(quantity, options)
        result = FaceResult(
            quantity,
            found.values,
            found.std_errors,
            found.unit,
            found.areas,
            found.back_values if any(both for _, both, _ in self._surfaces) else None,
            found.back_std_errors if any(both for _, both, _ in self._surfaces) else None,
            found.bands,
            found.walks,
            found.seconds,
            self,
        )
        worst = np.nanmax(result.std_errors, initial=0.0)
        if found.bound is not None and worst > found.bound:
            raise NotReachedError(f"the error {found.bound:.3g} was not reached: the largest is {worst:.3g}", result)
        return result

    def factors(self, *, error: float = 1e-9, threads: Optional[int] = None) -> Factors:
        """Form factors between the surfaces: those that are not 0, with areas and an error.

        Parameters
        ----------
        error : float
            The error to which form factors behind obstacles are computed.
        threads : int
            The number of threads; all cores if it is not given.
        """
        found = self._task(self._targets(mean=True)).sparse_factors(error, {"threads": threads})
        return Factors.sparse_of(found.names, (found.rows, found.columns, found.factors), found.areas, found.error)

    def plot(self, values: Optional[Any] = None, *, plotter: Optional[Any] = None, **options: Any) -> Any:
        """Draws the faces, in the colours of numbers if some are given, one for each; needs pyvista.

        Returns the plotter, whose ``show()`` opens a window; ``options`` go to its ``add_mesh``.
        """
        pyvista = import_module("pyvista")
        at = np.insert(self._corners, np.concatenate([[0], np.cumsum(self._counts)[:-1]]), self._counts)
        mesh = pyvista.PolyData(self.vertices, at)
        if values is not None:
            numbers = np.asarray(getattr(values, "values", values), dtype=float)
            if numbers.shape != self._counts.shape:
                raise InputError(f"values: there must be one for every face, {len(self._counts)}, not an array of shape {numbers.shape}")
            name = getattr(values, "quantity", "values")
            mesh.cell_data[name] = numbers
            options.setdefault("scalars", name)
        drawn: Any = pyvista.Plotter() if plotter is None else plotter
        drawn.add_mesh(mesh, **options)
        return drawn

    def __repr__(self) -> str:
        kinds = ", ".join(self.surfaces[:8]) + (", …" if len(self._surfaces) > 8 else "")
        return f"<Scene: {len(self._counts):,} faces, {len(self._surfaces):,} surfaces: {kinds}>\n{self._text.rstrip()}"


@dataclass(frozen=True)
class FaceResult:
    """A quantity on every face of a scene, with an error bar each.

    Attributes
    ----------
    quantity : str
        "u", "irradiance" or "net_flux".
    values, std_errors : numpy.ndarray
        The mean over each face and its standard error; NaN where others cover all of it.
    unit : str or None
        The unit of both.
    areas : numpy.ndarray
        The area of each face that others do not cover.
    back_values, back_std_errors : numpy.ndarray or None
        Those of the backs of faces that are seen from both sides.
    bands : numpy.ndarray
        Half the width of a band that holds all values at once with probability 95 %, at each face; NaN of fewer than 32 walks a face.
    walks : int
        The number of all walks.
    seconds : float
        The time that they took, with the set-up.
    """

    quantity: str
    values: Array
    std_errors: Array
    unit: Optional[str]
    areas: Array
    back_values: Optional[Array]
    back_std_errors: Optional[Array]
    bands: Array
    walks: int
    seconds: float
    scene: Scene = field(repr=False)

    @property
    def intervals(self) -> Array:
        """The intervals that hold the true values with probability 95 % each, of shape (m, 2)."""
        half = NORMAL * self.std_errors
        return np.stack([self.values - half, self.values + half], axis=1)

    def __len__(self) -> int:
        return len(self.values)

    def to_pandas(self) -> pandas.DataFrame:
        """A table with a row for each face; needs pandas."""
        import pandas

        groups = [self.scene.groups[int(own)] for own in self.scene.group_of]
        return pandas.DataFrame({"group": groups, "area": self.areas, "value": self.values, "std_error": self.std_errors})

    def plot(self, **options: Any) -> Any:
        """Draws the scene in the colours of the values: :meth:`Scene.plot`."""
        return self.scene.plot(self, **options)

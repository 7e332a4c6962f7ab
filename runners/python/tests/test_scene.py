"""Scenes from arrays."""

import math
import os
import pickle
import time
from types import SimpleNamespace
from typing import Any, Callable

import numpy as np
import pytest

import fredholm

CORNERS = np.array([[x, y, z] for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)])
#: The sides of a unit cube, seen from inside: floor, ceiling, left, right, front, back.
SIDES = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3]]
NAMES = ["floor", "ceiling", "left", "right", "front", "back"]
#: Howell's C-11 and C-14: opposite and neighbouring sides of a cube.
OPPOSITE, NEXT = 0.199824895698387, 0.200043776075403


def cube(**more: Any) -> fredholm.Scene:
    return fredholm.Scene(CORNERS, SIDES, **{"groups": NAMES, **more})


def triangles() -> tuple[np.ndarray, np.ndarray]:
    return CORNERS, np.array([t for s in SIDES for t in ([s[0], s[1], s[2]], [s[0], s[2], s[3]])])


def test_factors_are_exact_and_sparse() -> None:
    scene = cube()
    found = scene.factors()
    assert found.names == NAMES
    assert found.areas == pytest.approx(np.ones(6), abs=1e-15)
    assert found.matrix[0, 1] == pytest.approx(OPPOSITE, abs=1e-14)
    assert found.matrix[0, 2] == pytest.approx(NEXT, abs=1e-14)
    rows, columns, values = found.triplets
    assert len(values) == 30 and (rows != columns).all()
    assert found.matrix.sum(axis=1) == pytest.approx(np.ones(6), abs=1e-12)
    sparse = pytest.importorskip("scipy.sparse")
    assert isinstance(found.sparse(), sparse.csr_array) and found.sparse().nnz == 30
    with pytest.raises(fredholm.InputError, match="no materials"):
        scene.solve(mean=True)


def test_per_face_and_per_group_materials() -> None:
    by_group = cube(reflectance={name: 0.5 for name in NAMES}, emission={"ceiling": 1.0})
    by_face = cube(reflectance=np.full(6, 0.5), emission=[0, 1, 0, 0, 0, 0])
    results = [scene.solve(over="floor", walks=4000, cells=24, degree=1) for scene in (by_group, by_face)]
    assert results[0].values.tobytes() == results[1].values.tobytes()
    # Faces of one group that differ are surfaces of their own, and the group all of them.
    one = fredholm.Scene(CORNERS, SIDES, reflectance=0.5, emission=[0, 1, 0, 0, 0, 0])
    assert one.surfaces == ["faces 1", "faces 2"]
    whole = one.solve(over="faces", walks=4000)
    # 1 = ½ · 6 · the mean of u.
    assert abs(whole["faces"].value - 1 / 3) < 5 * whole["faces"].std_error


def test_what_is_asked_for_is_converged() -> None:
    scene = cube(reflectance=0.0, emission={"ceiling": 1.0})
    result = scene.solve(over="floor", ask="irradiance", target_error=1e-3)
    assert result.std_errors[0] <= 1e-3
    assert abs(result.values[0] - OPPOSITE) < 5 * result.std_errors[0]
    assert result["floor"].raw["ask"] == "irradiance"


def test_every_face_has_a_value_with_a_bar() -> None:
    scene = cube(reflectance=0.0, emission={"ceiling": 1.0})
    found = scene.irradiance(walks=2000)
    exact = np.array([OPPOSITE, 0.0, NEXT, NEXT, NEXT, NEXT])
    assert found.values.shape == found.std_errors.shape == (6,) and found.areas == pytest.approx(np.ones(6))
    # The ceiling sees what is dark: no walk scores, and none tells an error.
    assert (abs(found.values - exact) <= 5 * np.nan_to_num(found.std_errors) + 1e-12).all()
    assert np.isnan(found.std_errors).tolist() == [False, True, False, False, False, False]
    assert 2.6 < found.bands.max() / np.nanmax(found.std_errors) < 2.7
    assert found.intervals.shape == (6, 2) and found.walks == 12_000
    assert scene.irradiance(walks=200, threads=1).values.tobytes() == scene.irradiance(walks=200, threads=2).values.tobytes()
    finer = scene.irradiance(target_error=2e-3)
    assert np.nanmax(finer.std_errors) <= 2e-3
    # u is known.
    assert scene.radiosity().values.tolist() == [0, 1, 0, 0, 0, 0] and not scene.radiosity().std_errors.any()


def test_heat_has_net_fluxes() -> None:
    scene = cube(emissivity=1.0, temperature={name: 300.0 + 10.0 * i for i, name in enumerate(NAMES)})
    found = scene.net_flux(walks=2000)
    black = 5.670374419e-8 * (300.0 + 10.0 * np.arange(6)) ** 4
    view = np.full((6, 6), NEXT)
    for i in range(6):
        view[i, i], view[i, i ^ 1] = 0.0, OPPOSITE
    assert found.unit == "W/m2"
    assert (abs(found.values - (black - view @ black)) <= 5 * found.std_errors + 1e-9).all()


def test_both_sides_of_a_plate() -> None:
    plate = fredholm.Scene([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [[0, 1, 2, 3]], reflectance=0.3, two_sided=True, sky=100.0)
    found = plate.irradiance(walks=200)
    assert found.values == pytest.approx([100.0]) and found.back_values == pytest.approx([0.0])
    assert plate.solve(over=["faces", "faces (back)"], ask="irradiance", walks=1000).values == pytest.approx([100.0, 0.0])


def test_mirrors_periods_and_sunlight() -> None:
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], dtype=float)
    # Two plates without end, of which one mirrors a part: the exchange of diffuse ones.
    plates = fredholm.Scene(
        np.concatenate([square, square + [0, 0, 0.5]]),
        [[0, 1, 2, 3], [7, 6, 5, 4]],
        groups=["low", "high"],
        emissivity={"low": 0.5, "high": 0.8},
        temperature={"low": 400.0, "high": 300.0},
        specular={"low": 0.3},
        period={"x": 1.0, "y": 1.0},
    )
    found = plates.net_flux(walks=20_000)
    exact = 5.670374419e-8 * (400.0**4 - 300.0**4) / (1 / 0.5 + 1 / 0.8 - 1)
    assert (abs(found.values - [exact, -exact]) <= 5 * found.std_errors + 1e-6).all() and (found.std_errors < 0.03 * exact).all()
    with pytest.raises(fredholm.InputError, match="this one repeats"):
        plates.factors()
    # A plate in the sun that gives away as heat what it absorbs.
    plate = fredholm.Scene(
        square, [[0, 1, 2, 3]], open=True, net_flux=0.0, emissivity=0.8, absorptance=0.2, sun={"towards": [0, 0, 1], "irradiance": 1000.0}
    )
    kelvin = plate.solve(over="faces", ask="temperature", walks=100).values
    assert kelvin == pytest.approx([(0.2 / 0.8 * 1000.0 / 5.670374419e-8) ** 0.25], rel=1e-9)


def test_meshes_of_others() -> None:
    """By what they have, so that none of them is needed."""
    vertices, faces = triangles()
    as_trimesh = SimpleNamespace(vertices=vertices, faces=faces)
    as_meshio = SimpleNamespace(points=vertices, cells=[SimpleNamespace(type="line", data=[[0, 1]]), SimpleNamespace(type="triangle", data=faces)])
    padded = np.insert(faces, 0, 3, axis=1).ravel()
    as_pyvista = SimpleNamespace(points=vertices, faces=padded, n_points=8)
    for mesh in (as_trimesh, as_meshio, as_pyvista):
        scene = fredholm.Scene(mesh, groups=[NAMES[i // 2] for i in range(12)])
        assert scene.factors().matrix[0, 1] == pytest.approx(OPPOSITE, abs=1e-13)
    with pytest.raises(fredholm.InputError, match="no cells that are triangles"):
        fredholm.Scene(SimpleNamespace(points=vertices, cells=[SimpleNamespace(type="tetra", data=[[0, 1, 2, 3]])]))
    with pytest.raises(fredholm.InputError, match="a int has no vertices"):
        fredholm.Scene(3)


@pytest.mark.parametrize("package", ["trimesh", "meshio", "pyvista"])
def test_meshes_of_others_themselves(package: str) -> None:
    module = pytest.importorskip(package)
    vertices, faces = triangles()
    mesh = {
        "trimesh": lambda: module.Trimesh(vertices, faces, process=False),
        "meshio": lambda: module.Mesh(vertices, [("triangle", faces)]),
        "pyvista": lambda: module.PolyData(vertices, np.insert(faces, 0, 3, axis=1).ravel()),
    }[package]()
    scene = fredholm.Scene(mesh, groups=[NAMES[i // 2] for i in range(12)])
    assert scene.factors().matrix[0, 1] == pytest.approx(OPPOSITE, abs=1e-13)
    if package == "pyvista":
        drawn = scene.plot(np.arange(12.0), plotter=module.Plotter(off_screen=True))
        assert drawn.mesh.cell_data["values"].tolist() == list(range(12))


def test_an_office_of_trimesh() -> None:
    trimesh = pytest.importorskip("trimesh")
    # An office in fifteen lines: a room, a desk, and a lamp under the ceiling.
    room = trimesh.creation.box(bounds=[[0, 0, 0], [4, 3, 2.5]])
    room.invert()
    desk = trimesh.creation.box(bounds=[[1, 1, 0.7], [2.6, 1.8, 0.74]])
    lamp = trimesh.creation.box(bounds=[[1.4, 1.2, 2.3], [2.2, 1.5, 2.35]])
    office = trimesh.util.concatenate([room, desk, lamp])
    part = np.repeat([0, 1, 2], 12)
    up = office.face_normals[:, 2]
    room_part = np.where(up > 0.5, "floor", np.where(up < -0.5, "ceiling", "walls"))
    group = np.where(part == 0, room_part, np.where(part == 2, "lamp", np.where(up > 0.5, "desk top", "desk")))
    rho = {"floor": 0.2, "ceiling": 0.8, "walls": 0.5, "desk": 0.4, "desk top": 0.4, "lamp": 0.3}
    scene = fredholm.Scene(office, groups=list(group), reflectance=rho, emission={"lamp": 3000.0})
    light = scene.solve(over=["desk top", "floor"], ask="irradiance", target_error=0.02, relative=True)
    faces = scene.irradiance(walks=400)
    assert all(light.std_errors <= 0.02 * light.values) and light["desk top"].value > 1.2 * light["floor"].value
    top = faces.values[group == "desk top"].mean()
    assert abs(top - light["desk top"].value) < 5 * math.hypot(light["desk top"].std_error, faces.std_errors[group == "desk top"].max())


def test_pickles_carry_scenes_to_other_processes() -> None:
    scene = cube(reflectance=0.5, emission={"ceiling": 1.0})
    again = pickle.loads(pickle.dumps(scene))
    assert again.surfaces == scene.surfaces
    assert again.solve(mean=True, walks=1000).values.tobytes() == scene.solve(mean=True, walks=1000).values.tobytes()
    if not os.environ.get("FREDHOLM_LONG"):
        return
    joblib = pytest.importorskip("joblib")
    values = joblib.Parallel(n_jobs=2)(joblib.delayed(_floor)(scene, seed) for seed in (1, 2))
    assert values[0] != values[1] and values[0] == _floor(scene, 1)


def _floor(scene: fredholm.Scene, seed: int) -> float:
    return float(scene.solve(over="floor", walks=1000, seed=seed, threads=1)["floor"].value)


def test_many_faces() -> None:
    """A terrain of 20,000 triangles under a sky: some seconds in all, and a bar for each."""
    n = 101
    x, y = np.meshgrid(np.linspace(0, 10, n), np.linspace(0, 10, n))
    vertices = np.column_stack([x.ravel(), y.ravel(), 0.3 * np.sin(2 * x.ravel()) * np.cos(3 * y.ravel())])
    corner = (np.arange(n - 1)[:, None] * n + np.arange(n - 1)).ravel()
    faces = np.concatenate([np.column_stack([corner, corner + 1, corner + n + 1]), np.column_stack([corner, corner + n + 1, corner + n])])
    begun = time.monotonic()
    terrain = fredholm.Scene(vertices, faces, reflectance=0.3, sky=1000.0)
    found = terrain.irradiance(walks=64)
    assert found.values.shape == (20_000,) and np.isfinite(found.std_errors).all()
    assert 800 < found.values.mean() < 1000
    assert time.monotonic() - begun < 60


NAN = CORNERS.copy()
NAN[3, 1] = math.nan

BAD: dict[str, tuple[Callable[[], object], str]] = {
    "vertices in a plane": (lambda: fredholm.Scene(CORNERS[:, :2], SIDES), r"vertices: .*shape \(n, 3\), not \(8, 2\)"),
    "a vertex that is no number": (lambda: fredholm.Scene(NAN, SIDES), r"vertices\[3, 1\]: it must be a finite"),
    "vertices that are words": (lambda: fredholm.Scene([["a", "b", "c"]], SIDES), "vertices: "),
    "complex vertices": (lambda: fredholm.Scene(CORNERS * 1j, SIDES), "vertices: .*real numbers"),
    "faces of two vertices": (lambda: fredholm.Scene(CORNERS, [[0, 1]]), r"faces\[0\]: .*at least three"),
    "a face of a vertex that is none": (lambda: fredholm.Scene(CORNERS, [[0, 1, 2], [0, 1, 8]]), r"faces\[1\]: there is no vertex 8"),
    "a face of a number below 0": (lambda: fredholm.Scene(CORNERS, [[0, 1, -1]]), r"faces\[0\]: there is no vertex -1"),
    "faces of broken numbers": (lambda: fredholm.Scene(CORNERS, np.array([[0.5, 1, 2]])), "faces: .*whole numbers"),
    "an array of faces in one row": (lambda: fredholm.Scene(CORNERS, np.array([0, 1, 2])), r"faces: .*shape \(3,\)"),
    "no faces": (lambda: fredholm.Scene(CORNERS, []), "faces: there are none"),
    "too few groups": (lambda: cube(groups=NAMES[:5]), "groups: there must be one for every face, 6, not 5"),
    "a face without a group": (lambda: cube(groups={"a": [0, 1]}), "groups: face 2 is in no group"),
    "a face in two groups": (lambda: cube(groups={"a": range(6), "b": [2]}), r"groups\['b'\]: face 2 is in another"),
    "a face that is none in a group": (lambda: cube(groups={"a": [9]}), r"groups\['a'\]: .*from 0 to 5"),
    "too few reflectances": (lambda: cube(reflectance=[0.5] * 5), r"reflectance: there must be one for every face, 6, not .*\(5,\)"),
    "a reflectance above 1": (lambda: cube(reflectance=[0.5, 1.2, 0, 0, 0, 0]), r"reflectance\[1\] = 1.2: it must be from 0 to 1"),
    "an emissivity of 0": (lambda: cube(emissivity=0.0), "emissivity.*more than 0"),
    "a temperature that is no number": (lambda: cube(temperature=[300, math.nan, 1, 1, 1, 1]), r"temperature\[1\]: .*finite"),
    "an unknown group": (lambda: cube(emission={"cieling": 1.0}), "emission: there is no group 'cieling': there are floor"),
    "no number of a group": (lambda: cube(emission={"floor": "bright"}), "emission: "),
    "light and heat": (lambda: cube(reflectance=0.5, temperature=300.0), "face 0, of the group 'floor': give either"),
    "a temperature and a net flux": (lambda: cube(temperature=300.0, net_flux={"left": 1.0}), "face 2, .*'left': give either `temperature`"),
    "mirrors of more than all": (lambda: cube(reflectance=0.5, specular=0.6), r"faces\[\d\]: .*specular reflectance"),
    "an absorptance of light": (lambda: cube(reflectance=0.5, absorptance=0.6), "face 0, .*'floor': `absorptance` is"),
    "a period along no axis": (lambda: cube(reflectance=0.5, period={"w": 2.0}), "unknown key `w`"),
    "no period": (lambda: cube(reflectance=0.5, period={}), "a period is along an axis"),
    "two sides of a group that is none": (lambda: cube(two_sided={"a": True}), "two_sided: there is no group 'a'"),
    "a word for two sides": (lambda: cube(two_sided="yes"), "two_sided = 'yes'"),
    "a word for a sky": (lambda: cube(sky="blue", open=True), "sky = 'blue'"),
    "a sun without a direction": (lambda: cube(reflectance=0.5, sun={"irradiance": 800.0}), "towards"),
    "a hole": (lambda: fredholm.Scene(CORNERS, SIDES[:5]), r"faces\[\d\]: .*light leaves|faces\[\d\]"),
    "a flat triangle": (lambda: fredholm.Scene([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2]], open=True), r"faces\[0\]"),
    "values of another number": (lambda: cube(reflectance=0.5).irradiance(walk=3), "walk: unknown; options are"),
    "an emissivity without a temperature": (lambda: cube(emissivity=0.9).net_flux(), 'an emissivity is given of "floor".*no `temperature`'),
    "net fluxes of light": (lambda: cube(reflectance=0.5, emission=1.0).net_flux(), "a net flux is one of heat"),
}


@pytest.mark.parametrize("name", BAD)
def test_wrong_arguments_are_named(name: str) -> None:
    call, words = BAD[name]
    with pytest.raises(fredholm.InputError, match=words):
        call()


def test_suns_and_skies_over_time() -> None:
    ground = fredholm.Scene([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]], reflectance=0.5, emission=0.0, sky=1.0)
    suns = {"time": ["morning", "noon"], "altitude": [30, 90], "azimuth": np.array([90.0, 180.0]), "beam": [400, 800], "diffuse": [10, 0]}
    found = ground.times(suns, over="faces", ask="irradiance", walks=64)
    assert found.names == ["morning", "noon"]
    assert found["faces"] == pytest.approx([210.0, 800.0], rel=1e-12)
    assert found.std_errors("faces") == pytest.approx([0.0, 0.0], abs=1e-9)
    assert found.mean("faces")[0] == pytest.approx(505.0, rel=1e-12)
    for wrong, message in (
        ({**suns, "beam": [1]}, "equally long, not time 2, altitude 2, azimuth 2, beam 1"),
        ({**suns, "beam": [1, "x"]}, r"times\['beam'\]\[1\] = 'x': it must be a number"),
        ({**suns, "beam": [1, -1]}, "must be 0 or more"),
        ({**suns, "moon": [1, 1]}, "unknown column"),
        (3, "a dict of columns"),
        ("none.csv", "none.csv"),
    ):
        with pytest.raises(fredholm.InputError, match=message):
            ground.times(wrong, mean=True)
    with pytest.raises(fredholm.InputError, match="no setting of times"):
        ground.times(suns, mean=True, cells=3)
    with pytest.raises(KeyError, match="there are faces"):
        found["roof"]

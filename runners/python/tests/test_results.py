"""Results as arrays, tables and pictures."""

import json

import numpy as np
import pytest

import fredholm

CUBE = fredholm.Cube("0.5 * x * y", "x", solution="1.2 * x")


@pytest.fixture(scope="module")
def grid() -> fredholm.Result:
    return CUBE.solve(grid=9, cells=4, walks=2000)


def test_values(grid: fredholm.Result) -> None:
    assert len(grid) == 9 and grid.values.dtype == np.float64
    assert grid[0].value == float(grid[0]) == grid.values[0]
    low, high = grid[3].interval
    assert low < grid[3].value < high
    with pytest.raises(KeyError, match="nothing"):
        grid["nothing"]
    told = grid.to_dict()
    assert json.loads(json.dumps(told)) == told and told["problem"] == "cube"
    assert "target" in grid.table() and repr(grid) == grid.table().rstrip()
    assert "<table>" in grid._repr_html_()
    assert abs(grid.values - 1.2 * grid._places()[:, 0]).max() < 0.05


def test_frames(grid: fredholm.Result) -> None:
    frame = pytest.importorskip("pandas") and grid.to_pandas()
    assert list(frame.columns)[:3] == ["x1", "value", "std_error"] and len(frame) == 9
    data = pytest.importorskip("xarray") and grid.to_xarray()
    assert data["value"].shape == (9,) and data.attrs["cells"] == 4 and "x1" in data.coords


def test_frames_of_fields_and_walls() -> None:
    pytest.importorskip("pandas")
    pytest.importorskip("xarray")
    field = fredholm.Cube("0.2", "x1 + x2", dimension=2).field(3)
    frame = field.to_pandas()
    assert list(frame.columns) == ["x1", "x2", "value", "std_error", "band", "iterate"] and len(frame) == 9
    assert frame["x1"].to_list() == field.points[:, 0].tolist() and "x2" in field.to_xarray().coords
    plane = fredholm.Cube("0.2", "x1 + x2", dimension=2).solve(grid=[3, 2], walks=500).to_pandas()
    assert plane["x2"].to_list() == [0.0, 1.0] * 3
    circle = fredholm.Circle(0.5, 1.0).solve(grid=4, walks=500).to_pandas()
    assert len(set(circle["x1"])) == 4
    walls = [
        {"name": "floor", "points": [[0, 0], [1, 0]], "reflectance": 0.5, "emission": 1.0},
        {"name": "rest", "points": [[1, 0], [1, 1], [0, 1], [0, 0]], "reflectance": 0.5, "emission": 0.0},
    ]
    room = fredholm.Room(walls).solve(grid={"floor": 3}, walks=500).to_pandas()
    assert list(room.columns[:4]) == ["surface", "t", "x1", "x2"] and set(room["surface"]) == {"floor"}
    assert room["x1"].to_list() == room["t"].to_list() and set(room["x2"]) == {0.0}
    # The mean has no place.
    both = CUBE.solve(at=0.5, mean=True, walks=500).to_pandas()
    assert both["x1"].isna().to_list() == [True, False]


def test_pictures(grid: fredholm.Result) -> None:
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    assert grid.plot().get_ylabel() == "u"
    walls = [
        {"name": "floor", "points": [[0, 0], [1, 0]], "reflectance": 0.5, "emission": 1.0},
        {"name": "rest", "points": [[1, 0], [1, 1], [0, 1], [0, 0]], "reflectance": 0.5, "emission": 0.0},
    ]
    room = fredholm.Room(walls).solve(over=["floor", "rest"], walks=2000)
    assert room.plot().get_xlabel() == "m"
    assert "95 %" in CUBE.solve(mean=True, walks=500, cells=4).plot().get_xlabel()
    plane = fredholm.Cube("0.2", "x1 + x2", dimension=2).solve(grid=[4, 4], walks=500, cells=4)
    assert plane.plot().get_xlabel() == "x1"


def test_fields_sweeps_and_factors() -> None:
    field = CUBE.field(11, cells=4, walks=5000)
    assert field.points.shape == (11, 1)
    assert (abs(field.values - 1.2 * field.points[:, 0]) <= field.bands).all()
    at = CUBE.field(at=[0.25, 0.75], cells=4, walks=5000)
    assert at.values.shape == (2,)
    sweep = CUBE.sweep([4, 8, 16], walks=5000)
    assert sweep.cells.tolist() == [4, 8, 16] and sweep.std_devs[2] < sweep.std_devs[0]
    prediction = CUBE.predict(1e-6)
    assert prediction is not None and prediction.walks > 0 and prediction.method == "resolvent"
    on_cells = CUBE.predict(1e-6, cells=5, method="walks")
    assert on_cells is not None and on_cells.method == "walks" and on_cells.cells == 5
    room = fredholm.Room([
        {"name": "floor", "points": [[0, 0], [1, 0]], "reflectance": 0.5, "emission": 1.0},
        {"name": "rest", "points": [[1, 0], [1, 1], [0, 1], [0, 0]], "reflectance": 0.5, "emission": 0.0},
    ])
    factors = room.factors()
    assert factors.matrix.sum(axis=1) == pytest.approx([1.0, 1.0], abs=1e-12)
    assert factors.matrix[0] == pytest.approx([0.0, 1.0], abs=1e-12)


def test_factors_of_a_scene(tmp_path) -> None:
    corners = [(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1)]
    faces = {"floor": (1, 2, 4, 3), "roof": (5, 7, 8, 6), "w": (1, 3, 7, 5), "e": (2, 6, 8, 4), "s": (1, 5, 6, 2), "n": (3, 4, 8, 7)}
    lines = [f"v {x} {y} {z}" for x, y, z in corners]
    for name, face in faces.items():
        lines += [f"usemtl {name}", "f " + " ".join(map(str, face))]
    file = tmp_path / "cube.obj"
    file.write_text("\n".join(lines) + "\n")
    factors = fredholm.factors(file)
    # Hottel: opposite squares of a cube.
    assert factors.matrix[0, 1] == pytest.approx(0.19982489569838746, abs=1e-12)
    assert factors.areas == pytest.approx(np.ones(6)) and factors.error is not None


def test_settings_reach_the_walks() -> None:
    told = CUBE.solve(mean=True, cells=4, walks=2048, sequence="sobol", forced_steps=4).to_dict()
    assert (told["sequence"], told["forced_steps"], told["absorption"]) == ("sobol", 4, 0.2)
    assert CUBE.solve(mean=True, cells=4, walks=2048, method="walks").to_dict()["absorption"] is None
    assert CUBE.solve(mean=True, walks=500, method="paper").to_dict()["form"] == "product"
    assert CUBE.solve(mean=True, walks=500).to_dict()["method"] == "resolvent"
    assert CUBE.solve(mean=True, cells=4, walks=2048, absorption=0.25).to_dict()["absorption"] == 0.25
    assert fredholm.Circle(0.5, 1.0).solve(mean=True, cells=4, lift=2, walks=500).to_dict()["lift"] == 2
    assert CUBE.solve(mean=True, cells=4, points=2, walks=500).to_dict()["method"] == "walks"
    whole = CUBE.solve(grid=3, cells=4, walks=6400, global_=True, method="walks", score_degree=3).to_dict()["whole"]
    assert whole["score_degree"] == 3
    prediction = CUBE.predict(1e-6)
    assert prediction is not None and prediction.absorption is None
    with pytest.raises(fredholm.InputError, match="last_step"):
        CUBE.solve(mean=True, cells=4, walks=500, last_step=True)
    # The way back of all but scenes.
    ways: list[dict[str, bool]] = [{"adjoint": True}, {"global_": True}]
    back, whole = [CUBE.solve(mean=True, cells=4, walks=6400, method="walks", **way).values for way in ways]
    assert back == whole

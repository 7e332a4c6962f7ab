"""The program's files of form factors, read by what others read them with."""

import csv
import struct
import subprocess
import zlib
from pathlib import Path

import numpy as np
import pytest

from test_bits import program

#: A unit cube, whose floor is a pentagon and a triangle, seen from inside.
VERTICES = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1], [1, 0.5, 0], [0.5, 1, 0]]
FACES = {
    "floor": [[1, 2, 9, 10, 4], [9, 3, 10]],
    "ceiling": [[5, 8, 7, 6]],
    "walls": [[1, 5, 6, 2], [2, 6, 7, 3], [3, 7, 8, 4], [4, 8, 5, 1]],
}
#: Howell's C-11: between opposite sides of a cube.
OPPOSITE = 0.199824895698387


def written(folder: Path, out: str, *more: str, surfaces: dict[str, list[list[int]]] = FACES) -> Path:
    lines = [f"v {x} {y} {z}" for x, y, z in VERTICES]
    for name, faces in surfaces.items():
        lines += [f"g {name}", *("f " + " ".join(map(str, face)) for face in faces)]
    mesh = folder / "cube.obj"
    mesh.write_text("\n".join(lines) + "\n")
    subprocess.run([program(), "factors", str(mesh), "--out", str(folder / out), *more], capture_output=True, check=True)
    return folder / out


def test_openfoam(tmp_path: Path) -> None:
    foamlib = pytest.importorskip("foamlib")
    factors = foamlib.FoamFile(written(tmp_path, "F", "--faces"))
    faces = foamlib.FoamFile(tmp_path / "globalFaceFaces")
    assert (factors.class_, faces.class_) == ("scalarListList", "labelListList")
    whole = np.zeros((7, 7))
    for i, (row, to) in enumerate(zip(factors[None], faces[None], strict=True)):
        whole[i, list(to)] = row
    assert whole.sum(axis=1) == pytest.approx(np.ones(7), abs=1e-12)
    assert whole[2, 0] + whole[2, 1] == pytest.approx(OPPOSITE, abs=1e-12)
    for name in ("subMap", "constructMap"):
        assert [list(own) for own in foamlib.FoamFile(tmp_path / name)[None]] == [list(range(7))]
    size, sent, received, *rest = foamlib.FoamFile(tmp_path / "mapDist")[None]
    assert (size, [list(own) for own in sent]) == (7, [list(range(7))])
    assert [list(own) for own in received] == [list(range(7))] and rest == [0, 0, 0, [], []]


@pytest.mark.parametrize("name", ["zone.idf", "zone.epJSON"])
def test_energyplus(tmp_path: Path, name: str) -> None:
    idfkit = pytest.importorskip("idfkit")
    path = str(written(tmp_path, name, "--zone", "Office"))
    load = idfkit.load_idf if name.endswith(".idf") else idfkit.load_epjson
    (found,) = load(path, version=(24, 2, 0))["ZoneProperty:UserViewFactors:BySurfaceName"]
    found = found.to_dict()
    assert found["zone_or_zonelist_or_space_or_spacelist_name"] == "Office"
    pairs = {(own["from_surface"], own["to_surface"]): own["view_factor"] for own in found["view_factors"]}
    assert len(pairs) == 7
    assert pairs["floor", "ceiling"] == pytest.approx(OPPOSITE, abs=1e-9)


def test_the_digest_of_a_mesh(tmp_path: Path) -> None:
    """As the manual says; of triangles and plane quadrilaterals, for the program cuts others."""
    surfaces = {**FACES, "floor": [[1, 2, 9, 10], [1, 10, 4], [9, 3, 10]]}
    with written(tmp_path, "f.csv", surfaces=surfaces).open() as file:
        rows = list(csv.DictReader(file))
    digest = 0
    for name, faces in surfaces.items():
        digest = zlib.crc32(name.encode() + b"\0", digest)
        for face in faces:
            corners = np.array([VERTICES[number - 1] for number in face], dtype="<f8")
            digest = zlib.crc32(struct.pack("<I", len(face)) + corners.tobytes(), digest)
    assert {row["mesh_crc32"] for row in rows} == {f"{digest:08x}"}
    assert all(float(row["bound"]) < 1e-9 for row in rows)
    assert [float(row["area"]) for row in rows if row["to"] == "walls"] == pytest.approx([1, 1, 4])

"""The notebooks run from the first cell to the last, and say what they say in the repository, times aside."""

from pathlib import Path

import pytest

nbformat = pytest.importorskip("nbformat")
nbclient = pytest.importorskip("nbclient")

NOTEBOOKS = sorted((Path(__file__).resolve().parents[1] / "notebooks").glob("*.ipynb"))


def shown(notebook) -> list[set[str]]:
    """For each cell, what kinds of output it has."""
    return [{kind for out in cell.get("outputs", []) for kind in out.get("data", {"text": 0})} for cell in notebook.cells]


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebook(path: Path) -> None:
    kept = nbformat.read(path, 4)
    wanted = shown(kept)
    nbclient.NotebookClient(kept, timeout=300, kernel_name="python3").execute()
    assert shown(kept) == wanted
    assert any("image/png" in kinds for kinds in wanted)


def test_there_are_six() -> None:
    assert len(NOTEBOOKS) == 6

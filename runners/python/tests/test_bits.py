"""The bits are those of the program, for every example file."""

import json
import os
import subprocess
from pathlib import Path

import pytest

import fredholm

ROOT = Path(__file__).resolve().parents[3]
EXAMPLES = sorted((ROOT / "examples").glob("*.toml"))


def program() -> str:
    """The program of the same checkout: FREDHOLM, or the one that cargo built."""
    given = os.environ.get("FREDHOLM")
    built = [ROOT / "target" / profile / "fredholm" for profile in ("release", "debug")]
    found = [given] if given else [str(path) for path in built if path.exists()]
    if not found:
        pytest.skip("the program is not built: cargo build --release")
    return found[0]


def untimed(report: dict) -> dict:
    """A report without what a clock measured."""
    if isinstance(report, dict):
        measured = {"setup_seconds", "walk_seconds", "seconds", "pilot_seconds"}
        return {k: untimed(v) for k, v in report.items() if k not in measured}
    if isinstance(report, list):
        return [untimed(item) for item in report]
    return report


@pytest.mark.parametrize("scalar", ["f64", "f32"])
@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_bits(example: Path, scalar: str) -> None:
    walks = 5000
    command = [program(), "solve", str(example), "--json", "--walks", str(walks), "--scalar", scalar]
    wanted = subprocess.run(command, capture_output=True, text=True, check=False)
    problem = fredholm.load(example)
    # The walks may end before the error that a file asks for.
    if wanted.returncode == 3:
        with pytest.raises(fredholm.NotReachedError) as ended:
            problem.solve(walks=walks, scalar=scalar, threads=1)
        assert untimed(ended.value.result.to_dict()) == untimed(json.loads(wanted.stdout))
        return
    if wanted.returncode != 0:
        with pytest.raises(fredholm.FredholmError) as refused:
            problem.solve(walks=walks, scalar=scalar)
        assert str(refused.value).split(":")[-1].strip() in wanted.stderr
        return
    found = problem.solve(walks=walks, scalar=scalar, threads=1).to_dict()
    assert untimed(found) == untimed(json.loads(wanted.stdout))


def test_examples_are_there() -> None:
    assert len(EXAMPLES) >= 7


def test_a_formula_has_the_bits_of_a_file(tmp_path: Path) -> None:
    cube = fredholm.Cube("0.5 * exp(-(x1 - y1)^2 - (x2 - y2)^2)", "1 + x1", dimension=2)
    asked = {"at": [0.2, 0.7], "mean": True, "weight": "x1 * x2", "target_error": 1e-4, "seed": 7}
    own = cube.solve(**asked)
    again = cube.solve(**asked, threads=1)
    assert own.values.tobytes() == again.values.tobytes()
    file = tmp_path / "cube.toml"
    targets = (
        '[[target]]\nname = "mean"\nover = "all"\n'
        '[[target]]\nname = "x1 * x2"\nweight = "x1 * x2"\n[[target]]\nname = "p"\nat = [0.2, 0.7]\n'
    )
    file.write_text(f"{cube.text}\n{targets}[walk]\ntarget_error = 1e-4\nseed = 7\n")
    assert fredholm.load(file).solve().values.tobytes() == own.values.tobytes()

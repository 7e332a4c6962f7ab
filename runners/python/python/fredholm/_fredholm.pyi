from typing import Any, Callable, Optional, Sequence

import numpy as np
import numpy.typing as npt

class Functions:
    def __new__(
        cls, dimension: int, kernel: tuple[str, object], source: tuple[str, object]
    ) -> Functions: ...

class Field:
    points: list[list[float]]
    estimates: list[float]
    std_errors: list[Optional[float]]
    bands: list[Optional[float]]
    iterates: list[float]
    summary: str

class Mesh:
    def __new__(
        cls,
        vertices: npt.NDArray[np.float64],
        corners: npt.NDArray[np.int64],
        number_of_corners: npt.NDArray[np.int64],
        surface_of: npt.NDArray[np.int64],
        surfaces: list[tuple[str, bool, list[float]]],
    ) -> Mesh: ...

class FaceArrays:
    values: npt.NDArray[np.float64]
    std_errors: npt.NDArray[np.float64]
    back_values: npt.NDArray[np.float64]
    back_std_errors: npt.NDArray[np.float64]
    areas: npt.NDArray[np.float64]
    unit: Optional[str]
    bands: npt.NDArray[np.float64]
    bound: Optional[float]
    walks: int
    seconds: float

class SparseArrays:
    names: list[str]
    areas: npt.NDArray[np.float64]
    rows: npt.NDArray[np.int64]
    columns: npt.NDArray[np.int64]
    factors: npt.NDArray[np.float64]
    error: float

class Task:
    def __new__(
        cls,
        name: str,
        text: str,
        targets: Optional[str] = None,
        functions: Optional[Functions] = None,
        weights: Sequence[tuple[str, Callable[..., float]]] = ...,
        mesh: Optional[Mesh] = None,
    ) -> Task: ...
    @staticmethod
    def text_of(json: str) -> str: ...
    @staticmethod
    def read(path: str) -> str: ...
    def check(self, options: dict[str, Any]) -> tuple[str, Optional[int], list[str]]: ...
    def solve(
        self,
        options: dict[str, Any],
        progress: Optional[Callable[[int, int], None]] = None,
    ) -> tuple[str, str, str, list[str], Optional[BaseException]]: ...
    def predict(self, options: dict[str, Any]) -> str: ...
    def diagnose(self, options: dict[str, Any]) -> tuple[str, str]: ...
    def sweep(
        self, cells: list[int], walks: int, options: dict[str, Any]
    ) -> tuple[str, str]: ...
    def field(
        self,
        grid: Optional[int],
        points: list[list[float]],
        options: dict[str, Any],
    ) -> Field: ...
    def times(self, name: str, text: str, options: dict[str, Any]) -> tuple[str, str]: ...
    def certify(
        self,
        formulas: list[str],
        function: Optional[Callable[..., float]],
        values: list[float],
        options: dict[str, Any],
    ) -> tuple[str, str]: ...
    def sensitivities(self, options: dict[str, Any]) -> tuple[str, str]: ...
    def fit(
        self,
        quantities: list[str],
        measured: list[tuple[str, float, float, bool]],
        options: dict[str, Any],
    ) -> tuple[str, str]: ...
    def faces(self, quantity: str, options: dict[str, Any]) -> FaceArrays: ...
    def sparse_factors(self, error: float, options: dict[str, Any]) -> SparseArrays: ...
    def factors(self, options: dict[str, Any]) -> tuple[list[str], list[float]]: ...

def is_scene(path: str) -> bool: ...
def scene_factors(
    path: str, error: float, open: bool
) -> tuple[list[str], list[float], list[float], float]: ...

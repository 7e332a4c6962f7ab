from typing import Any, Callable, Optional, Sequence

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

class Task:
    def __new__(
        cls,
        name: str,
        text: str,
        targets: Optional[str] = None,
        functions: Optional[Functions] = None,
        weights: Sequence[tuple[str, Callable[..., float]]] = ...,
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
    def factors(self, options: dict[str, Any]) -> tuple[list[str], list[float]]: ...

def is_scene(path: str) -> bool: ...
def scene_factors(
    path: str, error: float, open: bool
) -> tuple[list[str], list[float], list[float], float]: ...

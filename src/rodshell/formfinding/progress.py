"""How long work says where it is: stage, detail and residual, at every iteration."""

from collections.abc import Callable

Progress = Callable[[str, str, float], None]


def silent(stage: str, detail: str, residual: float) -> None:
    """Says nothing."""

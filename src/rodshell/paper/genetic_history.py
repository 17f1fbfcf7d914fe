"""What a genetic search leaves behind: its generations and its best footprint, kept as JSON in the package's data."""

import json
from dataclasses import asdict, dataclass
from importlib.resources import files
from typing import Any

import numpy as np

from rodshell.arrays import Floats

WINDOW = 20  # generations in which
GAIN = 0.01  # the best must gain less than this share to have converged


@dataclass(frozen=True)
class Generation:
    """Objective [m] of the best of all so far, mean of those that live on; `runs`, `fallen` so far; seconds.

    Parameters
    ----------
    runs : pop-ups made; fallen : of which did not stand.
    seconds : processor time of this generation's pop-ups.
    """

    best: float
    mean: float
    runs: int
    fallen: int
    seconds: float

    def __str__(self) -> str:
        return f"best {1e3 * self.best:.3f} mm, mean {1e3 * self.mean:.3f} mm, {self.runs} pop-ups"


@dataclass(frozen=True)
class History:
    """A whole search.

    Parameters
    ----------
    variables : (n,) the best footprint's, in m; footprint : (2m, 2) its rod ends, start and end of each rod in turn,
        `rods` being the rods' names.
    direct_seconds : processor time of the direct method, on the same machine.
    """

    target: str
    seed: int
    population: int
    generations: tuple[Generation, ...]
    variables: Floats
    rods: tuple[str, ...]
    footprint: Floats
    direct_seconds: float

    @property
    def best(self) -> float:
        return self.generations[-1].best

    @property
    def runs(self) -> int:
        return self.generations[-1].runs

    @property
    def seconds(self) -> float:
        return sum(one.seconds for one in self.generations)

    @property
    def last_gain(self) -> float:
        """Share of its best that the search gained in its last `WINDOW` generations; 1 before there are as many."""
        return gain([one.best for one in self.generations])

    @property
    def converged(self) -> bool:
        return self.last_gain < GAIN

    def text(self) -> str:
        """As JSON, one line for each generation."""
        content: dict[str, Any] = {"format": "rodshell-genetic", "version": 1, "units": "SI"}
        content |= {name: getattr(self, name) for name in ("target", "seed", "population", "direct_seconds", "rods")}
        content |= {"variables": self.variables.tolist(), "footprint": np.round(self.footprint, 9).tolist()}
        lines = ",\n".join(json.dumps(asdict(one)) for one in self.generations)
        head = ",\n".join(f"{json.dumps(key)}: {json.dumps(value)}" for key, value in content.items())
        return f'{{\n{head},\n"generations": [\n{lines}\n]\n}}\n'

    @staticmethod
    def of(text: str) -> "History":
        """From JSON as `text` writes it."""
        content = json.loads(text)
        return History(
            content["target"], content["seed"], content["population"],
            tuple(Generation(**one) for one in content["generations"]), np.array(content["variables"]),
            tuple(content["rods"]), np.array(content["footprint"]), content["direct_seconds"],
        )  # fmt: skip


def gain(best: list[float]) -> float:
    """Share of the best value that was gained in the last `WINDOW` generations; 1 before there are as many."""
    return 1.0 - best[-1] / best[-1 - WINDOW] if len(best) > WINDOW else 1.0


def stored(target: str) -> History | None:
    """The search for the built-in case with a target of this name that came with the package, or None."""
    file = files("rodshell.paper") / "data" / f"genetic-{target}.json"
    return History.of(file.read_text(encoding="utf-8")) if file.is_file() else None


def stored_footprint(target: str) -> Floats | None:
    """(2m, 2) the genetic algorithm's G0 [m]: start and end of each rod of the built-in case in turn; None without."""
    history = stored(target)
    return None if history is None else history.footprint

"""Files of the genetic search: its history, of which some come with the package, and the values of a search that runs.

`History` is a finished search as JSON; `StoredValues` are the values of a search, from which it continues after an
interruption.
"""

import hashlib
import json
import os
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, field
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from rodshell.arrays import Floats
from rodshell.errors import InputError, OutputError
from rodshell.untrusted import read_text

Judged = tuple[float, float]  # value, processor time [s]
Evaluate = Callable[[Floats], Iterator[Judged]]

FORMAT, VERSION = "rodshell-genetic-values", 1
GAIN, WINDOW = 0.01, 20  # converged: the best gains less than this share in so many generations


@dataclass(frozen=True)
class Generation:
    """One generation of a search.

    Args:
        best: objective of the best individual so far [m].
        mean: mean objective of the survivors [m].
        fallen: those of them that were not stable.
        seconds: processor time of this generation's pop-ups [s].
    """

    best: float
    mean: float
    runs: int
    fallen: int
    seconds: float

    def __str__(self) -> str:
        return f"best {1e3 * self.best:.3f} mm, mean {1e3 * self.mean:.3f} mm, {self.runs} pop-ups"


@dataclass(frozen=True, eq=False)
class History:
    """A whole search.

    Args:
        variables: (n,) of the best footprint [m].
        footprint: (2m, 2) its rod ends, start and end of each rod in turn [m].
        direct_seconds: processor time of the direct method on the same machine [s].
    """

    target: str
    seed: int
    population: int
    generations: tuple[Generation, ...]
    variables: Floats
    rods: tuple[str, ...]
    footprint: Floats
    direct_seconds: float

    def __repr__(self) -> str:
        return (
            f"History({self.target}, {len(self.generations)} generations of {self.population}, best {self.best:.3g} m)"
        )

    @property
    def best(self) -> float:
        """Objective of the best individual [m]."""
        return self.generations[-1].best

    @property
    def runs(self) -> int:
        """Pop-ups of the whole search."""
        return self.generations[-1].runs

    @property
    def seconds(self) -> float:
        """Processor time of the whole search [s]."""
        return sum(generation.seconds for generation in self.generations)

    @property
    def last_gain(self) -> float:
        """Share by which the best improved in the last `WINDOW` generations [-]; 1 if there are fewer."""
        return gain([generation.best for generation in self.generations])

    @property
    def converged(self) -> bool:
        """Whether the best gains less than `GAIN` in `WINDOW` generations."""
        return self.last_gain < GAIN

    def json(self) -> str:
        """As JSON, one line for each generation."""
        content: dict[str, Any] = {"format": "rodshell-genetic", "version": 1, "units": "SI"}
        content |= {name: getattr(self, name) for name in ("target", "seed", "population", "direct_seconds", "rods")}
        content |= {"variables": self.variables.tolist(), "footprint": np.round(self.footprint, 9).tolist()}
        lines = ",\n".join(json.dumps(asdict(generation)) for generation in self.generations)
        head = ",\n".join(f"{json.dumps(key)}: {json.dumps(value)}" for key, value in content.items())
        return f'{{\n{head},\n"generations": [\n{lines}\n]\n}}\n'

    @staticmethod
    def of(text: str) -> "History":
        """From JSON as `json` writes it."""
        content = json.loads(text)
        return History(
            content["target"], content["seed"], content["population"],
            tuple(Generation(**generation) for generation in content["generations"]), np.array(content["variables"]),
            tuple(content["rods"]), np.array(content["footprint"]), content["direct_seconds"],
        )  # fmt: skip


def gain(best: list[float]) -> float:
    """Share by which the `best` values improved in the last `WINDOW` generations [-]; 1 if there are fewer."""
    return 1.0 - best[-1] / best[-1 - WINDOW] if len(best) > WINDOW else 1.0


def stored(target: str) -> History | None:
    """The search for the case with a target of this name that comes with the package, or None."""
    file = files("rodshell.paper") / "data" / f"genetic-{target}.json"
    return History.of(file.read_text(encoding="utf-8")) if file.is_file() else None


@dataclass
class StoredValues:
    """The values of all generations of a search, the last perhaps incomplete, and the file that holds them.

    The algorithm depends only on its seed and on these values, which therefore restore it exactly; digests of the
    individuals show whether it is the same search.

    Args:
        digests: of the individuals of each generation.
        values: of the individuals of each generation.
        seconds: processor time of each generation [s].
    """

    file: Path
    digests: list[str] = field(default_factory=list)
    values: list[list[float]] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list)

    @staticmethod
    def read(file: Path) -> "StoredValues":
        """The content of the `file`; empty if there is no file yet.

        Raises:
            InputError: it cannot be read, or does not hold the values of a search.
        """
        if not file.exists():
            return StoredValues(file)
        try:
            content = json.loads(read_text(file))
            if (content["format"], content["version"]) != (FORMAT, VERSION):
                raise ValueError(f"its format is not {FORMAT} {VERSION}")
            digests, values, seconds = (content[name] for name in ("digests", "values", "seconds"))
            numbers = np.concatenate([*values, seconds])
            if not (len(digests) == len(values) == len(seconds) and np.isfinite(numbers).all()):
                raise ValueError("it holds broken generations")
            return StoredValues(file, digests, values, seconds)
        except (ValueError, KeyError, TypeError, RecursionError) as error:
            raise InputError(f"cannot continue the search in {file}: {error!r}; remove it to start again") from error

    def write(self) -> None:
        """Replace the file in one step.

        Raises:
            OutputError: it cannot be written.
        """
        content = {
            "format": FORMAT, "version": VERSION,
            "digests": self.digests, "seconds": self.seconds, "values": self.values,
        }  # fmt: skip
        part = self.file.with_name(f".{self.file.name}.part")
        try:
            self.file.parent.mkdir(parents=True, exist_ok=True)
            part.unlink(missing_ok=True)  # it might be a link
            part.write_text(json.dumps(content) + "\n", encoding="utf-8")
            os.replace(part, self.file)
        except OSError as error:
            raise OutputError(f"cannot write the search to {self.file}: {error.strerror or error}") from error

    def complete(
        self, generation: int, individuals: Floats, evaluate: Evaluate, report: Callable[[int], None]
    ) -> Floats:
        """(k,) values of a generation: those in the file, and the others, which are evaluated and stored now.

        If this is interrupted, the values that were found are in the file.

        Args:
            individuals: (k, n) variables.
            evaluate: yields the values of some of them.
            report: is called with the number of values after each.

        Raises:
            InputError: the individuals in the file were others.
        """
        self._open(generation, individuals)
        values = self.values[generation]
        if len(values) < len(individuals):
            try:
                for value, seconds in evaluate(individuals[len(values) :]):
                    values.append(value)
                    self.seconds[generation] += seconds
                    report(len(values))
            finally:
                self.write()
        return np.array(values)

    def _open(self, generation: int, individuals: Floats) -> None:
        digest = hashlib.sha256(np.ascontiguousarray(individuals).tobytes()).hexdigest()[:16]
        if generation == len(self.digests):
            self.digests.append(digest)
            self.values.append([])
            self.seconds.append(0.0)
        if self.digests[generation] != digest or len(self.values[generation]) > len(individuals):
            raise InputError(
                f"the search in {self.file} is a different one (target, seed, population, or the versions of numpy "
                "and pymoo): choose another folder, or remove it"
            )

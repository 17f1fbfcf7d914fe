"""The values of a genetic search, kept in a file from which it goes on.

The algorithm depends on nothing but its seed and the values that it is told. So the values alone bring it back to
where it was, bit for bit; digests of the individuals tell whether it is the same search.
"""

import hashlib
import json
import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from rodshell.arrays import Floats
from rodshell.errors import InputError, OutputError

Judged = tuple[float, float]  # value, processor time [s]
Evaluate = Callable[[Floats], Iterator[Judged]]

FORMAT, VERSION = "rodshell-genetic-values", 1


@dataclass
class Kept:
    """All generations of a search, the last perhaps in part, and the file that they are kept in.

    Parameters
    ----------
    digests : of the individuals of each generation; values : theirs; seconds : processor time of each generation.
    """

    file: Path
    digests: list[str] = field(default_factory=list)
    values: list[list[float]] = field(default_factory=list)
    seconds: list[float] = field(default_factory=list)

    @staticmethod
    def read(file: Path) -> "Kept":
        """What the file holds; nothing where there is no file yet.

        Raises
        ------
        InputError : it cannot be read, or is not the values of a search.
        """
        try:
            content = json.loads(file.read_text(encoding="utf-8"))
            if (content["format"], content["version"]) != (FORMAT, VERSION):
                raise ValueError(f"its format is not {FORMAT} {VERSION}")
            digests, values, seconds = (content[name] for name in ("digests", "values", "seconds"))
            if not (len(digests) == len(values) == len(seconds) and np.isfinite(np.concatenate(values)).all()):
                raise ValueError("it holds broken generations")
            return Kept(file, digests, values, seconds)
        except FileNotFoundError:
            return Kept(file)
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise InputError(f"cannot go on with the search in {file}: {error!r}; remove it to begin again") from error

    def write(self) -> None:
        """Replace the file in one step.

        Raises
        ------
        OutputError : it cannot be written.
        """
        content = {
            "format": FORMAT, "version": VERSION,
            "digests": self.digests, "seconds": self.seconds, "values": self.values,
        }  # fmt: skip
        beside = self.file.with_name(f".{self.file.name}.part")
        try:
            self.file.parent.mkdir(parents=True, exist_ok=True)
            beside.write_text(json.dumps(content) + "\n", encoding="utf-8")
            os.replace(beside, self.file)
        except OSError as error:
            raise OutputError(f"cannot keep the search in {self.file}: {error.strerror or error}") from error

    def complete(self, generation: int, individuals: Floats, evaluate: Evaluate, told: Callable[[int], None]) -> Floats:
        """(k,) values of a generation's individuals (k, n): those kept, and the others evaluated and kept now.

        Whatever ends this early, the values that were found are in the file.

        Raises
        ------
        InputError : the individuals kept in the file were others.
        """
        self._open(generation, individuals)
        values = self.values[generation]
        if len(values) < len(individuals):
            try:
                for value, seconds in evaluate(individuals[len(values) :]):
                    values.append(value)
                    self.seconds[generation] += seconds
                    told(len(values))
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
                f"the search in {self.file} is another one (target, seed, population, or the versions of numpy and "
                "pymoo): choose another place, or remove it"
            )

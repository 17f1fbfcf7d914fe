"""Variables of a design: values within bounds, what they do to a shell, and how they are built."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from scipy.sparse import csc_array

from rodshell.arrays import Floats
from rodshell.formfinding.trim import Boundary
from rodshell.layout import GridMesh
from rodshell.refining.change import Change
from rodshell.refining.structure import Structure
from rodshell.refining.symmetry import Image, Operation, symmetries, ties


@dataclass(frozen=True, eq=False)
class Grid:
    """A flat grid and where its rods end: what is built.

    Args:
        mesh: the flat grid, its rods with their profiles.
        boundary: where the rods end, and in which directions.
    """

    mesh: GridMesh
    boundary: Boundary


@dataclass(frozen=True, eq=False)
class Box:
    """Values of n variables.

    Args:
        start: (n,) first values.
        lower, upper: (n,) bounds.
        scale: (n,) change that counts as one: the first step is not longer.
    """

    start: Floats
    lower: Floats
    upper: Floats
    scale: Floats

    @staticmethod
    def about_zero(count: int, most: float, first: float) -> "Box":
        """So many variables from -most to most, with one scale `first`."""
        zero = np.zeros(count)
        return Box(zero, zero - most, zero + most, zero + first)


class Variables(ABC):
    """The variables of a family on one shell; on a symmetric one they are `Tied`.

    Attributes:
        stock: the only values that can be built, ascending; None: all within the bounds.
        common: whether adding the same to all of them multiplies every stiffness alike.
        image: where a symmetry maps the variables.
    """

    structure: Structure
    box: Box
    stock: Floats | None = None
    common: bool = False
    image: Callable[[Operation], Image]

    @abstractmethod
    def change(self, values: Floats) -> Change:
        """What a design of values (n,) does, with its derivatives."""

    @abstractmethod
    def applied(self, grid: Grid, values: Floats) -> Grid:
        """The grid built to a design of values (n,), from one before, or with what other variables have changed."""

    def no_change(self) -> Change:
        """No effect of these variables."""
        return Change.none(len(self.structure.mesh.edges), len(self.structure.held), len(self.box.start))


class Family(Protocol):
    """A kind of variables that a user chooses.

    Attributes:
        name: as users write it.
    """

    @property
    def name(self) -> str: ...

    def on(self, structure: Structure) -> Variables:
        """The variables on a shell."""
        ...


@dataclass(frozen=True, eq=False)
class Tied:
    """Variables that are equal, or opposite, to others: those of a symmetric design.

    Args:
        ties: (n, q) with one entry, 1 or -1, in each row: which of the q common values each variable has.
    """

    whole: Variables
    ties: csc_array

    @property
    def box(self) -> Box:
        box, counts = self.whole.box, np.asarray(abs(self.ties).sum(axis=0)).ravel()

        def mean(values: Floats) -> Floats:
            return np.asarray((self.ties.T @ values) / counts)

        first = np.array([self.ties.indices[self.ties.indptr[k]] for k in range(self.ties.shape[1])])
        return Box(mean(box.start), box.lower[first], box.upper[first], box.scale[first])

    def change(self, values: Floats) -> Change:
        whole = self.whole.change(self.ties @ values)
        return replace(
            whole,
            stiffness_slopes=csc_array(whole.stiffness_slopes @ self.ties),
            length_slopes=csc_array(whole.length_slopes @ self.ties),
            held_slopes=np.einsum("pkx,pq->qkx", whole.held_slopes, self.ties.toarray()),
        )

    def applied(self, grid: Grid, values: Floats) -> Grid:
        return self.whole.applied(grid, self.ties @ values)


@dataclass(frozen=True, eq=False)
class Design:
    """The variables of several families, one after the other; `box`, `change` and `applied` as of `Variables`."""

    parts: Sequence[Tied]

    @property
    def box(self) -> Box:
        boxes = [part.box for part in self.parts]
        return Box(
            *(np.concatenate([getattr(box, name) for box in boxes]) for name in ("start", "lower", "upper", "scale"))
        )

    @property
    def stock(self) -> list[Floats | None]:
        """Of each variable the only values that can be built, ascending, or None."""
        return [part.whole.stock for part in self.parts for _ in part.box.start]

    def stiffer(self, values: Floats, logarithm: float) -> Floats:
        """(n,) values that multiply every stiffness by a common factor; unchanged where they cannot do that."""
        return np.concatenate([some + logarithm * part.whole.common for part, some in self._split(values)])

    def change(self, values: Floats) -> Change:
        return Change.together([part.change(some) for part, some in self._split(values)])

    def applied(self, grid: Grid, values: Floats) -> Grid:
        for part, some in self._split(values):
            grid = part.applied(grid, some)
        return grid

    def _split(self, values: Floats) -> list[tuple[Tied, Floats]]:
        begins = np.cumsum([len(part.box.start) for part in self.parts])[:-1]
        return list(zip(self.parts, np.split(values, begins), strict=True))


def design_of(structure: Structure, families: Sequence[Family]) -> Design:
    """The variables of several families on a shell; where it is symmetric, so is every design."""
    mesh, draped = structure.mesh, structure.popped.boundary.draped
    shapes = [structure.popped.positions, *([] if draped is None else [draped])]
    parts = [family.on(structure) for family in families]
    counts = [len(part.box.start) for part in parts]
    shared = max(counts, default=0) > 1  # a single variable is the same for all rods
    operations = symmetries(mesh, np.column_stack(shapes)) if shared else ()
    images = [[part.image(by) for by in operations] for part in parts]
    return Design([Tied(part, ties(count, of)) for part, count, of in zip(parts, counts, images, strict=True)])

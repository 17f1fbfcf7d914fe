"""Families of variables that change the stiffness of rods: a taper, double laths over a share of each rod, stock sizes.

Every rod has a profile of a few numbers, each of which is one of the variables; rods whose numbers are the same
variables have the same profile. The stiffness of the edges by these numbers is an explicit formula
(`model.rod_sections`), whose derivatives are central differences for all rods at once.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from scipy.sparse import csc_array

from rodshell.arrays import Floats, Ints
from rodshell.errors import InputError
from rodshell.layout import Profile
from rodshell.layout.profile import DOUBLE, Varies
from rodshell.refining.change import STIFFNESSES, Change
from rodshell.refining.structure import Structure
from rodshell.refining.symmetry import Image, Operation
from rodshell.refining.variables import Box, Grid, Variables
from rodshell.rods.varied import sizes

_Per = Literal["shell", "family", "rod"]
PROBE = 1e-4  # of a number of a profile: differences are then exact to 1e-8


@dataclass(frozen=True, eq=False)
class Profiles(Variables):
    """Variables that are numbers of profiles.

    Args:
        variable_of: (m, r) variable that is number r of each rod's profile.
    """

    structure: Structure
    variable_of: Ints
    profile: Callable[[Floats], Profile]
    box: Box
    stock: Floats | None = None
    common: bool = False

    def image(self, by: Operation) -> Image:
        index = np.empty(len(self.box.start), dtype=np.intp)
        index[self.variable_of] = self.variable_of[by.rods]
        return Image(index, np.ones(len(index)))

    def applied(self, grid: Grid, values: Floats) -> Grid:
        return replace(grid, mesh=grid.mesh.with_profiles(self._profiles(values[self.variable_of])))

    def change(self, values: Floats) -> Change:
        numbers, rods = values[self.variable_of], self.structure.mesh.edge_rods
        probes = PROBE * np.eye(numbers.shape[1])  # of one number each
        entries = [
            (self._logarithms(numbers + probe) - self._logarithms(numbers - probe)) / (2 * PROBE) for probe in probes
        ]
        columns = np.repeat(self.variable_of[rods].T, STIFFNESSES)
        rows = np.tile(np.arange(STIFFNESSES * len(rods)), len(probes))
        slopes = csc_array((np.ravel(entries), (rows, columns)), shape=(STIFFNESSES * len(rods), len(values)))
        stiffness = self._logarithms(numbers) - np.log(self.structure.edges.table[:, :STIFFNESSES])
        return replace(self.no_change(), stiffness=stiffness, stiffness_slopes=slopes)

    def _profiles(self, numbers: Floats) -> tuple[Profile, ...]:
        made: dict[bytes, Profile] = {}
        return tuple(made.setdefault(row.tobytes(), self.profile(row)) for row in numbers)

    def _logarithms(self, numbers: Floats) -> Floats:
        """(e, 4) of the edges' stiffnesses."""
        mesh = self.structure.mesh
        return np.asarray(np.log(self.structure.stiffness(mesh.with_profiles(self._profiles(numbers)))))


@dataclass(frozen=True)
class Taper:
    """The bending stiffness changes along rods, between that of their section and a part of it.

    Args:
        ratio: of the largest to the smallest EI that is allowed [-].
        per: a profile for the whole shell, for each family, or for each rod.
        stations: at which EI is chosen, from an end of a rod to its middle.
        varies: what of the section is changed, see `Profile`.
    """

    ratio: float = 8.0
    per: _Per = "shell"
    stations: int = 5
    varies: Varies = "size"

    name = "taper"

    def on(self, structure: Structure) -> Profiles:
        """The logarithms of the factors on EI; between them the profile is linear."""
        rods = structure.mesh.grid.rods
        if self.per == "shell":
            group = np.zeros(len(rods), dtype=np.intp)
        elif self.per == "family":
            group = np.unique([rod.family for rod in rods], return_inverse=True)[1].astype(np.intp)
        else:
            group = np.arange(len(rods))
        variable_of = self.stations * group[:, None] + np.arange(self.stations)
        box = Box.about_zero(int(variable_of.max()) + 1, 0.5 * np.log(self.ratio), 1.0)

        def tapered(logs: Floats) -> Profile:
            return Profile.symmetric(np.exp(logs).tolist(), varies=self.varies)

        return Profiles(structure, variable_of, tapered, box, common=True)


@dataclass(frozen=True)
class DoubleLaths:
    """Two equal laths on each other over the middle of every rod; they slip."""

    name = "double"

    def on(self, structure: Structure) -> Profiles:
        """The share of each rod's length that is double, one for all rods."""
        zero = np.zeros((len(structure.mesh.grid.rods), 1), dtype=np.intp)
        box = Box(*np.array([[0.5], [DOUBLE[0]], [DOUBLE[1]], [0.3]]))
        return Profiles(structure, zero, lambda share: Profile.double(float(share[0])), box)


RENARD = (0.63, 0.71, 0.8, 0.9, 1.0, 1.12, 1.25, 1.4, 1.6)  # preferred numbers, series R20 [ISO 3]


@dataclass(frozen=True)
class Sections:
    """One of several sizes in stock for each rod, the same from end to end: its own times the numbers of `RENARD`."""

    name = "sections"

    def on(self, structure: Structure) -> Profiles:
        """The logarithm of the factor on EI of each rod.

        Raises:
            InputError: the section has no size.
        """
        table = np.linspace(-6.0, 6.0, 601)  # of log EI; a size is a power of EI, and so are the values in between
        first, others = (sizes(structure.rod, "size", np.exp(logs)) for logs in (np.zeros(1), table))
        if first is None or others is None:
            raise InputError("sections of stock vary the size of a section: this rod has none; use taper")
        stock = np.interp(np.log(first * RENARD), np.log(others), table)
        zero = np.zeros(len(structure.mesh.grid.rods))

        def uniform(log: Floats) -> Profile:
            factor = float(np.exp(log[0]))
            return Profile((0.0, 1.0), (factor, factor))

        box = Box(zero, zero + stock[0], zero + stock[-1], zero + 1.0)
        return Profiles(structure, np.arange(len(zero))[:, None], uniform, box, stock)

"""Stiffness, mass and fibre distances along the rods of a mesh, whose sections may change along them.

Over an edge compliances add up: its stiffness is the harmonic mean, exact for a constant moment, and its mass per
length the arithmetic one. A node stands for the half edges next to it, whose compliances add up as well.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from rodshell.arrays import Floats, Ints
from rodshell.layout import GridMesh, Profile
from rodshell.rods.section import Rod
from rodshell.rods.varied import Varied, varied
from rodshell.validation import brief


@dataclass(frozen=True, eq=False)
class RodSections:
    """What the elements of a shell are made from; rod node k is entry k of `mesh.rod_nodes`. Build it with `of`.

    Args:
        edges: (e, 3) EI1, EI2 and GJ of each edge [N m2].
        nodes: (k, 3) the same at each rod node; at a rod's end that of its last edge.
        stretch: (e,) EA of each edge [N].
        mass: (e,) per length [kg/m].
        rotary_inertia: (e,) about the tangent, per length [kg m].
    """

    edges: Floats
    nodes: Floats
    stretch: Floats
    mass: Floats
    rotary_inertia: Floats

    __repr__ = brief

    @staticmethod
    def of(mesh: GridMesh, rods: Sequence[Rod]) -> "RodSections":
        """The sections of a mesh.

        Args:
            rods: of each of its rods what it is where the factor of its profile is 1.

        Raises:
            InputError: a profile changes a length that the section does not have.
        """
        rod_of, of_rods = mesh.rod_of, _uniform(rods)
        nodes = of_rods[:3].T.take(rod_of, axis=0)
        of_edges = of_rods.take(mesh.edge_rods, axis=1)
        edges, (stretch, mass, rotary) = of_edges[:3].T, of_edges[3:]
        for rod, profile, entries in _varied_rods(mesh, rods):
            inner = rod_of[entries[1:]] == rod_of[entries[:-1]]
            here = (entries - rod_of[entries])[:-1][inner]  # edges are counted rod by rod
            s = shares(mesh, entries)
            mean = profile.mean(partial(_inverse, rod, profile.varies), s[:-1][inner], s[1:][inner])
            edges[here] /= mean[:, :3]
            stretch[here] /= mean[:, 3]
            mass[here] *= mean[:, 4]
            rotary[here] *= mean[:, 5]
            half = 0.5 * mesh.edge_lengths[here, None]
            length, compliance = np.zeros((len(mesh.rod_nodes), 1)), np.zeros((len(mesh.rod_nodes), 3))
            for side in (entries[:-1][inner], entries[1:][inner]):
                length[side] += half
                compliance[side] += half / edges[here]
            nodes[entries] = length[entries] / compliance[entries]
        return RodSections(edges, nodes, stretch, mass, rotary)


def _uniform(rods: Sequence[Rod]) -> Floats:
    """(6, m) EI1, EI2, GJ, EA, mass and rotary inertia per length of each rod; computed once for each that differs."""
    different = (rods[0],) if rods and rods.count(rods[0]) == len(rods) else tuple(dict.fromkeys(rods))
    values = np.array([
        (*rod.bend_stiffnesses, rod.twist_stiffness, rod.stretch_stiffness, rod.mass_per_length, rod.rotary_inertia)
        for rod in different
    ]).reshape(-1, 6).T  # fmt: skip
    if len(different) == 1:
        return np.repeat(values, len(rods), axis=1)
    column = {rod: k for k, rod in enumerate(different)}
    return np.asarray(values[:, [column[rod] for rod in rods]])


def _inverse(rod: Rod, varies: str, factors: Floats) -> Floats:
    """(n, 6) factors on the compliances of EI1, EI2, GJ and EA, on the mass and on the rotary inertia."""
    by = varied(rod, varies, factors)
    compliances = [1.0 / factor for factor in (by.bend1, by.bend2, by.twist, by.stretch)]
    return np.column_stack([*compliances, by.stretch, by.rotary])


def _varied_rods(mesh: GridMesh, rods: Rod | Sequence[Rod]) -> Iterator[tuple[Rod, Profile, Ints]]:
    """The rods whose sections change, those that are alike together: rod, profile, and their entries of `rod_nodes`.

    Args:
        rods: the same for all, or m.
    """
    each = rods if isinstance(rods, Sequence) else (rods,) * len(mesh.grid.rods)
    alike: dict[tuple[Rod, Profile], list[Ints]] = {}
    for k, (line, rod) in enumerate(zip(mesh.grid.rods, each, strict=True)):
        if line.profile is not None and not line.profile.uniform:
            here = mesh.rod_slice(k)
            alike.setdefault((rod, line.profile), []).append(np.arange(here.start, here.stop))
    for (rod, profile), entries in alike.items():
        yield rod, profile, np.concatenate(entries)


def shares(mesh: GridMesh, entries: Ints) -> Floats:
    """(n,) distance of `entries` (n,) of `rod_nodes` from the start of their rods, over the rods' lengths."""
    first, last = mesh.stations[mesh.rod_start], mesh.stations[mesh.rod_stop - 1]
    rod = np.searchsorted(mesh.rod_start, entries, side="right") - 1
    return np.asarray(np.clip((mesh.stations[entries] - first[rod]) / (last - first)[rod], 0.0, 1.0))


def varied_at_nodes(mesh: GridMesh, rod: Rod) -> Varied | None:
    """What the sections change at each entry (k,) of `rod_nodes`, from rods that are all the same where their factor is
    1; None where all rods are uniform."""
    found = list(_varied_rods(mesh, rod))
    if not found:
        return None
    columns = {name: np.ones(len(mesh.rod_nodes)) for name in Varied.__dataclass_fields__}
    for kind, profile, entries in found:
        by = varied(kind, profile.varies, profile.at(shares(mesh, entries)))
        for name, column in columns.items():
            column[entries] = getattr(by, name)
    return Varied(**columns)

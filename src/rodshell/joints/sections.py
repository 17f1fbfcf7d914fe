"""The section of a rod at a node: its tangent T and its normal N, as functions of the edges that meet there.

T and N are means over the one or two edges of the rod at the node, N of their material directors m1. The section
lies between the middles of the two edges, so that the nearer one counts more: to second order T and N are the rod's
own tangent and director there. Frames, sources and spin are those of `rods.bend_twist`, which derives them; what is
here serves every energy of sections. An edge's unknowns are its vector e and its twist angle theta.
"""

from collections.abc import Iterator
from dataclasses import replace
from typing import Protocol, TypeVar

import numba as nb
import numpy as np

from rodshell.arrays import Bools, Floats, Ints
from rodshell.geometry.frames import adapted, parallel_transport
from rodshell.geometry.vectors import unit
from rodshell.joints.crossings import Places


class OfSections(Protocol):
    """What every energy of sections has; see `RelativeRotation`."""

    @property
    def blocks(self) -> Ints: ...
    @property
    def legs(self) -> Ints: ...
    @property
    def source_tangents(self) -> Floats: ...
    @property
    def source_directors(self) -> Floats: ...


T = TypeVar("T", bound=OfSections)


def edge_tangents(state: Floats, blocks: Ints, legs: Ints) -> Floats:
    """(m, l, 3) unit tangents of the edges `legs` of each joint."""
    return unit(state[blocks[:, legs[:, 1]]] - state[blocks[:, legs[:, 0]]])


def carried(element: T, state: Floats) -> T:
    """An energy of sections with its source frames moved to `state`."""
    tangents = edge_tangents(state, element.blocks, element.legs)
    directors = parallel_transport(element.source_directors, element.source_tangents, tangents)
    return replace(element, source_tangents=tangents, source_directors=adapted(directors, tangents))  # type: ignore[type-var]


def stencils(places: Places, met: Ints) -> Iterator[tuple[Bools, Ints, Ints, Ints, Floats]]:
    """Of crossings at the places `met` (m, 2), those alike in which edges their rods have there, set by set.

    Yields
    ------
    (m,) which of them; blocks (n, k); legs (l, 4): of each edge the columns of `blocks` of its first node, its second
    node and its twist angle, and its rod, 0 or 1; (2,) columns of the joint's node on either rod; weights (n, l).
    """
    kinds = np.column_stack([places.has(met[:, rod], side) for rod in range(2) for side in range(2)])
    for kind in np.unique(kinds, axis=0):
        mine = (kinds == kind).all(axis=1)
        yield mine, *_stencil(places, met[mine], kind.reshape(2, 2))


def _stencil(places: Places, met: Ints, kind: Bools) -> tuple[Ints, Ints, Ints, Floats]:
    columns, legs, middles, weights = list[Ints](), list[tuple[int, int, int, int]](), [0, 0], list[Floats]()
    for rod in range(2):
        here = met[:, rod]
        if rod == 0 or not np.array_equal(places.blocks[here], columns[0]):  # rods that do not share their node
            middles[rod] = len(columns)
            columns.append(places.blocks[here])
        for side in np.flatnonzero(kind[rod]).tolist():
            middle, there, angle = middles[rod], len(columns), len(columns) + 1
            columns += [places.neighbour(here, side), places.angle(here, side)]
            legs.append((middle, there, angle, rod) if side else (there, middle, angle, rod))
            weights.append(1.0 / (places.mesh.edge_lengths[places.edge(here, side)] * places.softness(here)))
    return np.column_stack(columns), np.array(legs), np.array(middles), np.column_stack(weights)


@nb.njit(cache=True, error_model="numpy")
def frame(x, blocks, leg, source, director, t, m1, m2, w, half):  # type: ignore[no-untyped-def]
    """Length of an edge; its tangent, material directors, spin w, and (source + t) / (1 + source.t)."""
    square, both, along = 0.0, 1.0, 0.0
    for k in range(3):
        t[k] = x[blocks[leg[1]], k] - x[blocks[leg[0]], k]
        square += t[k] * t[k]
    length = np.sqrt(square)
    for k in range(3):
        t[k] /= length
        both += source[k] * t[k]
        along += director[k] * t[k]
    theta = x[blocks[leg[2]], 0]
    cos, sin = np.cos(theta), np.sin(theta)
    for k in range(3):
        half[k] = (source[k] + t[k]) / both
    for k in range(3):
        k1, k2 = (k + 1) % 3, (k + 2) % 3
        w[k] = (source[k1] * t[k2] - source[k2] * t[k1]) / (both * length)
        d1 = director[k] - along * half[k]
        d2 = t[k1] * (director[k2] - along * half[k2]) - t[k2] * (director[k1] - along * half[k1])
        m1[k] = cos * d1 + sin * d2
        m2[k] = cos * d2 - sin * d1
    return length


@nb.njit(cache=True, error_model="numpy")
def by_edge(weight, length, t, m1, m2, w, jacobian):  # type: ignore[no-untyped-def]
    """(6, 4) derivatives of the edge's share of T and N by (e, theta); dm1 = -(m1.dt) t + m2 (dtheta - w.de)."""
    for i in range(3):
        for j in range(3):
            one = 1.0 if i == j else 0.0
            jacobian[i, j] = weight * (one - t[i] * t[j]) / length
            jacobian[3 + i, j] = -weight * (t[i] * m1[j] / length + m2[i] * w[j])
        jacobian[i, 3] = 0.0
        jacobian[3 + i, 3] = weight * m2[i]


@nb.njit(cache=True, error_model="numpy")
def of_edge(weight, by_t, by_n, length, t, m1, m2, w, half, local):  # type: ignore[no-untyped-def]
    """Add the second derivatives of t and m1, contracted with the energy's derivatives by T and N, to `local` (4, 4).

    As in `bend_twist`: first for a frame that does not spin, then the spin dtheta -> dtheta - w.de, then the
    symmetric part of the derivative of w; what is antisymmetric cancels.
    """
    tt, nt, n1, n2 = 0.0, 0.0, 0.0, 0.0
    for k in range(3):
        tt += weight * by_t[k] * t[k]
        nt += weight * by_n[k] * t[k]
        n1 += weight * by_n[k] * m1[k]
        n2 += weight * by_n[k] * m2[k]
    square = length * length
    for i in range(3):
        ti, ni = weight * by_t[i] - tt * t[i], weight * by_n[i] - nt * t[i]
        for j in range(3):
            tj, nj = weight * by_t[j] - tt * t[j], weight * by_n[j] - nt * t[j]
            one = 1.0 if i == j else 0.0
            value = -(t[i] * tj + ti * t[j]) - tt * (one - t[i] * t[j])
            value += nt * (t[i] * m1[j] + m1[i] * t[j]) - 0.5 * (m1[i] * nj + ni * m1[j])
            value /= square
            value += nt / length * (w[i] * m2[j] + m2[i] * w[j]) - n1 * w[i] * w[j]
            value += 0.5 * n2 / length * (w[i] * (t[j] + half[j]) + (t[i] + half[i]) * w[j])
            local[i, j] += value
        mixed = -nt * m2[i] / length + n1 * w[i]
        local[i, 3] += mixed
        local[3, i] += mixed
    local[3, 3] -= n1


@nb.njit(cache=True, error_model="numpy")
def spread(local, leg, other, hessian):  # type: ignore[no-untyped-def]
    """Add `local` (4, 4), by (e, theta) of two edges, to the rows and columns of their nodes and angles."""
    for i in range(3):
        for j in range(3):
            value = local[i, j]
            hessian[3 * leg[0] + i, 3 * other[0] + j] += value
            hessian[3 * leg[0] + i, 3 * other[1] + j] -= value
            hessian[3 * leg[1] + i, 3 * other[0] + j] -= value
            hessian[3 * leg[1] + i, 3 * other[1] + j] += value
        hessian[3 * leg[0] + i, 3 * other[2]] -= local[i, 3]
        hessian[3 * leg[1] + i, 3 * other[2]] += local[i, 3]
        hessian[3 * leg[2], 3 * other[0] + i] -= local[3, i]
        hessian[3 * leg[2], 3 * other[1] + i] += local[3, i]
    hessian[3 * leg[2], 3 * other[2]] += local[3, 3]

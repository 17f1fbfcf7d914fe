"""The contract of elastic energies, with exact gradients and Hessians on small stencils, and the stretch of edges.

The state of a shell is an (N, 3) array of *blocks*. A node is a block of three coordinates [m]; the twist
angle of an edge is a block of which only the first component is used [rad]. An element set names, for each
of its m elements, the k blocks that it touches: 2 for stretch, 3 for isotropic bending, 5 for bending and
twist (x, theta, x, theta, x). A solver sees only the sum of such sets [HQK Eq 1, 2, 4].

Stretch of an edge [HQK Eq 1a]: E = (N0 eps + EA/2 eps^2) |e0|, eps = |e|/|e0| - 1.

N0 = 0 is the paper's elastic edge. With a multiplier N0 it is the augmented Lagrangian of an inextensible
edge: at the solution the strain vanishes and N0 is the axial force.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Any, ClassVar, Protocol, Self, TypeGuard

import numpy as np
from numpy.typing import NDArray

from rodshell.arrays import Bools, Floats, Ints, State
from rodshell.kernels import njit
from rodshell.threads import in_threads
from rodshell.validation import brief

NO_HESSIANS = np.empty((0, 0, 0))
WORTHWHILE = 30_000  # elements from which on threads share a set


class Elements(Protocol):
    """A sum of local energies.

    Attributes:
        blocks: (m, k) blocks of each element.
    """

    @property
    def blocks(self) -> Ints: ...

    def evaluate(self, state: State, gradient: Floats, hessians: Floats = NO_HESSIANS) -> float:
        """Energy [J], with its gradient and, where wanted, its Hessians.

        Args:
            gradient: (N, 3), to which the energy's gradient is added [N, for angles N m].
            hessians: (m, 3k, 3k), filled with the element Hessians unless empty; rows and columns of the unused
                components of a twist angle are zero.
        """
        ...

    def refreshed(self, state: State) -> Self:
        """The same energy with its source frames moved to `state`; called at each accepted iterate."""
        ...


class WithoutFrames:
    """An energy without source frames."""

    def refreshed(self, state: State) -> Self:
        """The same at every state."""
        return self


class BendElements(Elements, Protocol):
    """Bending between consecutive edges of rods, and twist where they have it.

    Attributes:
        bend_stiffness: (b, 1) or (b, 2) EI over the Voronoi length, of both directions [N m].
        parts: the energies of each stiffness alone, bending first.
        moduli: for each part 0, 1 or 2: it resists with EI1, EI2 or GJ.
    """

    angle_columns: ClassVar[tuple[int, ...]]
    moduli: ClassVar[tuple[int, ...]]

    @property
    def bend_stiffness(self) -> Floats: ...

    @property
    def parts(self) -> tuple[Self, ...]: ...

    def strains(self, state: State) -> Floats:
        """(b, 3) curvatures (integrated, [-]) and twist [rad] at `state` (N, 3)."""
        ...

    def with_stiffness(self, stiffness: Floats) -> Self:
        """The same elements with EI1, EI2 and GJ over the Voronoi length, (b, 3) [N m]; what they lack is left out."""
        ...

    def relaxed(self, state: State) -> Self:
        """The same elements with `state` (N, 3) as their stress-free state; naturally straight ones stay so."""
        ...

    def between(self, held: Self, t: float) -> Self:
        """The same elements, their natural strains, if any, only the share t of the way from those of `held`."""
        ...


class Stressed(Elements, Protocol):
    """Energies of strains whose internal forces stiffen or soften a structure: those that buckling looks at."""

    def stress_stiffness(self, state: State, motion: Floats, hessians: Floats) -> None:
        """How the Hessians change with the internal forces alone, the geometry being frozen: the sum over the strains e
        of (ds/de de/dx . motion) d2e/dx2, with s the internal force. The rest of the Hessian's derivative turns the
        stiffness of the material with the motion, and is wrong by far without its terms of second order.

        Args:
            state: (N, 3) node positions [m] and twist angles [rad], the source frames being at, or near, it.
            motion: (N, 3) along which the internal forces change, to first order [m, rad].
            hessians: (m, 3k, 3k), which are filled.
        """
        ...


def is_bends(element: Elements) -> TypeGuard[BendElements]:
    """Whether an energy is that of bends of rods."""
    return hasattr(element, "moduli")


def is_stressed(element: Elements) -> TypeGuard[Stressed]:
    """Whether buckling looks at an energy."""
    return hasattr(element, "stress_stiffness")


def twist_angles(sets: Sequence[Elements], count: int) -> NDArray[np.bool_]:
    """(count,) which blocks are twist angles: those in the columns of `blocks` that elements name `angle_columns`."""
    result = np.zeros(count, dtype=bool)
    for elements in sets:
        result[elements.blocks[:, getattr(elements, "angle_columns", ())]] = True
    return result


def with_frames(element: Elements, like: Elements, rows: Bools | None = None, at: Bools | None = None) -> Elements:
    """An energy with the source frames of another one.

    Args:
        like: an energy of the same kind; without `rows` and `at` on the same blocks.
        rows: (l,) which elements of `like` are those of the energy; None: all.
        at: (m,) to which elements of the energy the frames go, the others keeping theirs; None: to all.
    """
    assert is_dataclass(element)
    sources: dict[str, Any] = {}
    for name in (field.name for field in fields(element) if field.name.startswith("source_")):
        frames = getattr(like, name)
        sources[name] = frames if rows is None else frames[rows]
        if at is not None:
            sources[name] = getattr(element, name).copy()
            sources[name][at] = frames
    if hasattr(element, "bends"):
        sources["bends"] = with_frames(element.bends, like.bends, rows, at)
    return replace(element, **sources)


def turned(element: Elements, turn: Floats) -> Elements:
    """An energy with its source frames turned about z: by (2, 2), of rows x, y, or (m, 2, 2), of each element."""
    assert is_dataclass(element)
    sources: dict[str, Any] = {}
    for name in ("source_tangents", "source_directors"):
        if hasattr(element, name):
            sources[name] = getattr(element, name).copy()
            sources[name][..., :2] @= turn
    if hasattr(element, "bends"):
        sources["bends"] = turned(element.bends, turn)
    return replace(element, **sources)


def each_gradient(elements: Elements, state: State) -> Floats:
    """(m, k, 3) gradient of each element alone [N, for angles N m].

    It is that of the same energy on an exploded state, in which no two elements share a block. An energy is linear in
    its stiffness, so this is also the derivative of the gradient by the logarithm of the element's stiffness.

    Args:
        elements: m of them, with one stiffness each (see `parts` of those that have several).
    """
    apart, local = _exploded(elements, state)
    gradient = np.zeros_like(local)
    apart.evaluate(local, gradient)
    return gradient.reshape(*elements.blocks.shape, 3)


def each_curvature(elements: Elements, state: State, motion: Floats) -> Floats:
    """(m,) v'Hv of each element alone for displacements `motion` (N, 3) [J], H being its Hessian."""
    m, k = elements.blocks.shape
    hessians = np.zeros((m, 3 * k, 3 * k))
    elements.evaluate(state, np.zeros_like(state), hessians)
    local = motion[elements.blocks].reshape(m, -1)
    return np.asarray(np.einsum("mi,mij,mj->m", local, hessians, local))


def _exploded(elements: Elements, state: State) -> tuple[Elements, Floats]:
    """The elements on blocks of their own, and the state there."""
    rows = np.arange(elements.blocks.size, dtype=elements.blocks.dtype).reshape(elements.blocks.shape)
    return replace(elements, blocks=rows), state[elements.blocks].reshape(-1, 3)  # type: ignore[type-var]


def in_parts(elements: Elements, most: int) -> list[Elements]:
    """Elements cut into parts of at most `most`, or one part if they cannot be; their arrays with a row for each are
    those as long as `blocks`."""
    count = len(elements.blocks)
    if count <= most or not is_dataclass(elements):
        return [elements]
    if any(is_dataclass(getattr(elements, field.name)) for field in fields(elements)):  # rows of its own inside
        return [elements]
    rows = {field.name: getattr(elements, field.name) for field in fields(elements)}
    rows = {name: row for name, row in rows.items() if isinstance(row, np.ndarray) and len(row) == count}
    return [
        replace(elements, **{name: np.ascontiguousarray(row[k : k + most]) for name, row in rows.items()})
        for k in range(0, count, most)
    ]


def evaluate_all(sets: Sequence[Elements], state: State, gradient: Floats, hessians: Sequence[Floats]) -> None:
    """Evaluate sets of elements, see `Elements.evaluate`; threads share large ones.

    Each thread has half of every set. The halves have gradients of their own, which are added in the end, so that the
    sum does not depend on the threads.

    Args:
        state, gradient: (N, 3), see `Elements.evaluate`.
        hessians: of each set, (m, 3k, 3k) or empty.
    """
    if max((len(elements.blocks) for elements in sets), default=0) < WORTHWHILE:
        for elements, of_set in zip(sets, hessians, strict=True):
            elements.evaluate(state, gradient, of_set)
        return
    halves = [in_parts(elements, (len(elements.blocks) + 1) // 2) for elements in sets]
    gradients = gradient, np.zeros_like(gradient)

    def evaluate(half: int, _: int) -> None:
        for parts, of_set in zip(halves, hessians, strict=True):
            if half < len(parts):
                first = len(parts[0].blocks)
                parts[half].evaluate(state, gradients[half], of_set[first:] if half else of_set[:first])

    in_threads(evaluate, 2)
    gradient += gradients[1]


@dataclass(frozen=True, eq=False)
class Stretch(WithoutFrames):
    """Elastic edges [HQK Eq 1a].

    Args:
        blocks: (e, 2) nodes of each edge.
        rest_lengths: (e,) [m].
        stiffness: (e,) EA [N].
        multipliers: (e,) N0 [N].
        forces: (e,) axial forces [N] of the geometric stiffness in the Hessian; None takes N0 + EA eps, which
            makes the Hessian exact. A solver that has the forces among its unknowns passes them here.
    """

    blocks: Ints
    rest_lengths: Floats
    stiffness: Floats
    multipliers: Floats
    forces: Floats | None = None

    __repr__ = brief

    @staticmethod
    def elastic(blocks: Ints, rest_lengths: Floats, stiffness: Floats) -> "Stretch":
        """The paper's elastic edges: no multipliers. Parameters as of the class."""
        return Stretch(blocks, rest_lengths, stiffness, np.zeros(len(blocks)))

    def with_forces(self, forces: Floats | None, *, multipliers: Floats | None = None) -> "Stretch":
        """The same edges with other axial forces and, if given, other multipliers; parameters as of the class."""
        multipliers = self.multipliers if multipliers is None else multipliers
        return Stretch(self.blocks, self.rest_lengths, self.stiffness, multipliers, forces)

    def strains(self, state: State) -> Floats:
        """(e,) axial strains [-] at `state` (N, 3)."""
        return np.asarray(_strains(state, self.blocks, self.rest_lengths))

    def elongation(self, state: State, motion: Floats) -> Floats:
        """(e,) change of the strains [-] to first order for displacements `motion` (N, 3) [m] from `state`."""
        return np.asarray(_elongation(state, motion, self.blocks, self.rest_lengths))

    def pulls(self, state: State) -> Floats:
        """(e, 2, 3) gradient of each edge alone under an axial force of 1 N, at `state` (N, 3) [-]."""
        along = state[self.blocks[:, 1]] - state[self.blocks[:, 0]]
        along /= np.linalg.norm(along, axis=1)[:, None]
        return np.stack([-along, along], axis=1)

    def by_rest_lengths(self, state: State) -> Floats:
        """(e,) change of each edge's axial force by its rest length, -EA |e| / l^2 [N/m], at `state` (N, 3)."""
        return np.asarray(-self.stiffness * (1.0 + self.strains(state)) / self.rest_lengths)

    def add_axial(self, state: State, forces: Floats, gradient: Floats) -> None:
        """Add to `gradient` (N, 3) [N] that of edges with the axial `forces` (e,) [N]."""
        _add_axial(state, self.blocks, forces, gradient)

    def evaluate(self, state: State, gradient: Floats, hessians: Floats = NO_HESSIANS) -> float:
        """Energy [J], gradient and Hessians: see `Elements.evaluate`."""
        exact = self.forces is None
        forces = self.rest_lengths if self.forces is None else self.forces
        return float(
            _stretch(
                state,
                self.blocks,
                self.rest_lengths,
                self.stiffness,
                self.multipliers,
                forces,
                exact,
                gradient,
                hessians,
            )
        )

    def stress_stiffness(self, state: State, motion: Floats, hessians: Floats) -> None:
        """Of the change of the axial forces: see `Stressed.stress_stiffness`."""
        self.axial_stiffness(state, self.stiffness * self.elongation(state, motion), hessians)

    def axial_stiffness(self, state: State, forces: Floats, hessians: Floats) -> None:
        """Fill `hessians` (e, 6, 6) [N/m] with the geometric stiffness of axial `forces` (e,) [N] alone."""
        limp = replace(self, stiffness=np.zeros_like(self.stiffness), forces=forces)
        limp.evaluate(state, np.zeros_like(state), hessians)


@njit("f2 i2 f1 f1 f1 f1 b f2 f3", nogil=True)
def _stretch(x, edges, rest, stiffness, multipliers, forces, exact, gradient, hessians):  # type: ignore[no-untyped-def]
    """Stencil (x_a, x_b) [m]; energies [J], from HQK Eq 1a."""
    wanted = hessians.shape[0] > 0
    energy = 0.0
    for e in range(edges.shape[0]):
        a, b = edges[e, 0], edges[e, 1]
        d0, d1, d2 = x[b, 0] - x[a, 0], x[b, 1] - x[a, 1], x[b, 2] - x[a, 2]
        length = np.sqrt(d0 * d0 + d1 * d1 + d2 * d2)
        strain = length / rest[e] - 1.0
        energy += (multipliers[e] + 0.5 * stiffness[e] * strain) * strain * rest[e]
        force = multipliers[e] + stiffness[e] * strain
        t0, t1, t2 = d0 / length, d1 / length, d2 / length
        gradient[a, 0] -= force * t0
        gradient[a, 1] -= force * t1
        gradient[a, 2] -= force * t2
        gradient[b, 0] += force * t0
        gradient[b, 1] += force * t1
        gradient[b, 2] += force * t2
        if wanted:
            across = (force if exact else forces[e]) / length  # geometric stiffness
            along = stiffness[e] / rest[e] - across
            t = (t0, t1, t2)
            for i in range(3):
                for j in range(3):
                    value = along * t[i] * t[j]
                    if i == j:
                        value += across
                    hessians[e, i, j] = value
                    hessians[e, i + 3, j + 3] = value
                    hessians[e, i, j + 3] = -value
                    hessians[e, i + 3, j] = -value
    return energy


@njit("f2 i2 f1")
def _strains(x, edges, rest):  # type: ignore[no-untyped-def]
    result = np.empty(len(edges))
    for e in range(len(edges)):
        square = 0.0
        for k in range(3):
            square += (x[edges[e, 1], k] - x[edges[e, 0], k]) ** 2
        result[e] = np.sqrt(square) / rest[e] - 1.0
    return result


@njit("f2 f2 i2 f1")
def _elongation(x, motion, edges, rest):  # type: ignore[no-untyped-def]
    result = np.empty(len(edges))
    for e in range(len(edges)):
        a, b = edges[e, 0], edges[e, 1]
        square, along = 0.0, 0.0
        for k in range(3):
            d = x[b, k] - x[a, k]
            square += d * d
            along += d * (motion[b, k] - motion[a, k])
        result[e] = along / (np.sqrt(square) * rest[e])
    return result


@njit("f2 i2 f1 f2")
def _add_axial(x, edges, forces, gradient):  # type: ignore[no-untyped-def]
    for e in range(len(edges)):
        a, b = edges[e, 0], edges[e, 1]
        square = 0.0
        for k in range(3):
            square += (x[b, k] - x[a, k]) ** 2
        share = forces[e] / np.sqrt(square)
        for k in range(3):
            pull = share * (x[b, k] - x[a, k])
            gradient[b, k] += pull
            gradient[a, k] -= pull

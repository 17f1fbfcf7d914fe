"""Other stable shapes of the same shell on the same supports.

A shell that was bent into its shape may have several. They are looked for from starts at some distance: popped
through, each node mirrored in the surface that the supports span, and kicked along the softest modes of the tangent
stiffness, one by one and mixed. From each start the energy is lowered to the next stable equilibrium. What is found
is a shape of the shell; that nothing is found proves nothing, so the search says how far it looked.
"""

from collections.abc import Callable, Iterator, Sequence

import numpy as np
from scipy.sparse import csr_array, diags_array
from scipy.sparse.linalg import spsolve

from rodshell.arrays import Floats
from rodshell.checks.bending import edge_directors
from rodshell.checks.deployment import Deployment, OtherShape
from rodshell.figures import checks as figures
from rodshell.figures.records import Rows, rows
from rodshell.formfinding.finite_sections import middle_surface
from rodshell.geometry.frames import parallel_transport, signed_angle, unit
from rodshell.layout import GridMesh
from rodshell.model import Shell
from rodshell.rods.bend_twist import BendTwist
from rodshell.solve.equilibrium import Equilibrium, find_equilibrium
from rodshell.solve.path import SAME
from rodshell.solve.problem import half_width

MODES = 4
MODE_SWEEPS = 4  # enough for directions to search in: the last eigenvalue may be a quarter too high
KICKS = (0.2, 0.4)  # of the shell's size: how far the node goes that goes farthest
MIXTURES = 12  # kicks along mixtures of the modes, which are the same at every run
MOST_A_START = 40  # iterations
FEWEST_A_START = 2
MODES_COST = 5  # factorisations that take as long as finding the modes, with those that they need
EACH = 4  # factorisations of an iteration at most, where the tangent stiffness is indefinite
COPLANAR = 1e-3  # of the size: how far supports may lie off their plane for the shell to have a mirror image,
MIRRORED = 0.02  # and the image off the reflection: trimmed ends lie some 1e-4 off the plane, layers keep their order


class OtherShapes(figures.OtherShapes):
    """What a search found, the shapes with their nodes."""

    found: Rows[OtherShape] = rows("shapes that were found")


def other_shapes(
    shell: Shell, found: Equilibrium, *, most_factorizations: int, deployment: Deployment | None = None,
    progress: Callable[[int], None] = lambda start: None,
) -> OtherShapes:  # fmt: skip
    """Look for other stable equilibria of a shell, its supports being held where they are.

    Args:
        found: its stable equilibrium without loads, the shell's source frames being there.
        most_factorizations: the search ends before they are used up; kicks that are small come first.
        deployment: of this shell; the shape that it ended in, where that is not the final one, is among those found.
        progress: called with the number of each start before it.
    """
    search = _Search(shell, found, deployment)
    kicks = list[float]()
    for kick, start in search.starts(most_factorizations):
        each = 2 if kick == 0 and search.image is not None else EACH  # next to its image the stiffness is definite
        most = min(MOST_A_START, (most_factorizations - search.factorizations) // each)
        if most < FEWEST_A_START:
            break
        progress(len(kicks) + 1)
        search.go(start, kick, most)
        kicks.append(kick)
    return OtherShapes(
        tried=len(kicks), searched=_looked(kicks), popped_through=0.0 in kicks, largest_kick=max(kicks, default=0.0),
        found=tuple(search.shapes), factorizations=search.factorizations,
    )  # fmt: skip


def _looked(kicks: Sequence[float]) -> str:
    """How far a search looked whose starts had these kicks over half the shell's width; 0 is popping through."""
    if not kicks:
        return "not looked for: the search may take half of the work that the form took, which is too little here"
    ways = ["popped through"] if 0.0 in kicks else []
    if largest := max(kicks):
        by = f"{100 * largest:.0f} % of half its width"
        ways.append(f"kicked by up to {by} along its {MODES} softest modes or mixtures of them")
    number = f"{len(kicks)} start{'s' if len(kicks) > 1 else ''}"
    return f"looked for from {number} ({' and '.join(ways)}); others are not excluded"


class _Search:
    def __init__(self, shell: Shell, found: Equilibrium, deployment: Deployment | None) -> None:
        self.shell, self.found, self.factorizations = shell, found, 0
        self.positions = shell.positions(found.state)
        self.length = half_width(self.positions)
        crossed = (shell.mesh.grid.joint_counts() > 0).all()  # else no normals are known
        self.middle = middle_surface(shell.mesh, shell.mesh, self.positions) if crossed else self.positions
        self.normal, origin, off = _plane(self.middle[shell.mesh.ends.ravel()])
        self.reached = deployment is not None and deployment.reached_from_flat
        plane = off < COPLANAR * self.length and not len(shell.ghosts)  # a clamp's direction has no image
        self.image = self._mirrored((self.middle - origin) @ self.normal) if plane else None
        self.shapes = list[OtherShape]()
        if deployment is not None and (there := deployment.elsewhere) is not None:
            self.shapes.append(there.changed(from_flat=True, mirror=False))

    def starts(self, most_factorizations: int) -> Iterator[tuple[float, Floats]]:
        """The kick's size over the shell's, and the state; zero for popping through, which comes first where the
        supports lie in a plane, since it leads straight to the mirror image."""
        if self.image is not None:
            yield 0.0, self._through()
        if self.factorizations + MODES_COST + EACH * FEWEST_A_START > most_factorizations:
            return
        modes, nodes = self._modes(), self.shell.stretch.blocks
        random = np.random.default_rng(0)
        for size in KICKS:
            for mode in modes:
                for side in (1.0, -1.0):
                    yield size, self.found.state + side * size * mode
            if self.image is None and size == KICKS[0]:
                yield 0.0, self._through()
        for _ in range(MIXTURES):
            mixture = np.tensordot(random.standard_normal(len(modes)), modes, 1)
            mixture *= self.found.problem.length / np.linalg.norm(mixture[nodes], axis=2).max()
            yield KICKS[-1], self.found.state + KICKS[-1] * mixture

    def go(self, start: Floats, kick: float, most: int) -> None:
        """Down from a start; keeps a shape that is new. The mirror image has the same axial forces."""
        forces = self.found.forces if kick == 0 else np.zeros_like(self.found.forces)
        there = find_equilibrium(
            self.found.problem, start, forces, descend=True, limit_steps=True, most_iterations=most
        )
        self.factorizations += there.report.factorizations
        positions = self.shell.positions(there.state)
        known = (self.positions, *(shape.positions for shape in self.shapes))
        if there.report.stable and all(self._apart(positions, other) > SAME for other in known):
            mirror = self.image is not None and self._apart(positions, self.image) < MIRRORED
            same = mirror and not self.shell.mesh.layered  # lifted to the other side it goes to its image
            from_flat = True if same and self.reached else None
            found = OtherShape(
                distance=self._apart(positions, self.positions),
                energy=there.energy / self.found.energy,
                from_flat=from_flat,
                mirror=mirror,
                positions=positions,
            )
            self.shapes.append(found)

    def _modes(self) -> list[Floats]:
        """The softest modes, the farthest node going by the shell's mean radius."""
        mass = self.shell.mass if self.shell.mass.any() else None
        modes = self.found.tangent.lowest_modes(MODES, mass=mass, tolerance=0.0, most_sweeps=MODE_SWEEPS, guards=2)
        self.factorizations += MODES_COST
        nodes, length = self.shell.stretch.blocks, self.found.problem.length
        return [mode * (length / np.linalg.norm(mode[nodes], axis=2).max()) for mode in modes.shapes]

    def _through(self) -> Floats:
        """Each node mirrored in the surface that the supports span, across their plane; the supports stay. So are the
        sections, whose first directors are kept on the side of the shell where they were."""
        nodes = np.flatnonzero(self.shell.like < self.shell.mesh.node_count)
        above = (self.middle - spanned(self.shell.mesh, self.middle)) @ self.normal
        state = self.found.state.copy()
        state[nodes] += (self._mirrored(above) - self.positions)[self.shell.like[nodes]]
        held = np.append(self.shell.ends, self.shell.ghosts)
        state[held] = self.found.state[held]
        if frames := self.shell.frames:
            self._turn_sections(frames, state)
        return state

    def _turn_sections(self, frames: BendTwist, state: Floats) -> None:
        """Set the twist angles of a state whose nodes are mirrored to those of mirrored sections."""
        shell, here = self.shell, self.found.state
        before, now = (unit(np.diff(at[shell.stretch.blocks], axis=1)[:, 0]) for at in (here, state))
        directors = edge_directors(shell, frames, here)
        wanted = parallel_transport(-self._reflected(directors), self._reflected(before), now)
        with np.errstate(divide="ignore", invalid="ignore"):  # turned right round an edge has no frame, nor energy
            turns = signed_angle(parallel_transport(directors, before, now), wanted, now)
        shell.turn_edges(state, np.unwrap(turns))  # neighbours less than half a revolution apart: twists keep small
        if shell.angles > len(turns):  # sections are free to spin in their clamps: no twist there
            clamps = frames.blocks[-len(shell.ghosts) :]
            twist = frames.strains(state)[-len(shell.ghosts) :, 2]
            state[clamps[::2, 1], 0] += twist[::2]  # at a rod's start the ghost edge comes first
            state[clamps[1::2, 3], 0] -= twist[1::2]

    def _mirrored(self, above: Floats) -> Floats:
        """(n, 3) the nodes, mirrored in what the surface between layers is `above` (n,); layers keep their order."""
        return self.middle - 2 * above[:, None] * self.normal - self._reflected(self.positions - self.middle)

    def _reflected(self, vectors: Floats) -> Floats:
        """(n, 3) vectors as the plane of the supports reflects them."""
        return np.asarray(vectors - 2 * (vectors @ self.normal)[:, None] * self.normal)

    def _apart(self, here: Floats, there: Floats) -> float:
        return float(np.linalg.norm(here - there, axis=1).max()) / self.length


def spanned(mesh: GridMesh, positions: Floats) -> Floats:
    """The surface that the rod ends span like a net of soft springs along the edges.

    Rods in two layers are joined at their crossings.

    Args:
        positions: (n, 3) of its nodes [m]; of rods in two layers on the surface between them.

    Returns:
        (n, 3) the nodes on that surface [m].
    """
    joined = np.arange(mesh.node_count)
    joined[mesh.joint_pairs[:, 1]] = mesh.joint_pairs[:, 0]
    ends, signs = joined[mesh.edges].ravel(), np.tile([-1.0, 1.0], len(mesh.edges))
    pulled = csr_array((signs, ends, 2 * np.arange(len(mesh.edges) + 1)), shape=(len(mesh.edges), mesh.node_count))
    inner = np.setdiff1d(joined, joined[mesh.ends])
    stiffness = csr_array(pulled.T @ diags_array(1.0 / mesh.edge_lengths) @ pulled)[inner]
    result = positions.copy()
    result[inner] -= spsolve(stiffness[:, inner].tocsc(), stiffness @ positions)
    return np.asarray(result[joined])


def _plane(points: Floats) -> tuple[Floats, Floats, float]:
    """Normal and middle of the plane nearest to points (m, 3), and how far the farthest lies off it."""
    middle = points.mean(axis=0)
    normal = np.linalg.svd(points - middle, full_matrices=False)[2][2]
    return normal, middle, float(np.abs((points - middle) @ normal).max())

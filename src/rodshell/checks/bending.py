"""Bending check: how each rod is bent and twisted along its length, and the stress of it all.

The curvature is the one whose moment EI kappa is in equilibrium: kappa = 2 tan(phi/2) over the Voronoi length
[HQK Eq 1b]. A pinned end has none; a clamped end has that between its last edge and its clamp. Its two parts are the
normal curvature, out of the shell, and the geodesic curvature, within it. Of rods with unlike stiffnesses, laths, they
are taken by the section's own axes m1 and m2, which are the shell's normal and a line within it where joints hold the
rods upright; of others by the shell's normal, that of the rods that cross there.

A joint that resists shear passes a moment M about its normal from one rod to the other, so that a rod's own jumps there
by M. The node has the mean of both sides; the sharper one bends by M/(2 EI2) more within the shell, and is what counts.

The stress over a section is that of bending, stretch and torsion together, at the points where it can be largest:

    sigma = E (eps + kappa1 x + kappa2 y),   tau = G theta' l(x, y),   s = sqrt(sigma^2 + (w tau)^2)

x and y run along the directors m1 and m2; theta' is the twist per length, l [m] Saint-Venant's shear stress over
G theta' [Timoshenko and Goodier, Theory of Elasticity, sections 105 and 109]. The weight w is the strength over the
shear strength: sqrt(3) makes s the stress of von Mises, for isotropic materials; for timber and fibre composites the
two strengths are given, and s over the strength is the criterion of Tsai and Hill for stress along the fibres.

The largest s lies on the outline: sigma is linear, and tau the gradient of a function of constant Laplacian, so that
neither sigma^2 nor tau^2 has a maximum inside.

Where a section changes along its rod, its fibres are as far from the axis as they are there, and torsion shears the
outline in the pattern of the unchanged section, up to the largest stress of the changed one.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt

import numpy as np

from rodshell.arrays import Floats, State
from rodshell.checks.reactions import joint_loads
from rodshell.errors import InputError
from rodshell.figures.form import Bent
from rodshell.formfinding.finite_sections import node_normals
from rodshell.geometry.frames import cross, dot, unit
from rodshell.joints.relative_rotation import is_elastic
from rodshell.layout import GridMesh
from rodshell.model import Shell
from rodshell.model.rod_sections import varied_at_nodes
from rodshell.model.shell import last_edges
from rodshell.rods.bend_twist import BendTwist
from rodshell.rods.section import GivenSection, Rod
from rodshell.validation import brief

VON_MISES = sqrt(3.0)
POINTS = 33  # on a side of a rectangle, from its middle to a corner, and on a quarter of an ellipse: s within 1e-3
TERMS = np.arange(1, 200, 2)  # of the series of a rectangle, which fall as n^-2 at worst, next to a corner


def fibre_distance(rod: Rod) -> float | None:
    """Distance [m] of the outermost fibre from the axis of bending, for bends in any direction.

    Where the section is not round it is that of its farthest point: the stress is then an upper bound. None for a
    given section without fibre distances.
    """
    if (half := rod.section.half_widths) is None:
        return None
    return float(np.hypot(*half)) if rod.section.boxed else max(half)


def fibre_strain(rod: Rod, kappa1: Floats, kappa2: Floats) -> Floats:
    """Largest bending strain over the section [-].

    Exact for each shape; for a given section that of the corner of the box that its fibre distances span.

    Args:
        kappa1, kappa2: (n,) curvatures towards m1 and m2 [1/m].

    Raises:
        InputError: a given section has no fibre distances.
    """
    if (half := rod.section.half_widths) is None:
        raise InputError("the strain of a given section without fibre_distances is not known: give them")
    across, within = half[0] * np.abs(kappa1), half[1] * np.abs(kappa2)
    return np.asarray(across + within if rod.section.boxed else np.hypot(across, within))


def torsion_stress(rod: Rod, twist_rate: Floats) -> Floats:
    """Largest shear stress of torsion over the section [Pa].

    Args:
        twist_rate: (n,) twist per length [rad/m].

    Raises:
        InputError: a given section has no torsion modulus.
    """
    return np.asarray(_outline(rod)[2].max() * np.abs(twist_rate))


def largest_stress(
    rod: Rod, kappa1: Floats, kappa2: Floats, axial: Floats, twist_rate: Floats, *, weight: float = VON_MISES
) -> Floats:
    """Largest s over the section [Pa], as the module defines it.

    Args:
        kappa1, kappa2: (n,) curvatures towards m1 and m2 [1/m].
        axial: (n,) strain of the axis [-].
        twist_rate: (n,) twist per length [rad/m].
        weight: w, of the shear stress against the normal stress [-].

    Raises:
        InputError: the stress of a given section needs a value that is missing.
    """
    modulus = fibre_modulus(rod)
    bent, drawn, twist = fibre_strain(rod, kappa1, kappa2), np.abs(axial), np.abs(twist_rate)
    result = np.asarray(modulus * (bent + drawn))
    if not twist.any():
        return result
    if rod.section.round:
        kappa1, kappa2 = np.hypot(kappa1, kappa2), np.zeros_like(kappa2)
    across, within = np.abs(kappa1), np.abs(kappa2)
    for x, y, shear in zip(*_outline(rod), strict=True):  # in the quarter of equal signs, the worst of four
        normal = modulus * (x * across + y * within + drawn)
        result = np.maximum(result, np.hypot(normal, weight * shear * twist))
    return result


def fibre_modulus(rod: Rod) -> float:
    """Young's modulus of the outermost fibres [Pa].

    Raises:
        InputError: a given section without fibre_modulus or fibre_distances.
    """
    if isinstance(rod.section, GivenSection):
        require_known_stress(rod, twisted=False)
        assert rod.section.fibre_modulus is not None
        return rod.section.fibre_modulus
    assert rod.material is not None
    return rod.material.youngs_modulus


def require_known_stress(rod: Rod, *, twisted: bool) -> None:
    """Refuse a given section whose stress is not known.

    Args:
        twisted: whether the rods can be twisted: by joints, or because their two bending stiffnesses differ.

    Raises:
        InputError: values are missing that the stress needs.
    """
    if missing := _missing(rod, twisted):
        needed = " and ".join([", ".join(missing[:-1]), missing[-1]] if missing[1:] else missing)
        raise InputError(
            "a strength can be checked only where the stress is known, and of this given section that needs "
            f"{needed}: give what is missing (rod.section), or leave out the strength"
        )


def _missing(rod: Rod, twisted: bool) -> list[str]:
    """Values that the stress of a given section needs and that are missing."""
    if not isinstance(rod.section, GivenSection):
        return []
    needed = ["fibre_distances", "fibre_modulus", *(["torsion_modulus"] if twisted else [])]
    return [name for name in needed if getattr(rod.section, name) is None]


def _outline(rod: Rod) -> tuple[Floats, Floats, Floats]:
    """Points x, y >= 0 of the outline [m], (p,) each, and the shear stress there over the twist per length [Pa m]."""
    section = rod.section
    if isinstance(section, GivenSection):
        require_known_stress(rod, twisted=True)
        assert section.fibre_distances is not None
        assert section.torsion_modulus is not None
        farthest = section.fibre_distances
        # where the largest shear stress acts is not known: at the farthest fibre is the worst case
        return np.array(farthest[:1]), np.array(farthest[1:]), np.array([section.GJ / section.torsion_modulus])
    assert rod.material is not None
    a, b = section.half_widths
    if section.boxed:
        x, y, lever = _rectangle(2 * a, 2 * b)
    else:
        at = np.linspace(0.0, 0.5 * np.pi, 1 if section.round else POINTS)
        x, y = a * np.cos(at), b * np.sin(at)
        lever = 2 * a * b / (a**2 + b**2) * np.hypot(b * np.cos(at), a * np.sin(at))
    return x, y, rod.material.shear_modulus * lever


def _rectangle(width: float, height: float) -> tuple[Floats, Floats, Floats]:
    """As `_outline`, the shear stress over G theta': from the middle of each side to the corner, where it vanishes."""
    thin, wide = sorted((0.5 * width, 0.5 * height))
    share = np.linspace(0.0, 1.0, POINTS)[:, None]
    n = TERMS * np.pi / (2 * thin)
    # cosh(n s)/cosh(n wide) without overflow
    falls = (np.exp(-n * wide * (1 - share)) + np.exp(-n * wide * (1 + share))) / (1 + np.exp(-2 * n * wide))
    sign = np.where(TERMS % 4 == 1, 1.0, -1.0)
    on_wide = 2 * thin * (1 - 8 / np.pi**2 * (falls / TERMS**2).sum(axis=1))
    on_thin = 16 * thin / np.pi**2 * (sign * np.tanh(n * wide) * np.cos(n * thin * share) / TERMS**2).sum(axis=1)
    lever = np.concatenate([on_wide, on_thin])
    lever[[POINTS - 1, -1]] = 0.0
    along, end = np.append(wide * share, np.full(POINTS, wide)), np.append(np.full(POINTS, thin), thin * share)
    return (end, along, lever) if width <= height else (along, end, lever)


@dataclass(frozen=True, eq=False)
class Bending:
    """Bending, twist and stress at every node of every rod: arrays (k,) in the order of the mesh's `rod_nodes`.

    Args:
        curvature: [1/m].
        axial_strain: [-], mean of the edges on both sides.
        stress: the largest over the section of bending, stretch and torsion together [Pa], see
            `checks.bending`; None where the section's fibres are not known.
        strain: of the outermost fibre, bending and axial; None as the stress.
        normal_curvature, geodesic_curvature: parts of the curvature out of the shell and within it [1/m]; None where
            no rods cross.
        twist_rate: twist per length [rad/m]; zero where nothing twists the rods.
        torsion_stress: largest shear stress of torsion over the section [Pa]; None as the stress.
        fibre_strains: (k, 2) of the outermost fibres along m1 and m2, of bending alone [-]; None as the stress, and
            where it is not known which way a section bends that is not round.
    """

    curvature: Floats
    axial_strain: Floats
    stress: Floats | None
    strain: Floats | None
    normal_curvature: Floats | None
    geodesic_curvature: Floats | None
    twist_rate: Floats
    torsion_stress: Floats | None
    fibre_strains: Floats | None = None

    __repr__ = brief

    @property
    def bending_strain(self) -> Floats | None:
        """(k,) of the outermost fibre, without the axial strain."""
        return None if self.strain is None else np.asarray(self.strain - np.abs(self.axial_strain))


def worst(shapes: Sequence[Bending], where: slice = slice(None)) -> dict[str, float | None]:
    """The figures of a `Bent`, each the largest over a part of the rods' nodes in any of the shapes; how much of a
    strength that uses is counted elsewhere."""
    sharp = max(float(shape.curvature[where].max()) for shape in shapes)
    figures: dict[str, float | None] = {"min_radius": 1 / sharp if sharp > 0 else None}
    for key in Bent.model_fields.keys() - {"min_radius", "utilisation"}:
        name = key.removeprefix("max_")
        parts = [part[where] for shape in shapes if (part := getattr(shape, name)) is not None]
        figures[key] = max((float(np.abs(part).max()) for part in parts), default=None)
    return figures


def bending_of(
    shell: Shell, state: State, rod: Rod, *, shear_weight: float = VON_MISES, edge_strains: Floats | None = None
) -> Bending:
    """Bending of a shell of equal rods in a `state` (N, 3); laths are judged by how they bend about either axis.

    Args:
        edge_strains: (e,) axial strains that stress the edges; default: against their rest lengths.
    """
    mesh, positions = shell.mesh, shell.positions(state)
    normals = shell_normals(mesh, positions)
    if shell.node_count != mesh.node_count:  # rods a distance apart at their joints: each has its own line
        mesh, positions = mesh.apart, state[: shell.node_count]
    clamps = unit(state[shell.ghosts] - state[shell.ends]) if len(shell.ghosts) else None
    components, twist, by_joints = None, None, _bent_by_joints(shell, state, rod)
    if frames := shell.frames:
        at_rest = np.column_stack([frames.natural_curvature, frames.natural_twist])
        strains = _on_entries(shell, frames.strains(state) - at_rest)
        twist = strains[:, 2]
        if len(set(rod.bend_stiffnesses)) > 1 or at_rest.any():
            components = strains[:, :2]
        elif not rod.section.round:
            directors = _mean_of_edges(mesh, edge_directors(shell, frames, state))
            components = np.column_stack(_parts(*_turns(mesh, positions, clamps), directors))
    return bending(
        mesh, positions, rod,
        clamps=clamps, components=components, twist_rate=twist, normals=normals, shear_weight=shear_weight,
        edge_strains=edge_strains, by_joints=by_joints,
    )  # fmt: skip


def _bent_by_joints(shell: Shell, state: Floats, rod: Rod) -> Floats | None:
    """(k, 3) by how much more each rod bends on the sharper side of its joints than at their nodes, along the joints'
    normals [1/m]; None where no joint resists shear."""
    if not any(element.stiffness[:, 0, 0].any() for element in filter(is_elastic, shell.between)):
        return None
    mesh, loads = shell.mesh, joint_loads(shell, state)
    moments = np.zeros((len(mesh.rod_nodes), 3))
    np.add.at(moments, mesh.at_crossings, (np.abs(loads.shear_moments)[:, None] * loads.normals)[:, None])
    stiffness = np.full(len(moments), rod.bend_stiffnesses[1])
    if (local := varied_at_nodes(mesh, rod)) is not None:
        stiffness = stiffness * local.bend2
    share = np.ones(len(moments))  # a rod that ends at a joint has all of its moment on one side
    share[mesh.bend_entries] = 0.5
    return np.asarray(moments * (share / stiffness)[:, None])


def bending(
    mesh: GridMesh, positions: Floats, rod: Rod, *, clamps: Floats | None = None, components: Floats | None = None,
    twist_rate: Floats | None = None, normals: Floats | None = None, shear_weight: float = VON_MISES,
    edge_strains: Floats | None = None, by_joints: Floats | None = None,
) -> Bending:  # fmt: skip
    """Bending of the rods of `mesh` with nodes at `positions` (n, 3) [m].

    Args:
        clamps: (2m, 3) outward unit tangents that hold both ends of each rod in turn, or None (pinned).
        components: (k, 2) curvatures towards m1 and m2 [1/m]; without, the stress of a section that is not round is an
            upper bound, as if it bent towards its farthest point.
        twist_rate: (k,) twist per length [rad/m]; without, none.
        normals: (k, 3) of the shell at each entry of `rod_nodes`, by which the curvature is parted without
            `components`.
        shear_weight: of the shear stress against the normal stress, see the module.
        edge_strains: (e,) as of `bending_of`.
        by_joints: (k, 3) along the normals of joints, how much sharper than their nodes bend the sides of them that
            bend most [1/m]; None: joints pass no moments about their normals.
    """
    turns, tangents = _turns(mesh, positions, clamps)
    if by_joints is not None:
        turns = turns + np.copysign(1.0, dot(turns, by_joints))[:, None] * by_joints
        if components is not None:
            within = np.copysign(np.sqrt(dot(by_joints, by_joints)), components[:, 1])
            components = np.column_stack([components[:, 0], components[:, 1] + within])
    curvature = np.linalg.norm(turns, axis=1)
    if edge_strains is None:
        lengths = np.linalg.norm(positions[mesh.edges[:, 1]] - positions[mesh.edges[:, 0]], axis=1)
        edge_strains = lengths / mesh.edge_lengths - 1.0
    axial = _mean_of_edges(mesh, edge_strains)
    twist = np.zeros(len(curvature)) if twist_rate is None else twist_rate
    stress = strain = sheared = normal = geodesic = fibres = None
    if components is not None:
        normal, geodesic = components.T
    elif normals is not None:
        normal, geodesic = _parts(turns, tangents, normals)
    fibre, known = fibre_distance(rod), not _missing(rod, twisted=bool(twist.any()))
    # the strain of a fibre k times as far is that of a bend k times as sharp
    sharp, bends, sheared_by = curvature, components, twist
    if (local := varied_at_nodes(mesh, rod)) is not None:
        sharp, sheared_by = np.maximum(local.fibre1, local.fibre2) * curvature, local.shear * twist
        bends = None if components is None else np.column_stack([local.fibre1, local.fibre2]) * components
    if fibre is not None:
        bent = fibre * sharp if bends is None else fibre_strain(rod, bends[:, 0], bends[:, 1])
        strain = bent + np.abs(axial)
        if bends is not None and rod.section.half_widths is not None:
            fibres = bends * np.array(rod.section.half_widths)
        elif rod.section.round:
            fibres = np.column_stack([bent, np.zeros(len(bent))])
    if known and strain is not None:
        sheared = torsion_stress(rod, sheared_by) if twist.any() else np.zeros(len(twist))
        if bends is None:
            stress = np.hypot(fibre_modulus(rod) * strain, shear_weight * sheared)
        else:
            stress = largest_stress(rod, bends[:, 0], bends[:, 1], axial, sheared_by, weight=shear_weight)
    return Bending(curvature, axial, stress, strain, normal, geodesic, twist, sheared, fibres)


def edge_directors(shell: Shell, frames: BendTwist, state: State) -> Floats:
    """(e, 3) first material director m1 of each edge in a `state` (N, 3), to which `frames` are transported."""
    m1 = frames.refreshed(state).material_directors(state)
    result = np.zeros((len(shell.mesh.edges) + len(shell.ghosts), 3))  # of ghost edges, too
    for side in range(2):
        result[frames.blocks[:, 1 + 2 * side] - shell.first_angle] = m1[:, side]
    return result[: len(shell.mesh.edges)]


def shell_normals(mesh: GridMesh, positions: Floats) -> Floats | None:
    """(k, 3) normal of a shell with nodes at `positions` (n, 3) [m] at each entry of `rod_nodes`; None where some rod
    crosses no other."""
    if (mesh.grid.joint_counts() == 0).any():
        return None
    return node_normals(mesh, positions)[mesh.rod_nodes]


def _mean_of_edges(mesh: GridMesh, values: Floats) -> Floats:
    """(k, ...) of each entry of `rod_nodes`: the mean of the `values` (e, ...) of its edges, which at an end is one."""
    total, count = np.zeros((len(mesh.rod_nodes), *values.shape[1:])), np.zeros(len(mesh.rod_nodes))
    for entries in (mesh.edge_entries, mesh.edge_entries + 1):
        total[entries] += values
        count[entries] += 1
    return np.asarray(total / count.reshape(-1, *[1] * (values.ndim - 1)))


def _on_entries(shell: Shell, strains: Floats) -> Floats:
    """(k, 3) strains of the bends, and of clamps if among them, over their length at each entry of `rod_nodes`."""
    mesh = shell.mesh
    result = np.zeros((len(mesh.rod_nodes), 3))
    result[mesh.bend_entries] = strains[: len(mesh.bends)] / mesh.voronoi_lengths[:, None]
    if len(strains) > len(mesh.bends):
        result[mesh.end_entries] = strains[len(mesh.bends) :] / (0.5 * last_edges(mesh)[:, None])
    return result


def _turns(mesh: GridMesh, positions: Floats, clamps: Floats | None) -> tuple[Floats, Floats]:
    """At each entry of `rod_nodes` the curvature binormal (k, 3) [1/m] and the rod's direction (k, 3)."""
    turns, tangents = np.zeros((2, len(mesh.rod_nodes), 3))
    edges = unit(positions[mesh.edges[:, 1]] - positions[mesh.edges[:, 0]])
    tangents[:] = _mean_of_edges(mesh, edges)
    before, here, after = (positions[mesh.bends[:, k]] for k in range(3))
    turns[mesh.bend_entries] = _turn(unit(here - before), unit(after - here)) / mesh.voronoi_lengths[:, None]
    if clamps is not None:
        half = 0.5 * last_edges(mesh)[:, None]
        first, last = mesh.rod_start, mesh.rod_stop - 1
        turns[first] = _turn(-clamps[::2], tangents[first]) / half[::2]
        turns[last] = _turn(tangents[last], clamps[1::2]) / half[1::2]
        tangents[first] -= clamps[::2]
        tangents[last] += clamps[1::2]
    return turns, unit(tangents)


def _turn(before: Floats, after: Floats) -> Floats:
    """(b, 3) integrated curvature binormal between unit tangents, 2 tan(phi/2) long; exact also for small angles."""
    return np.asarray(2.0 * cross(before, after) / (1.0 + dot(before, after))[:, None])


def _parts(turns: Floats, tangents: Floats, axes: Floats) -> tuple[Floats, Floats]:
    """(k,) parts of the curvature towards `axes` (k, 3), and towards what lies across them and the rod [1/m]."""
    across = unit(axes - dot(axes, tangents)[:, None] * tangents)
    return dot(turns, cross(tangents, across)), dot(turns, across)

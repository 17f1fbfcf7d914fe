"""Seams: the patches into which they cut a target, where the middle of each is, and the rods of all patches.

The rods are chosen such that where a rod ends on a seam, a rod of the next patch ends too.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from string import ascii_uppercase

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components, minimum_spanning_tree, shortest_path
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist

from rodshell.arrays import Bools, Floats, Ints
from rodshell.errors import InputError, RodshellError
from rodshell.formfinding.end_matching import EndGoals, Point, match_net, rod_ends
from rodshell.formfinding.trim import NEAREST_JOINT
from rodshell.geometry.frames import cross, unit
from rodshell.layout import FlatGrid, FlatRod, GridLayout
from rodshell.nets import ChebyshevNet, chebyshev_net, geodesics
from rodshell.progress import Progress, silent
from rodshell.targets import Patch, Target
from rodshell.targets.creased import Creased
from rodshell.targets.patch import Seam

RAYS, STEPS = 240, 90  # of the survey of a target from its summit
FAR = 3.0  # sizes: length of a ray
ADJACENT = 0.09  # of the size: points closer than this are neighbours
AGAIN = 0.3  # of the size: where one ray's path to a place is longer than another's by this, it is a repeated visit
LEAST = 0.01  # of the target's area: smaller parts are not patches
DEEP = 0.05  # of the size: a centre of area closer to the patch's end is not used as its middle
REMEDY = "turn the layout (layout.rotate), so that its rods cross the seams, or use a smaller spacing"
FEWEST = 2  # joints of a rod; fewer than elsewhere, as leaving out a rod also removes those that it meets
MANY = 0.1  # of the rods: a larger share left out gives a warning
ASTRAY = 0.005  # of the size: rod ends that are moved further give a warning
SWINGS = f"it has fewer than {FEWEST} joints and would swing"
ALONE = "it ends on a seam where no rod of the next patch can meet it"


def patches_of(target: Target, seams: tuple[Seam, ...]) -> dict[str, Patch]:
    """The patches by their names A, B, ..., from left to right.

    Raises:
        InputError: the seams cut off nothing, or there are more patches than letters.
    """
    creased = target if isinstance(target, Creased) else None
    seams = creased.seams if creased else seams
    points, areas = creased.survey() if creased else _survey(target)
    sides = np.array([seam.distance(points) > 0 for seam in seams])  # (seams, n)
    found = list[Patch]()
    for part in _connected(points, sides, ADJACENT * target.size):
        if areas[part].sum() > LEAST * areas.sum():
            signs = tuple(1 if left else -1 for left in sides[:, part[0]])
            surface = creased.piece(signs) if creased else target
            patch = Patch(whole=target, surface=surface, seams=seams, sides=signs, middle=(0.0, 0.0))
            found.append(replace(patch, middle=_middle(patch, points[part], areas[part])))
    if len(found) < 2:
        raise InputError("the seams leave the target in one piece: draw lines that run across it in plan")
    if len(found) > len(ascii_uppercase):
        raise InputError(
            f"the seams cut the target into {len(found)} patches, more than {len(ascii_uppercase)}: use fewer seams"
        )
    coarse = 0.05 * target.size  # of two middles that are equally far left, the lower comes first
    found.sort(key=lambda patch: (round(patch.middle[0] / coarse), patch.middle[1]))
    return dict(zip(ascii_uppercase, found, strict=False))


def transported_heading(target: Target, anchor: tuple[float, float], rotate: float) -> float:
    """Angle against x, seen from above [rad], of the summit's heading `rotate` where it is carried to an anchor.

    It is rotated as the surface's normal is from one point to the other: mirrored patches get mirrored headings. Where
    the target is creased it is that of a level plane, since the summit may lie on a crease.
    """
    points = target.lift(np.array([target.summit, anchor]))
    n, m = target.on_surface(points).normal
    n = np.array([0.0, 0.0, 1.0]) if isinstance(target, Creased) else n
    along = np.array([np.cos(rotate) * n[2], np.sin(rotate) * n[2], -np.cos(rotate) * n[0] - np.sin(rotate) * n[1]])
    axis = np.cross(n, m)
    turned = along + np.cross(axis, along) + np.cross(axis, np.cross(axis, along)) / (1.0 + n @ m)
    return float(np.arctan2(turned[1], turned[0]))


def _survey(target: Target) -> tuple[Floats, Floats]:
    """Points (n, 3) of a target, each standing for an area (n,) [m2].

    They lie on geodesic rays from the summit, which also reach overhanging parts. Points of a ray that comes from below
    to where other rays have been before are dropped.
    """
    x, y = target.summit
    top = target.lift(np.array([[x, y]]))
    normal = target.on_surface(top).normal
    along = np.array([[normal[0, 2], 0.0, -normal[0, 0]]])
    along /= np.linalg.norm(along)
    angle = 2 * np.pi * (np.arange(RAYS)[:, None] + 0.5) / RAYS  # no ray runs along an axis, where a seam may lie
    directions = np.cos(angle) * along + np.sin(angle) * cross(normal, along)
    step = FAR * target.size / STEPS
    with np.errstate(all="ignore"):
        rays = np.stack(geodesics(target, np.repeat(top, RAYS, axis=0), directions, [np.full(STEPS, step)] * RAYS))
    areas = step * np.linalg.norm(np.roll(rays, -1, axis=0) - np.roll(rays, 1, axis=0), axis=2) / 2
    far = np.broadcast_to(step * np.arange(1, STEPS + 1), areas.shape)
    known = np.isfinite(rays[..., 0]) & np.isfinite(areas)
    known[known] = target.margin(rays[known]) > 0
    points, areas, far = rays[known], areas[known], far[known]
    first, second = _neighbours(points, ADJACENT * target.size).T
    again = np.zeros(len(points), dtype=bool)
    again[first] |= far[first] > far[second] + AGAIN * target.size
    again[second] |= far[second] > far[first] + AGAIN * target.size
    return points[~again], areas[~again]


def _neighbours(points: Floats, reach: float) -> Ints:
    """(m, 2) pairs of points (n, 3) no further apart than `reach` [m]."""
    return np.asarray(cKDTree(points).query_pairs(reach, output_type="ndarray"), dtype=np.intp).reshape(-1, 2)


def _connected(points: Floats, sides: Bools, reach: float) -> list[Ints]:
    """Points (k,) of each part: those within `reach` [m] on the same sides of all seams belong together."""
    pairs = _neighbours(points, reach)
    kept = pairs[(sides[:, pairs[:, 0]] == sides[:, pairs[:, 1]]).all(axis=0)]
    graph = coo_array((np.ones(len(kept)), (kept[:, 0], kept[:, 1])), shape=(len(points), len(points)))
    parts, label = connected_components(graph, directed=False)
    return [np.flatnonzero(label == k) for k in range(parts)]


def _middle(patch: Patch, points: Floats, areas: Floats) -> tuple[float, float]:
    """x, y of the patch's centre of area, put on the target; of its deepest point where that is not on the target.

    The centre of area of a patch that surrounds another lies in the other patch.
    """
    centre = patch.closest(np.average(points, axis=0, weights=areas)[None])
    if not (patch.whole.margin(centre)[0] > DEEP * patch.size and _from_above(patch, centre)[0]):
        seen = points[_from_above(patch, points)]
        if not len(seen):
            x, y, z = points.mean(axis=0)
            raise InputError(
                f"nothing of the patch around ({x:.4g}, {y:.4g}, {z:.4g}) m is seen from above, as where a mesh is "
                "jagged along a crease: let edges of its faces run along the crease, or smooth it"
            )
        centre = seen[[np.argmax(patch.margin(seen))]]
    x, y = centre[0, :2].tolist()
    return x, y


def _from_above(patch: Patch, points: Floats) -> Bools:
    """Whether points (n, 3) are those that their x, y as an anchor would mean: the uppermost."""
    z = patch.height_at(points[:, :2])
    return np.asarray(np.abs(z - points[:, 2]) < 1e-6 * patch.size)


@dataclass(frozen=True, order=True)
class End:
    """An end of a rod of a patch: side 0 is its start, 1 its end."""

    patch: str
    rod: str
    side: int

    def __str__(self) -> str:
        return f"{self.patch}-{self.rod}.{self.side}"


@dataclass(frozen=True, eq=False)
class Meeting:
    """A point (3,) of a seam at which two rods of different patches end [m]."""

    seam: int
    point: Floats
    ends: tuple[End, End]


@dataclass(frozen=True)
class PatchNet:
    """A patch with its rods; `dropped` names those that its layout leaves out, with the reason."""

    patch: Patch
    layout: GridLayout
    anchor: Point
    net: ChebyshevNet
    dropped: tuple[tuple[str, str], ...] = ()

    @property
    def rods(self) -> tuple[FlatRod, ...]:
        """The rods that are to be built."""
        return tuple(rod for rod in self.net.rods if not rod.virtual and rod.name not in self.layout.left_out)


@dataclass(frozen=True, eq=False)
class Seams:
    """How the patches of a target are joined.

    Args:
        target, layout: of the whole.
        nets: the rods of each patch, by its name.
        meetings: where rods of two patches end at one point.
        moved: of each patch the largest distance between a rod end of its mesh and that point, to which it was moved
            [m].
    """

    target: Target
    layout: GridLayout
    nets: dict[str, PatchNet]
    meetings: tuple[Meeting, ...]
    moved: dict[str, float] = field(default_factory=dict)

    @property
    def lines(self) -> tuple[Seam, ...]:
        """Where the target is cut: along creases that seams are drawn near to."""
        return next(iter(self.nets.values())).patch.seams

    @property
    def left_out(self) -> float:
        """The share of the rods that is left out because no rod of the next patch meets them at a seam."""
        missing = sum(len(net.layout.left_out) for net in self.nets.values())
        return missing / (missing + sum(len(net.rods) for net in self.nets.values()))

    def ends_of(self, patch: str) -> dict[tuple[str, int], Floats]:
        """By rod and side, the points (3,) at which rods of a patch meet others [m]."""
        return {(end.rod, end.side): at.point for at in self.meetings for end in at.ends if end.patch == patch}

    @property
    def warnings(self) -> tuple[str, ...]:
        """Sentences that a user should read."""
        words = [
            f"patch {name}: rod ends were moved by up to {by:.3g} m to the points where they meet others: its net does "
            "not reach these points well; try another heading or anchor"
            for name, by in self.moved.items()
            if by > ASTRAY * self.target.size
        ]
        if self.left_out > MANY:
            words.append(
                f"{100 * self.left_out:.0f} % of the rods are left out, because no rod of the next patch can meet them "
                "at a seam: another heading may leave out fewer (layout.rotate, or seams.patches for a single patch)"
            )
        return tuple(words)


@dataclass(frozen=True, eq=False)
class _OpenEnd:
    """A rod end on a seam that no rod meets yet: the sides of the patch beyond, its outward tangent, and the tangent of
    its patch across the seam."""

    end: End
    seam: int
    beyond: tuple[int, ...]
    point: Floats
    out: Floats
    across: Floats

    def mirrored(self, patch: Patch) -> Floats:
        """The tangent (3,) mirrored in the seam, in the surface of the patch beyond."""
        return self.out - (self.out @ self.across) * (self.across + patch.across(self.point, self.seam))


def lay_patches(
    patches: Mapping[str, Patch],
    layouts: Mapping[str, GridLayout],
    anchors: Mapping[str, Point | None],
    *,
    eccentricity: float = 0.0,
    progress: Progress = silent,
) -> tuple[dict[str, PatchNet], tuple[Meeting, ...]]:
    """The rods of each patch, in turn: each takes up the rods of those before it.

    Rods that meet no other at a seam are left out, and so are those that would swing without them.

    Args:
        patches, layouts, anchors: by the patches' names; anchors x, y [m], default the patch's middle.
        eccentricity: see `chebyshev_net`; at a seam the points midway between the layers meet.
    """
    patch_nets, waiting, meetings = dict[str, PatchNet](), list[_OpenEnd](), list[Meeting]()
    for name, patch in patches.items():
        progress("seams", f"laying patch {name}", 0.0)
        layout, anchor = layouts[name], anchors[name] or patch.middle
        to_meet = [end for end in waiting if end.beyond == patch.sides]
        try:
            if to_meet:
                wanted = _end_goals(patch, to_meet, [net.patch for net in patch_nets.values()])
                layout, anchor, net, matched = match_net(patch, layout, anchor, wanted, eccentricity=eccentricity)
                patch_nets[name] = PatchNet(patch, layout, anchor, net)
                for met in matched:
                    other = to_meet[met.point]
                    meetings.append(Meeting(other.seam, other.point, (other.end, End(name, met.rod, met.side))))
            else:
                net = chebyshev_net(patch, layout, anchor=anchor, eccentricity=eccentricity)
                patch_nets[name] = PatchNet(patch, layout, anchor, net)
        except RodshellError as reason:
            raise type(reason)(f"patch {name}: {reason}") from None
        done = {end for meeting in meetings for end in meeting.ends}
        waiting = [end for end in (*waiting, *_ends_on_seams(name, patch_nets[name])) if end.end not in done]
    return _without_unmatched(patch_nets, {end.end for end in waiting}, meetings)


def _end_goals(patch: Patch, ends: list[_OpenEnd], others: list[Patch]) -> EndGoals:
    """Where a patch's rods should end: at these ends of the others' rods."""
    taken = [k for k in range(len(patch.seams)) if any(_across(patch, k) == other.sides for other in others)]
    points = np.array([end.point for end in ends])
    return EndGoals(
        points,
        np.array([end.mirrored(patch) for end in ends]),
        _rows(np.array([end.seam for end in ends]), points),
        lambda x: np.isin(_cut_by(patch, x), taken),
    )


def _in_order(meetings: list[Meeting]) -> tuple[Meeting, ...]:
    """Seam by seam, along each."""
    seams, points = np.array([at.seam for at in meetings]), np.array([at.point for at in meetings])
    return tuple(meetings[k] for row in _rows(seams, points) for k in row.tolist())


def _rows(seams: Ints, points: Floats) -> list[Ints]:
    """Indices of the points (n, 3) on each seam, in their order along it; `seams` (n,) is the seam of each point."""
    here = [np.flatnonzero(seams == seam) for seam in np.unique(seams)]
    return [row[in_a_row(points[row])] for row in here]


def in_a_row(points: Floats) -> Ints:
    """The order (n,) of points (n, 3) along a curve through them, from one end, by their minimum spanning tree."""
    tree = minimum_spanning_tree(cdist(points, points) + 1e-300)
    first = int(np.argmax(shortest_path(tree, directed=False, indices=0)))
    return np.argsort(shortest_path(tree, directed=False, indices=first), kind="stable")


def _across(patch: Patch, seam: int) -> tuple[int, ...]:
    """Sides of the patch beyond a seam."""
    return tuple(-side if k == seam else side for k, side in enumerate(patch.sides))


def _cut_by(patch: Patch, points: Floats) -> Ints:
    """(n,) the seam on which points (n, 3) of a patch's end lie; -1: on the end of the whole."""
    off = np.array([patch.whole.margin(points), *(seam.distance(points) for seam in patch.seams)])
    return np.asarray(np.argmin(np.abs(off), axis=0) - 1)


def _ends_on_seams(name: str, grid: PatchNet) -> list[_OpenEnd]:
    """The ends of a patch's rods that a seam cuts off, at their points of the seam."""
    patch, rods = grid.patch, grid.rods
    points = rod_ends(grid.net, rods)
    cut_by = _cut_by(patch, points)
    result = []
    for k in np.flatnonzero(cut_by >= 0).tolist():
        seam = int(cut_by[k])
        on_seam = patch.on_seam(points[k], seam)
        rod, tiny = rods[k // 2], 0.1 * grid.layout.edge
        at = rod.end - tiny if k % 2 else rod.start + tiny
        out = unit(points[k] - grid.net.positions(rod, np.array([at]))[0])
        across = patch.across(on_seam, seam)
        result.append(_OpenEnd(End(name, rod.name, k % 2), seam, _across(patch, seam), on_seam, out, across))
    return result


def _without_unmatched(
    patch_nets: dict[str, PatchNet], unmatched: set[End], meetings: list[Meeting]
) -> tuple[dict[str, PatchNet], tuple[Meeting, ...]]:
    """Leave out rods with a unmatched end, rods that would swing, and those that they met, until all is in order."""
    out = {(end.patch, end.rod): ALONE for end in sorted(unmatched)}
    while True:
        before = len(out)
        for name, net in patch_nets.items():
            out |= {(name, rod): SWINGS for rod in _swinging(name, net, [rod for patch, rod in out if patch == name])}
        for meeting in meetings:
            for end, other in (meeting.ends, meeting.ends[::-1]):
                if (end.patch, end.rod) in out and (other.patch, other.rod) not in out:
                    out[other.patch, other.rod] = f"it meets {end.patch}-{end.rod}, which is left out"
        if len(out) == before:
            break
    for name, net in patch_nets.items():
        dropped = tuple((rod, why) for (patch, rod), why in out.items() if patch == name)
        patch_nets[name] = replace(
            net, layout=replace(net.layout, left_out=tuple(rod for rod, _ in dropped)), dropped=dropped
        )
    return patch_nets, _in_order([at for at in meetings if not any((end.patch, end.rod) in out for end in at.ends)])


def _swinging(name: str, grid: PatchNet, out: list[str]) -> list[str]:
    """Names of the rods that would have too few joints without those that are out."""
    rods = [rod for rod in grid.rods if rod.name not in out]
    if not rods:
        raise InputError(f"no rod of patch {name} meets others at its seams: {REMEDY}")
    margin = NEAREST_JOINT * min(grid.layout.spacing)
    return FlatGrid.of(rods, margin=margin).without(lambda grid: grid.joint_counts() < FEWEST)[1]

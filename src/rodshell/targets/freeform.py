"""A target given by a surface in triangles: its smooth field, where the shell ends, and its highest point."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from rodshell.arrays import Bools, Floats, Ints
from rodshell.errors import InputError
from rodshell.geometry.frames import cross, dot, unit
from rodshell.progress import Progress, require_progress, silent
from rodshell.targets.creases import Creases
from rodshell.targets.field_fitting import OFF, FittedField, fit_mesh
from rodshell.targets.rim import UPRIGHT, Given, Rim, smooth_loop
from rodshell.targets.smooth_field import SmoothField
from rodshell.targets.target import Deviation, Gap, Implicit, Target
from rodshell.targets.trianglemesh import FARTHEST, TriangleMesh, sound_mesh
from rodshell.targets.wall_below_rim import WalledSurface, walled_surface
from rodshell.units import length_text, point_text
from rodshell.untrusted import limit, raised
from rodshell.validation import array, number

ASIDE = 0.05  # of the size: a boundary curve further from the surface does not belong to it
OTHER_UNIT = 8.0  # times as wide as the surface: such a boundary is drawn in another unit
TOLD = 2e-4  # of the size: how far from what is given the shell may end without a word
TIE = 1e-3  # of the size: points this close to the highest count as equally high
MOST_ALONG = 100_000  # points of all these curves
MOST_ENDS = 200  # closed curves at which a surface ends: each is followed at 1,500 points
AT_ONCE = 500_000  # pairs of a point and a facet that are looked at together


@dataclass(frozen=True, kw_only=True, eq=False)
class Freeform(Target):
    """A surface in triangles, open or closed, to which a smooth field is fitted; make one with `Freeform.of`.

    Two such targets are equal only if they are the same object.

    Args:
        surface: one smooth piece, facing up.
        base: z of a plane below which there is no shell [m], or None.
        curves: closed polylines (n, 3) near the surface [m]: the first bounds the shell, further ones are openings.
        source: kind, file and options, as they are written in a case file.
        repairs: what was changed in the mesh, in sentences.
        whole: the mesh with what is beyond its creases; None: it has none.
        creased: what is said of its creases.
        usable: False: the whole is not a smooth surface, and must be cut along its creases by seams.
    """

    surface: TriangleMesh
    base: float | None = None
    curves: tuple[Floats, ...] = ()
    source: Mapping[str, object] = field(default_factory=dict)
    repairs: tuple[str, ...] = ()
    whole: TriangleMesh | None = None
    creased: str = ""
    usable: bool = True

    @staticmethod
    def of(
        vertices: Floats,
        faces: Ints,
        *,
        base: float | None = None,
        curves: tuple[Floats, ...] = (),
        source: Mapping[str, object] | None = None,
        name: str = "the mesh",
        notes: tuple[str, ...] = (),
        progress: Progress = silent,
    ) -> "Freeform":
        """Make a target of a mesh; the shell ends at the mesh's open boundary, at curves and at a base plane.

        Args:
            vertices: (n, 3) [m].
            faces: (m, 3) indices of the vertices of each triangle.
            base: z of a plane below which there is no shell [m], or None.
            curves: closed polylines (n, 3) near the surface [m]: the first bounds the shell, further ones are openings.
            source: kind, file and options, as they are written in a case file.
            name: of the mesh, for messages.
            notes: what was changed in the mesh before, in sentences.
            progress: called at each step of the fit.

        Raises:
            InputError: an argument is of the wrong kind; the mesh is not a smooth surface; or it is closed, and neither
                a base nor a curve says where the shell ends.
        """
        require_progress(progress)
        vertices = array("vertices", vertices, np.float64, None, 3)
        faces = array("faces", faces, np.intp, None, 3)
        base = None if base is None else number("target base", base, "m")
        curves = tuple(array("a boundary curve", curve, np.float64, None, 3) for curve in curves)
        progress("preparing", f"mesh of {len(faces)} triangles", 0.0)
        found = sound_mesh(vertices, faces, name)
        made = {"kind": "mesh", "vertices": len(vertices), "faces": len(faces)}
        target = Freeform(
            surface=found.surface, base=base, curves=curves, source=dict(source or made),
            repairs=(*notes, *found.repairs), whole=found.whole, creased=found.creased, usable=found.smooth,
        )  # fmt: skip
        if not target.usable:
            if not target.along_creases:
                raise InputError(target.creased)
            return target
        try:
            target._require_curves(name)
            target.fit(progress)
            progress("preparing", "ends of the surface", 0.0)
            target._require_an_end(name)
            target.require_a_good_fit(name)
        except InputError as reason:
            if not target.along_creases:
                raise
            return replace(target, creased=str(reason), usable=False)
        return target

    @cached_property
    def creases(self) -> Creases:
        """Those of the whole mesh."""
        return Creases(self.whole or self.surface, self.name)

    @cached_property
    def along_creases(self) -> str:
        """What to do about its creases, where seams can lie along them; else ""."""
        lines = " | ".join("; ".join(f"{x:.4g},{y:.4g}" for x, y in line.tolist()) for line in self.creases.lines())
        return (
            lines and f': to form it in patches that meet there, lay seams along its creases, --seams.lines "{lines}"'
        )

    def require_usable(self) -> None:
        """Refuse a mesh that no seams cut along its creases, where it is smooth nowhere else.

        Raises:
            InputError: names seams that would.
        """
        if not self.usable:
            raise InputError(self.creased + self.along_creases)

    @property
    def name(self) -> str:
        """Name of its file without the folder, or its kind."""
        return Path(str(self.source.get("file", self.source.get("kind", "mesh")))).name

    @property
    def warnings(self) -> tuple[str, ...]:
        ends, moved = self._open_ends
        words = [*self.repairs, self.creased + self.along_creases] if self.creased else list(self.repairs)
        names = ["the edge of the mesh"] * bool(ends) + ["the boundary that is drawn"]
        words += [
            f"the shell ends up to {length_text(rim.off)} from {name}: on the smooth surface, in a smooth curve where "
            "six or more of its points turn by little; give more points, or corners"
            for name, rim in zip(names, self.rims, strict=False)
            if rim.off > TOLD * self.size and self._ends_at(rim)
        ]
        if jagged := np.count_nonzero(moved):
            edges = f"{jagged} of the {len(ends)} edges of the mesh are" if len(ends) > 1 else f"{names[0]} is"
            words.append(
                f"{edges} jagged where faces are missing: the shell ends at a smooth curve, up to "
                f"{length_text(max(moved))} from the vertices there; to end it elsewhere give target.boundary"
            )
        return tuple(words)

    def __repr__(self) -> str:
        widths = " x ".join(f"{width:.3g}" for width in np.ptp(self.surface.vertices, axis=0))
        return f"Freeform({self.name}: {len(self.surface.faces)} triangles, {widths} m)"

    def parameters(self) -> dict[str, object]:
        return dict(self.source)

    @cached_property
    def size(self) -> float:
        """Half the largest extent of the shell [m]."""
        known = np.vstack([self.surface.vertices, *(rim.points for rim in self.rims)])
        inside = self.margin(known) > -1e-6 * self._extent
        return 0.5 * float(np.ptp(known[inside], axis=0).max())

    @cached_property
    def _extent(self) -> float:
        return 0.5 * float(np.ptp(self.surface.vertices, axis=0).max())

    @cached_property
    def _fitted(self) -> FittedField:
        return self.fit()

    def fit(self, progress: Progress = silent) -> FittedField:
        """Fit its field now, which else is fitted when it is needed first; `progress` is called at each step."""
        self.require_usable()
        self.__dict__["_fitted"] = fitted = fit_mesh(self.surface, size=self._extent, progress=progress)
        return fitted

    @property
    def field(self) -> SmoothField:
        """The smooth implicit function that replaces the mesh."""
        return self._fitted.field

    @property
    def deviation(self) -> Deviation:
        off = self._fitted.off
        return Deviation(float(off.max()), float(np.sqrt(np.mean(off**2))))

    def implicit(self, x: Floats) -> Implicit:
        return self.field.implicit(x)

    def level(self, x: Floats) -> tuple[Floats, Floats]:
        value, gradient, _ = self.field.implicit(x, second=False)
        return value, gradient

    def covers(self, x: Floats) -> Bools:
        """Whether points `x` (n, 3) of the surface are inside the end, or where an opening was filled."""
        return (self.margin(x) > 0) | self._filled(x)

    def _filled(self, x: Floats) -> Bools:
        """Whether points (n, 3) of the surface are among its own, with its openings filled, and not past its edge."""
        return self.field.nearest(x)[1] < self._fitted.cubics

    @cached_property
    def rims(self) -> tuple[Rim, ...]:
        """The rims of the open boundary and of the boundary curves, if there are any."""
        rims = []
        if self.surface.loops:
            ends, moved = self._open_ends
            rims.append(self._rim(ends, ["surface" if far else "space" for far in moved]))
        if self.curves:
            over = [_turning(self._over(curve), k > 0) for k, curve in enumerate(self.curves)]
            rims.append(self._rim(over, ["space" if self._is_in_space(curve) else "plan" for curve in self.curves]))
        return tuple(rims)

    def _ends_at(self, rim: Rim) -> bool:
        """Whether the shell ends at some point of this rim: another boundary or the base plane may lie inside of it."""
        return bool((self.margin(rim.points) > -1e-6 * self._extent).any())

    @cached_property
    def _open_ends(self) -> tuple[list[Floats], list[float]]:
        """The loops (n, 3) of the open boundary; and how far each was moved, where it was jagged [m]."""
        ends, moved = list[Floats](), list[float]()
        for loop in self.surface.loops:
            x = self.surface.vertices[loop]
            smooth = smooth_loop(x, self.surface.normals[loop])
            ends.append(x if smooth is None else smooth)
            moved.append(0.0 if smooth is None else float(np.linalg.norm(self._settle(smooth) - x, axis=1).max()))
        return ends, moved

    def _rim(self, loops: list[Floats], given: list[Given]) -> Rim:
        return Rim.of(loops, self._settle, lambda x: unit(self.level(x)[1]), given)

    def _settle(self, x: Floats) -> Floats:
        """Points (n, 3) near the surface moved onto it: straight up or down, so that what is straight in plan stays so,
        or to the closest where it is steep. Other than `retract` it does not need the size, which the rims decide."""
        y = x
        for _ in range(3):
            value, gradient = self.level(y)
            y = y - (value / dot(gradient, gradient))[:, None] * gradient
        over = np.column_stack([x[:, :2], self._straight_up(np.column_stack([x[:, :2], y[:, 2]]))])
        near = UPRIGHT * np.abs(over - x)[:, 2] <= np.linalg.norm(y - x, axis=1) + 1e-9 * self._extent
        return np.where(near[:, None], over, y)

    def _straight_up(self, x: Floats) -> Floats:
        """z (n,) of the surface straight above or below points (n, 3) [m]; NaN where none is found."""
        z, left, step = x[:, 2].copy(), np.flatnonzero(np.isfinite(x[:, 2])), np.empty(0)
        for _ in range(20):
            value, gradient = self.level(np.column_stack([x[left, :2], z[left]]))
            with np.errstate(divide="ignore", invalid="ignore"):
                step = np.clip(-value / gradient[:, 2], -0.1 * self._extent, 0.1 * self._extent)
            z[left] += step
            busy = np.abs(step) > 1e-14 * self._extent
            left, step = left[busy], step[busy]
            if not len(left):
                break
        z[left[np.abs(step) > 1e-9 * self._extent]] = np.nan
        return z

    def margin(self, x: Floats) -> Floats:
        """Distance (n,) [m] of the points `x` (n, 3) to the nearest of base plane, open boundary and curves."""
        margins = [rim.distance(x) for rim in self.rims]
        if self.base is not None:
            margins.append(x[:, 2] - self.base)
        return np.asarray(np.min(margins, axis=0))

    def section(self, z: float) -> Rim:
        """The loops in which the plane at height `z` [m] cuts the surface, counter-clockwise seen from above."""

        def onto(x: Floats) -> Floats:
            for _ in range(4):
                value, gradient = self.level(x)
                across = gradient * [1.0, 1.0, 0.0]
                x = x - (value / dot(across, across))[:, None] * across
            return x

        return Rim.of(
            [_turning(loop, False) for loop in self.surface.section(z)], onto, lambda x: unit(self.level(x)[1])
        )

    @cached_property
    def _body(self) -> WalledSurface:
        return walled_surface(self, self.surface, self.field, self.rims, self.section)

    def outside(self, x: Floats) -> Bools:
        return self._body.outside(x)

    def contact(self, x: Floats) -> Gap:
        return self._body.contact(x)

    def height_at(self, xy: Floats) -> Floats:
        xy = np.asarray(xy, dtype=float).reshape(-1, 2)
        z = self._heights_of_facets(xy)
        beside = np.flatnonzero(np.isnan(z) & np.isfinite(xy).all(axis=1))
        z[beside] = self._heights_of_fillings(xy[beside])
        smooth = self._straight_up(np.column_stack([xy, z]))
        return np.where(np.abs(smooth - z) < 0.1 * self._extent, smooth, np.nan)

    @cached_property
    def _facets_by_size(self) -> list[tuple[cKDTree, Ints, float]]:
        """Trees of facets' centres in plan, one for each power of two of their widths; the facets; and that width."""
        plan = self.surface.vertices[self.surface.faces, :2]
        low, high = plan.min(axis=1), plan.max(axis=1)
        reach = np.maximum(np.linalg.norm(high - low, axis=1), 1e-9 * self._extent)  # twice of what is enough
        octave = np.ceil(np.log2(reach)).astype(int)
        groups = [(np.flatnonzero(octave == k), 2.0**k) for k in np.unique(octave).tolist()]
        return [(cKDTree(0.5 * (low + high)[some]), some, far) for some, far in groups]

    def _heights_of_facets(self, xy: Floats) -> Floats:
        """z (n,) of the uppermost facet over points of the plan, or NaN."""
        z, known = np.full(len(xy), np.nan), np.flatnonzero(np.isfinite(xy).all(axis=1))
        for tree, facets, far in self._facets_by_size:
            count = np.asarray(tree.query_ball_point(xy[known], 0.51 * far, return_length=True))
            for some in np.split(np.arange(len(known)), np.flatnonzero(np.diff(np.cumsum(count) // AT_ONCE)) + 1):
                near = tree.query_ball_point(xy[known[some]], 0.51 * far)
                point = np.repeat(known[some], count[some])
                facet = facets[np.concatenate([*near, []]).astype(np.intp)]
                x, y = xy[point].T
                a, b, c = self.surface.vertices[self.surface.faces[facet].T]
                wedge = np.stack(
                    [(p[:, 0] - x) * (q[:, 1] - y) - (p[:, 1] - y) * (q[:, 0] - x) for p, q in ((b, c), (c, a), (a, b))]
                )
                total = wedge.sum(axis=0)
                inside = ((wedge >= 0).all(axis=0) | (wedge <= 0).all(axis=0)) & (total != 0)
                height = (wedge * [a[:, 2], b[:, 2], c[:, 2]]).sum(axis=0)[inside] / total[inside]
                np.fmax.at(z, point[inside], height)
        return z

    def _heights_of_fillings(self, xy: Floats) -> Floats:
        """z (n,) of the uppermost cubic on the surface, or filling an opening, near points of the plan, or NaN."""
        centres = self.field.centres[: self._fitted.cubics]
        near = cKDTree(centres[:, :2]).query_ball_point(xy, self.field.spacing)
        return np.array([centres[found, 2].max() if found else np.nan for found in near])

    @cached_property
    def summit(self) -> tuple[float, float]:
        """x, y of the highest point inside the end [m]; of the surface's middle where it is on the edge.

        Of equally high points, as on a barrel vault, the point nearest to the middle.
        """
        x = self.surface.vertices
        margin = self.margin(x)
        inner = x[margin > -1e-6 * self._extent]
        middle = 0.5 * (inner.min(axis=0) + inner.max(axis=0))
        high = (margin > 2 * self.field.spacing) & (x[:, 2] >= inner[:, 2].max() - TIE * self._extent)
        if high.any():
            return self._climbed(x[high][np.argmin(np.linalg.norm(x[high, :2] - middle[:2], axis=1))])
        if np.isfinite(self.height_at(middle[None, :2])[0]):
            return float(middle[0]), float(middle[1])
        x, y, _ = x[np.argmax(margin)].tolist()
        return x, y

    def _climbed(self, start: Floats) -> tuple[float, float]:
        """The peak near a vertex, by Newton on the smooth surface; along a ridge it stays where it is."""
        point = start[None].copy()
        for _ in range(30):
            point = self.retract(point)
            _, gradient, hessian = self.implicit(point)
            slope, bend = -gradient[0, :2] / gradient[0, 2], -hessian[0, :2, :2] / gradient[0, 2]
            values, axes = np.linalg.eigh(bend)
            along = (axes.T @ slope) * (np.abs(values) > 0.02 / self._extent)
            step = axes @ (along / np.maximum(np.abs(values), 0.02 / self._extent))
            step *= min(1.0, self.field.spacing / max(float(np.linalg.norm(step)), 1e-300))
            point[0, :2] += step
            if np.linalg.norm(step) < 1e-12 * self._extent:
                break
        x, y = np.where(np.abs(point[0, :2]) < 1e-5 * self._extent, 0.0, point[0, :2]).tolist()
        return x, y

    def _over(self, curve: Floats) -> Floats:
        """A curve drawn in a horizontal plane, such as a plan, projected onto the surface; any other curve as it is."""
        if self._is_in_space(curve) or self._off(curve) < ASIDE * self._extent:
            return curve
        z = self.height_at(curve[:, :2])
        if not np.isfinite(z).all():
            where = point_text(curve[np.argmin(np.isfinite(z)), :2])
            width, across = float(np.ptp(curve[:, :2], axis=0).max()), 2 * self._extent
            if width > OTHER_UNIT * across:
                raise InputError(
                    f"the boundary curve is {length_text(width)} wide and the surface {length_text(across)}: draw it "
                    "in the unit of the surface, in which it is read"
                )
            raise InputError(f"the boundary curve leaves the surface in plan near {where}: draw it inside")
        return np.column_stack([curve[:, :2], z])

    def _is_in_space(self, curve: Floats) -> bool:
        return float(np.ptp(curve[:, 2])) > 1e-6 * self._extent

    def _off(self, curve: Floats) -> float:
        """Largest distance of a curve from the surface [m]."""
        return float(np.nan_to_num(np.abs(self.implicit(curve).value), nan=np.inf).max())

    def _require_curves(self, name: str) -> None:
        """Refuse a surface without an end or with too many, and curves of too few points: known without the field."""
        ends = len(self.surface.loops) + len(self.curves)
        along = sum(map(len, (*self.surface.loops, *self.curves)))
        for count, most, what in ((ends, MOST_ENDS, "closed curves"), (along, MOST_ALONG, "points")):
            if count > limit(most):
                raise InputError(
                    f"{name} ends at {count} {what}, and at most {limit(most):.0f} are followed: fill its openings, "
                    f"or mesh it more coarsely, {raised(most, count)}"
                )
        for curve in self.curves:
            far = float(np.abs(curve).max(initial=0.0))
            if not far <= FARTHEST:
                raise InputError(f"the boundary curve has coordinates up to {far:.3g} m: draw it on the surface")
            if len(np.unique(curve, axis=0)) < 3:
                raise InputError("the boundary curve has fewer than three different points: draw it around the shell")
        if self.base is None and not ends:
            x = self.surface.vertices
            raise InputError(
                f"{name} is closed: say where the shell ends, by a base plane between z = {x[:, 2].min():.4g} and "
                f"{x[:, 2].max():.4g} m or by a boundary curve"
            )

    def _require_an_end(self, name: str) -> None:
        for curve in self.curves:
            off = self._off(self._over(curve))
            if not off < ASIDE * self._extent:
                raise InputError(f"the boundary curve is up to {off:.3g} m away from {name}: draw it on the surface")
        x = self.surface.vertices
        if not (self.margin(np.vstack([x, x[self.surface.faces].mean(axis=1)])) > 0).any():
            raise InputError(f"no part of {name} is inside its boundary: choose a lower base or another boundary")

    def require_a_good_fit(self, name: str) -> None:
        """Refuse a mesh that its smooth field does not follow, as it is rough or two of its sheets are too close."""
        off, x = self._fitted.off, self.surface.vertices
        k = int(np.argmax(off))
        if not off[k] < OFF * self._extent:
            how = f"vertices lie {off[k]:.2g} m off it" if np.isfinite(off[k]) else "or another sheet's normals differ"
            raise InputError(
                f"{name} cannot be followed by a smooth surface near {point_text(x[k])}, where its "
                f"{how}: smooth it, mesh it more finely there, or separate sheets that touch or cross each other"
            )


def _turning(curve: Floats, opening: bool) -> Floats:
    """A closed curve with the shell on its left: inside the outer one, outside an opening; seen from above."""
    area = cross(curve, np.roll(curve, -1, axis=0)).sum(axis=0)
    return curve[::-1] if (area[2] < 0) != opening else curve

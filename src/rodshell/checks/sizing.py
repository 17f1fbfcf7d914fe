"""A rod that fits: the thickest section of a given material that withstands the bends of its shell.

The shape of a shell of equal rods does not depend on their size, since rods bend and twist, and hardly stretch: all
moments grow with EI, those of rigid joints too. So the curvatures of a shell popped up with a provisional rod are those
of any other size, and its strains are in proportion to it. Only proportions matter: of bending about either axis and
torsion (laths of other proportions, tubes), and of elastic joints to rods. A section chosen in this way is therefore
popped up itself, and chosen again where it uses too much.

Shells with ball joints and pins bend as the net of their target does, and are sized by it before anything is solved.
What joints that resist shear add is not in the net; and what a table of rods bends to follows from all its rods: the
arc over a single rod's chord is right only where the ends of all rods belong to one net.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import cache
from typing import NamedTuple, Self

import numpy as np

from rodshell.arrays import Floats
from rodshell.checks.bending import VON_MISES, bending_of, largest_stress
from rodshell.errors import InputError, NetLimitError
from rodshell.formfinding.popup import PopUp
from rodshell.joints import Ball, Joint
from rodshell.layout import Layout, SurfaceLattice
from rodshell.nets import ChebyshevNet, chebyshev_net
from rodshell.nets.surface_lattice import surface_net
from rodshell.progress import Progress, silent
from rodshell.rods.design_strength import permanent_strength
from rodshell.rods.materials import Material, PresetName
from rodshell.rods.section import TRADE_SIZES, Circle, GivenSection, Rod, Section, Tube, scaled, size_text
from rodshell.targets import Target
from rodshell.targets.creased import Creased
from rodshell.units import BUILT, as_built, length_text, rounded_down
from rodshell.untrusted import limit, raised

WIDE = 1.0  # m: targets above it are built of what shells of metres are built of, those below are models
SLENDER = 1 / 200  # radius over the target's size [HQK section 3.1]: no rod is sized thicker
# Of the permanent strength. By the bends of the net it is an estimate, since the free shell bends up to 1.2 times as
# sharply (measured on the gallery), a clamped barrel 1.35 times at its ends. During deployment flat roofs bend 3 times
# as sharply, those with several waves more.
AIM = 3 / 4
ROOM = 1 / 6  # depth of a rod over the spacing: joints need room
PLAN = 41  # points each way at which a target without a net is sampled
KNOWN = 50  # width of a shell over the depth of its rods, at least
MOST_SLENDER = 100_000  # the same, at most; known ones have up to 5000
USUAL = (20, 5000)  # the same of the sizes that are proposed
SPACED = (5, 500)  # width of a shell over the spacing of its rods, of those
UNITS = (1e-3, 0.01, 0.0254)  # by which lengths are wrong that were given as metres
THICKEST, WIDEST = 0.5, 1e3  # m: a section and a shell that are proposed


class Bends(NamedTuple):
    """How rods bend, whatever their size.

    Args:
        normal, geodesic: (k,) curvatures out of the shell, along its normal, and within it [1/m].
        twist: (k,) twist per length [rad/m].
        force: (k,) axial force over EI [1/m2].
    """

    normal: Floats
    geodesic: Floats
    twist: Floats = np.zeros(1)
    force: Floats = np.zeros(1)

    def rolled(self) -> "Bends":
        """The same of laths that are free to turn about their own axes: they bend towards their thin side alone."""
        return self._replace(normal=np.hypot(self.normal, self.geodesic), geodesic=np.zeros_like(self.geodesic))


@dataclass(frozen=True)
class Fit:
    """What a rod that is not given has to fit.

    Args:
        width: of the shell [m], by which the material is chosen.
        slender: radius of a rod as slender as the paper's [m].
        thickest: largest depth of a rod between its joints [m].
        bends: called if they are needed.
        thickest_of: what that depth is a share of, in words.
        bends_from: where the bends are taken from, in words.
        shear_weight: strength over shear strength, by which torsion is added to bending, see `checks.bending`.
        by_weight: whether the shell's own weight asked for more than three quarters of the strength.
    """

    width: float
    slender: float
    thickest: float
    bends: Callable[[], Bends]
    thickest_of: str = "a hundredth of half the shell's width"
    bends_from: str = "an estimate of the bends"
    shear_weight: float = VON_MISES
    by_weight: bool = False

    @classmethod
    def on(
        cls,
        target: Target,
        layout: Layout,
        *,
        anchor: tuple[float, float] | None = None,
        joint: Joint | None = None,
        progress: Progress = silent,
    ) -> Self:
        """By the net of a layout on its target, which is marched when bends are first asked for.

        Args:
            anchor: x, y of the point of the target where the two axes cross [m]; default: the target's highest point.
            joint: ball joints without; where it does not hold the rods' normals, laths roll towards their thin side.
        """
        slender = SLENDER * target.size
        room = ROOM * layout.least_spacing

        @cache  # a net costs more than all that is asked of it
        def bends() -> Bends:
            found = bends_of(target, layout, anchor, progress)
            return found if (joint or Ball()).holds_normals else found.rolled()

        fit = cls(2 * target.size, slender, 2 * slender, bends)
        if room < fit.thickest:
            fit = replace(fit, thickest=room, thickest_of="a sixth of the spacing")
        if joint is not None and joint.resists_shear:
            fit = replace(fit, bends_from="an estimate of the bends without the moments of the joints")
        return fit

    @classmethod
    def between(cls, lengths: Floats, ends: Floats) -> Self:
        """By rods whose ends come to lie at given points: each bends like a sine, as if it were joined to no other.

        Args:
            lengths: (m,) of the rods [m].
            ends: (m, 2, 3) where their ends come to lie [m].
        """
        chords = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
        ring = float(lengths.max()) / np.pi  # of a rod whose ends meet
        width = max(float(np.ptp(ends[:, :, :2], axis=(0, 1)).max()), ring)
        rise = 2 * np.sqrt(np.clip(1 - chords / lengths, 0.0, 1.0))  # amplitude of the tangent's angle [rad]
        slender = SLENDER * width / 2
        alone = "an estimate of the bends of single rods"
        bends = Bends(np.pi * rise / lengths, np.zeros(len(lengths)))
        return cls(width, slender, 2 * slender, lambda: bends, bends_from=alone)

    def by_pop_ups(self, shells: Iterable[PopUp], rod: Rod, *, shear_weight: float) -> Self:
        """The same by the bends that shells of a provisional `rod`, all flat rods alike, have in equilibrium."""
        bends = bends_of_pop_ups(shells, rod)
        return replace(self, bends=lambda: bends, bends_from="the bends of a pop-up", shear_weight=shear_weight)

    def allows(self, rod: Rod, strength: float) -> bool:
        """Whether a rod uses at most three quarters of a permanent strength [Pa]."""
        assert rod.material is not None
        assert not isinstance(rod.section, GivenSection)
        return self._strain(rod.section, rod.material) * rod.material.youngs_modulus <= AIM * strength

    def _strain(self, section: Section, material: Material, bends: Bends | None = None) -> float:
        return largest_strain(Rod(section, material), bends or self.bends(), shear_weight=self.shear_weight)

    @property
    def preset(self) -> PresetName:
        """The material where none is given: of those used for shells of metres the one that withstands the sharpest
        bends; below a metre the plastic of printers."""
        return "gfrp" if self.width > WIDE else "petg"

    def section(
        self, material: Material, *, strength: float | None = None, shape: Circle | Tube | None = None
    ) -> Section:
        """The thickest section that by these bends uses at most three quarters of the permanent strength.

        Of the sizes in which a preset material is sold; where none of those fits, or for a material without a name, in
        steps of 1, 1.5, 2, 3, 5, 7. Without a known strength the section is as slender as the paper's rods on its
        hemisphere, and with one no thicker than that.

        Args:
            strength: permanent [Pa]; None: the preset's by its building code.
            shape: a circle, or a tube whose wall stays as it is, of which only the radius is looked for.

        Raises:
            InputError: the tube's wall is too thick for what the bends allow.
        """
        strength = strength or permanent_strength(material)
        if strength is None:
            return Tube(self.slender, shape.thickness) if isinstance(shape, Tube) else Circle(self.slender)
        allowed = AIM * strength / material.youngs_modulus
        stock = _sold(material, shape)
        thin = [section for section in stock if section.depth <= self.thickest]
        fitting = [section for section in thin if self._strain(section, material) <= allowed]
        if fitting:
            return fitting[-1]
        like = shape or (stock[0] if stock else Circle(self.slender))
        strain = self._strain(scaled(like, self.thickest / like.depth), material)
        most = self.thickest * min(
            1.0, allowed / strain if strain else 1.0
        )  # thinner ones strain in proportion or less
        return _of_depth(like, rounded_down(most), wall_stays=shape is not None)

    def stiffer(self, rod: Rod, gain: float, strength: float) -> Section | None:
        """The thinnest size that is sold of which a shell carries `gain` times as many of its own weights as of `rod`,
        and that withstands the bends, or else the thickest that withstands them; None: none is stiffer and does.

        By similarity: the same bends take EI, so that the factor on the weight grows with EI over it.
        """
        assert rod.material is not None
        now, best = np.array(rod.section.second_moments) / rod.section.area, None  # type: ignore[union-attr]
        for section in TRADE_SIZES.get(rod.material.name or "rubber", ()):
            grown = np.min(np.array(section.second_moments) / section.area / now)
            used = self._strain(section, rod.material) * rod.material.youngs_modulus / strength
            if grown > 1 and used <= 1 and section.depth <= self.thickest:
                best = section
                if grown >= gain:
                    break
        return best

    def reason(
        self,
        section: Section,
        material: Material,
        *,
        strength: float | None = None,
        shape: Circle | Tube | None = None,
    ) -> str:
        """Why `section` was chosen, in words: by what, the share of the strength expected, and what keeps it thin. The
        parameters are those of `section`, which chose it."""
        strength = strength or permanent_strength(material)
        if strength is None:
            return "as slender as the paper's rods, since no strength is known"
        bears = strength / material.youngs_modulus

        def kept_out(other: Section) -> str:
            used = self._strain(other, material) / bears
            if other.depth > self.thickest and used <= AIM:
                return f"{size_text(other)}, is wider than {self.thickest_of}, {length_text(self.thickest)}"
            if used <= AIM:
                return f"{size_text(other)}, would have used more by the bends of an earlier pop-up"
            rolls = self._strain(other, material, self.bends().rolled()) / bears <= AIM
            edgewise = ", since the joints keep it from rolling and bend it edgewise too" if rolls else ""
            return f"{size_text(other)}, would use {_share(used)} at the sharpest bend{edgewise}"

        stock = _sold(material, shape)
        share = _share(self._strain(section, material) / bears)
        share += ", as its own weight asks for" * self.by_weight
        said = (
            f"by {self.bends_from}, aiming at {_share(AIM)} of the permanent strength at most and coming to {share}; "
        )
        if (section,) == stock[-1:]:
            return said + "no thicker one is sold"
        if section in stock:
            return f"{said}the next size that is sold, {kept_out(stock[stock.index(section) + 1])}"
        if stock:
            return f"{said}no size that is sold fits: the thinnest, {kept_out(stock[0])}"
        if self._strain(scaled(section, self.thickest / section.depth), material) > AIM * bears:
            return said + "a thicker one would use more at the sharpest bend"
        return f"{said}the next step would be wider than {self.thickest_of}, {length_text(self.thickest)}"


def require_likely_sizes(
    width: float, spacing: float, section: Section | GivenSection | None = None, unit: float | None = None
) -> None:
    """Refuse sizes of which one was given in another unit than was meant. Only their ratios count.

    Args:
        width: of the shell [m].
        spacing: the smallest between rods [m].
        section: one without a size is not judged.
        unit: that the target's file was read in [m], if it was.

    Raises:
        InputError: the rods are as thick as the spacing or the shell, or far thinner than those of any shell; the
            spacing is wider than the shell.
    """
    depth = 0.0 if section is None else section.depth
    shell, allowed = f"the shell of {length_text(width)}", ""
    if 0 < depth * limit(MOST_SLENDER) < width:
        what = f"thin for {shell}, which is more than {limit(MOST_SLENDER):.0f} times as wide"
        allowed = f", {raised(MOST_SLENDER, width / depth)}"
    elif depth >= width:
        what = f"as wide as {shell}"
    elif spacing > width:
        meant = _other_unit("spacing", spacing, width, unit, SPACED)
        raise InputError(f"the spacing of {length_text(spacing)} is wider than {shell}: give a smaller one, or {meant}")
    elif depth >= spacing:
        what = f"as thick as the spacing of the rods, {length_text(spacing)}"
    else:
        return
    meant = _other_unit("section", depth, width, unit, USUAL)
    raise InputError(f"the section of {length_text(depth)} is {what}: {meant}{allowed}")


def doubt_of_unit(width: float, section: Section | GivenSection | None, unit: float | None) -> str:
    """What is said of a shell whose spacing follows its size, if no building is as wide, and no rod is like it. The
    parameters are those of `require_likely_sizes`."""
    depth = 0.0 if section is None else section.depth
    if unit is None or depth * KNOWN < width < depth * limit(MOST_SLENDER):
        return ""
    meant = " or ".join(f"{length_text(wide)} in {name}" for name, wide in as_built(width, unit).items())
    return meant and f" (if that is too {'small' if width < BUILT[0] else 'large'}, check its unit: {meant})"


def _other_unit(name: str, size: float, width: float, unit: float | None, usual: tuple[float, float]) -> str:
    """What to check, and sizes in another unit that would suit each other: the ratio of the width and a `size` [m] of
    that `name` is one of the `usual` ones."""
    meant = list[str]()
    for other in UNITS:
        factor = other if width < usual[0] * size else 1 / other
        if not meant and usual[0] <= width / (size * factor) <= usual[1]:
            meant += [f"a {name} of {length_text(size * factor)}"] * (size * factor <= THICKEST)
            meant += [f"a shell of {length_text(width / factor)}"] * (unit is None and width / factor <= WIDEST)
    for drawn_in, wide in ({} if unit is None else as_built(width, unit)).items():
        if usual[0] <= wide / size <= usual[1]:
            meant.append(f"a shell of {length_text(wide)}, drawn in {drawn_in},")
    return f"check its unit ({' or '.join(meant)} would be usual)" if meant else "check their units"


def bends_of(
    target: Target, layout: Layout, anchor: tuple[float, float] | None = None, progress: Progress = silent
) -> Bends:
    """The bends of a layout's rods on its target; where no net covers it, bounds from the target's own curvature.

    No rod runs across a crease. The axes cross at the `anchor`, see `Fit.on`.
    """
    if isinstance(layout, SurfaceLattice):
        return Bends(*surface_net(target, layout, anchor=anchor).curvatures)
    if not isinstance(target, Creased):
        try:
            return net_bends(chebyshev_net(target, layout, anchor=anchor, progress=progress))
        except NetLimitError:  # it is cut by seams, or another anchor is looked for
            pass
    sharpest = np.atleast_1d(_sharpest_of(target))
    return Bends(sharpest, sharpest)


def net_bends(net: ChebyshevNet) -> Bends:
    """Curvatures of both families at the nodes inside the target, by second differences."""
    normal, geodesic = list[Floats](), list[Floats]()
    for at, bend in net.net.bends(net.net.inside):
        along = np.einsum("ij,ij->i", bend, net.target.on_surface(at).normal)
        normal.append(np.abs(along))
        geodesic.append(np.sqrt(np.maximum(np.einsum("ij,ij->i", bend, bend) - along**2, 0.0)))
    return Bends(np.concatenate(normal), np.concatenate(geodesic))


def bends_of_pop_ups(shells: Iterable[PopUp], rod: Rod) -> Bends:
    """The bends at every node of every rod, at joints on the side that bends more."""
    parts = list[Bends]()
    for popped in shells:
        bent = bending_of(popped.shell, popped.state, rod)
        normal, geodesic = bent.normal_curvature, bent.geodesic_curvature
        if normal is None or geodesic is None:  # some rod crosses no other
            normal, geodesic = bent.curvature, np.zeros_like(bent.curvature)
        parts.append(Bends(normal, geodesic, bent.twist_rate, bent.axial_strain / _bend_over_stretch(rod)))
    return Bends(*(np.concatenate(values) for values in zip(*parts, strict=True)))


def largest_strain(rod: Rod, bends: Bends, *, shear_weight: float = VON_MISES) -> float:
    """Largest strain of a section that bends like this, with stretch, and torsion by its stress [-]."""
    assert rod.material is not None
    axial = bends.force * _bend_over_stretch(rod)
    stress = largest_stress(rod, bends.normal, bends.geodesic, axial, bends.twist, weight=shear_weight)
    return float(np.max(stress, initial=0.0)) / rod.material.youngs_modulus


def _bend_over_stretch(rod: Rod) -> float:
    """EI over EA [m2], towards the side that bends more easily."""
    return min(rod.bend_stiffnesses) / rod.stretch_stiffness


def _sold(material: Material, shape: Circle | Tube | None) -> tuple[Section, ...]:
    """The sizes to choose from; none where only a radius is looked for, or for a material without a name."""
    return () if shape is not None or material.name is None else TRADE_SIZES[material.name]


def _share(used: float) -> str:
    return f"{100 * used:.0f} %" if used >= 0.01 else "under 1 %"


def _of_depth(section: Section, deep: float, *, wall_stays: bool) -> Section:
    """A section like this one of another depth [m]; the wall of a tube may have to stay as it is."""
    if not (wall_stays and isinstance(section, Tube)):
        return scaled(section, deep / section.depth)
    if deep < 2 * section.thickness:
        raise InputError(
            f"a wall of {length_text(section.thickness)}: tubes that withstand the bends of this shell are at most "
            f"{length_text(deep)} thick: give a thinner wall, or the diameter too"
        )
    return Tube(deep / 2, section.thickness)


def _sharpest_of(target: Target) -> float:
    """The sharpest principal curvature [1/m] of a target, sampled over its plan."""
    side = np.linspace(-2 * target.size, 2 * target.size, PLAN)
    x, y = (target.summit[k] + plane.ravel() for k, plane in enumerate(np.meshgrid(side, side)))
    plan = np.column_stack([x, y])
    with np.errstate(all="ignore"):
        points = np.column_stack([plan, target.height_at(plan)])
    points = points[np.isfinite(points[:, 2])]
    points = points[target.margin(points) > 0]
    return float(np.abs(np.linalg.eigvalsh(target.on_surface(points).hessian)).max(initial=0.0))

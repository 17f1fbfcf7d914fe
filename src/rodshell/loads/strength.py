"""Strength: what the rods, joints and bracing of a loaded shell use of what they can carry.

At every node of a rod, with f the design strength for the duration of the loads (`rods.design_strength`):

    bending    s / f_m + |sigma_N| (1/f_a - 1/f_m),   s = max over the section of sqrt(sigma^2 + (f_m/f_v tau_T)^2)
    shear      (tau_T + tau_V) / f_v

sigma is the normal stress of both bending moments and the axial force together, sigma_N that of the axial force alone,
whose strength is f_a. Of timber by a building code bending is that of the code's own rule,
in which torsion has no part, and shear counts the same (`rods.design_strength`). tau_T is the stress of
torsion, tau_V of the shear force: 3/2 of its mean in a rectangle, 4/3 in a circle or an ellipse, 2 in a tube. At a
joint with a hole, stresses are those of the net section. A joint slips where the axial forces of a rod on both of its
sides differ by more than it can transfer. A locked joint also transfers a moment about its normal (which bends rods
more sharply on one side of it, see `checks.bending`), and slip is the root of the sum of the squares of force and
moment over what alone makes it slip [the limit surface of sliding friction as an ellipse: Howe and Cutkosky 1996].

tau_V is the largest of a span, continued in a straight line to its joints from the edges that are not next to them.

Compression is also shown over the Euler load of each span between joints. It does not count as a utilisation: the path
of the loaded shell has the buckling of spans in it.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from math import pi
from typing import Any, Literal

import numpy as np
from pydantic import Field

from rodshell.arrays import Bools, Floats, Ints, State, largest_at
from rodshell.checks.bending import VON_MISES, Bending, bending_of, fibre_modulus
from rodshell.checks.reactions import cut_forces
from rodshell.errors import InputError
from rodshell.figures.loads import DesignStrength
from rodshell.figures.records import Found
from rodshell.geometry.frames import dot, unit
from rodshell.layout import GridMesh
from rodshell.loads.settings import Strength
from rodshell.model import Shell
from rodshell.model.rod_sections import varied_at_nodes
from rodshell.rods.design_strength import COVERED, DESIGN, DURATIONS, DesignFactors, Duration
from rodshell.rods.section import GivenSection, Rod, Section
from rodshell.validation import brief

By = Literal["bending", "shear", "slip", "permanent", "slip_unloaded"]


class Limits(DesignStrength):
    """What a rod is judged by."""

    shear_weight: Found[float] = Field(default=VON_MISES, description="bending over shear strength: checks.bending")
    cracked: Found[float] = Field(default=1.0, description="share of the section that carries shear forces")
    given: Found[bool] = Field(default=False, description="whether strengths were given in place of a preset's")
    rod: Found[Rod | None] = Field(default=None, description="that is judged")
    counted: Found[float | None] = Field(
        default=None, description="bending strength as given, or a preset's characteristic one [Pa]"
    )
    strength_of: Found[str | None] = Field(default=None, description="the preset whose strengths these are")
    shear_strength: Found[float | None] = Field(default=None, description="that goes with it [Pa]; None: von Mises")

    @property
    def bending(self) -> dict[Duration, float]:
        """Design strength by duration [Pa]; an unknown one is missing."""
        known = {name: getattr(self, name) for name in DURATIONS}
        return {name: strength for name, strength in known.items() if strength is not None}

    def compared(self, bent: Bending, mesh: GridMesh) -> Floats | None:
        """(k,) the stress of bending and axial force that stands against the bending strength [Pa]; None: not known."""
        rod, rules = self.rod, _factors(self.rod) if self.code else None
        if bent.stress is None or rod is None:
            return bent.stress
        axial = bent.axial_strain * rod.stretch_stiffness / area_of(rod)
        if rules is None:
            return np.asarray(bent.stress + np.abs(axial) * (1.0 / (self.axial or 1.0) - 1.0))
        half, widths = rod.section.half_widths, None
        if rod.section.boxed:
            widths = 2.0 * np.array(half)
            if (local := varied_at_nodes(mesh, rod)) is not None:
                widths = widths * np.column_stack([local.fibre1, local.fibre2])
        bends = bent.fibre_strains
        if bends is None:  # towards the farthest point, as if that were the deeper side
            assert bent.bending_strain is not None
            bends = np.column_stack([bent.bending_strain, np.zeros(len(axial))])
            widths = None if widths is None else np.max(widths, axis=-1, keepdims=True) * np.ones(2)
        return rules.compared(fibre_modulus(rod) * bends, axial, widths)

    def relaxed_stress(self, stress: Floats, bent: Bending, before: Bending, mesh: GridMesh) -> Floats:
        """(k,) `stress` under permanent loads as it stands against the permanent strength [Pa]: at first by the short
        one, and after months without what has relaxed of that `before` the loads."""
        if not self.relaxed or bent.fibre_strains is None or before.fibre_strains is None:
            return stress
        gone = {
            name: getattr(bent, name) - self.relaxed * getattr(before, name)
            for name in ("fibre_strains", "axial_strain")
        }
        left, short, permanent = self.compared(replace(bent, **gone), mesh), self.short, self.permanent
        assert left is not None
        return np.maximum(left, stress * (permanent or 0.0) / (short or np.inf))

    def standing(self, bent: Bending, mesh: GridMesh) -> Floats | None:
        """(k,) as `compared`, of a shell without loads: torsion counts too, against the shear strength."""
        stress = self.compared(bent, mesh)
        if stress is None or bent.torsion_stress is None:
            return stress
        return np.maximum(stress, self.shear_weight * bent.torsion_stress)

    @staticmethod
    def of(rod: Rod, asked: Strength, *, given: float | None = None, shear_given: float | None = None) -> "Limits":
        """The limits of a rod: what is `asked`, or else one strength for every duration of load, or else the preset's.

        Args:
            given: bending strength [Pa] in place of that of the rod's preset.
            shear_given: shear strength that goes with it [Pa]; default: in the preset's proportion, or by von Mises.

        Raises:
            InputError: a service class is given, and nothing depends on it.
        """
        factors, service = _factors(rod), asked.service_class or COVERED
        moist = factors is not None and len(factors.factors) > 1
        if asked.service_class is not None and (asked.given or not moist):
            raise InputError(
                f"strength.service_class = {asked.service_class}: only the strengths of timber presets depend on it: "
                "leave it out"
            )
        characteristic, shear = None, None
        if (material := rod.material) is not None:
            characteristic, shear = material.bending_strength, material.shear_strength
        counted = given or characteristic
        if given is not None:
            shear = shear_given or (given * shear / characteristic if characteristic and shear else None)
        shear_weight = counted / shear if counted and shear else VON_MISES
        bending: dict[Duration, float] = {}
        rules: DesignFactors | None = None
        source = "no design strength is known"
        if asked.given:
            known: float | None = None
            for duration in DURATIONS:
                known = asked.given.get(duration, known)
                if known is not None:
                    bending[duration] = known
            source = "design strengths as given"
        elif given is not None:
            bending = dict.fromkeys(DURATIONS, given)
            source = "the strength as given, for every duration of load"
        elif factors is not None and characteristic is not None and material is not None:
            bending = {key: share * characteristic for key, share in factors.by_duration(service).items()}
            source = f"{material.name}, characteristic {1e-6 * characteristic:.4g} MPa; {factors.source}"
            source += f"; service class {service}" if moist else ""
            rules = factors if factors.code else None
        creep = asked.creep
        if creep is None and factors is not None and factors.creep:
            creep = factors.creep[service - 1 if moist else 0]
        by_code: dict[str, Any] = dict(bending.items())
        if asked.hole:
            by_code["hole"] = asked.hole
        if rules is not None:
            by_code |= {"code": rules.code, "service_class": asked.service_class, "relaxed": asked.relaxed}
            by_code |= {"compression": rules.compression, "stiffness": rules.stiffness}
            if rod.section.boxed:
                depths = rules.depth_factor(2.0 * np.array(rod.section.half_widths))
                by_code |= {"depth": depths, "biaxial": rules.biaxial}
        elif asked.relaxed is not None:
            raise InputError(
                f"strength.relaxed = {asked.relaxed:g}: it is for timber presets that are judged by their code: leave "
                "it out, or count it in strength.permanent"
            )
        return Limits(
            **by_code,
            erection=asked.erection or bending.get("short"),
            axial=factors.tension if factors is not None else 1.0,
            shear=1.0 / shear_weight,
            shear_weight=shear_weight,
            cracked=factors.cracked if factors is not None else 1.0,
            creep=creep,
            source=source,
            given=bool(asked.given) or given is not None,
            rod=rod,
            counted=counted,
            strength_of=material.name if material and characteristic and not (asked.given or given) else None,
            shear_strength=shear,
        )


def preset_limits(rod: Rod, service_class: int | None) -> Limits:
    """The limits of a rod by its material's preset; of other materials none is known."""
    factors = _factors(rod)
    moist = factors is not None and len(factors.factors) > 1
    return Limits.of(rod, Strength(service_class=service_class if moist else None))


def _factors(rod: Rod | None) -> DesignFactors | None:
    """What building codes make of the strengths of the rod's preset, if it has one that they know."""
    return None if rod is None or rod.material is None or rod.material.name is None else DESIGN.get(rod.material.name)


@dataclass(frozen=True, eq=False)
class Utilisation:
    """What the rods and joints of a shell use of their strength, at each entry (k,) of `rod_nodes`.

    Args:
        uses: by what; what is not known is missing.
        euler: largest compression of the spans next to each entry, over their Euler load.
    """

    uses: dict[By, Floats]
    euler: Floats

    __repr__ = brief

    @property
    def largest(self) -> dict[By, float]:
        """The largest of each."""
        return {by: float(values.max()) for by, values in self.uses.items()}

    @property
    def governs(self) -> tuple[By, int] | None:
        """What is used most, and where; None: nothing is known."""
        by = max(self.uses, key=lambda by: float(self.uses[by].max()), default=None)
        return None if by is None else (by, largest_at(self.uses[by]))

    def with_permanent(self, permanent: "Utilisation") -> "Utilisation":
        """The same, where the erected shell's own utilisation counts too, by the permanent strength, and the slip of
        its joints."""
        uses = dict(self.uses)
        if "slip" in permanent.uses:
            uses["slip_unloaded"] = permanent.uses["slip"]
        rods = [permanent.uses[by] for by in ("bending", "shear") if by in permanent.uses]
        if rods:
            uses["permanent"] = np.maximum.reduce(rods)
        return Utilisation(uses, self.euler)


def utilisation(
    shell: Shell, state: State, rod: Rod, *,
    forces: Floats, limits: Limits, asked: Strength, duration: Duration | None, bent: Bending | None = None,
    before: Bending | None = None, moments: Floats | None = None, slip_moment: float | None = None,
) -> Utilisation:  # fmt: skip
    """Utilisation of a shell in equilibrium, its source frames being at the state.

    Args:
        forces: (e,) axial force of each edge, tension positive [N].
        asked: holes, slip and effective lengths.
        duration: of the loads; None: there are none, and the rods stay bent.
        bent, before: the shell's bending, where it is known, and that without loads, of which a part may relax.
        moments: (c,) of locked joints about their normals [N m]; None or empty: none is locked.
        slip_moment: at which locked joints slip [N m]; None: not known.

    Raises:
        InputError: holes in rods whose section varies or is not known.
    """
    mesh, section = shell.mesh, rod.section
    bent = bent or bending_under(shell, state, rod, forces, limits)
    local = varied_at_nodes(mesh, rod)
    if asked.hole and local is not None:
        raise InputError("strength.hole: the net section of rods that vary along their length is not known: leave out")
    spans = Spans.of(mesh)
    axial, across = forces[spans.middle], spans.towards_joints(_shear_forces(shell, state))
    bends = np.full(len(mesh.rod_nodes), min(rod.bend_stiffnesses))
    areas = np.ones(len(mesh.rod_nodes))
    if local is not None:
        bends, areas = bends * np.minimum(local.bend1, local.bend2), areas * local.stretch
    euler_loads = pi**2 * spans.least(bends) / (asked.effective_length * spans.lengths) ** 2
    euler = spans.on_entries(np.maximum(-axial, 0.0) / euler_loads)
    turned = np.zeros(len(mesh.rod_nodes))
    if moments is not None and len(moments):
        joints = mesh.at_crossings
        np.maximum.at(turned, joints, np.abs(moments)[:, None])
    uses: dict[By, Floats] = {}
    strength = limits.staying if duration is None else limits.bending.get(duration)
    if strength is not None and (stress := limits.compared(bent, mesh)) is not None:
        if duration == "permanent" and before is not None:
            stress = limits.relaxed_stress(stress, bent, before, mesh)
        net = net_factors(mesh, section, asked.hole)
        uses["bending"] = net * stress / strength
        if bent.torsion_stress is not None and (peak := section.shear_peak) is not None:
            sheared = spans.on_entries(across) * peak / (limits.cracked * area_of(rod) * areas)
            uses["shear"] = net * limits.shear_weight * (bent.torsion_stress + sheared) / strength
    slips = [] if asked.slip is None else [spans.jumps(forces) / asked.slip]
    slips += [] if slip_moment is None else [turned / slip_moment]
    if slips:
        uses["slip"] = np.sqrt(np.sum(np.square(slips), axis=0))
    return Utilisation(uses, euler)


def bending_under(shell: Shell, state: Floats, rod: Rod, forces: Floats, limits: Limits) -> Bending:
    """Bending and stress of a shell whose axial forces (e,) [N] are known: where rods are warm their lengths do not say
    them."""
    strains = forces / shell.stretch.stiffness
    return bending_of(shell, state, rod, shear_weight=limits.shear_weight, edge_strains=strains)


def area_of(rod: Rod) -> float:
    """Area of the section [m2]; of a given one as its axial stiffness and fibres have it."""
    if isinstance(rod.section, GivenSection):
        return rod.stretch_stiffness / (rod.section.fibre_modulus or np.inf)
    return rod.section.area


def net_section(section: Section | GivenSection, hole: float) -> float:
    """Largest stress at a hole through the section along its first axis, over that of the full section.

    Args:
        hole: diameter [m].

    Raises:
        InputError: the hole is as wide as the rod; the section is a given one.
    """
    if isinstance(section, GivenSection):
        raise InputError("strength.hole: the net section of a given section is not known: leave it out")
    area, cut = section.hole(hole)
    left = min(1.0 - area / section.area, 1.0 - cut / section.second_moments[0])
    if hole >= 2 * section.half_widths[1] or left <= 0:
        raise InputError(
            f"strength.hole = {hole:g} m: a hole of that diameter leaves nothing of the rod: make it smaller"
        )
    return 1.0 / left


def net_factors(mesh: GridMesh, section: Section | GivenSection, hole: float) -> Floats:
    """(k,) stress of the net section over that of the full one, at each entry of `rod_nodes`: 1 but at joints with
    a `hole` [m]."""
    factors = np.ones(len(mesh.rod_nodes))
    if hole:
        factors[_at_joints(mesh)] = net_section(section, hole)
    return factors


def _at_joints(mesh: GridMesh) -> Bools:
    """(k,) which entries of `rod_nodes` are at joints."""
    return np.isin(mesh.rod_nodes, np.unique(mesh.joint_pairs))


def _shear_forces(shell: Shell, state: Floats) -> Floats:
    """(e,) size of the shear force in each edge [N]."""
    forces = cut_forces(shell, state)
    ends = shell.stretch.blocks[: len(forces)]
    tangents = unit(state[ends[:, 1]] - state[ends[:, 0]])
    return np.asarray(np.linalg.norm(forces - dot(forces, tangents)[:, None] * tangents, axis=1))


@dataclass(frozen=True, eq=False)
class Spans:
    """The s spans between neighbouring joints, and between the last joints and the ends, rod by rod.

    Args:
        first, last: (s,) entries of `rod_nodes` at their ends.
        middle: (s,) edge in the middle of each.
        lengths: (s,) [m].
    """

    first: Ints
    last: Ints
    middle: Ints
    lengths: Floats

    @staticmethod
    def of(mesh: GridMesh) -> "Spans":
        """The spans of a mesh."""
        stops = _at_joints(mesh)
        stops[mesh.end_entries] = True
        entries = np.flatnonzero(stops)
        rods = mesh.rod_of[entries]
        same = rods[1:] == rods[:-1]
        first, last = entries[:-1][same], entries[1:][same]
        middle = (first + last - 1) // 2 - rods[:-1][same]  # edges are counted rod by rod
        return Spans(first, last, middle, mesh.stations[last] - mesh.stations[first])

    @property
    def edges(self) -> tuple[Ints, Ints]:
        """(s,) first and last edge of each."""
        count = self.last - self.first
        first = self.middle - (count - 1) // 2
        return first, first + count - 1

    def towards_joints(self, values: Floats) -> Floats:
        """(s,) largest of the `values` (e,) of each span, continued in a straight line from its inner edges to those
        next to joints, whose own shear forces contain moments of the joints."""
        result = values[self.middle].copy()
        first, last = self.edges
        for s in np.flatnonzero(last - first >= 3).tolist():
            inner = values[first[s] + 1 : last[s]]
            result[s] = max(inner.max(), 2 * inner[0] - inner[1], 2 * inner[-1] - inner[-2])
        return result

    def least(self, values: Floats) -> Floats:
        """(s,) smallest of `values` (k,) of the entries of each span."""
        parts: Iterable[Floats] = (values[a : b + 1] for a, b in zip(self.first, self.last, strict=True))
        return np.array([part.min() for part in parts])

    def on_entries(self, values: Floats) -> Floats:
        """(k,) largest of the `values` (s,) of the spans that each entry is in."""
        result = np.zeros(int(self.last.max()) + 1)
        for a, b, value in zip(self.first, self.last, values, strict=True):
            result[a : b + 1] = np.maximum(result[a : b + 1], value)
        return result

    def jumps(self, values: Floats) -> Floats:
        """(k,) differences of the `values` (e,), continued in straight lines to each joint from both sides; elsewhere
        0."""
        result = np.zeros(int(self.last.max()) + 1)
        first, last = self.edges
        begin = 1.5 * values[first] - 0.5 * values[np.minimum(first + 1, last)]
        end = 1.5 * values[last] - 0.5 * values[np.maximum(last - 1, first)]
        next_to = self.last[:-1] == self.first[1:]
        result[self.last[:-1][next_to]] = np.abs(begin[1:] - end[:-1])[next_to]
        return result

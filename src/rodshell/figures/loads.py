"""Records of a shell under loads."""

from pydantic import Field

from rodshell.figures.records import (
    ByEnds,
    Number,
    Numbers,
    Points,
    Real,
    Record,
    Rows,
    Text,
    Vector,
    Whole,
    key,
    numbers,
    points,
    rows,
)


class Governs(Record):
    """Where strength is used most."""

    rod: Text = Field(description="id of the rod")
    at: Real = Field(description="distance from the rod's start [m]")
    by: Text | None = key("bending, shear, slip, or permanent: the erected shell by its permanent strength")


class Utilisations(Record):
    """What is used of each strength at most; null: not known."""

    bending: Number = key("of both bending moments and the axial force, with torsion")
    shear: Number = key("of torsion and the shear force")
    slip: Number = key("of the force and the moment at which joints slip")
    permanent: Number = key("of the erected shell without loads, by the permanent strength")
    slip_unloaded: Number = key("of the force at which joints slip, by the erected shell without loads")


class DesignStrength(Record):
    """What the rods are judged by, unloaded and under loads; null: not known."""

    permanent: Number = key("design strength in bending under permanent loads", "Pa")
    long: Number = key("under loads of months", "Pa")
    medium: Number = key("under loads of weeks", "Pa")
    short: Number = key("under loads of days", "Pa")
    instantaneous: Number = key("under gusts", "Pa")
    erection: Number = key("during the deployment", "Pa")
    code: Text | None = key("building code by which all is judged; null: by none")
    service_class: Whole | None = key("that was asked for; null: none was, or nothing depends on it")
    relaxed: Number = key("share of the unloaded shell's stress that is gone after months; null: not given, none is")
    axial: Number = key("strength along the rod over bending strength, in tension by a code")
    compression: Number = key("the same in compression, by a code")
    depth: Numbers = numbers("k_h by the depth along both axes of the section; empty: not a rectangle by a code")
    biaxial: Number = key("k_m, share of the smaller of two bends that counts")
    stiffness: Number = key("Young's modulus for stability over its mean; null: the mean itself is taken")
    shear: Number = key("shear strength over bending strength")
    hole: Number = key("diameter of the holes at joints, by which the net section is judged; absent: none", "m")
    creep: Number = key("by how much deflections under permanent loads grow, over what they are at first")
    erection_utilisation: Number = key("largest stress of the deployment over that strength")
    source: Text | None = key("where they are from")

    @property
    def staying(self) -> float | None:
        """By which rods are judged that stay bent [Pa]: all of their stress for a short time, and what does not relax
        permanently; None: not known."""
        if not self.relaxed or self.permanent is None:
            return self.permanent
        left = self.permanent / max(1.0 - self.relaxed, 1e-9)
        return left if self.short is None else min(left, self.short)


class AfterYears(Record):
    """A shell under a permanent combination of loads whose rods have crept: their stiffness is divided by 1 + creep."""

    creep: Number = key("by how much deflections grow")
    limit_factor: Number = key("of the combination, up to which the shell is stable; null: above 100")
    limit_kind: Text | None = key("as limit_kind of the shell as erected")
    imperfect_factor: Number = key("the same with imperfections; null: above 100, not found, or not asked for")
    imperfect_kind: Text | None = key("what ends the path with imperfections; null: not asked for")
    max_deflection: Number = key(
        "largest displacement of a node against the unloaded shell as erected; null: it does not carry the loads", "m"
    )


class UsedBeam(Record):
    """What acts in a beam along the edge, and what it uses of its strength."""

    name: Text | None = key("its name, as in edge_beams")
    tension: Number = key("largest tension", "N")
    compression: Number = key("largest compression", "N")
    max_stress: Number = key("largest stress of bending, axial force and torsion", "Pa")
    max_stress_at: Text | None = key("the rod end nearest to it")
    utilisation: Number = key("of the strength of its material's preset; null: not known")
    euler: Number = key("largest compression of a span between rod ends over its Euler load")


class LoadedShell(Record):
    """The shell under a combination of loads. Factors multiply the whole combination."""

    at_factor: Number = key("of the combination, under which all but the factors stands: 1, or the last stable one")
    load_sum: Vector | None = key("sum of the loads, those on supports included", "N")
    reaction_sum: Vector | None = key("sum of the support forces, without those of the unloaded shell", "N")
    max_deflection: Number = key("largest displacement of a node", "m")
    deflection_limit: Number = key("how far a node may move, as was given; null: no limit was", "m")
    linear_factor: Number = key("lowest linear buckling factor about the unloaded shell; null: above 100, or not known")
    limit_factor: Number = key("up to which the shell is stable; null: above 100")
    limit_kind: Text | None = key("limit point, bifurcation, none, unstable unloaded, or not followed: unknown above")
    imperfect_factor: Number = key("the same with imperfections; null: above 100, not found, or not asked for")
    imperfect_kind: Text | None = key("what ends the path with imperfections, as limit_kind; null: not asked for")
    after_years: AfterYears | None = key("under permanent loads, with creep; null: others, or creep is not known")
    reserve: Number = key("how many times the combination a good shell carries, as was asked for")
    duration: Text | None = key("of the load that acts for the shortest time, which decides the strength")
    utilisation: Number = key("the largest of the utilisations; null: none is known")
    utilisations: Utilisations | None = key("what is used of each strength")
    euler: Number = key("largest compression of a span between joints over its Euler load")
    euler_at: Governs | None = key("where that is")
    max_stress: Number = key("largest stress of bending, axial force and torsion", "Pa")
    governs: Governs | None = key("where strength is used most")
    uplift: Number = key("largest force by which the shell pulls at a support upwards; 0: at none", "N")
    reactions: Points = points("force of each support, in the order of boundary, without the unloaded shell's", "N")
    support_forces: Points = points("force of each support, with the unloaded shell's", "N")
    support_moments: Points = points("moment of each support, with the unloaded shell's", "N m")
    bracing: Rows[Number] = rows(
        "axial force of each brace in the order of fabrication.bracing, tension positive, 0: slack; null: left out", "N"
    )
    bracing_unloaded: Rows[Number] = rows("the same before these loads: what a cable is to be stressed to", "N")
    bracing_utilisation: Number = key("utilisation of laths of a third layer or of cables; null: none, or not known")
    edge_beams: Rows[UsedBeam] = rows("what acts in the beams along the edge")
    joint_moments: Numbers = numbers(
        "moment of each locked joint about its normal, in the order of joint_loads; empty: none is locked", "N m"
    )
    joint_moment_at: Text | None = key("id of the joint whose moment is largest; null: none is locked")
    slipping: Rows[Text] = rows("ids of the joints that slip")
    mode_factors: Numbers = numbers("linear buckling factors of the lowest modes")
    frequencies: Numbers = numbers(
        "lowest natural frequencies without loads, of rods, joints, bracing and cladding; empty: not known", "Hz"
    )
    factorizations: Whole | None = key("factorisations of the tangent, on all paths")


LoadCases = dict[Text, ByEnds[LoadedShell]]

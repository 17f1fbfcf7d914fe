"""What was asked for, and the form that was found."""

from itertools import pairwise
from typing import Literal, Self

from pydantic import Field, model_validator

from rodshell.figures.loads import UsedBeam
from rodshell.figures.records import (
    ByEnds,
    Ends,
    Flag,
    Flat,
    Number,
    Point,
    Real,
    Record,
    Rows,
    Text,
    Whole,
    by_ends,
    key,
    required,
    rows,
)

Gate = Literal["flat", "from_flat", "remeshed", "tolerance", "stable"]
_FEWEST_STATIONS = 2

# What was asked for


class Deviation(Record):
    """Distance of the smooth surface that is used from the vertices of the mesh that was given."""

    max: Number = key("largest distance", "m")
    rms: Number = key("root mean square", "m")


class Target(Record):
    """The target surface: the parameters of the case file's [target], which depend on its kind, and its size."""

    kind: Text | None = key("kind of surface, as in the case file")
    reference_size: Number = key("half of the larger width, by which gaps are made relative", "m")
    deviation: Deviation | None = key("distance of the smooth surface used from the mesh given")
    flat: Flag | None = key("true where it is too flat for its rods to bend, so that nothing pops up")


class Layout(Record):
    """How the rods were to be laid out."""

    kind: Text | None = key("lattice: chebyshev, geodesic, asymptotic or curves")
    families: Whole | None = key("number of families of a geodesic or asymptotic lattice")
    rods: Text | tuple[Whole, Whole] | None = key('number of rods of families u and v, or "auto"')
    spacing: tuple[Real, Real] | None = key("distance between neighbouring rods of the first family and of others", "m")
    length: Text | Real | None = key('length of every rod before trimming [m], or "auto"')
    edge: Number = key("longest edge of the mesh", "m")
    rotate: Number = key("angle of the first family against the target's x axis", "rad")
    offset: Flat | None = key("shift of the lattice against the axes through the anchor", "m")
    crossing: Number = key("angle between both families on the target, at the anchor", "rad")


class FlatState(Record):
    """The rods of a geodesic or asymptotic lattice laid out in the plane, where they bend as little as they can."""

    lies_flat: Flag | None = key("whether the rods withstand that; else the shell is assembled in place")
    in_plane_strain: Number = key("largest bending strain of the rods within the plane")
    limit: Number = key("bending strain that the rods withstand during erection, or up to which they are thin rods")
    negative_modes: Whole | None = key("directions in which that state is unstable; 0: it is stable")


class Section(Record):
    """A rod's section: the parameters of the case file's [rod.section]."""

    kind: Text | None = key("circle, tube, ellipse, rectangle or given")
    radius: Number = key("outer radius of a circle or tube", "m")
    thickness: Number = key("wall thickness of a tube", "m")
    width: Number = key("side of a rectangle along the grid's normal", "m")
    height: Number = key("side of a rectangle within the grid", "m")
    a: Number = key("half-axis of an ellipse along the grid's normal", "m")
    b: Number = key("half-axis of an ellipse within the grid", "m")


class Material(Record):
    """A rod's material: the parameters of the case file's [rod.material]."""

    preset: Text | None = key("name of a preset material")
    youngs_modulus: Number = key("Young's modulus", "Pa")
    density: Number = key("density", "kg/m3")
    poisson_ratio: Number = key("Poisson's ratio")
    shear: Number = key("shear modulus", "Pa")


class Preset(Record):
    """What is known of a preset material."""

    name: Text | None = key("name of the preset")
    youngs_modulus: Number = key("mean Young's modulus", "Pa")
    shear: Number = key("mean shear modulus; null: incompressible", "Pa")
    density: Number = key("mean density", "kg/m3")
    bending_strength: Number = key("characteristic short-term bending strength", "Pa")
    shear_strength: Number = key("characteristic short-term shear strength", "Pa")
    grade: Text | None = key("what the figures hold for")
    strength_note: Text | None = key("how the strengths are meant")
    source: Text | None = key("where the figures come from")


class RodType(Record):
    """Section, material and stiffnesses of every rod."""

    section: Section | None = key("the section")
    material: Material | None = key("the material; absent where stiffnesses were given")
    preset: Preset | None = key("the preset that the material is made from")
    chosen: dict[Literal["material", "section"], Flag] | None = key("which of the two were not given and chosen to fit")
    EA: Number = key("stretch stiffness", "N")
    EI: Number = key("bending stiffness, where it is the same about both axes", "N m2")
    EI1: Number = key("bending stiffness out of the grid", "N m2")
    EI2: Number = key("bending stiffness within the grid", "N m2")
    GJ: Number = key("twist stiffness", "N m2")
    mass_per_length: Number = key("mass per length", "kg/m")


class EdgeBeam(Record):
    """A beam along the edge, free of stress in the shape in which the shell stands when it is fitted."""

    name: Text | None = key("its name: E1, E2, ...")
    kind: Text | None = key("edge_beam, ring or arch")
    ends: Rows[Text] = rows("the rod ends on it, in their order; a ring's first one follows its last")
    length: Number = key("from its first rod end to its last; of a ring all round", "m")
    mass: Number = key("of the whole beam", "kg")
    rod: RodType | None = key("section, material and stiffnesses")
    unloaded: UsedBeam | None = key("what acts in it without loads")


class Joint(Record):
    """What the rods do to each other where they cross: the parameters of the case file's [joint]."""

    kind: Text | None = key("ball, pin, rigid, spring or linker")
    eccentricity: Number = key("distance of the rods' axes", "m")
    mass: Number = key("mass of a joint", "kg")


# The form


class Net(Record):
    """The inextensible net on the target."""

    error_estimate: Number = key("estimated error of the rods' cuts before extrapolation", "m")
    min_angle_deg: Number = key("smallest angle between rods", "deg")
    min_angle_at: Point | None = key("place of the smallest angle", "m")


class Solve(Record):
    """Effort and outcome of one solve."""

    dofs: Whole | None = key("degrees of freedom")
    status: Text | None = key('"converged", or how it stopped')
    iterations: Whole | None = key("Newton iterations")
    factorizations: Whole | None = key("factorisations of the tangent")
    seconds: Number = key("time", "s")


class Rest(Record):
    """How a fall onto the target ended."""

    at_rest: Flag | None = key("whether it came to rest")
    time: Number = key("simulated time", "s")
    kinetic_energy: Number = key("kinetic energy at the end", "J")
    force_residual: Number = key("largest out-of-balance force on a node", "N")
    joint_gap: Number = key("largest distance of two rods at a joint", "m")
    growth: Rows[Number] = rows("lowest s of K x = s M x; a negative one grows as exp(sqrt(-s) t)", "1/s2")
    steps: Whole | None = key("time steps taken")
    refused_steps: Whole | None = key("time steps tried in vain")


class StrongBending(Record):
    """How rods that joints keep from rolling bend about their strong axis."""

    ratio: Number = key("larger bending stiffness over the smaller")
    flat: Flag | None = key("whether the rods lie flat on the surface; else they stand on edge")
    curvature: Number = key("curvature about the strong axis where the moment is largest", "1/m")
    moment: Number = key("largest moment over that at which a rod buckles sideways between its joints")
    beyond: Number = key("share of the rods' length where the moment is beyond that")


class NetDeviation(Record):
    """Distances of the drape's rod ends from the net's."""

    max: Number = key("largest distance", "m")
    median: Number = key("median distance", "m")


class Drape(Record):
    """The rods laid on the target."""

    method: Text | None = key("bound, gravity or paper")
    status: Text | None = key('"converged", or how it stopped')
    dofs: Whole | None = key("degrees of freedom")
    levels: Rows[Solve] = rows("solves from the coarsest mesh to the finest")
    seconds: Number = key("time", "s")
    force_residual: Number = key("largest out-of-balance force on a node", "N")
    max_strain: Number = key("largest axial strain")
    max_gap: Number = key("largest gap to the target; of methods gravity and paper the deepest node inside it", "m")
    negative_modes: Whole | None = key("negative eigenvalues of the tangent")
    min_angle_deg: Number = key("smallest angle between rods", "deg")
    min_angle_at: Point | None = key("place of the smallest angle", "m")
    contact_pulls: Whole | None = key("nodes that the target would have to pull")
    fall: Rest | None = key("how the fall of method paper ended")
    eccentricity: Number = key("distance of the two layers of rods", "m")
    strong_bending: StrongBending | None = key("bending about the strong axis")
    net_deviation: NetDeviation | None = key("distance of the drape's rod ends from the net's")


class PopUp(Solve):
    """The shell popped up from flat, its ends at their supports."""

    start: Text | None = key('state that the solve started from: "draped", "flat" or another shell')
    force_residual: Number = key("largest out-of-balance force on a node", "N")
    max_strain: Number = key("largest axial strain")
    negative_modes: Whole | None = key("negative eigenvalues of the tangent; 0: stable, if the solve converged")
    stable: Flag | None = key("whether the unloaded shell is a stable equilibrium; null where none was found")


class Agreement(Record):
    """Gap between the popped-up shell and the target."""

    max: Number = key("largest gap", "m")
    rms: Number = key("root mean square of the gap", "m")
    max_relative: Number = key("largest gap over the target's reference_size")
    rms_relative: Number = key("root mean square over the target's reference_size")
    where: Point | None = key("place of the largest gap", "m")


class GapBefore(Record):
    """Gap of a form before or after it was refined."""

    rms_relative: Number = key("root mean square over the target's reference_size")
    max_relative: Number = key("largest gap over the target's reference_size")


class Refinement(Record):
    """How the form was refined: its rods, joints, ends and states are the refined ones."""

    vary: Rows[Text] = rows("families of variables")
    ends: Ends | None = key("the only end condition of the refined form")
    before: GapBefore | None = key("gap to the target before")
    after: GapBefore | None = key("gap to the target after; that before where nothing was accepted")
    factorizations: Whole | None = key("factorisations of the search")
    gate_factorizations: Whole | None = key("factorisations of all gates")
    gates: dict[Gate, Flag] | None = key("which gates the design passes: the accepted one, else the best one refused")
    refused: Text | None = key("why the best design was refused, the gate first; null: it was accepted")


class RodJoint(Record):
    """A joint on a rod."""

    other: Text = required("id of the rod that is met", alias="with")
    at: Real = Field(description="distance from the rod's start, its end allowance not counted [m]")
    slot: Number = key("width of the rod's slot there; from above where the other rod's layer is the higher one", "m")


class Bent(Record):
    """Largest bending, twist and stress, each for itself."""

    min_radius: Number = key("smallest radius of curvature; null: straight", "m")
    normal_curvature: Number = key("curvature out of the shell", "1/m")
    geodesic_curvature: Number = key("curvature within the shell", "1/m")
    twist_rate: Number = key("twist", "rad/m")
    max_strain: Number = key("strain of bending and axial force")
    max_bending_strain: Number = key("strain of bending alone")
    max_stress: Number = key("stress of bending, axial force and torsion", "Pa")
    torsion_stress: Number = key("shear stress of torsion alone", "Pa")
    utilisation: Number = key("stress over the strength")


class Stiffness(Record):
    """Bending stiffness along a rod whose section changes, over that of the rods' section; linear between stations."""

    at: Rows[Real] = rows("stations, from the start to the end; given twice where the factor steps", "m")
    factors: Rows[Real] = rows("factor on EI (EI1 where there are two) at each station")
    varies: Literal["size", "width", "height", "a", "b", "laths"] | None = key(
        "what changes: all lengths of the section (size), one of them by its name, or the number of laths on each other"
    )
    sizes: Rows[Real] = rows("that length at each station; of a round rod its diameter; none of laths", "m")
    splices: Rows[Rows[Real]] = rows("of laths: splices of each lath beyond the first, from the rod's start", "m")

    @model_validator(mode="after")
    def _as_many(self) -> Self:
        if not len(self.at) == len(self.factors) >= _FEWEST_STATIONS or len(self.sizes) not in (0, len(self.at)):
            raise ValueError(
                f"{len(self.at)} stations, {len(self.factors)} factors and {len(self.sizes)} sizes: there must be as "
                "many of each, two or more"
            )
        return self


class RestCurvature(Record):
    """How a rod is curved where it is free of stress and lies flat; linear between stations."""

    at: Rows[Real] = rows("stations, ascending from the start to the end", "m")
    curvatures: Rows[Real] = rows("curvature at each station, positive to the left seen from above", "1/m")

    @model_validator(mode="after")
    def _as_many(self) -> Self:
        if not len(self.at) == len(self.curvatures) >= _FEWEST_STATIONS:
            raise ValueError(
                f"{len(self.at)} stations and {len(self.curvatures)} curvatures: there must be as many of each, two or "
                "more"
            )
        if any(after <= before for before, after in pairwise(self.at)):
            raise ValueError("the stations must ascend from the start of the rod to its end")
        return self


class RodLine(Record):
    """A rod's flat geometry, its joints, and how it is cut."""

    id: Text = Field(description="name of the rod")
    family: Text = Field(
        description='rods that do not cross each other: "u" along x at y = offset, "v" along y at x = offset; without '
        'an offset "u", "v", "w" along curves of the target; "free": of a table or along lines that are given'
    )
    offset: Number = key("place of the rod's line across its family; null: it is on no line of a straight lattice", "m")
    start: Real = Field(description="material coordinate of the start, from the layout's middle [m]")
    end: Real = Field(description="material coordinate of the end [m]")
    length: Number = key("length between the supports", "m")
    joints: Rows[RodJoint] = rows("joints from the start to the end")
    cut_length: Number = key("length as cut, with both end allowances", "m")
    mass: Number = key("mass as cut", "kg")
    layer: Whole | None = key("layer in which it is laid, 1 the lowest")
    splices: Rows[Real] = rows("splices, from the start", "m")
    stiffness: Stiffness | None = key("where its section changes along it: its bending stiffness")
    rest_curvature: RestCurvature | None = key("of a rod that is curved at rest: the curvature that it is cut with")


class Rod(Bent, RodLine):
    """One rod, with its worst bending in the final shape."""

    pop_up: Bent | None = key("worst bending in all shapes, those of the deployment included")
    splice_moments: Rows[Real] = rows("bending moment at each splice in the final shape without loads", "N m")
    splice_forces: Rows[Real] = rows("axial force at each splice there, tension positive", "N")


class Dropped(Record):
    """A rod of the layout that is not part of the grid."""

    id: Text = Field(description="name of the rod")
    reason: Text = Field(default="", description="why it was left out")


# Patches and seams


class Patch(Record):
    """One patch of a shell that is cut along seams."""

    id: Text = Field(description="name of the patch")
    status: Text | None = key('"converged", or which stage stopped')
    rods: Whole | None = key("number of rods")
    left_out: Whole | None = key("number of rods left out because they are too short")
    anchor: Flat | None = key("place in plan through which the grid's axes run", "m")
    rotate: Number = key("angle of the first family against the target's x axis", "rad")
    spacing: tuple[Real, Real] | None = key("distance between neighbouring rods of the first family and of others", "m")
    flat_shift: Flat | None = key("shift of its flat grid in the row of all", "m")
    ends_moved: Number = key("largest distance by which a rod end was moved to meet another on a seam", "m")
    net: Net | None = key("the inextensible net")
    agreement: ByEnds[Agreement] = by_ends("gap to the target")
    drape: Drape | None = key("the drape")
    pop_up: ByEnds[PopUp] = by_ends("the pop-up")


class Meeting(Record):
    """A place on a seam where two rods meet."""

    point: tuple[Real, Real, Real] = Field(description="the place [m]")
    ends: tuple[Text, Text] = Field(description='the two rod ends, such as "A-U03.1" (0 start, 1 end)')


class SeamForces(Record):
    """What a seam carries: the sum of both rods' support forces."""

    each: Rows[Point] = rows("force at each meeting", "N")
    largest: Number = key("largest of these forces", "N")
    sum: Point | None = key("sum of these forces", "N")


class Seam(Record):
    """A seam between patches."""

    points: Rows[Flat] = rows("the seam's line in plan", "m")
    meetings: Rows[Meeting] = rows("places where rods meet")
    forces: ByEnds[SeamForces] = by_ends("forces that the seam carries")

"""The records that result.json consists of: each key of the file with its meaning and its unit, in SI.

A record keeps the keys that were set, so that a file is written back as it was read: a key that is absent stays absent,
null is what is not known, and keys of later versions are kept as they are. Reading checks every value: a text in place
of a number, a number that is not finite or a point with two coordinates is refused.
"""

import json
from collections.abc import Mapping
from math import isfinite
from typing import Annotated, Any, Literal, Self, TypeVar

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, BeforeValidator, ConfigDict, FailFast, Field, ValidationInfo, model_validator
from pydantic_core import CoreSchema, core_schema

Ends = Literal["pinned", "clamped"]
Gate = Literal["flat", "from_flat", "remeshed", "tolerance", "stable"]
FEWEST_STATIONS = 2
LARGEST = 1e30  # of a number in its SI unit, so that its products are finite
MOST = 10**15  # of a count
FARTHEST = 1e6  # m between two points of a shell, and of each of its lengths
SHORTEST = 1e-9  # m of a rod
ORIGIN = 1e9  # m from the origin, as in national grids


def printable(text: str) -> str:
    """`text` on one line, without the control characters and lone surrogates that no text file can hold."""
    return text if text.isprintable() else "".join(letter if letter.isprintable() else " " for letter in text)


def _finite_or_unknown(value: object, info: ValidationInfo) -> object:
    """None for a number of a computation that is out of range; in a file such a number is an error."""
    return None if info.mode == "python" and isinstance(value, float) and not abs(value) <= LARGEST else value


def _in_range(value: Any, info: ValidationInfo) -> Any:
    """The value of a key that is not known here: of an object, or of a later version."""
    if info.mode == "python":
        return plain(value)
    if isinstance(value, int | float) and not abs(value) <= LARGEST:
        raise ValueError(f"it must be a number from {-LARGEST:g} to {LARGEST:g}")
    if isinstance(value, dict):
        return {printable(name): _in_range(item, info) for name, item in value.items()}
    if isinstance(value, list):
        return [_in_range(item, info) for item in value]
    return printable(value) if isinstance(value, str) else value


def _no_rows_for_null(value: object) -> object:
    """A list that is not known has no entries."""
    return () if value is None else value


def _no_keys_for_null(value: object) -> object:
    """A table that is not known has no entries."""
    return {} if value is None else value


class _Checked:
    """What a value must be, by a schema that is written once: pydantic would infer it again for every key."""

    def __init__(self, schema: CoreSchema) -> None:
        self._schema = schema

    def __get_pydantic_core_schema__(self, source: object, handler: object) -> CoreSchema:
        return {**self._schema}


_REAL = core_schema.float_schema(strict=True, ge=-LARGEST, le=LARGEST)
_NUMBER = core_schema.with_info_before_validator_function(_finite_or_unknown, core_schema.nullable_schema(_REAL))

Real = Annotated[float, _Checked(_REAL)]
Number = Annotated[Real | None, _Checked(_NUMBER)]
Whole = Annotated[int, _Checked(core_schema.int_schema(strict=True, ge=-MOST, le=MOST))]
Flag = Annotated[bool, _Checked(core_schema.bool_schema(strict=True))]
Text = Annotated[
    str, _Checked(core_schema.no_info_after_validator_function(printable, core_schema.str_schema(strict=True)))
]
_Other = Annotated[Any, _Checked(core_schema.with_info_after_validator_function(_in_range, core_schema.any_schema()))]
T = TypeVar("T")
Rows = Annotated[tuple[T, ...], FailFast(), BeforeValidator(_no_rows_for_null)]
ByEnds = Annotated[dict[Ends, T], BeforeValidator(_no_keys_for_null)]
Flat = Annotated[tuple[Number, Number], _Checked(core_schema.tuple_schema([_NUMBER] * 2))]
Point = Annotated[tuple[Number, Number, Number], _Checked(core_schema.tuple_schema([_NUMBER] * 3))]


class Record(BaseModel):
    """A part of result.json: frozen, with the keys that the file has."""

    model_config = ConfigDict(frozen=True, extra="allow", allow_inf_nan=False, populate_by_name=True, defer_build=True)
    __pydantic_extra__: dict[str, _Other] = Field(init=False)

    def plain(self) -> dict[str, Any]:
        """The record as it stands in result.json: plain dictionaries, lists and numbers, without absent keys."""
        return self.model_dump(mode="json", by_alias=True, exclude_unset=True)

    def changed(self, **values: Any) -> Self:
        """The same record with other values of some fields, by their names here; they are not checked."""
        return self.model_copy(update=values)


def key(meaning: str, unit: str = "") -> Any:
    """A key that may be absent, with what it means and its unit.

    Parameters
    ----------
    meaning : of the key, in words.
    unit : of its value; "" without.
    """
    return Field(default=None, description=f"{meaning} [{unit}]" if unit else meaning)


def required(meaning: str, *, alias: str) -> Any:
    """A key that must be there, and that Python cannot have as a name.

    Parameters
    ----------
    meaning : of the key, in words.
    alias : name of the key in the file.
    """
    return Field(alias=alias, description=meaning)


def rows(meaning: str, unit: str = "") -> Any:
    """A list that may be absent.

    Parameters
    ----------
    meaning : of the list's entries, in words.
    unit : of their values; "" without.
    """
    return Field(default=(), description=f"{meaning} [{unit}]" if unit else meaning)


def by_ends(meaning: str) -> Any:
    """A table by end condition that may be absent."""
    return Field(default_factory=dict, description=f"{meaning}, by end condition")


def json_text(content: Mapping[str, Any]) -> str:
    """Plain content as strict JSON, a key or a rod on each line; what is not a finite number becomes null.

    Parameters
    ----------
    content : keys and values; NumPy's arrays and numbers are converted.
    """
    lines = []
    for name, value in plain(content).items():
        if isinstance(value, list) and value and isinstance(value[0], dict):
            text = "[\n  " + ",\n  ".join(map(_dumps, value)) + "\n ]"
        else:
            text = _dumps(value)
        lines.append(f" {_dumps(name)}: {text}")
    return "{\n" + ",\n".join(lines) + "\n}\n"


def _dumps(value: Any) -> str:
    return json.dumps(value, allow_nan=False, ensure_ascii=False)


def plain(value: Any) -> Any:
    """`value` in JSON's types; records, NumPy's arrays and numbers are converted, texts are printable.

    Parameters
    ----------
    value : dictionaries, sequences, arrays, records, numbers, texts.
    """
    if isinstance(value, float):  # most are; NumPy's float64 is one
        return float(value) if isfinite(value) else None
    if isinstance(value, str):
        return printable(value)
    if isinstance(value, Mapping):
        return {printable(str(name)): plain(item) for name, item in value.items()}
    if isinstance(value, Record):
        return value.plain()
    if isinstance(value, np.ndarray | np.generic):
        return plain(value.tolist())
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    return value


def far_apart(points: NDArray[Any]) -> str:
    """What is wrong with the places (..., 2 or 3) [m] of points of one shell, one at least and finite; or nothing."""
    rows = points.reshape(-1, points.shape[-1])
    low, high = rows.min(axis=0).astype(float), rows.max(axis=0).astype(float)
    if max(high.max(), -low.min()) > ORIGIN:
        return f"a point more than {ORIGIN:g} m from the origin"
    return f"points more than {FARTHEST:g} m apart" if max(high - low) > FARTHEST else ""


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
    """The flat grid that was asked for."""

    rods: Text | tuple[Whole, Whole] | None = key('number of rods of families u and v, or "auto"')
    spacing: tuple[Real, Real] | None = key("distance between neighbouring rods of families u and v", "m")
    length: Text | Real | None = key('length of every rod before trimming [m], or "auto"')
    edge: Number = key("longest edge of the mesh", "m")
    rotate: Number = key("angle of family u against the target's x axis", "rad")
    offset: Flat | None = key("shift of the lattice against the axes through the anchor", "m")
    crossing: Number = key("angle between both families on the target, at the anchor", "rad")


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
        if not len(self.at) == len(self.factors) >= FEWEST_STATIONS or len(self.sizes) not in (0, len(self.at)):
            raise ValueError(
                f"{len(self.at)} stations, {len(self.factors)} factors and {len(self.sizes)} sizes: there must be as "
                "many of each, two or more"
            )
        return self


class RodLine(Record):
    """A rod's flat geometry, its joints, and how it is cut."""

    id: Text = Field(description="name of the rod")
    family: Text = Field(description='"u" runs along x at y = offset, "v" along y at x = offset, "free": from a table')
    offset: Number = key("place of the rod's line across its family", "m")
    start: Real = Field(description="material coordinate of the start, from the layout's middle [m]")
    end: Real = Field(description="material coordinate of the end [m]")
    length: Number = key("length between the supports", "m")
    joints: Rows[RodJoint] = rows("joints from the start to the end")
    cut_length: Number = key("length as cut, with both end allowances", "m")
    mass: Number = key("mass as cut", "kg")
    layer: Whole | None = key("layer in which it is laid, 1 the lowest")
    splices: Rows[Real] = rows("splices, from the start", "m")
    stiffness: Stiffness | None = key("where its section changes along it: its bending stiffness")


class Rod(Bent, RodLine):
    """One rod, with its worst bending in the final shape."""

    pop_up: Bent | None = key("worst bending in all shapes, those of the deployment included")


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
    rotate: Number = key("angle of family u against the target's x axis", "rad")
    spacing: tuple[Real, Real] | None = key("distance between neighbouring rods of families u and v", "m")
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

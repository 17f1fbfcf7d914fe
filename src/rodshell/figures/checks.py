"""What was checked of a shell without loads, and under its own weight."""

from re import fullmatch

from pydantic import Field

from rodshell.figures.form import Bent
from rodshell.figures.records import (
    Flag,
    Number,
    Point,
    Points,
    Real,
    Record,
    Rows,
    T,
    TableOr,
    Text,
    Vector,
    Whole,
    key,
    points,
    rows,
)
from rodshell.validation import NAME

OTHER_SHAPES = ("pop_up", "deployment")  # with figures in addition to those on supports


def _by_shape(record: Record, kind: type[T]) -> dict[str, T]:
    """What a record holds of shapes: by the names of supports, then of the deployment."""
    known = {name: value for name, value in record if isinstance(value, kind) and fullmatch(f"{NAME}|pop_up", name)}
    return {name: known[name] for name in sorted(known, key=OTHER_SHAPES.__contains__)}


class WorstBent(Bent):
    """Worst bending over all rods, and where the stress is largest."""

    rod: Text | None = key("id of the rod with the largest stress")
    at: Number = key("distance of that place from the rod's start", "m")
    where: Point | None = key("that place in space; absent in stages of the deployment", "m")
    share: Number = key("share of the deployment at which it occurs; 0 flat, 1 popped up")


class Bending(Record):
    """Bending and stress of all rods in the shapes of the shell: on each support by its name, and of the deployment."""

    __pydantic_extra__: dict[str, TableOr[WorstBent]] = Field(init=False)

    strength: Number = key("by which the use of final shapes is counted: permanent, if that is known", "Pa")
    erection_strength: Number = key("by which the use of the deployment's stages is counted", "Pa")
    shear_strength: Number = key("shear strength; null: stress is counted by von Mises", "Pa")
    strength_of: Text | None = key("the preset whose strengths these are; null where they were given")
    pinned: WorstBent | None = key("final shape with pinned ends")
    clamped: WorstBent | None = key("final shape with clamped ends")
    pop_up: WorstBent | None = key("all stages of the deployment and the final shape")
    deployment: WorstBent | None = key("stages of the deployment below the final shape")

    def shapes(self) -> dict[str, WorstBent]:
        """What is known, by the name of the shape."""
        return _by_shape(self, WorstBent)


class Clearance(Record):
    """The nearest two rods of a shape, apart from those that cross there."""

    clearance: Number = key("distance of their surfaces; negative: overlap; null: none are near, or not known", "m")
    pairs: Whole | None = key("number of pairs of rods that touch")
    rods: tuple[Text, Text] | None = key("ids of the nearest two rods")
    where: Point | None = key("place between them", "m")
    share: Number = key("share of the deployment of this shape; 0 flat, 1 popped up")


class Contact(Record):
    """Contact of rods with each other: in the shape on each support by its name, and in the deployment."""

    __pydantic_extra__: dict[str, TableOr[Clearance]] = Field(init=False)

    pinned: Clearance | None = key("final shape with pinned ends")
    clamped: Clearance | None = key("final shape with clamped ends")
    deployment: Clearance | None = key("the worst stage of the deployment")

    def shapes(self) -> dict[str, Clearance]:
        """What is known, by the name of the shape."""
        return _by_shape(self, Clearance)

    def of(self, shape: str) -> Clearance | None:
        """Of a support by its name, or of the "deployment"."""
        return self.shapes().get(shape)


class Reactions(Record):
    """What the supports exert on the unloaded shell, in the order of `boundary`."""

    force_sum: Vector | None = key("sum of all forces", "N")
    moment_sum: Vector | None = key("sum of all moments", "N m")
    force_imbalance: Number = key("sum of all forces over the largest")
    moment_imbalance: Number = key("sum of all moments over the largest")
    largest_force: Number = key("largest support force", "N")
    largest_moment: Number = key("largest support moment", "N m")
    forces: Points = points("force at each rod end", "N")
    moments: Points = points("moment at each rod end, about its own point; 0 where it is pinned", "N m")
    figures: dict[Text, tuple[Number, Text]] = key(
        "value and SI unit of each figure that the support says of itself, by what it is", default_factory=dict
    )


class JointLoad(Record):
    """What acts at a joint on the second of its rods."""

    rods: tuple[Text, Text] = Field(description="ids of the two rods")
    force: Point | None = key("force", "N")
    normal_force: Number = key("force along the joint's normal", "N")
    shear_moment: Number = key("moment about the joint's normal", "N m")
    out_of_plane_moment: Number = key("moment across the joint's normal", "N m")
    scissor_deg: Number = key("growth of the angle between the rods since the flat grid", "deg")


class SelfWeight(Record):
    """How much of its own weight the shell carries: up to at most 0.2 % below where stability is lost.

    limit point: the load cannot grow, the shell snaps through. bifurcation: it gives way sideways. none: it is stable
    up to 100 times its weight. not followed: it is stable up to the factor, and nothing is known above.
    """

    load_factor: Number = key("factor on the weight at which stability is lost; null: above 100, or no mass given")
    deflection: Number = key("largest displacement under the whole weight; null: it does not carry it", "m")
    limit: Text | None = key("limit point, bifurcation, unstable unloaded, none, not followed, or no mass")
    braced_factor: Number = key("the load_factor of the shell with its bracing and locked joints")
    braced_limit: Text | None = key("as limit, of the braced shell; absent without bracing")
    factorizations: Whole | None = key("factorisations of the tangent")


class EndsInTheAir(Record):
    """Rod ends, those at seams left out, that lie higher than a fiftieth of the size above the lowest one."""

    count: Whole | None = key("number of these ends")
    highest: Number = key("height of the highest over the lowest end", "m")
    largest_force: Number = key(
        "largest force on what holds one of them, of all that were checked; null: none are", "N"
    )


class Stage(Bent):
    """A stage of the deployment, and its worst bending."""

    share: Real = Field(description="share of the deployment: 0 flat, 1 popped up")
    height: Number = key("height of the shell", "m")


class OtherShape(Record):
    """Another stable shape on the same supports."""

    distance: Number = key("distance of the farthest node from the shell's shape, over half the shell's width")
    energy: Number = key("energy over that of the shell's shape")
    mirror: Flag | None = key("whether it is the reflection in the plane of the supports")
    from_flat: Flag | None = key("true where a deployment is known to end in it")


class ClampedDeployment(Record):
    """Deployment to the clamped shape: pinned first, then the ends are turned."""

    reached_from_flat: Flag | None = key("whether turning the ends leads to the clamped shape; null: not known")


class Deployment(Record):
    """The deployment from flat to popped up with pinned ends, the ends driven along straight lines."""

    ends: Text | None = key("name of the support")
    stages: Rows[Stage] = rows("equilibria from flat to popped up")
    snaps: Rows[tuple[Real, Real]] = rows("pairs of shares between which the shell snaps forward")
    snapped_by: Rows[Number] = rows("how far a node moves in each snap", "m")
    lost_at: Number = key("share below which no stage was found; null: all were")
    reached_from_flat: Flag | None = key("whether the deployment ends in the final shape; null: not known")
    elsewhere: OtherShape | None = key("the shape in which it ends instead")
    guided: tuple[Real, Real] | None = key("shares between which the shell has to be guided")
    clamped: ClampedDeployment | None = key("deployment to the clamped shape")
    factorizations: Whole | None = key("factorisations of the tangent")


class OtherShapes(Record):
    """Search for other stable shapes; what was not found is not excluded."""

    tried: Whole | None = key("number of starts")
    searched: Text = Field(default="", description="how far the search looked")
    popped_through: Flag | None = key("whether popping through was among the starts")
    largest_kick: Number = key("largest kick over half the shell's width")
    found: Rows[OtherShape] = rows("shapes that were found")
    factorizations: Whole | None = key("factorisations of the tangent")

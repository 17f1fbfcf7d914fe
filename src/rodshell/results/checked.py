"""The records of what was checked, made and drawn, and of what the result is worth."""

from typing import Literal

from pydantic import Field

from rodshell.results.records import (
    Bent,
    Flag,
    Number,
    Point,
    Real,
    Record,
    Rows,
    Text,
    Whole,
    key,
    required,
    rows,
)

Level = Literal["good", "check", "unbuildable"]


class WorstBent(Bent):
    """Worst bending over all rods, and where the stress is largest."""

    rod: Text | None = key("id of the rod with the largest stress")
    at: Number = key("distance of that place from the rod's start", "m")
    share: Number = key("share of the deployment at which it occurs; 0 flat, 1 popped up")


class Bending(Record):
    """Bending and stress of all rods in the shapes of the shell."""

    strength: Number = key("bending strength by which utilisation is counted", "Pa")
    shear_strength: Number = key("shear strength; null: stress is counted by von Mises", "Pa")
    strength_of: Text | None = key("the preset whose strengths these are; null where they were given")
    pinned: WorstBent | None = key("final shape with pinned ends")
    clamped: WorstBent | None = key("final shape with clamped ends")
    pop_up: WorstBent | None = key("all stages of the deployment and the final shape")
    deployment: WorstBent | None = key("stages of the deployment below the final shape")

    def shapes(self) -> dict[str, WorstBent]:
        """What is known, by the name of the shape."""
        known = {"pinned": self.pinned, "clamped": self.clamped, "pop_up": self.pop_up, "deployment": self.deployment}
        return {name: bent for name, bent in known.items() if bent is not None}


class Clearance(Record):
    """The nearest two rods of a shape, apart from those that cross there."""

    clearance: Number = key("distance of their surfaces; negative: overlap; null: none are near, or not known", "m")
    pairs: Whole | None = key("number of pairs of rods that touch")
    rods: tuple[Text, Text] | None = key("ids of the nearest two rods")
    where: Point | None = key("place between them", "m")
    share: Number = key("share of the deployment of this shape; 0 flat, 1 popped up")


class Contact(Record):
    """Contact of rods with each other."""

    pinned: Clearance | None = key("final shape with pinned ends")
    clamped: Clearance | None = key("final shape with clamped ends")
    deployment: Clearance | None = key("the worst stage of the deployment")

    def of(self, shape: str) -> Clearance | None:
        """Of "pinned", "clamped" or "deployment"."""
        return {"pinned": self.pinned, "clamped": self.clamped, "deployment": self.deployment}.get(shape)


class Reactions(Record):
    """What the supports exert on the unloaded shell, in the order of `boundary`."""

    force_sum: Point | None = key("sum of all forces", "N")
    moment_sum: Point | None = key("sum of all moments", "N m")
    force_imbalance: Number = key("sum of all forces over the largest")
    moment_imbalance: Number = key("sum of all moments over the largest")
    largest_force: Number = key("largest support force", "N")
    largest_moment: Number = key("largest support moment", "N m")
    forces: Rows[Point] = rows("force at each rod end", "N")
    moments: Rows[Point] = rows("moment at each rod end", "N m")


class JointLoad(Record):
    """What acts at a joint on the second of its rods."""

    rods: tuple[Text, Text] = Field(description="ids of the two rods")
    force: Point | None = key("force", "N")
    normal_force: Number = key("force along the joint's normal", "N")
    shear_moment: Number = key("moment about the joint's normal", "N m")
    out_of_plane_moment: Number = key("moment across the joint's normal", "N m")
    scissor_deg: Number = key("growth of the angle between the rods since the flat grid", "deg")


class SelfWeight(Record):
    """How much of its own weight the shell bears."""

    load_factor: Number = key("factor on the weight at which stability is lost; null: above 100, or no mass given")
    deflection: Number = key("largest displacement under the whole weight; null: it does not bear it", "m")
    limit: Text | None = key("limit point, bifurcation, unstable unloaded, none, not followed, or no mass")


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
    """The shell on its way from flat to popped up with pinned ends, the ends driven along straight lines."""

    ends: Text | None = key('end condition: "pinned"')
    stages: Rows[Stage] = rows("equilibria from flat to popped up")
    snaps: Rows[tuple[Real, Real]] = rows("pairs of shares between which the shell snaps forward")
    snapped_by: Rows[Number] = rows("how far a node moves in each snap", "m")
    lost_at: Number = key("share below which no stage was found; null: all were")
    reached_from_flat: Flag | None = key("whether the deployment ends in the final shape; null: not known")
    elsewhere: OtherShape | None = key("the shape in which it ends instead")
    guided: tuple[Real, Real] | None = key("shares between which the shell has to be guided")
    clamped: ClampedDeployment | None = key("deployment to the clamped shape")


class OtherShapes(Record):
    """Search for other stable shapes; what was not found is not excluded."""

    tried: Whole | None = key("number of starts")
    searched: Text = Field(default="", description="how far the search looked")
    popped_through: Flag | None = key("whether popping through was among the starts")
    largest_kick: Number = key("largest kick over half the shell's width")
    found: Rows[OtherShape] = rows("shapes that were found")


# Fabrication and drawings


class Brace(Record):
    """A diagonal between two joints."""

    start: Text = required("id of the first joint, the two rods' ids with a slash", alias="from")
    end: Text = required("id of the second joint", alias="to")
    flat: Number = key("length in the flat grid", "m")
    final: Number = key("length in the final shape", "m")


class Piece(Record):
    """A piece that is cut from stock."""

    piece: Text = Field(description="the rod's id, a dot and its number along the rod")
    length: Number = key("length", "m")


class Bar(Record):
    """A bar of stock."""

    pieces: Rows[Piece] = rows("what is cut from it")
    left: Number = key("what is left of it", "m")


class Stock(Record):
    """The cutting plan."""

    waste: Number = key("share of the stock that is in no piece")
    fewest: Whole | None = key("bars that the pieces' total length takes at least")
    bars: Rows[Bar] = rows("the bars")


class Fabrication(Record):
    """How the rods are cut and braced."""

    end_allowance: Number = key("length added at each end of a rod, for its support", "m")
    stock_length: Number = key("length of the bars; null: every rod comes in one piece", "m")
    kerf: Number = key("length lost at each saw cut", "m")
    total_mass: Number = key("mass of rods and joints", "kg")
    bracing: Rows[Brace] = rows("diagonals of the cells, both of a cell in a row")
    stock: Stock | None = key("the cutting plan")


class Drawings(Record):
    """What the drawings have in common."""

    paper: Text = Field(default="A3", description="size of the PDF's sheets: A4 to A0")
    project: Text = Field(default="", description="name of the project")
    revision: Text = Field(default="", description="revision")
    tolerance: Number = key("to which lengths are to be kept", "m")
    layers: dict[str, Text] = Field(default_factory=dict, description="other names of DXF layers")
    name: Text = Field(default="", description='name of the drawings; "": the target\'s')
    author: Text = Field(default="", description="author")
    date: Text = Field(default="", description='a day as "2026-11-22"; "": the day of writing')


class Verdict(Record):
    """What a result is worth."""

    level: Level = Field(
        description='"good": it pops up, stands under its own weight and can be built; "check": something has to be '
        'checked first; "unbuildable": no end condition gives a shell that can be built'
    )
    reasons: tuple[Text, ...] = Field(min_length=1, description="sentences, the gravest first")

    @property
    def headline(self) -> str:
        """The first sentence, after the level in words."""
        words: dict[Level, str] = {"good": "Good", "check": "Check", "unbuildable": "Not buildable"}
        return f"{words[self.level]}: {self.reasons[0]}"

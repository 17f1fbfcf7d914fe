"""Records of a shell under loads."""

from pydantic import Field

from rodshell.results.records import ByEnds, Number, Point, Real, Record, Rows, Text, key, rows


class Governs(Record):
    """The place with the largest stress."""

    rod: Text = Field(description="id of the rod")
    at: Real = Field(description="distance from the rod's start [m]")


class LoadedShell(Record):
    """The shell under a combination of loads. Factors multiply the whole combination."""

    at_factor: Number = key("of the combination, under which all but the factors stands: 1, or the last stable one")
    load_sum: Point | None = key("sum of the loads, those on supports included", "N")
    reaction_sum: Point | None = key("sum of the support forces, without those of the unloaded shell", "N")
    max_deflection: Number = key("largest displacement of a node", "m")
    linear_factor: Number = key("lowest linear buckling factor about the unloaded shell; null: above 100, or not known")
    limit_factor: Number = key("up to which the shell is stable; null: above 100")
    limit_kind: Text | None = key("limit point, bifurcation, none, unstable unloaded, or not followed: unknown above")
    imperfect_factor: Number = key("the same with imperfections; null: above 100, not found, or not asked for")
    imperfect_kind: Text | None = key("what ends the path with imperfections, as limit_kind; null: not asked for")
    utilisation: Number = key("largest stress over the strength; null: one of them is not known")
    max_stress: Number = key("largest stress of bending, axial force and torsion", "Pa")
    governs: Governs | None = key("place with the largest stress")
    uplift: Number = key("largest force by which the shell pulls at a support upwards; 0: at none", "N")
    reactions: Rows[Point] = rows("force of each support, in the order of boundary, without the unloaded shell's", "N")
    support_forces: Rows[Point] = rows("force of each support, with the unloaded shell's", "N")
    support_moments: Rows[Point] = rows("moment of each support, with the unloaded shell's", "N m")
    bracing: Rows[Number] = rows(
        "axial force of each brace in the order of fabrication.bracing, tension positive, 0: slack; null: left out", "N"
    )
    bracing_utilisation: Number = key("utilisation of the laths of a third layer; null: none, or not known")


LoadCases = dict[str, ByEnds[LoadedShell]]

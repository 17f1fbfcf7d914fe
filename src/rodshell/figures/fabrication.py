"""How the rods are cut and braced."""

from pydantic import Field

from rodshell.figures.records import Number, Real, Record, Rows, Text, Whole, key, required, rows


class Brace(Record):
    """A diagonal between two joints, or from a joint to a support."""

    start: Text = required("id of the first joint, the two rods' ids with a slash", alias="from")
    end: Text = required("id of the second joint, or of a support, as U03.1", alias="to")
    flat: Number = key("length in the flat grid", "m")
    final: Number = key("length in the final shape", "m")
    cut: Number = key("length of a cable free of stress; absent without bracing of cables", "m")


class Piece(Record):
    """A piece that is cut from stock."""

    piece: Text = Field(
        description="the rod's id, a dot and its number along the rod; of the second lath on a rod with -2 after the id"
    )
    length: Real = Field(description="length [m]")


class Bar(Record):
    """A bar of stock."""

    pieces: Rows[Piece] = rows("what is cut from it")
    left: Number = key("what is left of it", "m")


class Stock(Record):
    """The cutting plan."""

    waste: Number = key("share of the stock that is in no piece")
    fewest: Whole | None = key("bars that these pieces take at least, however they are cut")
    bars: Rows[Bar] = rows("the bars")


class Fabrication(Record):
    """How the rods are cut and braced."""

    end_allowance: Number = key("length added at each end of a rod, for its support", "m")
    stock_length: Number = key("length of the bars; null: every rod comes in one piece", "m")
    kerf: Number = key("length lost at each saw cut", "m")
    total_mass: Number = key("mass of rods and joints", "kg")
    bracing: Rows[Brace] = rows("diagonals of the cells, those of a cell in a row")
    cable_stiffness: Number = key("EA of each cable; null: no cables, or no loads were checked", "N")
    cable_mass_per_length: Number = key("the same of its mass", "kg/m")
    stock: Stock | None = key("the cutting plan; absent where rods are cut from boards, curved at rest")
    slot_depth: Number = key("depth of the slots by which upright strips cross; absent where there are none", "m")

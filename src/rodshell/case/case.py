"""A whole case: everything that decides one job, complete and in SI, as objects and as TOML text."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple, Self

from rodshell.case.held import Held, built
from rodshell.case.load_tables import BracingKinds, CombinationRows, LoadRows, NoBracing
from rodshell.case.rod_tables import RodTable
from rodshell.case.stage_tables import (
    DesignTable,
    DrapeTable,
    LayoutKinds,
    LayoutTable,
    PopUpTable,
    RefineTable,
    SeamsTable,
    SupportRows,
)
from rodshell.case.target_tables import HeldTarget, Hemisphere, TargetKinds
from rodshell.errors import InputError
from rodshell.fabrication.settings import Fabrication, has_slots
from rodshell.loads.combinations import Loads
from rodshell.loads.settings import LockedJoints, Stability, Strength
from rodshell.output.settings import CheckOptions, DrawingStyle
from rodshell.progress import Progress, silent
from rodshell.rods.design_strength import permanent_strength
from rodshell.rods.joints import Ball, JointKind
from rodshell.rods.materials import Material
from rodshell.rods.section import Rod
from rodshell.rods.support_groups import SupportGroups
from rodshell.rods.supports import BOTH, Support, supports_of
from rodshell.schema import read, undescribed, written
from rodshell.units import length_text, shown

if TYPE_CHECKING:
    from rodshell.checks.sizing import Fit
    from rodshell.formfinding.methods import Method
    from rodshell.layout import Layout
    from rodshell.output.options import OutputOptions
    from rodshell.targets import Target

HEADER = "# The full input of a rodshell job, in SI units. To run it again: rodshell form case.toml\n"
UNDESCRIBED = "not_described"
"""Key of the case kept with the form of an object that no case file can describe: what that is; no such case is run."""


class Built(NamedTuple):
    """A case as library objects.

    Args:
        anchor: x, y where the axes cross [m]; None: the default, or one that is searched for.
    """

    target: "Target"
    layout: "Layout"
    rod: Rod
    method: "Method"
    anchor: tuple[float, float] | None


@dataclass(frozen=True, kw_only=True)
class Case:
    """Everything that decides one job, complete and in SI. Make one with `load_case`."""

    target: TargetKinds | HeldTarget = field(default_factory=Hemisphere)
    layout: LayoutKinds = field(default_factory=LayoutTable)
    rod: RodTable = field(default_factory=RodTable)
    joint: JointKind = field(default_factory=Ball)
    drape: DrapeTable = field(default_factory=DrapeTable)
    pop_up: PopUpTable = field(default_factory=PopUpTable)
    supports: SupportRows = ()
    refine: RefineTable = field(default_factory=RefineTable)
    seams: SeamsTable = field(default_factory=SeamsTable)
    checks: CheckOptions = field(default_factory=CheckOptions)
    fabrication: Fabrication = field(default_factory=Fabrication)
    drawings: DrawingStyle = field(default_factory=DrawingStyle)
    loads: LoadRows = ()
    combinations: CombinationRows = ()
    bracing: BracingKinds = field(default_factory=NoBracing)
    locked_joints: LockedJoints | None = None
    stability: Stability = field(default_factory=Stability)
    strength: Strength = field(default_factory=Strength)
    design: DesignTable = field(default_factory=DesignTable)

    @property
    def held_objects(self) -> dict[str, Held]:
        """Objects that tables were made of and that their keys do not describe, by the name of the table."""
        tables = {each.name: getattr(self, each.name) for each in fields(self)}
        found = {name: table.held for name, table in tables.items() if getattr(table, "held", None) is not None}
        what = undescribed(self.joint)
        return found | ({"joint": Held(self.joint, what)} if what else {})

    def to_toml(self) -> str:
        """The full input as a case file with SI numbers: loading it from anywhere gives the same case.

        Raises:
            InputError: it holds an object that no case file can describe.
        """
        notes = []
        for name, held in self.held_objects.items():
            if not held.writable:
                raise InputError(
                    f"no case file can describe {held.what} ({name}): keep the Python that makes it, or save the form"
                )
            notes += [f"# {held.note}\n"] if held.note else []
        idle = {"bracing"} if self.bracing.kind == "none" else set[str]()
        idle |= set() if self.design.open else {"design"}
        if not self.loads:
            unset = {"stability": Stability(), "strength": Strength()}
            idle |= {name for name, table in unset.items() if getattr(self, name) == table}
        tables = {name: table for name, table in written(self.absolute()).items() if name not in idle}
        return "".join(notes) + toml_text(tables)

    def text(self) -> str:
        """As `to_toml`, or a text that is refused as a case and says why no case file can give the same again."""
        if self.of_table:
            return ""
        for held in self.held_objects.values():
            if not held.writable:
                return f"# no case file can give {held.what} again\n{UNDESCRIBED} = {_value(held.what)}\n"
        return self.to_toml()

    def absolute(self) -> Self:
        """The same case, whose files are named from the root."""
        rooted: dict[str, Any] = {key: str(Path(path).absolute()) for key, path in self._paths.items()}
        return replace(self, target=replace(self.target, **rooted)) if rooted else self

    @property
    def of_table(self) -> bool:
        """Whether it is about a table of rods, in place of a target."""
        kind: str = self.target.kind
        return kind == "table"

    @property
    def files(self) -> set[str]:
        """The files that the target is read from."""
        return set(self._paths.values())

    @property
    def _paths(self) -> dict[str, str]:
        """The same by their keys."""
        paths = {key: getattr(self.target, key, None) for key in ("file", "boundary")}
        return {key: path for key, path in paths.items() if path is not None}

    def rod_on(
        self,
        target: "Target",
        layout: "Layout",
        *,
        anchor: tuple[float, float] | None = None,
        progress: Progress = silent,
    ) -> Rod:
        """The rod; material and section that were left to the target are chosen by the bends of its net."""
        if self.rod.held is not None:
            rod: Rod = self.rod.held.value
            return rod
        fit = partial(self.fit_on, target, layout, anchor=anchor, progress=progress)
        return self.rod.build(fit, strength=self.permanent_strength)

    def permanent_strength(self, material: Material) -> float | None:
        """What rods of a material withstand permanently [Pa]: as given, or by the building code of a preset."""
        given = self.strength.permanent or self.checks.strength
        return given or permanent_strength(material, self.strength.service_class)

    def fit_on(
        self,
        target: "Target",
        layout: "Layout",
        *,
        anchor: tuple[float, float] | None = None,
        progress: Progress = silent,
    ) -> "Fit":
        """What a rod that is left to the target has to fit."""
        from rodshell.checks.sizing import Fit

        return Fit.on(target, layout, anchor=anchor, joint=self.joint, progress=progress)

    @property
    def left_open(self) -> tuple[str, ...]:
        """What loads may decide (`design.open`): section, bracing and spacing, as far as they are not given."""
        spaced = isinstance(self.layout, LayoutTable) and self.layout.spacing == "auto" and not self.seams.lines
        left = {
            "section": self.rod.held is None and "section" in self.rod.left_open,
            "bracing": self.bracing.kind == "none",
            "spacing": spaced,
        }
        return tuple(name for name, is_open in left.items() if is_open)

    def with_rod(self, rod: Rod) -> "Case":
        """The same case with this rod spelled out."""
        if self.rod.held is not None or not self.rod.left_open:
            return self
        return replace(self, rod=read(RodTable, rod.parameters()))

    @property
    def undecided(self) -> bool:
        """Whether anchor or heading are to be searched for."""
        return "auto" in (self.drape.anchor, self.layout.rotate)

    def decided(self, anchor: tuple[float, float], rotate: float) -> "Case":
        """The same case with its anchor [m] and heading [rad]: nothing is left to an objective."""
        return replace(self.headed(rotate), drape=replace(self.drape, anchor=anchor, objective="shear"))

    def headed(self, rotate: float) -> "Case":
        """The same case with its heading [rad]."""
        if not isinstance(self.layout, LayoutTable):
            return replace(self, layout=replace(self.layout, rotate=rotate))
        held = self.layout.held
        turned = None if held is None else replace(held, value=replace(held.value, rotate=rotate))
        return replace(self, layout=replace(self.layout, rotate=rotate, held=turned))

    @property
    def popped_on(self) -> tuple[Support, ...]:
        """The supports on which the grid is popped up: those by groups, and what is asked for in addition to them."""
        if self.pop_up.held is not None:
            return tuple(self.pop_up.held.value)
        others = supports_of(self.pop_up.ends) if not self.supports or self.pop_up.ends != BOTH else ()
        return (*others, *([SupportGroups(groups=self.supports)] if self.supports else ()))

    @property
    def ends(self) -> tuple[str, ...]:
        """The names of the supports."""
        return tuple(support.name for support in self.popped_on)

    def build(self, target: "Target | None" = None, progress: Progress = silent) -> Built:
        """The objects.

        Args:
            target: the target, where it was built before.
            progress: called while a file is read and fitted, and by the net by whose bends the rod is chosen.

        Raises:
            InputError: values that are fine alone do not fit together, the formula or the file cannot be used; with
                seams, also keys that a form in patches does not have.
        """
        from rodshell.checks.sizing import require_likely_sizes
        from rodshell.layout import GridLayout
        from rodshell.targets.creased import cut_at
        from rodshell.targets.patch import Seam

        if self.seams.lines:
            self._require_keys_of_patches()
        elif self.drape.objective != "shear" and not self.undecided:
            raise InputError(
                f"drape.objective = {shown(self.drape.objective)}: nothing is searched for: set drape.anchor or "
                'layout.rotate to "auto", or leave it out'
            )
        anchor = None if self.drape.anchor == "auto" else self.drape.anchor
        method: Method = built(self.drape)
        seams = [Seam.of(line) for line in self.seams.lines]
        target = cut_at(target or built(self.target, progress), seams, progress)
        layout: Layout = built(self.layout, target)
        if isinstance(layout, GridLayout):
            layout = layout.with_edges(method.edges_a_span)
        spacings = [row.layout.spacing for row in self.seams.patches if row.layout.spacing is not None]
        shortest = min([layout.least_spacing, *map(min, spacings)])
        self._require_stock(shortest)
        self._require_allowance(target)
        loads = self.built_loads()
        if loads is not None and loads.locked_joints is not None:
            loads.locked_joints.require_pins(self.joint)
        if self.refine.under not in ("nothing", "weight", *self.combination_names):
            known = ", ".join(("nothing", "weight", *self.combination_names))
            raise InputError(
                f"refine.under = {shown(self.refine.under)}: not a combination of loads: give one of {known}"
            )
        section = self.rod.given_section
        require_likely_sizes(2 * target.size, shortest, section, getattr(self.target, "unit", None))
        if self.rod.left_open:
            progress("preparing", "net for the size of the rods", 0.0)
        rod = self.rod_on(target, layout, anchor=anchor, progress=progress)
        self.require_strength(rod)
        self.require_slots(rod, upright=layout.upright)
        return Built(target, layout, rod, method, anchor)

    def require_strength(self, rod: Rod) -> None:
        """InputError where what is said of the strength does not suit the rod, such as bolts as wide as it."""
        options = self.output_options()
        options.require_known_stress(rod, self.joint)
        if self.strength != Strength():
            from rodshell.loads.strength import net_section

            options.limits(rod, self.strength)
            if self.strength.hole:
                net_section(rod.section, self.strength.hole)

    def require_slots(self, rod: Rod, *, upright: bool) -> None:
        """InputError where slots have a clearance and there are none: of strips that do not stand `upright`."""
        if self.fabrication.slot_clearance and not has_slots(upright, rod, self.joint):
            raise InputError(
                f"fabrication.slot_clearance = {shown(self.fabrication.slot_clearance)}: only strips of an asymptotic "
                "lattice, higher than they are thick and without pins, cross by slots: leave it out"
            )

    def _require_allowance(self, target: "Target") -> None:
        """InputError where rods are cut longer by more than the shell is wide: of no support."""
        allowance = self.fabrication.end_allowance
        if allowance > target.size:
            raise InputError(
                f"fabrication.end_allowance = {shown(allowance)}: more than the {length_text(target.size)} of the "
                "target's size: give the length that the support holds, such as 50 mm"
            )

    def _require_stock(self, shortest: float) -> None:
        """InputError where bars of stock are shorter than any two joints are apart: no rod could be spliced of them."""
        stock = self.fabrication.stock_length
        if stock is not None and stock < shortest:
            raise InputError(
                f"fabrication.stock_length = {shown(stock)}: shorter than the {length_text(shortest)} between joints, "
                "of which no rod could be spliced: give longer stock"
            )

    def _require_keys_of_patches(self) -> None:
        """InputError where a key is set that a form in patches does not have."""
        patches = "each patch of a target cut by seams has its own"
        if not isinstance(self.layout, LayoutTable):
            raise InputError(
                f'layout.kind = {shown(self.layout.kind)}: a target cut by seams needs "chebyshev": set it, or leave '
                "the seams out"
            )
        for key, value, default, instead in (
            ("layout.rods", self.layout.rods, "auto", f'{patches}: use "auto"'),
            ("layout.length", self.layout.length, "auto", f'{patches}: use "auto"'),
            ("layout.offset", self.layout.offset, (0.0, 0.0), f"{patches}: leave it out"),
            ("drape.method", self.drape.method, "bound", 'seams need the bound drape: use "bound", or no seams'),
            ("drape.anchor", self.drape.anchor, None, f"{patches}: leave it out, or give it in seams.patches"),
            ("drape.objective", self.drape.objective, "shear", "with seams the fewest rods are left out: leave it out"),
        ):
            if value != default:
                raise InputError(f"{key} = {shown(value)}: {instead}")

    @property
    def combination_names(self) -> tuple[str, ...]:
        """Names of the combinations of loads, one for each direction of a wind."""
        loads = self.built_loads()
        return () if loads is None else tuple(loads.combinations)

    def built_loads(self) -> Loads | None:
        """What the shell is to be checked under; None where the case has no loads.

        Raises:
            InputError: two loads or two combinations of one name, and what `Loads` refuses.
        """
        if not self.loads and not self.combinations:
            return None
        for tables, rows in (("loads", self.loads), ("combinations", self.combinations)):
            names = [row.name for row in rows]
            for name in names:
                if names.count(name) > 1:
                    raise InputError(f"{tables} has {shown(name)} twice: give each a name of its own")
        return Loads(
            loads={row.name: row.load for row in self.loads},
            combinations={row.name: dict(row.factors) for row in self.combinations},
            bracing=None if isinstance(self.bracing, NoBracing) else self.bracing,
            locked_joints=self.locked_joints,
            stability=self.stability,
            strength=self.strength,
            deflections={row.name: row.deflection for row in self.combinations if row.deflection is not None},
            durations={row.name: row.duration for row in self.loads if row.duration is not None},
        )

    def output_options(self) -> "OutputOptions":
        """Options of checks, fabrication and drawings.

        Raises:
            InputError: a value cannot be used.
        """
        from rodshell.output.options import OutputOptions

        return OutputOptions(
            **vars(self.checks), fabrication=self.fabrication, drawings=self.drawings, rod_chosen=self.rod.left_open
        )


def toml_text(case: Mapping[str, Any]) -> str:
    """One [table] for each entry, one [[table]] for each in a row, their own tables inline, keys in the order given."""
    tables = [
        f"{head}\n" + "".join(f"{key} = {_value(value)}\n" for key, value in table.items())
        for name, entry in case.items()
        for head, table in _headed(name, entry)
    ]
    return "\n".join([HEADER, *tables])


def _headed(name: str, entry: Any) -> list[tuple[str, Mapping[str, Any]]]:
    """A table, or each of the tables in a row, with its head."""
    return [(f"[{name}]", entry)] if isinstance(entry, Mapping) else [(f"[[{name}]]", table) for table in entry]


def _key(name: str) -> str:
    """A key, in quotation marks where it is not a bare word of TOML."""
    bare = name.replace("-", "").replace("_", "")
    return name if bare.isascii() and bare.isalnum() else _value(name)


def _value(value: object) -> str:
    if isinstance(value, Mapping):
        inside = ", ".join(f"{_key(key)} = {_value(item)}" for key, item in value.items())
        return f"{{ {inside} }}" if inside else "{}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(_value(item) for item in value) + "]"
    if isinstance(value, str):  # JSON's escapes are TOML's, except for the character DEL
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    assert isinstance(value, int | float)  # the schema has no other values
    return repr(value)

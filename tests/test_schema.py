"""Classes that a user gives: read from tables, checked, written back; and what a new one costs."""

import ast
from dataclasses import dataclass
from math import inf
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal, get_args

import pytest

import rodshell as rs
from rodshell.errors import InputError
from rodshell.loads.kinds import Load
from rodshell.quantities import FileToRead, Length, Name, Stiffness, quantity
from rodshell.rods.joints import JointKind
from rodshell.schema import Inline, Key, Missing, NoKey, Place, Rows, checked, read, undescribed, written

SOURCE = Path(rs.__file__).parent
PUBLIC = {"__init__.py", "joints/__init__.py"}  # lists of names


@dataclass(frozen=True)
class Round:
    kind: ClassVar = "round"
    radius: Annotated[Length, "radius of the leg"]

    def __post_init__(self) -> None:
        checked(self, "the leg's {}")


@dataclass(frozen=True)
class Square:
    kind: ClassVar = "square"
    side: Annotated[Length, "side of the leg"] = 0.1
    finish: Annotated[Literal["raw", "oiled"], "its surface"] = "raw"


@dataclass(frozen=True)
class Glue:
    stiffness: Annotated[Stiffness, "stiffness of the glue"] = 0.0
    note: Annotated[str | None, "what is to be known"] = None


@dataclass(frozen=True)
class Leg:
    name: Annotated[Name, "name of the leg"]
    shape: Annotated[Round | Square, Inline]


@dataclass(frozen=True)
class Table:
    height: Annotated[Length, "height", Missing("give it, or buy one")]
    legs: Annotated[tuple[Leg, ...], Rows("leg", '[{ name = "left" }]'), "its legs"] = ()
    foot: Round | Square | None = None
    glue: Glue | None = None
    plan: Annotated[FileToRead | None, "file with its plan"] = None
    title: Annotated[str, Key("name"), "what it is called"] = ""
    cloth: Annotated[object, NoKey("a table with a cloth of Python")] = None


LEGS = ({"name": "left", "kind": "round", "radius": 0.02}, {"name": "right", "kind": "square", "finish": "oiled"})


def test_an_object_is_read_with_units_and_written_in_si() -> None:
    given = {"height": "70 cm", "legs": LEGS, "foot": {"kind": "round", "radius": "1 in"}, "name": "desk"}
    found = read(Table, given | {"glue": {"stiffness": "rigid"}})
    legs = (Leg("left", Round(0.02)), Leg("right", Square(finish="oiled")))
    assert found == Table(0.7, legs, Round(0.0254), Glue(inf), title="desk")
    assert written(found, changed=True) == {
        "height": 0.7, "legs": LEGS, "foot": {"kind": "round", "radius": 0.0254}, "glue": {"stiffness": "rigid"},
        "name": "desk",
    }  # fmt: skip
    assert read(Table, written(found)) == found


def test_a_table_that_may_be_left_out_is_none_where_it_says_nothing() -> None:
    assert read(Table, {"height": 1, "glue": {}, "foot": {}}) == read(Table, {"height": 1, "glue": {"note": None}})
    assert read(Table, {"height": 1}).glue is None


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({}, "table.height is missing: give it, or buy one"),
        ({"height": "1 kg"}, 'table.height = "1 kg": kg is a unit of mass; give a length'),
        ({"height": "x", "hight": 1}, "unknown key table.hight: did you mean height?"),
        ({"height": 1, "foot": {"radius": 1}}, 'table.foot.kind is missing: give "round" or "square"'),
        ({"height": 1, "foot": {"kind": "rund"}}, 'table.foot.kind must be "round" or "square", not "rund": did you'),
        ({"height": 1, "foot": {"kind": "round"}}, "table.foot.radius is missing: give the radius of the leg"),
        ({"height": 1, "foot": {"kind": "square", "radius": 1}}, 'radius: a table of kind "square" has kind, side'),
        ({"height": 1, "foot": 3}, "table.foot = 3: must be a table"),
        ({"height": 1, "legs": [{"name": "a", "kind": "round", "radius": 0}]}, 'radius of leg 1 ("a") = 0: must be'),
        ({"height": 1, "legs": [{"name": "", "kind": "square"}]}, "name of leg 1 is empty: give the name of the leg"),
        ({"height": 1, "legs": [{"name": "a"}]}, 'kind of leg 1 ("a") is missing: give "round" or "square"'),
        ({"height": 1, "legs": [{"name": "a", "kind": "square", "sid": 1}]}, 'key sid of leg 1 ("a"): did you mean'),
        ({"height": 1, "legs": {}}, 'table.legs = {  }: give tables in a case file, such as [{ name = "left" }]'),
        ({"height": 1, "foot": {"kind": "square", "finish": 1}}, 'table.foot.finish must be "raw" or "oiled", not 1'),
        ({"height": 1, "name": 3}, "table.name = 3: must be text, the what it is called"),
        ({"height": 1, "cloth": 3}, "unknown key table.cloth"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_said_of_the_key(given: dict[str, Any], sentence: str) -> None:
    with pytest.raises(InputError) as caught:
        read(Table, given, Place("table"))
    assert sentence in str(caught.value)


def test_whoever_reads_a_table_decides_which_files_it_names() -> None:
    assert read(Table, {"height": 1, "plan": "a.dxf"}, files=lambda name: f"/safe/{name}").plan == "/safe/a.dxf"

    def none(_: object) -> str:
        raise InputError("no files here")

    with pytest.raises(InputError, match=r'plan = "a.dxf": no files here'):
        read(Table, {"height": 1, "plan": "a.dxf"}, files=none)


def test_python_is_checked_by_the_same_types_and_names_what_no_key_describes() -> None:
    with pytest.raises(InputError, match=r"the leg's radius must be positive, not -1 m"):
        Round(-1)
    assert undescribed(Table(1.0, cloth=object())) == "a table with a cloth of Python"
    assert undescribed(Table(1.0)) == ""
    assert quantity("bending stiffness").check is not None


def names_in(path: Path) -> set[str]:
    """The names of the code, without its texts and comments."""
    tree = list(ast.walk(ast.parse(path.read_text(encoding="utf-8"))))
    names = {node.id for node in tree if isinstance(node, ast.Name)}
    names |= {node.attr for node in tree if isinstance(node, ast.Attribute)}
    return names | {alias.name for node in tree if isinstance(node, ast.ImportFrom) for alias in node.names}


def files_that_name(kind: type) -> set[str]:
    files = {path.relative_to(SOURCE).as_posix(): path for path in SOURCE.rglob("*.py")}
    return {name for name, path in files.items() if name not in PUBLIC and kind.__name__ in names_in(path)}


@pytest.mark.parametrize("kind", [rs.Snow, rs.Wind, rs.PointLoad, rs.LineLoad, rs.Rigid])
def test_a_kind_of_load_or_joint_costs_two_source_files_at_most(kind: type) -> None:
    """Its class with keys, units, help and checks; and whatever treats it in a way of its own."""
    assert kind in (*get_args(Load), *get_args(JointKind))
    assert len(files_that_name(kind)) <= 2

"""Classes declared by `rodshell.dataclass` behave as those of the standard library, which is the twin here."""

import copy
import dataclasses
import inspect
import pickle
from collections.abc import Callable
from dataclasses import FrozenInstanceError, field, fields, replace
from functools import cached_property
from types import SimpleNamespace
from typing import Any, ClassVar

import pytest

from rodshell.dataclass import dataclass


def classes(dataclass: Callable[..., Any]) -> SimpleNamespace:
    @dataclass(frozen=True)
    class Rod:
        """With a default, one that is made, one that is computed and one that is not compared or shown."""

        length: float
        names: list[str] = field(default_factory=list)
        radius: float = 0.5
        count: int = field(default=3, init=False)
        made: dict[str, int] = field(default_factory=dict, init=False, repr=False)
        hidden: float = field(default=0.0, repr=False, compare=False)
        unit: ClassVar[str] = "m"

        @cached_property
        def area(self) -> float:
            return self.length * self.radius

    @dataclass(frozen=True, kw_only=True)
    class Tube(Rod):
        thickness: float
        radius: float = 0.7

        def __post_init__(self) -> None:
            if self.thickness > self.radius:
                raise ValueError("a wall thicker than the radius")

    @dataclass(frozen=True)
    class Point:
        x: float
        put: float = 2.0  # which might be a name within `__init__`
        default_x: float = 3.0

    @dataclass(frozen=True)
    class Alone:
        value: object

    @dataclass(frozen=True)
    class Empty: ...

    @dataclass(frozen=True, eq=False)
    class Itself:
        value: float

    @dataclass(frozen=True, repr=False)
    class Own:
        value: float

        def __repr__(self) -> str:
            return "own"

        def __eq__(self, other: object) -> bool:
            return isinstance(other, type(self))

        def __hash__(self) -> int:
            return 7

    @dataclass(frozen=True)
    class Equal:
        value: float

        def __eq__(self, other: object) -> bool:
            return True

    class Heir(Point):
        """Not a dataclass itself."""

    @dataclass
    class Open:
        value: float

    @dataclass(frozen=True, order=True)
    class Ordered:
        value: float

    return SimpleNamespace(**{key: value for key, value in locals().items() if isinstance(value, type)})


OURS, THEIRS = classes(dataclass), classes(dataclasses.dataclass)
MADE: dict[str, Callable[[Any], list[Any]]] = {
    "Rod": lambda cls: [
        cls(1.0),
        cls(1.0, ["a"]),
        cls(1.0, [], 0.7),
        cls(length=2.0, hidden=1.0),
        cls(1.0, hidden=4.0),
    ],
    "Tube": lambda cls: [cls(1.0, thickness=0.1), cls(length=1.0, thickness=0.1, radius=2.0)],
    "Point": lambda cls: [cls(1.0), cls(1.0, 2.0), cls(1.0, put=5.0, default_x=1.0)],
    "Alone": lambda cls: [cls(1), cls((1, 2)), cls(1.0)],
    "Empty": lambda cls: [cls()],
    "Itself": lambda cls: [cls(1.0), cls(1.0)],
    "Own": lambda cls: [cls(1.0), cls(2.0)],
    "Equal": lambda cls: [cls(1.0), cls(2.0)],
    "Heir": lambda cls: [cls(1.0), cls(1.0, 3.0)],
    "Open": lambda cls: [cls(1.0), cls(1.0)],
    "Ordered": lambda cls: [cls(1.0), cls(2.0)],
}


def said(work: Callable[..., object], *given: Any, **named: Any) -> object:
    """What it returns, or the type and text of what it raises."""
    try:
        return work(*given, **named)
    except Exception as error:
        return type(error), str(error)


def shown(value: object) -> object:
    """Of an instance what it holds."""
    return value if isinstance(value, tuple) else vars(value)


@pytest.mark.parametrize("name", MADE)
def test_instances_are_made_shown_compared_and_replaced_as_by_the_standard_library(name: str) -> None:
    ours, theirs = getattr(OURS, name), getattr(THEIRS, name)
    assert str(inspect.signature(ours)) == str(inspect.signature(theirs))
    assert ours.__init__.__qualname__ == theirs.__init__.__qualname__
    assert [item.name for item in fields(ours)] == [item.name for item in fields(theirs)]
    assert ours.__match_args__ == theirs.__match_args__
    mine, twins = MADE[name](ours), MADE[name](theirs)
    assert [*map(vars, mine)] == [*map(vars, twins)]
    if name != "Itself":
        assert [*map(repr, mine)] == [*map(repr, twins)]
    assert [[a == b for a in mine] for b in mine] == [[a == b for a in twins] for b in twins]
    assert [[a != b for a in mine] for b in mine] == [[a != b for a in twins] for b in twins]
    assert all(a != b for a in mine for b in twins if name not in ("Equal", "Own"))
    if name not in ("Itself", "Equal"):  # whose hashes are those of objects
        assert [said(hash, instance) for instance in mine] == [said(hash, instance) for instance in twins]
    assert (ours.__hash__ is None) == (theirs.__hash__ is None)
    changed = fields(ours)[0].name if fields(ours) else "other"
    for own, twin in zip(mine, twins, strict=True):
        assert shown(said(replace, own, **{changed: 9.0})) == shown(said(replace, twin, **{changed: 9.0}))
        assert vars(copy.deepcopy(own)) == vars(own)
        assert dataclasses.asdict(own) == dataclasses.asdict(twin)
        for name_of_field in (changed, "other"):
            assert said(setattr, own, name_of_field, 5.0) == said(setattr, twin, name_of_field, 5.0)
            assert vars(own) == vars(twin)
            assert said(delattr, own, name_of_field) == said(delattr, twin, name_of_field)
            assert vars(own) == vars(twin)


@pytest.mark.parametrize(
    ("name", "given"),
    [
        ("Rod", {}),
        ("Rod", {"length": 1.0, "count": 2}),
        ("Tube", {"length": 1.0}),
        ("Tube", {"length": 1.0, "thickness": 9.0}),
        ("Point", {"y": 1.0}),
        ("Empty", {"a": 1}),
    ],
)
def test_what_does_not_fit_is_refused_in_the_same_words(name: str, given: dict[str, object]) -> None:
    ours, theirs = (said(getattr(kind, name), **given) for kind in (OURS, THEIRS))
    assert ours == theirs


@pytest.mark.parametrize("frozen", [True, False])
@pytest.mark.parametrize("base", ["Point", "Tube", "Open", "Ordered"])
@pytest.mark.parametrize("heir", [dataclass, dataclasses.dataclass])
def test_classes_of_both_kinds_inherit_from_each_other(base: str, heir: Callable[..., Any], frozen: bool) -> None:
    def inherited(heir: Callable[..., Any], parent: type) -> object:
        made = heir(frozen=frozen)(type("Heir", (parent,), {"__annotations__": {"more": float}, "more": 1.0}))
        return [item.name for item in fields(made)], made.__dataclass_params__.frozen

    assert said(inherited, heir, getattr(OURS, base)) == said(inherited, dataclasses.dataclass, getattr(THEIRS, base))
    assert getattr(OURS, base).__dataclass_params__.frozen == getattr(THEIRS, base).__dataclass_params__.frozen


@pytest.mark.parametrize("given", [field(hash=False, default=1.0), dataclasses.InitVar])
def test_what_only_the_standard_library_knows_is_refused(given: Any) -> None:
    kind = given[float] if given is dataclasses.InitVar else float
    body = {"__annotations__": {"value": kind}, "value": 1.0 if given is dataclasses.InitVar else given}
    with pytest.raises(TypeError, match=r"which only dataclasses\.dataclass knows"):
        dataclass(frozen=True)(type("Other", (), body))


def test_defaults_are_made_for_each_and_computed_properties_are_kept() -> None:
    first, second = OURS.Rod(2.0), OURS.Rod(2.0)
    assert first.names is not second.names
    assert first.made is not second.made
    assert first.area == 1.0
    assert "area" in vars(first)
    with pytest.raises(FrozenInstanceError, match="cannot assign to field 'area'"):
        first.area = 3.0


@dataclass(frozen=True)
class Link:
    """At the top of a module, as pickle needs it."""

    others: list[Any]


def test_instances_are_pickled_and_may_hold_themselves() -> None:
    link = Link([1.0])
    assert pickle.loads(pickle.dumps(link)) == link
    link.others.append(link)
    assert repr(link) == "Link(others=[1.0, ...])"

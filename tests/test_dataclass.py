"""Our dataclasses behave as frozen ones of the standard library."""

import dataclasses
import pickle
from dataclasses import FrozenInstanceError, field, replace
from functools import cached_property
from typing import Any

import pytest

from rodshell.dataclass import dataclass


@dataclass(frozen=True)
class Point:
    """A point."""

    x: float
    y: float = 0.0
    names: list[str] = field(default_factory=list, repr=False, compare=False)
    length: float = field(default=-1.0, init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "length", abs(self.x) + abs(self.y))

    @cached_property
    def doubled(self) -> float:
        return 2 * self.x


@dataclass(frozen=True, kw_only=True)
class Named(Point):
    """A point with a name."""

    title: str
    place: int = 3


@dataclass(frozen=True, eq=False, repr=False)
class Own:
    """It has its own words."""

    x: float

    def __repr__(self) -> str:
        return "mine"


@dataclass(frozen=True)
class OwnEquality:
    """Equal to all others, and of one hash."""

    x: float

    def __eq__(self, other: object) -> bool:
        return True

    def __hash__(self) -> int:
        return 7


@dataclass(frozen=True, order=True)
class Ordered:
    """In the order of its fields."""

    x: float


def theirs(ours: type[Any], bases: tuple[type, ...] = (), **options: bool) -> Any:
    """The same class, by the standard library."""
    body = {name: vars(ours)[name] for name in ("__annotations__", "__module__", "__qualname__") if name in vars(ours)}
    body |= {
        name: known if known.default_factory is not dataclasses.MISSING or not known.init else known.default
        for name, known in ours.__dataclass_fields__.items()
        if name in body["__annotations__"] and (known.default, known.default_factory) != (dataclasses.MISSING,) * 2
    }
    body |= {"__post_init__": ours.__post_init__} if "__post_init__" in vars(ours) else {}
    return dataclasses.dataclass(frozen=True, **options)(type(ours.__name__, bases, body))


def test_values_words_and_equality_are_those_of_the_standard_library() -> None:
    their_point = theirs(Point)
    their_named = theirs(Named, (their_point,), kw_only=True)
    for ours, their in ((Point, their_point), (Named, their_named)):
        more = {"title": "a"} if ours is Named else {}
        made = [(kind(1.0, **more), kind(1.0, -2.5, names=["b"], **more)) for kind in (ours, their)]
        for us, them in zip(*made, strict=True):
            assert dataclasses.asdict(us) == dataclasses.asdict(them)
            assert repr(us) == repr(them)
            assert hash(us) == hash(them)
            assert us != them
        (a, b), _ = made
        assert a == replace(b, y=0.0) != b  # names are not compared
        assert ours.__match_args__ == their.__match_args__
    assert Point(1.0).names is not Point(1.0).names
    assert Point(1.0) != Named(1.0, title="a")


def test_fields_cannot_be_changed() -> None:
    point = Point(1.0)
    with pytest.raises(FrozenInstanceError, match="cannot assign to field 'x'"):
        point.x = 2.0  # type: ignore[misc]
    with pytest.raises(FrozenInstanceError, match="cannot delete field 'x'"):
        del point.x
    assert (point.x, point.doubled, point.doubled) == (1.0, 2.0, 2.0)


@pytest.mark.parametrize(("given", "more"), [((), {}), ((1.0, 2.0, [], 3.0), {}), ((1.0,), {"length": 3.0})])
def test_wrong_arguments_are_refused(given: tuple[Any, ...], more: dict[str, Any]) -> None:
    with pytest.raises(TypeError, match=r"Point.__init__\(\)"):
        Point(*given, **more)


def test_what_a_class_defines_itself_stays() -> None:
    assert repr(Own(1.0)) == "mine"
    assert Own(1.0) != Own(1.0)
    assert (OwnEquality(1.0) == 3, hash(OwnEquality(1.0))) == (True, 7)
    assert Ordered(1.0) < Ordered(2.0)


def test_they_are_copied_and_pickled() -> None:
    named = Named(1.0, 2.0, ["b"], title="a")
    again = pickle.loads(pickle.dumps(named))
    assert (again, again.names, again.place) == (named, ["b"], 3)
    assert replace(named, x=5.0).length == 7.0

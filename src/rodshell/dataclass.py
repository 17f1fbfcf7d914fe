"""`dataclass` of the standard library, declared in a quarter of the time.

The standard library writes and compiles five or six functions for each frozen class, which took a sixth of a short
command. Only `__init__` has to be written for each; the others are the same functions for all classes. Fields,
`replace` and all else are those of the standard library, and a type checker sees its decorator.
"""

import dataclasses
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import MISSING, FrozenInstanceError, fields
from functools import cache
from operator import attrgetter
from reprlib import recursive_repr
from typing import TYPE_CHECKING, Any, cast

if TYPE_CHECKING:
    from dataclasses import dataclass as dataclass
else:

    def dataclass(cls=None, /, *, frozen=False, eq=True, repr=True, kw_only=False, **options):
        """As `dataclasses.dataclass`, which declares classes that are not frozen or have other options."""
        if options or not frozen:
            return dataclasses.dataclass(cls, frozen=frozen, eq=eq, repr=repr, kw_only=kw_only, **options)

        def declare(cls):
            return _declared(cls, eq=eq, repr=repr, kw_only=kw_only)

        return declare if cls is None else declare(cls)


def _declared(cls: type, *, eq: bool, repr: bool, kw_only: bool) -> type:
    """The class as a frozen dataclass, with what it defines itself."""
    given = dict(vars(cls))
    cls.__doc__ = cls.__doc__ or cls.__name__  # else the standard library asks for the signature
    with _thawed(cls):
        cls = dataclasses.dataclass(cls, init=False, repr=False, eq=False, kw_only=kw_only)
    vars(cls)["__dataclass_params__"].frozen = True
    known = vars(cls)["__dataclass_fields__"].values()
    if any(field.hash is not None or field._field_type.name == "_FIELD_INITVAR" for field in known):
        raise TypeError(f"{cls.__name__} has an InitVar or a field with hash=, which only dataclasses.dataclass knows")
    methods: dict[str, Any] = {"__init__": _init(cls), "__setattr__": _set, "__delattr__": _delete}
    methods |= {"__repr__": _repr} if repr else {}
    methods |= {"__eq__": _equal, "__hash__": _hash} if eq else {}
    if given.get("__hash__", 0) is None:  # as Python sets it where only `__eq__` is defined
        del given["__hash__"]
    for name, method in methods.items():
        if name not in given:
            setattr(cls, name, method)
    return cls


@contextmanager
def _thawed(cls: type) -> Iterator[None]:
    """The classes that it inherits from pass as not frozen meanwhile, as it does; they must be frozen."""
    bases = [vars(base)["__dataclass_params__"] for base in cls.__mro__[1:] if "__dataclass_params__" in vars(base)]
    if not all(base.frozen for base in bases):
        raise TypeError("cannot inherit frozen dataclass from a non-frozen one")
    for base in bases:
        base.frozen = False
    try:
        yield
    finally:
        for base in bases:
            base.frozen = True


def _init(cls: type) -> Callable[..., None]:
    """Its `__init__`, with the signature and annotations that the standard library gives it."""
    known: dict[str, Any] = {"__put__": object.__setattr__, "__made__": MADE}
    first, named, lines = ["self"], list[str](), list[str]()
    for field in fields(cls):
        name, value = field.name, field.name
        if field.default_factory is not MISSING:
            known[f"__make_{name}__"] = field.default_factory
            value = f"__make_{name}__()"
            value += f" if {name} is __made__ else {name}" if field.init else ""
        if field.init:
            default = field.default if field.default_factory is MISSING else MADE
            known[f"__default_{name}__"] = default
            (named if field.kw_only else first).append(name if default is MISSING else f"{name}=__default_{name}__")
        if field.init or value != name:
            lines.append(f"__put__(self, {name!r}, {value})")
    if hasattr(cls, "__post_init__"):
        lines.append("self.__post_init__()")
    parameters = ", ".join([*first, *(["*", *named] if named else [])])
    exec(f"def __init__({parameters}):\n " + "\n ".join(lines or ["pass"]), known)
    made: Any = known["__init__"]
    made.__module__, made.__qualname__ = cls.__module__, f"{cls.__qualname__}.__init__"
    made.__annotations__ = {field.name: field.type for field in fields(cls) if field.init} | {"return": None}
    return cast("Callable[..., None]", made)


class _Made:
    """Stands for a default that is made for each instance, in signatures."""

    def __repr__(self) -> str:
        return "<factory>"


MADE = _Made()


def _set(self: Any, name: str, value: object) -> None:
    _refuse("assign to", self, name)
    object.__setattr__(self, name, value)


def _delete(self: Any, name: str) -> None:
    _refuse("delete", self, name)
    object.__delattr__(self, name)


def _refuse(what: str, instance: Any, name: str) -> None:
    """Any attribute of a dataclass; of a class that inherits from one, its fields."""
    if "__dataclass_fields__" in vars(type(instance)) or name in instance.__dataclass_fields__:
        raise FrozenInstanceError(f"cannot {what} field {name!r}")


@recursive_repr()
def _repr(self: Any) -> str:
    shown = ", ".join(f"{field.name}={getattr(self, field.name)!r}" for field in fields(self) if field.repr)
    return f"{type(self).__qualname__}({shown})"


def _equal(self: Any, other: object) -> Any:
    if type(self) is not type(other):
        return NotImplemented
    cls: Any = type(self)
    return _compared(cls)(self) == _compared(cls)(other)


def _hash(self: Any) -> int:
    cls: Any = type(self)
    return hash(_compared(cls)(self))


@cache
def _compared(cls: type) -> Callable[[Any], tuple[object, ...]]:
    """What gives the values of an instance that are compared."""
    names = [field.name for field in fields(cls) if field.compare]
    return attrgetter(*names) if len(names) > 1 else lambda instance: tuple(getattr(instance, name) for name in names)

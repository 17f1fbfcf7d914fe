"""Frozen dataclasses whose methods are not compiled for each class: declared in a third of the time that those of the
standard library take, which a command that ends in two seconds would notice, as there are two hundred of them."""

import dataclasses
from collections.abc import Callable
from dataclasses import MISSING, FrozenInstanceError, fields
from typing import TYPE_CHECKING, Any, NoReturn

if TYPE_CHECKING:
    from dataclasses import dataclass as dataclass
else:

    def dataclass(cls=None, /, *, frozen=False, eq=True, repr=True, kw_only=False, order=False):
        """As `dataclasses.dataclass`."""

        def declared(cls):
            if not frozen or order:
                return dataclasses.dataclass(cls, frozen=frozen, eq=eq, repr=repr, kw_only=kw_only, order=order)
            return _frozen(cls, eq=eq, repr=repr, kw_only=kw_only)

        return declared if cls is None else declared(cls)


def _frozen(cls: type[Any], *, eq: bool, repr: bool, kw_only: bool) -> type[Any]:
    written = {name for name, method in vars(cls).items() if method is not None}
    made = dataclasses.dataclass(init=False, repr=False, eq=False, kw_only=kw_only)(cls)
    methods: dict[str, Any] = {"__init__": _init(made), "__setattr__": _refuse, "__delattr__": _refuse}
    methods |= {"__repr__": _repr} if repr else {}
    methods |= {"__eq__": _equal, "__hash__": _hash} if eq else {}
    for name, method in methods.items():
        if name not in written:
            setattr(made, name, method)
    return made


def _init(cls: type[Any]) -> Callable[..., None]:
    """The only method that is compiled."""
    known: dict[str, Any] = {"_absent": MISSING}
    given, lines = {False: list[str](), True: list[str]()}, ["_own = self.__dict__"]
    for field in fields(cls):
        name, default = field.name, f"_default_{field.name}"
        factory, value, word = field.default_factory, name, name
        if factory is not MISSING:
            known[default] = factory
            value, word = f"{default}() if {name} is _absent else {name}", f"{name}=_absent"
        elif field.default is not MISSING:
            known[default] = field.default
            word = f"{name}={default}"
        if field.init:
            given[bool(field.kw_only)].append(word)
        else:
            value = f"{default}()" if factory is not MISSING else default
        lines.append(f"_own[{name!r}] = {value}")
    if hasattr(cls, "__post_init__"):
        lines.append("self.__post_init__()")
    words = ", ".join(["self", *given[False], *(["*"] if given[True] else []), *given[True]])
    exec("\n ".join([f"def __init__({words}):", *lines]), known)
    init: Callable[..., None] = known["__init__"]
    init.__qualname__ = f"{cls.__qualname__}.__init__"
    init.__annotations__ = {field.name: field.type for field in fields(cls) if field.init} | {"return": None}
    return init


def _refuse(self: object, name: str, *value: object) -> NoReturn:
    raise FrozenInstanceError(f"cannot {'assign to' if value else 'delete'} field {name!r}")


def _repr(self: Any) -> str:
    shown = ", ".join(f"{field.name}={getattr(self, field.name)!r}" for field in fields(self) if field.repr)
    return f"{type(self).__qualname__}({shown})"


def _compared(record: Any) -> tuple[object, ...]:
    return tuple(getattr(record, field.name) for field in fields(record) if field.compare)


def _equal(self: object, other: object) -> bool:
    return _compared(self) == _compared(other) if type(other) is type(self) else NotImplemented


def _hash(self: object) -> int:
    return hash(_compared(self))

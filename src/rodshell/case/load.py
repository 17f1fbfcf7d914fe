"""From a name, a file, a text or a mapping, and changed keys, to a complete case or one clear sentence."""

import re
import warnings
from collections.abc import Callable, Iterator, Mapping
from copy import deepcopy
from dataclasses import replace
from difflib import get_close_matches
from functools import partial
from itertools import permutations
from os import PathLike
from pathlib import Path
from typing import Any

from rodshell.case.case import UNDESCRIBED, Case
from rodshell.case.keys import (
    BY_KIND,
    case_keys,
    case_tables,
    file_keys,
    not_a_table,
    unknown_key,
    unknown_path,
)
from rodshell.case.stage_tables import IDLE
from rodshell.case.tables import TEXT, plain, toml_of
from rodshell.errors import InputError
from rodshell.quantities import Polylines, Unit
from rodshell.rods.section import SectionKeys
from rodshell.schema import read, value_of, written
from rodshell.units import shown
from rodshell.untrusted import read_text
from rodshell.validation import file_path, instance, is_auto

_Raw = dict[str, Any]


def _paper(rods: tuple[int, int]) -> _Raw:
    """A grid of the paper [HQK section 3.1] with so many rods along x and y."""
    grid = {"rods": rods, "spacing": 0.03, "length": 1.2, "edge": 0.005}
    return {"layout": grid, "rod": {"section": {"radius": 0.001}, "material": {"youngs_modulus": 1e6}}}


BUILT_IN: dict[str, _Raw] = {
    "hemisphere": _paper((17, 17)),
    "paraboloid": _paper((15, 15)),
    "ellipsoid": _paper((11, 15)),
    "cap": _paper((17, 17)),
    "heightfield": {},
    "pavilion": {
        "target": {"kind": "paraboloid", "radius": 6.0, "height": 3.0},
        "layout": {"spacing": 0.8},
        "rod": {"section": {"kind": "tube", "radius": 0.016, "thickness": 0.003}, "material": {"preset": "gfrp"}},
        "drawings": {"name": "pavilion"},
    },
}
"""The cases that need no file, except one named like their target's kind; the tables' defaults give the rest.

The pavilion is a shell to stand under: 12 m wide, of GFRP tubes that stay below their permanent design strength.
"""

WORDED = tuple(path for path in case_keys() if path in case_tables())  # tables that words may stand for
INSTEAD = (("rod.material", "shear", "poisson_ratio"), *((path, "radius", "diameter") for path in WORDED))
"""Of a table two keys of which only one can be given: one from an option goes before the other from the case."""

BY_SUFFIX = dict.fromkeys((".obj", ".stl", ".ply", ".off", ".glb", ".gltf", ".json"), "mesh")
BY_SUFFIX |= dict.fromkeys((".3dm", ".step", ".stp"), "nurbs")
BY_SUFFIX |= dict.fromkeys((".csv", ".png", ".pgm", ".jpg", ".jpeg", ".tif", ".tiff"), "heights")
"""Kinds of targets by the file that holds them: the file alone is a case."""

_CASE_FILE = ".toml"
FILES = f"a case ({_CASE_FILE}) or a surface ({', '.join(BY_SUFFIX)})"
FILE_KEYS = file_keys()

TABLES_OF_RODS = ("rod", "joint", "checks", "fabrication", "drawings")
"""What a case about a table of rods has, in place of a target with its layout and drape."""

RENAMED: dict[str, str] = {"refine.offer": ""}
"""Keys that were called otherwise in the last version, old -> new: still read, with a warning, for this version; ""
stands for one that is gone."""


_UNDESCRIBED_BEFORE = (
    re.compile(r"# no case file can give (.+) again"),
    re.compile(r"# the target was (.+): no case file can give it again"),
)
"""The one comment that earlier versions kept in place of a case with `UNDESCRIBED`."""

_NOT_A_WORD = "the keys of a case are words such as target.radius, not {}"


class RenamedKeyWarning(FutureWarning):
    """A case has a key by its old name, which the next version will not know."""


def load_case(
    source: "str | PathLike[str] | Mapping[str, object] | None",
    overrides: Mapping[str, object] | None = None,
    *,
    otherwise: Mapping[str, _Raw] | None = None,
    files: Callable[[object], str] | None = None,
) -> Case:
    """The case of this name, in this file or with this content, with some keys changed.

    Args:
        source: one of `BUILT_IN`; the path of a TOML file, or of a surface (`BY_SUFFIX`); the text of a TOML file; its
            content as a mapping, in which dots may stand for tables in tables; None: an empty case.
        overrides: values by dotted key, {"target.radius": "250 mm"}; as in a file, or as text. Another `kind`
            keeps those keys of its table that it has too.
        otherwise: tables that stand in for those that the case does not have.
        files: for a case of somebody who may not name any file: gives the path for the value of each key that names
            one, or raises InputError.

    Raises:
        InputError: no such case or file, not TOML, an unknown key, a value that cannot be used, the case of an object
            that no case file can describe; in one sentence.
    """
    overrides = dict(plain(overrides or {}))
    raw = _raw_of(source)
    if UNDESCRIBED in raw:
        what = raw[UNDESCRIBED]
        raise InputError(
            f"this case cannot be run again: no case file can describe {what}: keep the Python that makes it"
        )
    raw = {**deepcopy(dict(otherwise or {})), **raw}
    if isinstance(source, str | PathLike) and str(source) in BUILT_IN:
        layout = raw.get("layout", {})
        for key in ("rods", "length") if {"seams.lines", "seams.file"} & overrides.keys() else ():
            layout.pop(key, None)  # of the whole; what seams cut has them from its patches
        for key in ("spacing", "edge") if overrides.get("layout.kind") == "curves" else ():
            layout.pop(key, None)  # those of the paper's grid; the lines have their own
        if overrides.get("drape.method") == "paper":
            layout.pop("edge", None)  # 5 mm as the paper states; its falls had longer ones, as any fall has (E21)
    return _validated(raw, overrides, files)


def is_described(path: Path) -> bool:
    """Whether the case file kept with a result describes all that the result was made of."""
    return UNDESCRIBED not in _raw_of(path)


def changed_case(case: Case, overrides: Mapping[str, object]) -> Case:
    """The same case with some keys changed, as `load_case` does.

    Raises:
        InputError: as of `load_case`; also a key of a table that was made from an object which keys do not describe.
    """
    held = case.held_objects
    if case.of_table:
        require_keys_of_rods(overrides)
    for path in overrides:
        table = path.partition(".")[0]
        if table in held and path in case_keys():
            raise InputError(
                f"{path} cannot be changed: it is {held[table].what}, which no key describes: make a new job of "
                "another object"
            )
    tables = {name: plain(table) for name, table in written(case).items() if name not in held}
    changed = _validated(tables, plain(dict(overrides)))
    return replace(changed, **{name: getattr(case, name) for name in held})


def require_keys_of_rods(changes: Mapping[str, object]) -> None:
    """InputError for a key that a table of rods does not use; unknown keys are left to the case."""
    for path, value in changes.items():
        if path in case_keys() and path.partition(".")[0] not in TABLES_OF_RODS:
            raise InputError(
                f"{path} = {shown(value)}: a table of rods does not use this key: leave it out, or change one of "
                f"{', '.join(f'[{name}]' for name in TABLES_OF_RODS)}"
            )


def flattened(changes: Mapping[str, object]) -> dict[str, object]:
    """Values by dotted key, from a mapping in which tables may be mappings, dots, or double underscores."""

    def leaves(prefix: str, table: Mapping[str, object]) -> Iterator[tuple[str, object]]:
        for name, value in table.items():
            if not isinstance(name, str):
                raise InputError(_NOT_A_WORD.format(shown(name)))
            path = prefix + name.replace("__", ".")
            if isinstance(value, Mapping) and path in case_tables():
                yield from leaves(f"{path}.", value)
            else:
                yield path, value

    return dict(leaves("", changes))


def _validated(raw: _Raw, overrides: dict[str, object], files: Callable[[object], str] | None = None) -> Case:
    """The case of tables as they were read, with some keys changed."""
    _rename(raw, overrides)
    _read_loads(raw, overrides)
    _read_words(raw, overrides)
    for path in case_tables():
        if not isinstance(_table(raw, path), dict):
            raise InputError(not_a_table(path, _table(raw, path)))
    section = raw["rod"]["section"]
    if section.get("kind") == "auto" and any(key.startswith("rod.section.") for key in overrides):
        del section["kind"]
    for path, kind in BY_KIND.items():
        table = _table(raw, path)
        if path == "rod.section" and (table or any(key.startswith("rod.section.") for key in overrides)):
            kind = "circle"
        if path == "bracing.section" and not (table or any(key.startswith(f"{path}.") for key in overrides)):
            continue
        table.setdefault("kind", kind)
    _drop_for_another_kind(raw, overrides)
    for path, value in overrides.items():
        if path in case_tables():
            raise InputError(not_a_table(path, value))
        if path not in case_keys():
            raise InputError(unknown_path(path, value, raw))
        table, _, key = path.rpartition(".")
        _table(raw, table)[key] = value
    raw["bracing"] = {key: value for key, value in raw["bracing"].items() if value is not None and value != {}}
    _read_seams(raw["seams"], files)
    _read_drawn_rods(raw["layout"], files)
    return read(Case, raw, unknown=partial(unknown_key, raw), files=files)


def _rename(raw: _Raw, overrides: dict[str, object]) -> None:
    """Give keys that stand under their old names their new ones, with a warning each."""
    for old, new in RENAMED.items():
        old_table, _, old_name = old.rpartition(".")
        new_table, _, new_name = new.rpartition(".")
        table = _found_table(raw, old_table)
        if old in overrides or old_name in table:
            said = f"is now called {new}: rename it" if new else "is no longer read: leave it out"
            warnings.warn(f"the key {old} {said}", RenamedKeyWarning, stacklevel=2)
        if not new:
            overrides.pop(old, None)
            table.pop(old_name, None)
        if old in overrides:
            overrides.setdefault(new, overrides.pop(old))
        if old_name in table:
            _table(raw, new_table).setdefault(new_name, table.pop(old_name))
            if not table and old_table not in case_tables():
                del raw[old_table]


def _read_words(raw: _Raw, overrides: dict[str, object]) -> None:
    """Put keys in the place of sections in words: rod = "tube 32x3" is rod.section = { kind = "tube", ... }."""
    if isinstance(raw.get("rod"), str):
        raw["rod"] = {"section": raw["rod"]}
    if isinstance(overrides.get("rod"), str):
        overrides.setdefault("rod.section", overrides.pop("rod"))
    for path in WORDED:
        table, _, name = path.rpartition(".")
        inner = _found_table(raw, table)
        if isinstance(inner.get(name), str):
            inner[name] = _in_keys(path, inner[name])
        if isinstance(overrides.get(path), str):
            for key, value in _in_keys(path, str(overrides.pop(path))).items():
                overrides.setdefault(f"{path}.{key}", value)


def _in_keys(path: str, words: str) -> _Raw:
    """A section in words by its keys; "auto" is left to the target."""
    return {"kind": words} if is_auto(words) else dict(value_of(SectionKeys, path, words))


_LOAD_TABLES = ("loads", "combinations", "bracing", "locked_joints", "stability", "strength")
"""What a file of loads may have; it replaces all of these that the case has."""


def _read_loads(raw: _Raw, overrides: dict[str, object]) -> None:
    """Put the tables of a file of loads, that an override names, in the place of the case's."""
    name = overrides.get("loads")
    if not isinstance(name, str | PathLike):
        return
    path, wanted = file_path("loads", name), "give a TOML file with [[loads]] and [[combinations]]"
    if not path.exists():
        raise InputError(f"loads = {shown(str(name))}: there is no such file: {wanted}")
    del overrides["loads"]
    given = _read(path)
    for key in given:
        if key not in _LOAD_TABLES:
            raise InputError(f"{name} has {shown(key)}, which no file of loads has: it has {', '.join(_LOAD_TABLES)}")
    if "loads" not in given:
        raise InputError(f"{name} has no loads: {wanted}")
    for key in _LOAD_TABLES:
        raw.pop(key, None)
    raw |= given


def _read_seams(table: _Raw, files: Callable[[object], str] | None) -> None:
    """Put the lines of the file of seams into the case, which then needs the file no longer."""
    name = table.get("file")
    if name is None:
        return
    from rodshell.targets.curve_files import read_lines  # here, as most cases have no such file

    unit = value_of(Unit, "seams.unit", table.pop("unit", 1.0))
    given = value_of(Polylines, "seams.lines", table.get("lines", ()))
    try:
        drawn = read_lines(file_path("the file", name if files is None else files(name)), unit)
    except InputError as reason:
        raise InputError(f"seams.file = {shown(name)}: {reason}") from None
    del table["file"]
    table["lines"] = [*given, *(line[:, :2].tolist() for line in drawn)]


def _read_drawn_rods(table: _Raw, files: Callable[[object], str] | None) -> None:
    """Put the lines of a file of drawn rods into the case, which then needs the file no longer."""
    name = table.get("file")
    if name is None or table.get("kind") != "curves":
        return
    from rodshell.case.drawn_rods import read_drawn_rods  # here, as most cases have no such file

    if "lines" in table or "names" in table:
        raise InputError("layout.lines and layout.names are those of layout.file: leave out one or the other")
    unit = value_of(Unit, "layout.unit", table.pop("unit", 1.0))
    try:
        drawn = read_drawn_rods(file_path("the file", name if files is None else files(name)), unit)
    except InputError as reason:
        raise InputError(f"layout.file = {shown(name)}: {reason}") from None
    del table["file"]
    table |= {"lines": list(drawn.values()), "names": list(drawn)}


def _found_table(raw: _Raw, path: str) -> _Raw:
    """The table at a dotted path; empty where there is none."""
    inner: Any = raw
    for name in path.split("."):
        inner = inner.get(name, {}) if isinstance(inner, dict) else {}
    return inner if isinstance(inner, dict) else {}


def _table(raw: _Raw, path: str) -> Any:
    """The table at a dotted path, made where it is missing."""
    inner: Any = raw
    for name in path.split(".") if path else ():
        inner = inner.setdefault(name, {})
    return inner


def _drop_for_another_kind(raw: _Raw, overrides: Mapping[str, object]) -> None:
    """Where an override sets another kind (or domain), drop what was given for the old one alone."""
    for path in BY_KIND:
        kind, table = overrides.get(f"{path}.kind"), _table(raw, path)
        if kind is not None and kind != table["kind"]:
            for key in case_keys().values():
                if key.table == path and key.kinds and kind not in key.kinds:
                    table.pop(key.name, None)
    if "rod.material.preset" in overrides:
        raw["rod"]["material"] = {}
    for table, *names in INSTEAD:
        for name, instead in permutations(names):
            if overrides.get(f"{table}.{name}") is not None and f"{table}.{instead}" not in overrides:
                _found_table(raw, table).pop(instead, None)
    method = overrides.get("drape.method")
    if method is not None and method != raw["drape"].get("method", "bound"):
        for name in IDLE.get(str(method), ()):
            raw["drape"].pop(name, None)
    domain, target = overrides.get("target.domain"), raw["target"]
    if domain is not None and domain != target.get("domain", "disc"):
        for name in ("radius", "size"):
            target.pop(name, None)


def _raw_of(source: "str | PathLike[str] | Mapping[str, object] | None") -> _Raw:
    """The tables of a source, their keys as they stand there."""
    if source is None:
        return {}
    if isinstance(source, Mapping):
        return _nested(plain(source))
    instance("the case", source, str | PathLike, "the name of a built-in case, a path, text, or a mapping")
    name = str(source)
    if not name.strip():
        raise InputError(f"the name of the case is empty: give a case file, a surface, or one of {', '.join(BUILT_IN)}")
    if name in BUILT_IN:
        return {"target": {"kind": name}, **deepcopy(BUILT_IN[name])}
    if isinstance(source, str) and ("\n" in source or ("=" in source and not _is_path(source))):
        return _parsed("the text", source)
    path = file_path("the case", source)
    if kind := BY_SUFFIX.get(path.suffix.lower()):
        return {"target": {"kind": kind, "file": name}}
    if path.is_dir():
        raise InputError(f"{name} is a folder: give {_wanted_in(path)}")
    if not path.exists():
        near = get_close_matches(name, BUILT_IN, n=1)
        hint = f"did you mean {near[0]}?" if near else f"give a case file, a surface, or one of {', '.join(BUILT_IN)}"
        raise InputError(f"there is no case and no file named {shown(name)}: {hint}")
    return _from_its_folder(path, _read(path))


def _is_path(text: str) -> bool:
    """Whether there is such a file or folder."""
    try:
        return file_path("the case", text).exists()
    except InputError:
        return False


def _read(path: Path) -> _Raw:
    """The tables of a case file."""
    wrong_type = _unknown_type(path)
    return _parsed(str(path), read_text(path, TEXT, instead=wrong_type or "save it as UTF-8"), wrong_type)


def _parsed(name: str, text: str, wrong_type: str = "") -> _Raw:
    raw: _Raw = plain(toml_of(name, text, wrong_type))
    if not raw:
        for comment in _UNDESCRIBED_BEFORE:
            if found := comment.fullmatch(text.strip()):
                return {UNDESCRIBED: found[1]}
    return raw


def _nested(mapping: Mapping[str, object]) -> _Raw:
    """A mapping as TOML gives it: tables in tables, where a key may also have dots."""
    raw: _Raw = {}
    for path, value in mapping.items():
        if not isinstance(path, str):
            raise InputError(_NOT_A_WORD.format(shown(path)))
        table, _, name = path.rpartition(".")
        inner = _table(raw, table) if table else raw
        if not isinstance(inner, dict):
            raise InputError(not_a_table(table, inner))
        if isinstance(value, Mapping):
            inner[name] = {**inner.get(name, {}), **_nested(value)}
        else:
            inner[name] = value
    return raw


def _unknown_type(path: Path) -> str:
    """What is wrong with a file that holds no case, if its name does not say that it does."""
    if path.suffix.lower() in ("", _CASE_FILE):
        return ""
    return f"unknown file type {path.suffix}; use {FILES}"


def _wanted_in(folder: Path) -> str:
    """The first file in a folder that could be meant, a case before a surface; without one, what could be."""
    files = sorted(path for path in folder.iterdir() if path.suffix.lower() in (_CASE_FILE, *BY_SUFFIX))
    files.sort(key=lambda path: path.suffix.lower() != _CASE_FILE)
    return f"a file in it, such as {files[0]}" if files else FILES


def _from_its_folder(path: Path, raw: _Raw) -> _Raw:
    """Files that a case names lie in its own folder, unless they are given from the root; of a shell's pipe, here."""
    folder = Path() if path.parent.parts[:2] in (("/", "dev"), ("/", "proc")) else path.parent
    for table, key in named_files(raw):
        table[key] = str(folder / table[key])
    return raw


def named_files(raw: _Raw) -> Iterator[tuple[_Raw, str]]:
    """Where the tables of a case name files to be read: the table and its key."""
    for name, keys in FILE_KEYS.items():
        table = raw.get(name)
        if isinstance(table, dict):
            yield from ((table, key) for key in keys if isinstance(table.get(key), str))

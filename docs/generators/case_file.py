"""The reference of the case file, read off its classes as a case file is: keys, help, values, bounds and defaults."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import MISSING, is_dataclass

from docs.generators.tables import first_paragraph, table
from rodshell.case.case import Case
from rodshell.rods.materials import Material
from rodshell.schema import Field, fields_of, kind_of
from rodshell.units import shown

HEAD = """# The case file

Every table and key of [a case file](../files.md#the-case-file). A key is also an option of `rodshell form`, such as
`--target.radius "6 m"`, unless its table is one of several in a row, `[[loads]]`. A plain number is in SI units.

"""


def page() -> str:
    return HEAD + "".join(_table(Case, field, field.name, 2, set()) for field in fields_of(Case))


def _table(owner: type, field: Field, path: str, depth: int, seen: set[type]) -> str:
    """The section of a table, or of tables in a row, and of the tables in it.

    Args:
        seen: classes that the page has described, with their tables.
    """
    if not field.tables:  # "loads" and the like may also be files, and are described with their rows
        return ""
    name = f"[[{path}]]" if field.rows else f"[{path}]"
    text = f"{'#' * depth} `{name}`\n\n" + (f"{_sentence(field.help)}\n\n" if field.help else "")
    inner = ""
    for classes in _alike(field.tables):
        kinds = [kind_of(each) for each in classes] if len(field.tables) > 1 else []
        if kinds:
            text += f"**`kind = {' or '.join(shown(kind) for kind in kinds)}`**"
            text += " (default)\n\n" if _default_kind(field) in kinds else "\n\n"
        for each in classes:
            said = first_paragraph(each)
            text += (f"{shown(kind_of(each))}: " if len(classes) > 1 else "") * bool(said) + f"{said}\n\n" * bool(said)
        rows = list(_rows(classes[0], path))
        text += table(("key", "meaning", "value", "default"), rows) + "\n" if rows else "No keys.\n\n" * bool(kinds)
        for inside in _tables_in(classes[0]):
            if not seen.issuperset(inside.tables):
                seen.update(inside.tables)
                inner += _table(classes[0], inside, f"{path}.{inside.name}", min(depth + 1, 4), seen)
    return text + inner


def _alike(tables: Sequence[type]) -> list[list[type]]:
    """Classes with the same keys together."""
    groups = dict[tuple[Field, ...], list[type]]()
    for each in tables:
        groups.setdefault(fields_of(each) or (each,), []).append(each)  # type: ignore[arg-type]
    return list(groups.values())


def _default_kind(field: Field) -> str:
    return "" if field.default is MISSING else kind_of(field.default)


def _tables_in(owner: type) -> Iterator[Field]:
    """Fields that are tables in the table; keys of an inline one stand in its owner's table."""
    for field in fields_of(owner):
        if not field.tables:
            continue
        if field.inline and not field.by_kind:
            yield from _tables_in(field.tables[0])
        else:
            yield field


def _rows(owner: type, path: str) -> Iterator[tuple[str, str, str, str]]:
    for field in fields_of(owner):
        if field.inline and not field.by_kind:
            yield from _rows(field.tables[0], path)
        elif field.inline:
            yield "`kind`, and its keys", _sentence(field.help), "a kind, below", _default(field)
        elif field.tables:
            yield f"`{field.name}`", _sentence(field.help), "a table, below", _default(field)
        else:
            default = "the preset's" if owner is Material and field.default is MISSING else _default(field)
            yield f"`{field.name}`", _sentence(field.help), accepted(field), default
            if field.twice:
                yield f"`{field.twice}`", f"Twice the {field.name}, in its place", accepted(field), ""


def accepted(field: Field) -> str:
    """What a key takes, in the words with which anything else is refused."""
    words = " or ".join(f"`{shown(word)}`" for word in field.choices)
    if field.value is None or field.value.role:
        what = {"file": "a path", "folder": "a folder"}.get(field.value.role if field.value else "", "text")
        return words if field.choices and not field.any_value else ", or ".join(filter(None, [what, words]))
    try:
        field.value.read(object())
    except ValueError as reason:
        said = str(reason).removeprefix("not a number; ")
        said = re.sub("^(give|needs|must be) ", "", said)
        return ", ".join(filter(None, [said, _bound(field)]))
    return "any"


def _bound(field: Field) -> str:
    """The lower bound of a number, found by what is refused."""
    assert field.value is not None
    if not _takes(field, 1.0) or _takes(field, -1.0):
        return ""
    return "not negative" if _takes(field, 0.0) else "above 0"


def _takes(field: Field, value: float) -> bool:
    try:
        field.value.read(value)  # type: ignore[union-attr]
    except ValueError:
        return False
    return True


def _default(field: Field) -> str:
    if field.default is MISSING:
        return "required"
    if field.default is None or field.default == ():
        return ""
    if is_dataclass(field.default):
        return f"`{shown(kind_of(field.default))}`" if kind_of(field.default) else ""
    return f"`{field.default:g}`" if isinstance(field.default, float) else f"`{_plain(field.default)}`"


def _plain(value: object) -> str:
    if isinstance(value, tuple):
        return f"[{', '.join(map(_plain, value))}]"
    return f"{value:g}" if isinstance(value, float) else shown(value)


def _sentence(text: str) -> str:
    return text[:1].upper() + text[1:]

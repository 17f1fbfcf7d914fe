"""A case as TOML text, the same for the same case."""

import json
from collections.abc import Mapping

HEADER = "# The full input of a rodshell job, in SI units. To run it again: rodshell form case.toml\n"


def toml_text(case: Mapping[str, Mapping[str, object]]) -> str:
    """One [table] for each entry, its own tables inline, keys in the order given."""
    tables = [
        f"[{name}]\n" + "".join(f"{key} = {_value(value)}\n" for key, value in table.items())
        for name, table in case.items()
    ]
    return "\n".join([HEADER, *tables])


def _value(value: object) -> str:
    if isinstance(value, Mapping):
        inside = ", ".join(f"{key} = {_value(item)}" for key, item in value.items())
        return f"{{ {inside} }}" if inside else "{}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(_value(item) for item in value) + "]"
    if isinstance(value, str):  # JSON's escapes are TOML's, but for the character DEL
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    assert isinstance(value, int | float)  # the schema has no other values
    return repr(value)

"""An archive whose every name is an attack: on spreadsheets, DXF, markup, paths and printers."""

import json
from typing import Any

from rodshell.results import Archive, Results
from tests.output.sample_archive import sample_archive, with_deployment

NAMES = (
    "=cmd|' /C calc'!A0", "+1+cmd", "-2+3+cmd", "@SUM(A1:A9)", "\uff1d1+1", "\t=1+1", "\r\n=1+1", "a;=1+1", '";=1+1;"',
    "<script>alert(1)</script>", "</title></svg><script>alert(1)</script>", "]]><b>", "nul\x00 esc\x1b bell\x07",
    "half a pair \ud800", "%%d^J{\\U+0041}", "../../etc/passwd", "(paren) \\", "\u202ereversed",
)  # fmt: skip
LAYERS = {
    "CUT": "evil\n  0\nSECTION\n  2\nX", "MARK": "a<b>c", "LABEL": "A_B_C", "BOUNDARY-FLAT": "a|b,c", "DIM": "0",
    "TITLE": "   ", "BOUNDARY-FINAL": "long " * 100,
}  # fmt: skip


def hostile_archive() -> Archive:
    """The sample dome with hostile names of rods, drawings, layers, target, patches, bars and warnings."""
    made = with_deployment(sample_archive(count=9), stages=4)
    renamed = {rod["id"]: name for rod, name in zip(made.results.plain()["rods"], NAMES, strict=False)}
    result: dict[str, Any] = json.loads(
        json.dumps(made.results.plain()), object_hook=lambda table: _renamed(table, renamed)
    )
    ids = [rod["id"] for rod in result["rods"]]
    a, b = f"{ids[0]}/{ids[9]}", f"{ids[1]}/{ids[10]}"
    pieces = [{"piece": name, "length": 0.1} for name in ids]
    result |= {
        "name": NAMES[9],
        "warnings": list(NAMES),
        "end_tangents": [[0.0, 0.0, -1.0]] * (2 * len(ids)),
        "dropped": [{"id": name, "reason": name} for name in NAMES],
        "target": {"kind": "mesh", "file": NAMES[10]},
        "drawings": {"project": NAMES[10], "revision": NAMES[0], "author": NAMES[12], "layers": LAYERS},
        "fabrication": {
            "bracing": [{"from": one, "to": other, "flat": 0.04, "final": 0.05} for one, other in ((a, b), (b, a))],
            "stock": {"waste": 0.1, "fewest": 1, "bars": [{"pieces": pieces, "left": 0.1}]},
        },
        "seams": [{"meetings": [{"ends": [f"{ids[0]}.0", f"{ids[1]}.1"], "point": [-0.1, 0.0, 0.1]}]}],
    }  # fmt: skip
    return Archive(Results.of(result), made.states, f'# {NAMES[9]}\nname = "{NAMES[10]}"\n')


def _renamed(table: dict[str, Any], renamed: dict[str, str]) -> dict[str, Any]:
    return {key: renamed.get(value, value) if isinstance(value, str) else value for key, value in table.items()}

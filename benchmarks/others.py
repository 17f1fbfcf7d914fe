"""Against others: the paper's own scheme, and PyElastica."""

import importlib.util
import json
from pathlib import Path

from benchmarks.pyelastica_cantilever import by_pyelastica, by_rodshell, rodshell_tips, true_tips
from benchmarks.rows import Row, Section


def paper(quick: bool) -> Section:
    """The paper's scheme and ours are timed for Fig 8 (`python docs/paper.py fig8`, docs/paper.md), whose ratios these
    are: its explicit scheme, 2 s of fall in steps of 10 ms, over drape, trim and map back on the same mesh."""
    made = json.loads((Path(__file__).parents[1] / "docs" / "paper" / "fig8" / "result.json").read_text())
    assert paper.__doc__ is not None
    rows = [
        Row(f"the paper's fall of 2 s over ours, {name}", f"{ratio:.0f} times", "at least 50 times")
        for name, ratio in made["ratios"].items()
    ]
    return Section("The paper's method", paper.__doc__.replace("\n    ", " "), rows)


def pyelastica(quick: bool) -> Section:
    """A cantilever of 1 m let go under gravity, one simulated second to 2 % of its largest deflection (see
    benchmarks/pyelastica_cantilever.py for more cases)."""
    assert pyelastica.__doc__ is not None
    said = pyelastica.__doc__.replace("\n    ", " ")
    if not importlib.util.find_spec("elastica"):
        return Section("PyElastica", said, [Row("not installed", 'pip install -e ".[bench]"')])
    rodshell_tips(10, 1e6, 0.02)  # compiles
    rows = list[Row]()
    for nodes in (100,) if quick else (100, 1000):
        truth = true_tips(1e6)
        ours, theirs = by_rodshell(nodes, 1e6, truth), by_pyelastica(nodes, 1e6, truth, 10.0 if quick else 60.0)
        rows.append(
            Row(f"{nodes} nodes, 1 MPa: PyElastica over rodshell", f"{theirs.seconds / ours.seconds:.1f} times")
        )
        rows += [Row("   rodshell", str(ours)), Row("   PyElastica", str(theirs))]
    return Section("PyElastica", said, rows)

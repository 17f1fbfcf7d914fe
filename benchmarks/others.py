"""Against others: the paper's own scheme, and PyElastica."""

import importlib.util

from benchmarks.pyelastica_cantilever import by_pyelastica, by_rodshell, rodshell_tips, true_tips
from benchmarks.rows import Row, Section
from rodshell.progress import silent

FALLS = {True: 0.2, False: 2.0}  # seconds that are simulated, by whether it must be quick


def paper(quick: bool) -> Section:
    """The paper's explicit scheme at 15 mm edges, time steps of 10 ms, against net, bound drape, trim and map back at
    5 mm edges; no pop-up on either side. Its fall takes about 2 s."""
    from rodshell.paper import fig8

    falling = FALLS[quick]
    made = fig8.make(silent, cases=fig8.CASES[:1], falling=falling)
    rows = [
        Row(
            f"the paper's fall of {falling:g} s over ours, {name}", f"{ratio:.0f} times", "at least 50 times" * (k == 0)
        )
        for k, (name, ratio) in enumerate(_flat(made.ratios()))
    ]
    rows += [Row(f"   {' '.join(map(str, row[:3]))}", ", ".join(map(str, row[3:]))) for row in made.rows()]
    assert paper.__doc__ is not None
    return Section("The paper's method", paper.__doc__.replace("\n    ", " "), rows)


def _flat(ratios: object, name: str = "") -> list[tuple[str, float]]:
    if isinstance(ratios, dict):
        return [pair for key, value in ratios.items() for pair in _flat(value, f"{name} {key}".strip())]
    return [(name, float(ratios))]  # type: ignore[arg-type]


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

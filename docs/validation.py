"""Writes docs/validation.md: what is predicted next to what is known or was published: `python docs/validation.py`."""

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE.parent))

import rodshell as rs  # noqa: E402
from rodshell.figures.loads import LoadedShell  # noqa: E402
from rodshell.solve.load_path import load_path  # noqa: E402
from rodshell.solve.modes import linear_buckling  # noqa: E402
from tests.acceptance import hosts  # noqa: E402
from tests.acceptance.loads_creteil import CASE  # noqa: E402
from tests.formfinding.test_support_groups import SPAN, bows, groups, thrust  # noqa: E402
from tests.solve import stability_problems as known  # noqa: E402

HEAD = """# Validation

What rodshell predicts next to closed forms, published figures and a second code, made by `python docs/validation.py`
(a minute). Most rows stand with their bounds in `make accept-loads` and `make accept-signed`. Forces, shapes and
factors of whole shells are also held against code of the tests' own (`tests/checks/loaded_twin.py`,
`tests/loads/braced_twin.py`).

| case | source | known | rodshell | off |
|---|---|---|---|---|
"""
TAIL = """
## The cathedral of Creteil

`examples/loads/creteil.toml` has its length, width, height, tubes, pitch and modulus; its surface, of two hills, is not
published in full, and is a paraboloid over an ellipse here, which is bent as evenly as can be. Published are 130 MPa
under permanent loads, with a limit of 133 [du Peloux, Tayeb, Baverel and Caron, Structural Engineering International
2/2016].

{creteil}

So the permanent stress is that of an even surface of this size. It says no more of the built one than that its surface
was chosen for small curvatures. That the look-alike falls under the winter of our case does not say that the cathedral
does: its surface, supports, membrane and design loads are not in it, and are not published in full.

## In OpenSees

Each shell is exported (`rodshell export DIR --only opensees`) and replayed by the script that is exported with it, of
beams with large rotations: its flat grid, free of stress, is moved through the stages of its deployment, and all but
the supports are let go, so that its bending prestress is OpenSees' own. Edges of 0.2 m, of the braced shell 0.1 m; each
code has errors of second order in them, of either sign. `make accept-hosts`.

{opensees}

## Not compared

- A built shell as a whole: none is published with surface, supports, bracing and measured deflections together.
- C-shells, which are opened by their joints: there are no published figures that could be taken over.
"""


class Line(NamedTuple):
    case: str
    source: str
    exact: float
    found: float
    unit: str = ""


def lines() -> Iterator[Line]:
    for stiffness in (2.5e3, 2e4):
        push = abs(bows(groups(rs.SprungEnds(stiffness=(stiffness, stiffness, 1e6))))[0, 0])
        exact = thrust(SPAN + 2 * push / stiffness)
        yield Line(f"bow of 2 m on springs of {stiffness:g} N/m, thrust", "Euler's elastica", exact, push, "N")
    column, ring, pressed = known.eulers_column(40), known.michells_ring(192), known.ring_under_pressure(96)
    for case, source, loaded in (
        ("column, 40 edges", "Euler", column),
        ("ring that is twisted, 192 edges", "Michell 1889", ring),
        ("ring under pressure, 96 edges", "Levy 1884", pressed),
        ("strip bent on edge, 80 edges", "Prandtl 1899", known.prandtls_cantilever(80)),
    ):
        found = linear_buckling(loaded.unloaded, loaded.load).factors[0]
        yield Line(f"{case}: linear buckling factor", source, 1.0, found)
    arch = known.shallow_arch(4.0)
    found = load_path(arch.unloaded, arch.load, most=3.0, close=2e-4).factor
    yield Line("shallow arch, rise 4 radii of gyration: snap-through", "closed form, see the tests", 1.0, found)
    truss, dome = known.von_mises(), known.star_dome()
    yield Line("truss of two bars: upper limit", "von Mises 1923", 381.087, upper(truss, 600.0), "N")
    yield Line("star dome of 24 bars: first limit over EA", "see the tests", dome.exact["limit"], upper(dome, 1e-3))
    frame, toggle = known.lees_frame(1.5), known.williams_toggle()
    yield Line("frame of two rods: upper limit", "Lee et al. 1968", frame.exact["upper"], upper(frame, 3.0))
    yield Line("toggle: upper limit", "Williams 1964", toggle.exact["upper"], upper(toggle, 60.0))
    bend = known.bend_of_45_degrees()
    end = load_path(bend.unloaded, bend.load, most=1.0).at(1.0)
    assert end is not None
    rise = (end.state - bend.unloaded.state)[bend.node][2]
    yield Line("bend of 45 degrees: rise of its tip", "Bathe and Bolourchi 1979", bend.exact["z"], rise)
    for ends, exact in (("pinned", 150.0), ("clamped", 180.0)):
        yield Line(
            f"hemisphere, {ends} ends: stiffness under a point load at its top, in EI/(s R^2), 45 rods each way",
            "a second code, many rods", exact, point_stiffness(ends),
        )  # fmt: skip


def upper(loaded: known.Loaded, most: float) -> float:
    """The first limit of a path that is followed past it."""
    return load_path(loaded.unloaded, loaded.load, most=most, past_limit=True).turns[0].factor


def point_stiffness(ends: str) -> float:
    radius, spacing = 5.0, 0.25
    rod = rs.Rod(rs.Circle(0.003), rs.Material(25e9, 1900.0))
    layout = rs.GridLayout.orthogonal(spacing=spacing, edge=spacing / 3)
    form = rs.find_form(rs.Hemisphere(radius), layout, rod, ends=ends)
    unit = rod.bend_stiffnesses[0] / radius**2
    loads = rs.Loads(
        loads={"top": rs.PointLoad((0.0, 0.0), (0.0, 0.0, -1e-4 * unit))}, combinations={"all": {"top": 1.0}},
        stability=rs.Stability(imperfection=0, modes=1),
    )  # fmt: skip
    found = rs.check_loads(form, loads).shells["all"][ends]
    return 1e-4 * spacing / float(found.max_deflection or np.inf)


def creteil() -> str:
    """What is found of the look-alike, in a table."""
    form = rs.Job.load(str(CASE), checks__stages=0).run()
    results = form.archive().results
    weight, winter = (results.loads[name]["pinned"] for name in ("weight", "winter"))
    assert results.strength is not None
    share = max((found.utilisations.permanent if found.utilisations else None) or 0.0 for found in (weight, winter))
    permanent = 1e-6 * (results.strength.permanent or 0.0) * share
    rows = (
        ("permanent stress of the erected shell", "130 MPa", f"{permanent:.0f} MPa"),
        ("E r kappa at the top, by hand", "", f"{1e-6 * 25e9 * 0.02085 * 2 * 7 / 8.5**2:.0f} MPa"),
        ("weight: limit, with imperfections of span/500", "stood", _factors(weight)),
        ("winter: limit, with imperfections of span/500", "stood", _factors(winter)),
        ("verdict", "built in 2013", form.verdict.headline.rstrip(".")),
    )
    return "| | published | rodshell |\n|---|---|---|\n" + "\n".join(f"| {' | '.join(row)} |" for row in rows)


def opensees() -> str:
    """What OpenSees finds of exported shells, in a table."""
    python = hosts.python_with_opensees()
    if python is None:
        raise SystemExit("openseespy cannot be imported: see `make accept-hosts`")
    return hosts.markdown(row for name in hosts.SHELLS for row in hosts.rows_of(name, python))


def _factors(found: LoadedShell) -> str:
    return f"{found.limit_factor:.3g}, {found.imperfect_factor:.3g}"


def main() -> None:
    rows = []
    for case, source, exact, found, unit in lines():
        off = f"{100 * (found / exact - 1):+.2g} %"
        rows.append(f"| {case} | {source} | {exact:.5g} {unit} | {found:.5g} {unit} | {off} |")
        print(rows[-1], flush=True)
    (HERE / "validation.md").write_text(
        HEAD + "\n".join(rows) + "\n" + TAIL.format(creteil=creteil(), opensees=opensees()), encoding="utf-8"
    )


if __name__ == "__main__":
    main()

"""Rows of shells on supports that yield, of creep, and of 40 shells by chance that the verdict must not call good."""

from collections import Counter
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from scipy.linalg import eigh

import rodshell as rs
from examples import under_snow
from rodshell.layout.cells import diagonals
from rodshell.solve.modes import frequencies
from tests.acceptance.rows import Row
from tests.formfinding.test_edge_beams import (
    OPEN,
    R,
    arc,
    bare,
    critical_pressure,
    first_frequencies,
    ring,
    twin_of_arch,
)
from tests.formfinding.test_edge_beams import on as on_beams
from tests.formfinding.test_support_groups import SPAN, SprungTwin, bows, groups, on, thrust
from tests.loads.braced_twin import BracedTwin
from tests.loads.shells import TUBE, one, shell
from tests.loads.test_creep import CABLES, CLADDING, CREEP, KNOWN, STABILITY, soft_shell

CLOSED, TWIN = 5e-3, 0.02
SPRINGS = 2.5e3, 5e3, 2e4, 1e6  # N/m
RESERVE, SNOW, SHELLS = 1.5, 200.0, 40
ROPE, STEEL = 0.003, {"preset": "spring-steel"}


def support_rows() -> Iterator[Row]:
    """Bows on springs against the elastica; a shell on springs against code of the tests' own."""
    for stiffness in SPRINGS:
        forces = bows(groups(rs.SprungEnds(stiffness=(stiffness, stiffness, 1e6))))
        aside = abs(forces[0, 0]) / stiffness
        yield Row(
            f"bows, {stiffness:g} N/m",
            "thrust off the elastica",
            abs(forces[0, 0] / thrust(SPAN + 2 * aside) - 1),
            CLOSED,
        )
    form, stiffness = on(groups(rs.SprungEnds(stiffness=2e4))), 2e4
    twin = SprungTwin(shell("tubes").popped["pinned"], TUBE, stiffness, [*range(2 * len(form.footprint.rods))])
    settled = twin.settled(twin.state, 0.0, most=20)
    assert settled is not None
    twin.state, _ = settled
    n, popped = form.footprint.mesh.node_count, form.popped["given"]
    apart = np.abs(popped.positions - twin.state[: 3 * n].reshape(-1, 3)).max() / form.target.size
    yield Row("cap on springs", "shape off other code, over the size", float(apart), 1e-6)
    limit, _ = twin.load_factor(2e-3)
    yield Row(
        "cap on springs",
        "limit under its weight, off other code",
        _off(form.checks.self_weight["given"].load_factor, limit),
        TWIN,
    )
    mass = np.maximum(-twin.load[2 : 3 * n : 3] / 9.81, 1e-12)
    lumped = np.zeros_like(popped.equilibrium.state)
    lumped[:n] = mass[:, None]
    stiff = twin.hessian(twin.state)[twin.free][:, twin.free].toarray()
    square = eigh(stiff, np.diag(np.repeat(mass, 3)[twin.free]), eigvals_only=True, subset_by_index=[0, 0])[0]
    found = frequencies(popped.equilibrium, lumped, 1).frequencies[0]
    yield Row("cap on springs", "first frequency, off other code", _off(found, np.sqrt(square) / (2 * np.pi)), 0.01)


def beam_rows() -> Iterator[Row]:
    """Rings and arches against closed forms; a shell on an arch against code of the tests' own."""
    beam, half = bare(ring(96), closed=True).rod, np.pi / 3
    yield Row(
        "ring, pressure", "buckling off 3 EI/R^3",
        _off(critical_pressure(ring(96), closed=True), 3 * beam.bend_stiffness / R**3), CLOSED,
    )  # fmt: skip
    yield Row(
        "arch on two hinges", "buckling off (pi^2/alpha^2 - 1) EI/R^3",
        _off(critical_pressure(arc(61, half), closed=False), ((np.pi / half) ** 2 - 1) * beam.bend_stiffness / R**3),
        CLOSED,
    )  # fmt: skip
    twin, form = twin_of_arch(), on_beams(rs.Arch(at=OPEN, rod=beam))
    popped = form.popped["given"]
    apart = np.abs(popped.positions.ravel() - twin.state[: popped.positions.size]).max() / form.target.size
    yield Row("cap on an arch", "shape off other code, over the size", float(apart), 1e-6)
    limit, _ = twin.load_factor(2e-3)
    carried = form.checks.self_weight["given"].load_factor
    yield Row("cap on an arch", "limit under its weight, off other code", _off(carried, limit), TWIN)
    yield Row("cap on an arch", "first frequency, off other code", _off(*first_frequencies()), 0.01)


def creep_rows() -> Iterator[Row]:
    """Shells after years against shells of softer rods; deflections that grow by creep."""
    for name, more in (("bare", {}), ("cables", {"bracing": CABLES})):
        loads = one(CLADDING, stability=STABILITY, strength=KNOWN, **more)
        years = rs.check_loads(shell("tubes"), loads).shells["all"]["pinned"].after_years
        twin = rs.check_loads(soft_shell(), loads).shells["all"]["pinned"]
        assert years is not None
        yield Row(
            f"crept cap, {name}", "limit off that of softer rods", _off(years.limit_factor, twin.limit_factor), TWIN
        )
        yield Row(
            f"crept cap, {name}",
            "the same with imperfections",
            _off(years.imperfect_factor, twin.imperfect_factor),
            TWIN,
        )
    few = replace(
        one(CLADDING, stability=rs.Stability(imperfection=0), strength=KNOWN), combinations={"all": {"it": 1e-4}}
    )
    found = rs.check_loads(shell("tubes"), few).shells["all"]["pinned"]
    assert found.after_years is not None
    ratio = (found.after_years.max_deflection or 0.0) / (found.max_deflection or 1.0)
    yield Row("cap, little load", "deflection after years over 1 + k, off 1", abs(ratio / (1 + CREEP) - 1), CLOSED)


def example_rows() -> Iterator[Row]:
    """Examples that are said to stand under their loads with their reserve."""
    for name in ("garden", "pavilion"):
        form = rs.Job.load(f"examples/loads/{name}.toml").run()
        level = form.verdict.level
        shell = form.archive().results.loads["winter"]["pinned"]
        least = min(shell.limit_factor or np.inf, shell.imperfect_factor or np.inf)
        yield Row(f"example {name}", "judged otherwise than good", float(level != "good"), 0, note=f"{least:.2f} times")


def snow_rows() -> Iterator[Row]:
    """Shells of the gallery that are said to stand under snow, with imperfections and after years."""
    for name in under_snow.SHELLS:
        found = under_snow.factors_of(name).values()
        least, used = min(factor for factor, _ in found), max(used for _, used in found)
        yield Row(name, "limit short of the reserve of 1.5", max(0.0, 1.5 - least), 0, note=f"{least:.2f} times")
        yield Row(name, "use of the strength", used, 1)


def chance_rows(count: int = SHELLS) -> Iterator[Row]:
    """Braced shells by chance under 1.35 own + 1.5 snow and 1.35 own: none is good that falls by other code."""
    rng, levels, wrong = np.random.default_rng(44), Counter[str](), list[str]()
    for k in range(count):
        radius, spans, prestrain = rng.uniform(2.5, 6.0), rng.uniform(4.0, 8.0), float(rng.uniform(5e-4, 2e-3))
        size = radius / 375 * rng.uniform(0.8, 1.6)
        form = rs.Job.load({
            "target": {"kind": "paraboloid", "radius": radius, "height": rng.uniform(0.2, 0.35) * radius},
            "layout": {"spacing": radius / spans, "edge": radius / spans / 3},
            "rod": {"section": {"kind": "tube", "radius": size, "thickness": size / 5}, "material": {"preset": "gfrp"}},
            "pop_up": {"ends": "pinned"},
            "bracing": {"kind": "cables", "prestrain": prestrain, "section": {"radius": ROPE}, "material": STEEL},
            "loads": [{"name": "own", "kind": "self_weight"}, {"name": "snow", "kind": "snow", "value": SNOW}],
            "combinations": [
                {"name": "winter", "factors": {"own": 1.35, "snow": 1.5}}, {"name": "always", "factors": {"own": 1.35}},
            ],
            "strength": {"creep": 0.3},
            "stability": {"modes": 1},
        }).run()  # fmt: skip
        results = form.archive().results
        level = form.verdict.level
        levels[level] += 1
        found = results.loads.get("winter", {}).get("pinned")
        if level != "good" or found is None:
            continue
        if min(found.limit_factor or np.inf, found.imperfect_factor or np.inf) < RESERVE:
            wrong.append(f"{k}: {found.limit_factor}, {found.imperfect_factor}")
        if not _carries(form, prestrain):
            wrong.append(f"{k}: by other code")
    told = ", ".join(f"{number} {level}" for level, number in sorted(levels.items()))
    note = f"{told}; {'; '.join(wrong)}"
    yield Row(f"{count} shells by chance", "good, and not by the rule", len(wrong), 0, note=note)


def _carries(form: rs.Form, prestrain: float) -> bool:
    """Whether other code finds the shell stable under 1.5 times 1.35 own + 1.5 snow."""
    mesh, shape, ropes = (
        form.footprint.mesh,
        form.target.parameters(),
        rs.Rod(rs.Circle(ROPE), rs.Material.preset("spring-steel")),
    )
    radius, height = shape["radius"], shape["height"]
    other = BracedTwin(
        form.popped["pinned"], form.rod, snow=1.5 * SNOW, height=lambda x, y: height * (1 - (x**2 + y**2) / radius**2),
        radius=radius, ropes=mesh.joint_nodes[diagonals(mesh.grid)], prestrain=prestrain,
        rope_stiffness=ropes.stretch_stiffness,
    )  # fmt: skip
    for side in range(2):
        weight = 0.5 * other.rest * form.rod.mass_per_length * 9.81
        np.add.at(other.load, 3 * other.edges[:, side] + 2, -1.35 * weight)
    settled = other.settled(other.state, 0.0, most=20)
    if settled is None:
        return False
    other.state = settled[0]
    return other.negative_modes([0.4, 0.8, 1.2, RESERVE]) == 0


def _off(found: float | None, exact: float | None) -> float:
    assert found is not None
    assert exact is not None
    return abs(found / exact - 1)

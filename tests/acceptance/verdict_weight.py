"""Own weight: what share of it a shell bears, against another code's figures and against code of the tests' own."""

from collections.abc import Iterator
from math import inf

import numpy as np

import rodshell as rs
from rodshell.checks.reactions import Reactions, reactions
from rodshell.checks.self_weight import self_weight
from rodshell.figures.checks import SelfWeight
from tests.acceptance.cases import HEMISPHERE, ROD
from tests.acceptance.rows import Row
from tests.acceptance.targets_random import random_case
from tests.checks.loaded_twin import LoadedTwin

STEEL = rs.Rod(rs.Circle(radius=5e-4), rs.Material(210e9, 7850, 0.3))
TUBE = rs.Rod(rs.Tube(radius=0.0417 / 2, thickness=0.0035), rs.Material(25e9, 1900, 0.3))
LARCH = rs.Rod(rs.RectangularSection(width=0.035, height=0.05), rs.Material(12e9, 590, shear=0.7e9))
ROUND = {"rods": (17, 17), "spacing": 0.03, "edge": 0.015}
FORMS: dict[str, tuple[rs.Target, dict[str, object], rs.Rod]] = {
    "hemisphere, paper's rod": (HEMISPHERE, ROUND, ROD),
    "hemisphere, 1 mm spring steel": (HEMISPHERE, ROUND, STEEL),
    "GFRP tubes, cap of 10 m": (rs.Cap(radius=10.0, base=4.0), {"spacing": 1.0, "edge": 0.5}, TUBE),
    "larch laths, paraboloid 16 m": (rs.Paraboloid(radius=8.0, height=4.0), {"spacing": 1.0, "edge": 0.5}, LARCH),
    "oval turned by 0.4": (rs.Ellipsoid(a=0.2, b=0.15, c=0.12), {"spacing": 0.03, "edge": 0.015, "rotate": 0.4}, ROD),
}
BOUNDS = {"pinned": (0.02, 0.031), "clamped": (0.04, 0.062)}  # of the first, by another code
RANDOM = ((1, "pinned"), (9, "clamped"), (23, "pinned"))  # targets whose shells snap from one stable state to the next
HIGH = 1e4  # factor up to which springs are followed; result.json stops at 100
FACTORISATIONS = 15


def rows() -> Iterator[Row]:
    for name, (target, layout, rod) in FORMS.items():
        form = rs.find_form(target, rs.GridLayout.orthogonal(**layout), rod)
        for ends, popped in form.popped.items():
            shell, found = popped.shell, popped.equilibrium
            twin, held = LoadedTwin(popped, rod), reactions(shell, found)
            yield from unloaded_rows(f"{name}, {ends}", twin, held, popped.report.negative_modes)
            weighed, _ = self_weight(shell, found, most=HIGH)
            if rod is ROD and target is HEMISPHERE:
                low, high = BOUNDS[ends]
                yield Row(f"{name}, {ends}", "load factor on the own weight", _at_least(weighed), high)
                yield Row(f"{name}, {ends}", "the same, at least", -_at_least(weighed), -low)
            yield from _loaded(f"{name}, {ends}", twin, weighed)
            yield Row(f"{name}, {ends}", "factorisations", weighed.factorizations, FACTORISATIONS)
    for seed, held_by in RANDOM:
        _, target, layout, anchor = random_case(seed)
        popped = rs.find_form(target, layout, ROD, anchor=anchor).popped[held_by]  # type: ignore[index]
        yield from _loaded(
            f"random {seed}, {held_by}", LoadedTwin(popped, ROD), self_weight(popped.shell, popped.equilibrium)[0]
        )


def _at_least(weighed: SelfWeight) -> float:
    """The factor as a number: infinite above the largest that is looked for, 0 where nothing is known."""
    if weighed.load_factor is not None:
        return weighed.load_factor
    return inf if weighed.limit == "none" else 0.0


def unloaded_rows(case: str, twin: LoadedTwin, held: Reactions, negative_modes: int) -> Iterator[Row]:
    """Equilibrium, reactions and inertia of a popped-up shell."""
    largest = float(np.linalg.norm(held.forces, axis=1).max())
    forces, _ = twin.reactions(twin.state)
    residual = twin.residual(twin.state)[: len(twin.free) - len(twin.angles)]
    yield Row(case, "other code: unbalanced over reaction", float(np.abs(residual).max()) / largest, 1e-6)
    yield Row(case, "reactions apart, over the largest", float(np.abs(forces - held.forces).max()) / largest, 1e-6)
    yield Row(case, "negative modes apart", abs(twin.factored(twin.state)[1] - negative_modes), 0)


def _loaded(case: str, twin: LoadedTwin, weighed: SelfWeight) -> Iterator[Row]:
    factor, at_one = twin.load_factor(accuracy=1e-3)
    note = f"{_at_least(weighed):.5g} and {factor:.5g}, {weighed.limit}"
    yield Row(case, "load factors apart", abs(_at_least(weighed) / factor - 1), 0.01, note=note)
    if at_one is not None:
        assert weighed.deflection is not None
        moved = (at_one - twin.state)[: 3 * twin.nodes].reshape(-1, 3)
        sunk = float(np.linalg.norm(moved, axis=1).max())
        yield Row(
            case, "deflections at 1 g apart", abs(weighed.deflection / sunk - 1), 0.01, note=f"{1e3 * sunk:.4g} mm"
        )

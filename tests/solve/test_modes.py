"""Linear buckling and natural frequencies against closed forms, and that no mode is missed."""

from math import pi

import numpy as np
import pytest

from rodshell.errors import ConvergenceError, InputError, StabilityError
from rodshell.solve import modes
from rodshell.solve.load import Load
from rodshell.solve.load_path import load_path
from rodshell.solve.modes import frequencies, linear_buckling
from tests.solve import stability_problems as known


def test_factors_of_a_pinned_column_are_eulers_in_pairs() -> None:
    """Of n hinges between rigid edges exactly (2 n sin(k pi / 2n) / k pi)^2 k^2, to either side."""
    edges = 40
    column = known.eulers_column(edges)
    found = linear_buckling(column.unloaded, column.load, 8)
    number = np.repeat(np.arange(1, 5), 2)
    exact = (2 * edges * np.sin(number * pi / (2 * edges))) ** 2 / pi**2
    np.testing.assert_allclose(found.factors, exact, rtol=2e-5)  # EA 1e6: it is 1e-5 shorter
    across = found.shapes[:, : edges + 1, 1:]
    wave = np.sin(np.arange(edges + 1) * pi / edges)
    size = np.linalg.norm(across[0], axis=1)
    np.testing.assert_allclose(size / size.max(), wave, atol=1e-6)


def test_a_column_that_is_pulled_has_no_factor() -> None:
    column = known.eulers_column(10)
    assert column.load.forces is not None
    assert len(linear_buckling(column.unloaded, -column.load.forces, 3).factors) == 0


def test_a_strip_buckles_sideways_by_its_moments() -> None:
    """It has no axial force: the moments' part of the geometric stiffness is all there is."""
    strip = known.prandtls_cantilever(40)
    assert linear_buckling(strip.unloaded, strip.load).factors[0] == pytest.approx(1.0, rel=2e-3)


def test_a_ring_leaves_its_plane_by_its_torsion() -> None:
    ring = known.michells_ring(48)
    assert linear_buckling(ring.unloaded, ring.load).factors[0] == pytest.approx(1.0, rel=2e-2)  # 1.3e-2; second order


def test_the_linear_factor_of_an_arch_is_that_of_its_thrust() -> None:
    arch = known.shallow_arch(8.0, 48)
    found = linear_buckling(arch.unloaded, arch.load).factors[0]
    assert found == pytest.approx(arch.exact["linear"], rel=5e-3)
    assert found > 1.1  # it sinks before it buckles, which a linear factor does not see
    assert load_path(arch.unloaded, arch.load, stations=()).factor == pytest.approx(1.0, rel=5e-3)


def test_what_the_structure_carries_already_is_not_multiplied() -> None:
    column = known.eulers_column(20)
    assert column.load.forces is not None
    squeezed = load_path(column.unloaded, column.load, stations=(0.4,)).at(0.4)
    assert squeezed is not None
    whole, left = (linear_buckling(here, column.load).factors[0] for here in (column.unloaded, squeezed))
    assert left == pytest.approx(whole - 0.4, rel=1e-4)


def test_a_mode_that_lanczos_misses_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Once, and more modes are computed; always, and there is no answer."""
    column, calls = known.eulers_column(40), []
    whole = modes._lanczos

    def one_missing(*arguments, start, always=False):  # type: ignore[no-untyped-def]
        values, vectors = whole(*arguments, start=start)
        calls.append(len(values))
        kept = np.argsort(values)[::-1]
        if len(calls) == 1 or always:
            kept = np.delete(kept, 1)
        return values[kept], vectors[:, kept]

    exact = linear_buckling(column.unloaded, column.load, 3).factors
    monkeypatch.setattr(modes, "_lanczos", one_missing)
    np.testing.assert_allclose(linear_buckling(column.unloaded, column.load, 3).factors, exact, rtol=1e-8)
    assert len(calls) == 2
    monkeypatch.setattr(modes, "_lanczos", lambda *arguments, **start: one_missing(*arguments, **start, always=True))
    with pytest.raises(ConvergenceError, match="the inertia of the stiffness counts"):
        linear_buckling(column.unloaded, column.load, 3)


def test_of_a_pair_that_the_first_start_hides_both_are_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """As of a symmetric shell; although no more modes are above the limit than are asked for."""
    column, starts = known.eulers_column(40), []

    def hiding(size: int, count: int) -> np.ndarray:
        starts.append(count)
        rows = generic(size, count)
        return rows * (np.arange(size) % 3 == 2) if count == 1 else rows  # to a single side

    generic = modes.generic
    exact = linear_buckling(column.unloaded, column.load, 2, most=2.0).factors
    monkeypatch.setattr(modes, "generic", hiding)
    found = linear_buckling(column.unloaded, column.load, 2, most=2.0).factors
    np.testing.assert_allclose(found, exact, rtol=1e-8)
    assert len(found) == 2
    assert starts == [1, 2]


def test_frequencies_of_a_tube_are_those_of_beam_theory() -> None:
    """Lumped (k pi / n)^2 / 12 too low, of second order; with mass spread along edges of fourth order."""
    lumped, spread = [], []
    for edges in (16, 32):
        tube, mass, edge_mass, exact = known.tube(edges)
        number = np.arange(1, 6)
        found = frequencies(tube, mass, 5).frequencies / exact - 1
        np.testing.assert_allclose(found, -((number * pi / edges) ** 2) / 12, rtol=0.04)  # the next order
        lumped.append(found[0])
        spread.append(frequencies(tube, mass, 5, edge_mass=edge_mass).frequencies / exact - 1)
    assert lumped[0] / lumped[1] == pytest.approx(4.0, abs=0.02)
    assert np.abs(spread[1]).max() < 5e-5
    assert spread[0][4] / spread[1][4] == pytest.approx(16.0, abs=3.0)


def test_frequencies_fall_as_the_root_of_what_is_left_of_eulers_load() -> None:
    column = known.eulers_column(20)
    mass = np.full_like(column.unloaded.state, 0.05)
    squeezed = load_path(column.unloaded, column.load, stations=(0.75,)).at(0.75)
    assert squeezed is not None
    slow, fast = (frequencies(here, mass).frequencies[0] for here in (squeezed, column.unloaded))
    critical = linear_buckling(column.unloaded, column.load).factors[0]
    assert slow / fast == pytest.approx(np.sqrt(1 - 0.75 / critical), rel=1e-4)


def test_modes_of_what_is_not_stable_are_refused() -> None:
    column = known.eulers_column(20)
    assert column.load.forces is not None
    path = load_path(column.unloaded, column.load, most=1.5, past_limit=True)
    fallen = path.points[-1].equilibrium
    assert path.points[-1].negative_modes == 2
    with pytest.raises(StabilityError, match="2 negative modes"):
        linear_buckling(fallen, column.load)
    with pytest.raises(StabilityError, match="not stable"):
        frequencies(fallen, np.ones_like(fallen.state))
    with pytest.raises(InputError, match="must not be negative"):
        frequencies(column.unloaded, -np.ones_like(fallen.state))
    with pytest.raises(InputError, match="the mass has the shape"):
        frequencies(column.unloaded, np.ones(3))


def test_that_a_load_only_stiffens_is_found_by_inertia_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """A column that is drawn has no factor; Lanczos' method would look for its largest eigenvalue, next to zero, among
    many others, and took minutes under the wind's suction on braced shells."""
    column = known.eulers_column(40)
    assert column.load.forces is not None
    drawn = Load(forces=-column.load.forces)
    monkeypatch.setattr(modes, "_lanczos", None)
    assert len(linear_buckling(column.unloaded, drawn, 3, most=100.0).factors) == 0
    monkeypatch.undo()
    for count, found in ((1, 1), (3, 3), (4, 4), (9, 4)):  # 1 and 4, in both planes; 9 is above the largest asked for
        factors = linear_buckling(column.unloaded, column.load, count, most=5.0).factors
        np.testing.assert_allclose(factors, [1.0, 1.0, 4.0, 4.0][:found], rtol=5e-3)

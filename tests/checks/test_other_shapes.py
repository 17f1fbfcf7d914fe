"""Other stable shapes: what is found is one, by a code of the tests' own; and the search says how far it looked."""

from functools import cache

import numpy as np
import pytest
from scipy.linalg import eigh

import rodshell as rs
from rodshell.checks import check
from rodshell.checks.deployment import OtherShape, deploy
from rodshell.checks.other_shapes import OtherShapes, _Search, other_shapes, spanned
from rodshell.joints import Joint
from rodshell.solve.equilibrium import find_equilibrium
from rodshell.solve.problem import Problem, Supports
from rodshell.solve.shifted_matrix import ShiftedMatrix
from tests.acceptance.targets_random import random_case
from tests.checks.shells import ROD, dome
from tests.formfinding.elastic_twins import ElasticTwin


@cache
def square_cap() -> rs.Form:
    """A shallow paraboloid over a square, its rods along the diagonals: its rim is made of arches, not plane."""
    layout = rs.GridLayout.orthogonal(spacing=0.08, edge=0.02, rotate=np.pi / 4)
    target = rs.HeightField(formula="0.05 - 0.3*(x^2 + y^2)", domain=rs.Rectangle((0.4, 0.4)))
    return rs.find_form(target, layout, ROD, ends=("pinned",))


@cache
def searched(most: int = 300) -> OtherShapes:
    popped = square_cap().popped["pinned"]
    shell, found = popped.shell, popped.equilibrium
    return other_shapes(shell, found, most_factorizations=most)


@cache
def random_form(seed: int) -> rs.Form:
    _, target, layout, anchor = random_case(seed)
    return rs.find_form(target, layout, ROD, anchor=anchor, ends=("pinned",))


def half_width(positions: np.ndarray) -> float:
    return 0.5 * float(np.ptp(positions, axis=0).max())


def test_a_cap_with_a_rim_that_is_not_plane_is_found_to_be_bistable() -> None:
    """Both shapes are minima of an energy written anew: gradient zero, Hessian positive definite, ends in place."""
    popped = square_cap().popped["pinned"]
    own, (other,) = popped.positions, searched().found
    mesh = popped.footprint.mesh
    twin = ElasticTwin(mesh, ROD)
    free = np.setdiff1d(np.arange(mesh.node_count), mesh.ends)
    unknowns = (3 * free[:, None] + np.arange(3)).ravel()
    for positions in (own, other.positions):
        np.testing.assert_allclose(positions[mesh.ends], own[mesh.ends], atol=1e-15)
        bends = np.abs(twin.bend_gradient(positions)).max()
        assert np.abs(twin.gradient(positions)[free]).max() < 1e-6 * bends
        hessian = twin.hessian(positions)[np.ix_(unknowns, unknowns)]
        assert np.linalg.eigvalsh(hessian)[0] > 0
    energies = [
        float(twin.bend_energies(x[twin.bends]).sum() + twin.stretch_energies(x[twin.edges]).sum())
        for x in (own, other.positions)
    ]
    assert other.energy == pytest.approx(energies[1] / energies[0], rel=1e-6)
    apart = np.linalg.norm(other.positions - own, axis=1).max() / half_width(own)
    assert other.distance == pytest.approx(apart, rel=1e-9)
    assert not other.mirror
    assert other.distance > 0.1


def test_the_bistable_cap_pops_down_to_below_the_surface_that_its_rim_spans() -> None:
    mesh, (other,) = square_cap().footprint.mesh, searched().found
    crown = int(np.argmax(square_cap().popped["pinned"].positions[:, 2]))
    rim = spanned(mesh, other.positions)
    assert other.positions[crown, 2] < rim[crown, 2] < square_cap().popped["pinned"].positions[crown, 2]


@pytest.mark.slow
def test_which_shape_comes_from_flat_depends_on_the_side_to_which_it_is_lifted() -> None:
    """Both shapes of the cap do; of two shapes of a random target one does, and the other ends in that one."""
    for case, count, reached in ((square_cap(), 300, True), (random_form(49), 600, False)):
        popped = case.popped["pinned"]
        shell, found = popped.shell, popped.equilibrium
        assert deploy(shell, found, stages=4).reached_from_flat
        other = min(other_shapes(shell, found, most_factorizations=count).found, key=lambda one: one.distance)
        start = shell.state(other.positions)
        problem = Problem(
            shell.elements, shell.stretch, Supports(shell.held_ends()), 0.2, flat_coordinates=shell.flat_coordinates
        )
        there = find_equilibrium(problem, start, shell.stretch.stiffness * shell.stretch.strains(start))
        assert there.report.stable
        way = deploy(shell.with_elements(there.elements), there, stages=8)
        assert way.reached_from_flat is reached
        np.testing.assert_allclose(way.positions[-1], other.positions, atol=1e-8)
    assert way.elsewhere is not None
    assert way.elsewhere.distance == pytest.approx(other.distance, rel=1e-2)  # of other half widths
    assert way.elsewhere.energy == pytest.approx(1 / other.energy, rel=1e-6)
    np.testing.assert_allclose(way.elsewhere.positions, popped.positions, atol=1e-8)
    (words,) = [one for one in way.warnings if "another shape" in one]
    assert "lifted from flat and driven by its ends alone" in words
    assert words.endswith("it has to be guided into its final shape")
    again = other_shapes(shell, there, most_factorizations=0, deployment=way)
    assert again.tried == 0
    assert [one.from_flat for one in again.found] == [True]


def test_a_shell_on_a_plane_has_its_reflection_and_that_is_named_as_such() -> None:
    popped = dome().popped["pinned"]
    shell, found = popped.shell, popped.equilibrium
    mirrors = [one for one in other_shapes(shell, found, most_factorizations=60).found if one.mirror]
    (image,) = mirrors
    height = popped.positions[:, 2] - popped.positions[popped.footprint.mesh.ends, 2].mean()
    assert image.distance == pytest.approx(2 * height.max() / half_width(popped.positions), rel=0.01)
    assert image.energy == pytest.approx(1.0, rel=0.01)
    turned_over = popped.positions - 2 * height[:, None] * [0.0, 0.0, 1.0]
    assert np.abs(image.positions - turned_over).max() < 0.02 * half_width(popped.positions)


@cache
def steel_cap(joint: Joint) -> rs.Form:
    """A cap of 0.6 m of steel rods, whose rim is plane."""
    rod = rs.Rod(rs.Circle(0.001), rs.Material(2e11, 7800.0))
    layout = rs.GridLayout(rods=(7, 7), spacing=(0.06, 0.06), length=0.6, edge=0.03)
    return rs.find_form(rs.Cap(0.4, 0.346), layout, rod, ends="pinned", joint=joint)


@pytest.mark.parametrize("joint", [rs.Pin(), rs.Rigid()])
def test_a_cap_whose_sections_turn_with_the_shell_has_its_reflection_only(joint: Joint) -> None:
    """The reflection of a stable shape in the plane of its supports is one, whatever the joints are."""
    popped = steel_cap(joint).popped["pinned"]
    shell, found = popped.shell, popped.equilibrium
    (image,) = other_shapes(shell, found, most_factorizations=20).found
    height = popped.positions[:, 2] - popped.positions[popped.footprint.mesh.ends, 2].mean()
    turned_over = popped.positions - 2 * height[:, None] * [0.0, 0.0, 1.0]
    assert np.abs(image.positions - turned_over).max() < 1e-3 * half_width(popped.positions)
    assert image.energy == pytest.approx(1.0, rel=0.01)  # its ends lie off their plane by a little
    assert image.mirror


def test_laths_popped_through_are_not_twisted_in_their_clamps() -> None:
    """They are free to spin there: what is left is the twist along them, with the other sign."""
    lath = rs.Rod(rs.RectangularSection(width=0.004, height=0.002), rs.Material(1e10, 600.0))
    layout = rs.GridLayout(rods=(7, 7), spacing=(0.06, 0.06), length=0.6, edge=0.03)
    popped = rs.find_form(rs.Cap(0.4, 0.346), layout, lath, ends="clamped", joint=rs.Pin()).popped["clamped"]
    shell, found = popped.shell, popped.equilibrium
    frames = shell.frames
    assert frames is not None
    own, mirrored = (frames.strains(state)[:, 2] for state in (found.state, _Search(shell, found, None)._through()))
    at_clamps = slice(len(own) - len(shell.ghosts), None)
    assert np.abs(mirrored[at_clamps]).max() < 1e-12
    rods = slice(0, at_clamps.start)
    np.testing.assert_allclose(mirrored[rods], -own[rods], atol=0.02 * np.abs(own[rods]).max())


@pytest.mark.slow
def test_a_cap_in_two_layers_is_found_popped_through() -> None:
    """Its joints are nearly where the reflection has them: the layers are 1 % of half the width apart."""
    popped = steel_cap(rs.Pin(eccentricity=2e-3)).popped["pinned"]
    shell, found = popped.shell, popped.equilibrium
    search = other_shapes(shell, found, most_factorizations=12)
    (image,) = search.found
    assert image.mirror
    assert search.tried == 1
    assert image.from_flat is None
    own, there = (x[shell.mesh.joint_pairs].mean(axis=1) for x in (popped.positions, image.positions))
    rim = popped.positions[shell.mesh.ends, 2].mean()
    np.testing.assert_allclose(there[:, :2], own[:, :2], atol=0.01 * half_width(popped.positions))
    np.testing.assert_allclose(there[:, 2] - rim, rim - own[:, 2], atol=0.01 * half_width(popped.positions))


def test_the_supports_of_two_layers_span_the_surface_that_they_do_without_layers() -> None:
    popped = square_cap().popped["pinned"]
    mesh = popped.footprint.mesh
    layered = mesh.in_layers(2e-3)
    np.testing.assert_allclose(
        spanned(layered, popped.positions[mesh.rod_nodes]), spanned(mesh, popped.positions)[mesh.rod_nodes], atol=1e-12
    )


def test_the_mirror_image_of_a_shell_that_rises_from_flat_does_so_too() -> None:
    others = check(dome().popped, ROD, stages=8).other_shapes["pinned"]
    assert [one.from_flat for one in others.found if one.mirror] == [True]


@pytest.mark.slow
def test_a_second_shape_of_a_random_target_is_found() -> None:
    """0.065 of the size away, at 0.953 times the energy: the same as from flat by arches [formfinding/popup.py]."""
    form = random_form(1)
    risen = rs.pop_up(form.footprint, form.trimmed.boundary, ROD, ends="pinned", start="flat")
    popped = form.popped["pinned"]
    shell, found = popped.shell, popped.equilibrium
    (other,) = other_shapes(shell, found, most_factorizations=120).found
    np.testing.assert_allclose(other.positions, risen.positions, atol=1e-8)
    assert np.abs(risen.positions - form.popped["pinned"].positions).max() > 0.005


@pytest.mark.parametrize("most", [0, 20, 60, 200])
def test_no_more_work_is_done_than_allowed(most: int, monkeypatch: pytest.MonkeyPatch) -> None:
    popped = square_cap().popped["pinned"]
    shell, found = popped.shell, popped.equilibrium
    done = list[int]()
    inner = ShiftedMatrix._factor

    def counted(self, values):  # type: ignore[no-untyped-def]
        done.append(1)
        return inner(self, values)

    monkeypatch.setattr(ShiftedMatrix, "_factor", counted)
    other = other_shapes(shell, found, most_factorizations=most)
    assert len(done) <= most
    assert (other.tried == 0) == (most == 0)


def test_the_search_says_how_far_it_looked() -> None:
    wide = searched(300).searched
    assert wide.startswith(f"looked for from {searched(300).tried} starts (popped through and kicked by up to 40 %")
    assert wide.endswith("others are not excluded")
    assert searched(0).searched.startswith("not looked for")


def test_kicks_that_lead_back_find_nothing() -> None:
    """The clamped dome has but one shape as far as is looked."""
    popped = dome().popped["clamped"]
    shell, found = popped.shell, popped.equilibrium
    other = other_shapes(shell, found, most_factorizations=60)
    assert other.tried > 3
    assert other.found == ()


def test_kicks_are_along_the_softest_modes() -> None:
    """Their Rayleigh quotients beside the eigenvalues of the tests' own Hessian, by the lumped mass."""
    popped = square_cap().popped["pinned"]
    mesh, shell = popped.footprint.mesh, popped.shell
    free = np.setdiff1d(np.arange(mesh.node_count), mesh.ends)
    unknowns = (3 * free[:, None] + np.arange(3)).ravel()
    hessian = ElasticTwin(mesh, ROD).hessian(popped.positions)[np.ix_(unknowns, unknowns)]
    mass = shell.mass.ravel()[unknowns]
    exact = eigh(hessian, np.diag(mass), eigvals_only=True, subset_by_index=[0, 3])
    modes = [mode.ravel()[unknowns] for mode in _Search(shell, popped.equilibrium, None)._modes()]
    quotients = sorted(mode @ hessian @ mode / (mass @ mode**2) for mode in modes)
    np.testing.assert_allclose(quotients, exact, rtol=0.3)  # four sweeps: 0.7 % and, of the last, 26 % measured


@pytest.mark.slow
def test_two_shapes_of_a_search_are_never_the_same() -> None:
    form = random_form(11)
    popped = form.popped["pinned"]
    shell, found = popped.shell, popped.equilibrium
    shapes: tuple[OtherShape, ...] = other_shapes(shell, found, most_factorizations=500).found
    size = half_width(form.popped["pinned"].positions)
    everyone = [form.popped["pinned"].positions, *(one.positions for one in shapes)]
    assert len(everyone) >= 2
    for k, one in enumerate(everyone):
        for two in everyone[:k]:
            assert np.linalg.norm(one - two, axis=1).max() > 1e-3 * size


def test_result_and_summary_say_what_was_found() -> None:
    archive = square_cap().archive()
    way, searched = archive.results.plain()["deployment"], archive.results.plain()["other_shapes"]["pinned"]
    assert way["reached_from_flat"] is True
    assert way["elsewhere"] is None
    assert way["snaps"] == way["snapped_by"] == []
    assert searched["tried"] > 0
    assert searched["searched"].startswith("looked for from ")
    for one in searched["found"]:
        assert set(one) == {"distance", "energy", "from_flat", "mirror"}
    lines = archive.summary(verbose=True).splitlines()
    assert "  from flat pinned  reached" in lines
    (shapes,) = [line for line in lines if line.startswith("  shapes")]
    assert shapes.endswith(searched["searched"])
    assert ("no other stable shape found" in shapes) == (not searched["found"])

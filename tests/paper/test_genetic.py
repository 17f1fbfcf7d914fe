"""The genetic algorithm: what it seeks and how that is judged, its run on a small grid, and the searches kept."""

import json
import sys
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

import rodshell as rs
from rodshell.cli import main
from rodshell.errors import InputError
from rodshell.formfinding import Footprint, Stages, find_stages
from rodshell.paper import genetic, genetic_search
from rodshell.paper.figure import CASES, Case
from rodshell.paper.genetic_records import GAIN, WINDOW, Generation, History, gain, stored
from rodshell.paper.genetic_search import Design
from rodshell.progress import silent
from tests.formfinding.falls import HEMISPHERE, PAPER_ROD

SMALL = Case("a", HEMISPHERE, (5, 5), spacing=0.06, edge=0.03)
POPULATION, MOST, SEED = 6, 3, 3
LEANING = rs.HeightField(formula="0.12 + 0.2*x - 2.5*x^2 - 2*y^2", domain=rs.Disc(0.2))
LEANS = Case("d", LEANING, (5, 5), spacing=0.06, edge=0.03)


@cache
def direct(case: Case) -> Stages:
    return find_stages(case.target, case.layout, PAPER_ROD, ends=("pinned",))


@cache
def design(case: Case) -> Design:
    return Design.of(direct(case))


def reach(footprint: Footprint) -> np.ndarray:
    """(2m,) how far each rod's start and end lie from its middle; the layouts here have no offset."""
    return np.abs([[rod.start, rod.end] for rod in footprint.rods]).ravel()


def direct_variables(case: Case) -> np.ndarray:
    orbit = design(case).orbit
    return np.bincount(orbit, reach(direct(case).footprint)) / np.bincount(orbit)


def find(kept: Path, *, seed: int = SEED, jobs: int = 1, most: int = MOST, progress: object = silent) -> History:
    return genetic.find(SMALL, kept, seed=seed, jobs=jobs, population=POPULATION, most=most, progress=progress)  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> History:
    """A search that nothing interrupts."""
    return find(tmp_path_factory.mktemp("whole"))


def course(history: History) -> list[tuple[float, float, int, int]]:
    """All that a history tells but the time it took."""
    return [(one.best, one.mean, one.runs, one.fallen) for one in history.generations]


def same_set(points: np.ndarray, others: np.ndarray) -> bool:
    return bool(np.linalg.norm(points[:, None] - others[None], axis=2).min(axis=1).max() < 1e-12)


MIRROR_X, MIRROR_Y, SWAP = np.diag([-1.0, 1.0]), np.diag([1.0, -1.0]), np.array([[0.0, 1.0], [1.0, 0.0]])


@pytest.mark.parametrize(
    ("case", "count", "kept", "broken"),
    [
        (CASES[0], 9, [MIRROR_X, MIRROR_Y, SWAP], []),  # rods at 0, 30, ..., 240 mm, both families alike
        (CASES[1], 8, [MIRROR_X, MIRROR_Y, SWAP], []),
        (CASES[2], 6 + 8, [MIRROR_X, MIRROR_Y], [SWAP]),
        (LEANS, 3 * 2 + 5, [MIRROR_Y], [MIRROR_X, SWAP]),
    ],
    ids=["hemisphere", "paraboloid", "ellipsoid", "leaning"],
)
def test_random_footprints_have_the_symmetry_of_their_target_and_no_other(
    case: Case, count: int, kept: list[np.ndarray], broken: list[np.ndarray]
) -> None:
    one = design(case)
    assert len(one.lower) == count
    points = one.footprint(one.random(np.random.default_rng(0), 1, 0.1)[0]).points
    assert all(same_set(points @ turn.T, points) for turn in kept)
    assert not any(same_set(points @ turn.T, points) for turn in broken)


@pytest.mark.parametrize("case", [CASES[2], LEANS], ids=["ellipsoid", "leaning"])
def test_a_variable_moves_only_its_own_rod_ends_and_along_their_rods(case: Case) -> None:
    one = design(case)
    variables = 0.5 * (one.lower + one.upper)
    before = one.footprint(variables).points
    np.testing.assert_allclose(reach(one.footprint(variables)), variables[one.orbit], rtol=1e-12)
    for k in range(len(variables)):
        moved = one.footprint(variables + 1e-3 * (np.arange(len(variables)) == k)).points - before
        np.testing.assert_allclose(np.linalg.norm(moved, axis=1), 1e-3 * (one.orbit == k), atol=1e-12)
        outward = before * np.repeat([[rod.family == "u", rod.family == "v"] for rod in one.lines], 2, axis=0)
        assert np.all(np.einsum("ij,ij->i", moved, outward)[one.orbit == k] > 0)


def test_bounds_run_from_taut_to_twice_as_long_on_a_hemisphere_and_hold_the_direct_answer_on_all_targets() -> None:
    """A vertical section of a hemisphere over a chord of its rim is half a circle: as high as the chord's half."""
    one = design(CASES[0])
    np.testing.assert_allclose(one.upper, 2 * one.lower, rtol=2e-3)
    ends = direct(CASES[0]).trimmed.boundary.points[:, :2].reshape(-1, 2, 2)
    chords = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    np.testing.assert_allclose(one.lower[one.orbit].reshape(-1, 2).sum(axis=1), chords, atol=2e-6)
    for case in CASES:
        found = direct_variables(case)
        assert np.all((design(case).lower < found) & (found < design(case).upper))


@pytest.mark.parametrize("case", [SMALL, *CASES], ids=lambda case: f"{case.target.name}-{case.rods[0]}")
def test_the_objective_at_the_direct_answer_is_the_direct_methods_own_agreement(case: Case) -> None:
    """Popped up from flat on a mesh of its own, not released from the draped state. Newton's steps end at 1e-6."""
    assert design(case).error(direct_variables(case)) == pytest.approx(direct(case).agreement["pinned"].rms, rel=1e-5)


def test_the_objective_is_the_rms_of_nodes_and_edge_middles_off_the_sphere() -> None:
    one = design(CASES[0])
    variables = 1.002 * direct_variables(CASES[0])
    popped = one.pop_up(variables)
    assert popped is not None
    mesh, points = popped.footprint.mesh, [popped.positions]
    for rod in range(len(mesh.grid.rods)):
        s = mesh.stations[mesh.rod_slice(rod)]
        points.append(CubicSpline(s, popped.positions[mesh.nodes_of(rod)])(0.5 * (s[1:] + s[:-1])))
    gaps = np.linalg.norm(np.vstack(points), axis=1) - 0.2
    # another cubic through the nodes: middles differ by 1e-6 m where gaps are 1e-3 m
    assert one.error(variables) == pytest.approx(float(np.sqrt(np.mean(gaps**2))), rel=2e-3)


def test_what_does_not_stand_counts_as_off_by_the_targets_size(monkeypatch: pytest.MonkeyPatch) -> None:
    one = design(SMALL)
    good = direct_variables(SMALL)
    short = np.where(good == good.min(), 0.05, good)  # ends before the joints at 60 mm: one joint is left
    assert one.pop_up(short) is None
    assert one.error(short) == 0.2
    stands = one.pop_up(good)
    assert stands is not None
    found = stands.equilibrium
    shaky = replace(stands, equilibrium=replace(found, report=replace(found.report, negative_modes=1)))
    with monkeypatch.context() as patched:
        patched.setattr(genetic_search, "pop_up", lambda *_, **__: shaky)
        assert one.error(good) == 0.2
    monkeypatch.setattr(genetic_search, "PATIENCE", 5)
    assert one.error(good) == 0.2


def test_random_footprints_are_smooth_but_for_the_roughness_and_within_bounds() -> None:
    one = design(CASES[0])
    shares = (one.random(np.random.default_rng(5), 200, 0.0) - one.lower) / (one.upper - one.lower)
    assert shares.min() >= 0
    assert shares.max() <= 1
    assert np.ptp(shares[:, 0]) > 0.8  # they fill the bounds
    offsets = np.unique([abs(rod.offset) for rod in one.lines])
    order = np.argsort([np.flatnonzero(one.orbit == k)[0] for k in range(9)])[::-1]  # from the middle outwards
    assert np.abs(np.diff(shares[:, order], n=3, axis=1)).max() < 1e-9  # parabolas over equal steps of offset
    assert np.allclose(np.diff(offsets), offsets[1])
    rough = (one.random(np.random.default_rng(5), 200, 0.04) - one.lower) / (one.upper - one.lower)
    assert 0.019 < np.abs(rough - shares).max() <= 0.02 + 1e-12
    roughest = one.random(np.random.default_rng(5), 200, 1.0)
    assert np.array_equal(roughest.min(axis=0), one.lower)
    np.testing.assert_allclose(roughest.max(axis=0), one.upper, rtol=1e-15)


@pytest.mark.slow
def test_a_search_from_the_same_seed_is_the_same_and_from_another_is_not(whole: History, tmp_path: Path) -> None:
    again, other = find(tmp_path / "again"), find(tmp_path / "other", seed=SEED + 1)
    assert course(again) == course(whole)
    assert np.array_equal(again.variables, whole.variables)
    assert course(other) != course(whole)


@pytest.mark.slow
def test_the_best_gets_better_and_is_what_its_variables_give(whole: History) -> None:
    best = [one.best for one in whole.generations]
    assert best == sorted(best, reverse=True)
    assert best[-1] < best[0]
    assert design(SMALL).error(whole.variables) == best[-1]
    assert [one.runs for one in whole.generations] == [POPULATION * (k + 1) for k in range(MOST)]
    assert np.array_equal(whole.footprint, design(SMALL).footprint(whole.variables).points)


def stopping(after: int) -> Callable[[str, str, float], None]:
    """A progress that is interrupted at its call of this number."""
    left = after

    def told(*_: object) -> None:
        nonlocal left
        left -= 1
        if left == 0:
            raise KeyboardInterrupt

    return told


@pytest.mark.slow
def test_an_interrupted_search_goes_on_bit_for_bit_and_makes_no_run_twice(
    whole: History, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    runs = 0
    judge = genetic_search._judge

    def counted(*given: object) -> tuple[float, float]:
        nonlocal runs
        runs += 1
        return judge(*given)  # type: ignore[arg-type]

    monkeypatch.setattr(genetic_search, "_judge", counted)
    for after in (3, POPULATION, POPULATION + 2):  # in the first generation, at an end, in a later one
        with pytest.raises(KeyboardInterrupt, match=r"hemisphere-seed3.json has the values found so far"):
            find(tmp_path, progress=stopping(after))
    found = find(tmp_path)
    assert course(found) == course(whole)
    assert np.array_equal(found.variables, whole.variables)
    assert runs == POPULATION * MOST
    find(tmp_path)
    assert runs == POPULATION * MOST  # a finished one costs nothing


@pytest.mark.slow
def test_a_search_given_up_goes_on_when_more_generations_are_allowed(whole: History, tmp_path: Path) -> None:
    assert course(find(tmp_path, most=2)) == course(whole)[:2]
    assert course(find(tmp_path)) == course(whole)


@pytest.mark.slow
def test_two_processes_find_what_one_finds(whole: History, tmp_path: Path) -> None:
    found = find(tmp_path, jobs=2, most=2)
    assert course(found) == course(whole)[:2]
    assert all(one.seconds > 0 for one in found.generations)


def test_a_search_says_where_it_is_in_every_generation(tmp_path: Path) -> None:
    told = []
    find(tmp_path, most=2, progress=lambda stage, detail, _: told.append((stage, detail)))
    stages = list(dict.fromkeys(stage for stage, _ in told))
    assert len(stages) == 3
    assert f"best {1e3 * find(tmp_path, most=1).best:.3f} mm" in stages[1]
    assert len(told) == 2 * POPULATION + 1


@pytest.mark.parametrize(
    "text", ["", "{", "[]", '{"format": "rodshell-genetic-values", "version": 1}', '{"format": "other"}'],
)  # fmt: skip
def test_a_broken_file_is_refused_in_one_sentence(text: str, tmp_path: Path) -> None:
    file = tmp_path / f"hemisphere-seed{SEED}.json"
    file.write_text(text)
    with pytest.raises(InputError, match=r"cannot continue the search in .*hemisphere-seed3.*remove it"):
        find(tmp_path)
    assert file.read_text() == text


@pytest.mark.slow
@pytest.mark.parametrize("harm", ["lost", "nan", "many"])
def test_values_that_cannot_be_are_refused(harm: str, tmp_path: Path) -> None:
    find(tmp_path, most=1)
    file = tmp_path / f"hemisphere-seed{SEED}.json"
    content = json.loads(file.read_text())
    if harm == "lost":
        content["digests"] = []
    elif harm == "nan":
        content["values"][0][2] = float("nan")
    else:
        content["values"][0] += [0.1]
    file.write_text(json.dumps(content))
    with pytest.raises(InputError, match="hemisphere-seed3"):
        find(tmp_path)


def test_values_of_another_search_are_refused(tmp_path: Path) -> None:
    find(tmp_path, most=1)
    (tmp_path / f"hemisphere-seed{SEED}.json").rename(tmp_path / "hemisphere-seed9.json")
    with pytest.raises(InputError, match=r"hemisphere-seed9.json is a different one"):
        find(tmp_path, seed=9, most=1)


def test_without_pymoo_one_sentence_says_what_to_install(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setitem(sys.modules, "pymoo.algorithms.soo.nonconvex.de", None)
    with pytest.raises(InputError, match=r'needs the package pymoo: pip install "rodshell\[paper\]"'):
        find(tmp_path)
    genetic.make(silent, cases=CASES[1:2])  # the searches that are kept need no such package


def test_a_search_has_converged_when_twenty_generations_gained_less_than_a_hundredth() -> None:
    assert gain([2.0] * WINDOW) == 1.0
    assert gain([2.0, *[1.0] * WINDOW]) == 0.5
    assert gain([2.0, 1.0, *[0.995] * WINDOW]) == pytest.approx(0.005)


@pytest.mark.slow
def test_the_table_the_picture_and_the_files_tell_the_search(tmp_path: Path) -> None:
    made = genetic.make(silent, seed=SEED, generations=1, cases=[SMALL], folder=tmp_path / "kept")
    assert made.status == f"seed {SEED} on the hemisphere has not converged: 1 of at least 21 generations"
    made.save(tmp_path / "genetic")
    found, by_direct = made.parts[0].searches[0], made.rows()[0]
    assert float(by_direct[5]) == pytest.approx(1e3 * direct(SMALL).agreement["pinned"].rms, abs=6e-4)
    assert by_direct[3] == "1"
    row = made.rows()[1]
    assert float(row[5]) == pytest.approx(1e3 * found.history.best, abs=6e-4)
    assert int(row[3]) == genetic_search.POPULATION
    apart = 1e3 * np.abs(reach(direct(SMALL).footprint) - found.history.variables[design(SMALL).orbit])
    assert [float(one) for one in row[7:9]] == pytest.approx([apart.max(), np.sqrt(np.mean(apart**2))], abs=6e-3)
    assert row[-1].startswith("NOT CONVERGED")
    kept = History.of((tmp_path / "genetic" / f"hemisphere-{SEED}.json").read_text())
    assert kept.generations == found.history.generations
    assert np.array_equal(kept.variables, found.history.variables)
    result = json.loads((tmp_path / "genetic" / "result.json").read_text())
    assert result["comparisons"][0]["searches"][0]["forward_runs"] == genetic_search.POPULATION
    root = ElementTree.parse(tmp_path / "genetic" / "genetic.svg").getroot()
    assert len(root.findall(".//{http://www.w3.org/2000/svg}polyline")) == 2  # the search, the direct method


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["fig4", "--seed", "2"], "--seed is for the figure genetic, not for fig4"),
        (["genetic", "--jobs", "2"], "jobs and generations belong to a new search: give its seed, too"),
        (["genetic", "--seed", "2", "--target", "cap"], "use one of hemisphere, paraboloid, ellipsoid"),
        (["genetic", "--seed", "-1"], "--seed"),
    ],
)
def test_the_command_refuses_what_is_not_for_it(
    words: list[str], said: str, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    assert main(["paper", *words, "--quiet", "--out", str(tmp_path / "out")]) == 2
    assert said in capsys.readouterr().err


def test_the_command_says_what_an_interrupted_search_keeps(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def stopped(*_: object) -> tuple[float, float]:
        raise KeyboardInterrupt

    monkeypatch.setattr(genetic_search, "_judge", stopped)
    monkeypatch.chdir(tmp_path)
    assert main(["paper", "genetic", "--seed", "2", "--target", "ellipsoid", "--quiet", "--out", "here"]) == 130
    assert (
        "interrupted: out/genetic-searches/ellipsoid-seed2.json has the values found so far" in capsys.readouterr().err
    )


def test_a_best_footprint_that_pops_up_otherwise_is_said(whole: History) -> None:
    last = replace(whole.generations[-1], best=0.5 * whole.best)
    lying = replace(whole, generations=(*whole.generations[:-1], last))
    assert "does not pop up again" in genetic.compare(SMALL, [lying]).status


SEEDS = range(1, 6)
KEPT = [(case, number) for case in CASES for number in range(len(SEEDS))]


@pytest.mark.parametrize(("case", "number"), KEPT, ids=lambda one: one.target.name if isinstance(one, Case) else one)
def test_the_kept_searches_converged_and_their_best_pop_up_again(case: Case, number: int) -> None:
    history = stored(case.target.name)[number]
    best = [one.best for one in history.generations]
    assert best[-1] > (1 - GAIN) * best[-1 - WINDOW]
    assert min(np.array(best[: -1 - WINDOW][WINDOW:]) * (1 - GAIN) - best[2 * WINDOW : -1]) > 0  # not before
    assert best == sorted(best, reverse=True)
    assert history.runs == history.population * len(best)
    assert design(case).error(history.variables) == pytest.approx(best[-1], rel=1e-4)
    assert best[0] > 5 * direct(case).agreement["pinned"].rms  # they began far from the direct answer
    np.testing.assert_allclose(history.footprint, design(case).footprint(history.variables).points, atol=1e-7)
    assert history.rods == tuple(rod.name for rod in direct(case).footprint.rods)


def test_a_target_without_a_kept_search_has_none() -> None:
    assert stored("cap") == ()


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.target.name)
def test_five_seeds_are_kept_from_the_best_and_the_best_is_nearer_than_the_direct_answer(case: Case) -> None:
    kept = stored(case.target.name)
    assert sorted(history.seed for history in kept) == list(SEEDS)
    assert [history.best for history in kept] == sorted(history.best for history in kept)
    assert kept[0].best < direct(case).agreement["pinned"].rms


def test_a_history_is_read_as_it_was_written(whole: History) -> None:
    again = History.of(whole.json())
    assert again.generations == whole.generations
    assert isinstance(again.generations[0], Generation)
    assert again.last_gain == whole.last_gain == 1.0
    assert not again.converged

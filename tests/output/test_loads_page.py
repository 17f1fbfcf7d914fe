"""The report's part on loads says what the result has."""

from dataclasses import replace
from functools import cache

import pytest

import rodshell as rs
from rodshell.figures.loads import LoadedShell
from rodshell.output.loads_page import _stability, loads_page
from rodshell.results import Archive
from rodshell.results.summary import summary_text

CASE = {
    "target": {"kind": "cap", "radius": "10 m", "base": "7 m"},
    "layout": {"spacing": "3 m", "edge": "1.5 m"},
    "rod": {
        "section": {"kind": "rectangle", "width": "20 mm", "height": "30 mm"},
        "material": {"preset": "larch"},
    },
    "joint": {"kind": "pin"},
    "pop_up": {"ends": "pinned"},
    "checks": {"stages": 0},
    "bracing": {
        "kind": "cables", "prestrain": 2e-4,
        "section": {"kind": "circle", "radius": "2 mm"}, "material": {"preset": "spring-steel"},
    },
    "loads": [{"name": "snow", "kind": "snow", "value": "20 N/m2"}],
    "combinations": [{"name": "winter", "factors": {"snow": 1.5}}],
    "strength": {"service_class": 3, "hole": "6 mm", "slip": "500 N"},
}  # fmt: skip


@cache
def archive() -> Archive:
    return rs.Job.load(CASE).run().archive()


def test_holes_weaken_the_unloaded_shell_too() -> None:
    """All inner nodes are joints here, where a hole of 6 mm takes a fifth of the section's 30 mm."""
    case = {**CASE, "checks": {"stages": 4}, "layout": {"spacing": "3 m", "edge": "3 m"}}
    full = rs.Job.load({**case, "strength": {"service_class": 3, "slip": "500 N"}}).run().archive().results
    net = rs.Job.load(case).run().archive().results
    for shape in ("pinned", "deployment"):
        before, after = (getattr(results.bending, shape).utilisation for results in (full, net))
        assert after == pytest.approx(before / 0.8, rel=1e-9)
    assert ", holes at joints counted\n" in summary_text(net, verbose=True)
    assert "holes" not in summary_text(full, verbose=True)
    assert net.strength is not None
    assert full.strength is not None
    assert net.strength.erection_utilisation == net.bending.deployment.utilisation  # type: ignore[union-attr]
    permanent = net.loads["winter"]["pinned"].utilisations.permanent  # type: ignore[union-attr]
    assert permanent == pytest.approx(net.bending.pinned.utilisation, rel=0.1)  # type: ignore[union-attr]


def test_the_worst_place_is_that_of_the_net_section() -> None:
    """At a joint, where four fifths of the section are missing, and not between joints, where the rods bend most."""
    found = rs.Job.load({**CASE, "strength": {"service_class": 3, "hole": "24 mm"}}).run().archive().results
    assert found.bending is not None
    assert found.bending.pinned is not None
    (rod,) = [rod for rod in found.rods if rod.id == found.bending.pinned.rod]
    assert min(abs(joint.at - found.bending.pinned.at) for joint in rod.joints) < 1e-9  # type: ignore[operator]


def test_every_figure_of_the_page_is_that_of_the_result() -> None:
    page, results = loads_page(archive()), archive().results
    assert page is not None
    loaded, used = results.loads["winter"]["pinned"], results.strength
    assert loaded.utilisations is not None
    assert used is not None
    assert used.permanent == pytest.approx(0.5 * 30e6 / 1.3)
    (row,) = (list(figures.values()) for figures in page["strength"])
    assert row[:3] == ["winter", "pinned", "short"]
    shares = [float(value.removesuffix(" %").replace("under ", "")) for value in row[3:7]]
    parts = loaded.utilisations
    assert shares == pytest.approx(
        [100 * v for v in (parts.bending, parts.shear, parts.slip, parts.permanent)], rel=0.1
    )  # type: ignore[operator]
    assert loaded.utilisation == max(v for v in (parts.bending, parts.shear, parts.slip, parts.permanent) if v)
    assert 0 < parts.slip_unloaded < parts.slip  # type: ignore[operator]
    assert loaded.governs is not None
    assert loaded.governs.rod in row[7]
    assert any("service class 3" in sentence and "EN 1995" in sentence for sentence in page["assumptions"])
    assert any("counts divided by 3 (1 + k_def)" in sentence for sentence in page["assumptions"])
    assert len(page["modes"]) >= 3
    (braced,) = page["bracing"]
    assert braced["Utilisation"] != "not known"
    (held,) = page["foundations"]
    assert float(held["Loads x, y, z"].split(", ")[2]) == -float(held["Reactions x, y, z"].split(", ")[2])


def test_without_loads_there_is_no_page() -> None:
    plain = {key: CASE[key] for key in ("target", "layout", "rod", "joint", "pop_up", "checks")}
    assert loads_page(rs.Job.load(plain).run().archive()) is None


@pytest.mark.parametrize(
    ("limit", "kind", "imperfect", "imperfect_kind", "said"),
    [
        (1.0, "bifurcation", 1.2, "limit point", "1.2 (the bifurcation is stable)"),
        (1.0, "bifurcation", None, "none", "over 100 (the bifurcation is stable)"),
        (1.0, "bifurcation", 1.002, "limit point", "1"),  # as near as factors are found
        (1.0, "bifurcation", 0.8, "limit point", "0.8"),
        (1.0, "limit point", 1.2, "limit point", "1.2"),
        (1.0, "bifurcation", 1.2, "not followed", "not known above 1.2"),
        (0.1, "limit point", None, "not followed", "not known"),
        (1.0, "bifurcation", None, None, "not asked for"),
        (None, "none", None, "none", "over 100"),
    ],
)
def test_a_factor_that_imperfections_raise_is_explained(
    limit: float | None, kind: str, imperfect: float | None, imperfect_kind: str | None, said: str
) -> None:
    shell = LoadedShell(limit_factor=limit, limit_kind=kind, imperfect_factor=imperfect, imperfect_kind=imperfect_kind)  # type: ignore[call-arg]
    assert _stability(shell)["With imperfections"] == said


def test_deflections_do_not_stand_above_the_limit_at_which_they_are_known() -> None:
    factor = 0.512747
    loaded = archive().results.loads["winter"]["pinned"]
    shell = loaded.model_copy(update={"limit_factor": factor, "at_factor": factor})
    results = archive().results.model_copy(update={"loads": {"winter": {"pinned": shell}}})
    assert "stable up to 0.512 times the loads" in summary_text(results, verbose=True)
    assert "; deflection at 0.512 times " in summary_text(results, verbose=True)
    page = loads_page(replace(archive(), results=results))
    assert page is not None
    assert page["deflection"][0]["At factor"] == "0.512"

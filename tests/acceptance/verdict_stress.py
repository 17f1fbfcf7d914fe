"""Stress with torsion, strain beyond thin rods, strength exceeded and contact, against the tests' independent code."""

from collections.abc import Iterator
from functools import cache

import numpy as np

import rodshell as rs
from rodshell.checks import Checks, check
from rodshell.checks.bending import bending_of
from rodshell.checks.contact import contact_of
from tests.acceptance.rows import Row
from tests.checks.stress_twin import distance, stresses, twisted_shells

R = 0.2
THIN = 0.05  # the theory of thin rods, as the checks have it


def stress_rows() -> Iterator[Row]:
    """Five shells, at every node of every rod: by joints or unlike stiffnesses twisted, and counted two ways."""
    for name, (rod, form) in twisted_shells().items():
        popped = form.popped["pinned"]
        for strengths, weight in (("von Mises", np.sqrt(3.0)), ("shear strength a sixth", 6.0)):
            found = bending_of(popped.shell, popped.state, rod, shear_weight=weight)
            assert found.stress is not None
            assert found.torsion_stress is not None
            expected = stresses(popped.shell, popped.state, rod, weight)
            off = 100 * float(np.abs(found.stress - expected).max() / expected.max())
            share = 100 * found.torsion_stress.max() / found.stress.max()
            note = f"{1e-6 * found.stress.max():.1f} MPa, torsion {share:.1f} % of it, {len(expected)} places"
            yield Row(name, f"stress off the twin's, {strengths}", off, 0.5, "%", note)


def curvature_rows() -> Iterator[Row]:
    """Curvature out of the shell, and twist, where they are known: round rods with ball joints on a sphere."""
    layout = rs.GridLayout.orthogonal(spacing=0.03, edge=0.005)
    rod = rs.Rod(rs.Circle(1e-3), rs.Material(1e6, 1e3))
    popped = rs.find_form(rs.Hemisphere(R), layout, rod, ends=("clamped",)).popped["clamped"]
    bent = bending_of(popped.shell, popped.state, rod)
    assert bent.normal_curvature is not None
    off = 100 * np.abs(R * np.abs(bent.normal_curvature) - 1)
    yield Row("hemisphere, clamped", "curvature out of the shell off 1/R, 95 %", float(np.quantile(off, 0.95)), 2, "%")
    yield Row("hemisphere, clamped", "twist of round rods with ball joints", float(np.abs(bent.twist_rate).max()), 0)


@cache
def checked(radius: float) -> tuple[Checks, rs.Form]:
    rod = rs.Rod(rs.Circle(radius), rs.Material(1e9, 1e3))
    layout = rs.GridLayout.orthogonal(rods=(17, 17), spacing=0.03, edge=0.005)
    form = rs.find_form(rs.Hemisphere(R), layout, rod)
    return check(form.popped, rod, stages=4), form


def contact_rows() -> Iterator[Row]:
    """20 mm and 40 mm rods on the hemisphere are found; so are slender ones not, nor what meets by design."""
    for radius in (0.01, 0.02):
        checks, form = checked(radius)
        for ends, popped in form.popped.items():
            nearest = _nearest_parallel(popped) - 2 * radius
            found = checks.contact[ends]
            assert found.clearance is not None
            case = f"{2e3 * radius:.0f} mm rods on the hemisphere, {ends}"
            note = f"{1e3 * found.clearance:.2f} mm, {found.pairs} pairs, worst {found.rods}"
            yield Row(case, "clearance off that of all pairs", 1e3 * abs(found.clearance - nearest), 0.5, "mm", note)
            yield Row(case, "not found", float(found.pairs == 0), 0)
        yield Row(
            f"{2e3 * radius:.0f} mm rods on the hemisphere",
            "not said",
            float(not any(met.pairs for met in checks.contact.values())),
            0,
        )
    for radius in (0.001, 0.01, 0.02):
        checks, form = checked(radius)
        bent = checks.bending["pinned"].bending_strain
        assert bent is not None
        expected = radius * _sharpest(form.popped["pinned"])
        off, note = 100 * abs(float(bent.max()) / expected - 1), f"{100 * bent.max():.2g} %"
        said = any("too thick" in word for word in form.verdict.reasons)
        case = f"{2e3 * radius:.0f} mm rods on the hemisphere"
        yield Row(case, "bending strain off r over radius", off, 2, "%", note)
        yield Row(case, "strain beyond thin rods said wrongly", float(said != (expected > THIN)), 0)
    checks, form = checked(0.001)
    wrong = sum(found.pairs for found in (*checks.contact.values(), *checks.deployment_contact))
    yield Row("2 mm rods on the hemisphere", "contacts in all shapes and stages", float(wrong), 0)


def _sharpest(popped: rs.PopUp) -> float:
    """Largest curvature [1/m] by the circles through three nodes in a row."""
    a, b, c = (popped.positions[popped.footprint.mesh.bends[:, k]] for k in range(3))
    sides = [np.linalg.norm(p - q, axis=1) for p, q in ((a, b), (b, c), (c, a))]
    return float((2 * np.linalg.norm(np.cross(b - a, c - a), axis=1) / np.prod(sides, axis=0)).max())


def _nearest_parallel(popped: rs.PopUp) -> float:
    """Distance of the axes of the two nearest rods of one family [m], by a search over all pairs near the rim."""
    mesh, x = popped.footprint.mesh, popped.positions
    rods = mesh.grid.rods
    nearest = np.inf
    for a in range(len(rods)):
        for b in range(a + 1, len(rods)):
            if rods[a].family != rods[b].family:
                continue
            one, two = x[mesh.nodes_of(a)], x[mesh.nodes_of(b)]
            i, j = np.unravel_index(np.argmin(np.linalg.norm(one[:, None] - two[None], axis=2)), (len(one), len(two)))
            for k in range(max(int(i) - 1, 0), min(int(i) + 1, len(one) - 1)):
                for m in range(max(int(j) - 1, 0), min(int(j) + 1, len(two) - 1)):
                    nearest = min(nearest, distance(one[k], one[k + 1], two[m], two[m + 1]))
    return nearest


def design_rows() -> Iterator[Row]:
    """Patches meet at a seam, rods end at openings and cross next to their ends: no contacts."""
    dome, rod = rs.Hemisphere(R), rs.Rod(rs.Circle(1.5e-3), rs.Material(1e9, 1e3))
    seams = [[(-1.0, 0.0), (1.0, 0.0)], [(-1.0, -1.0), (1.0, 1.0)], [(-1.0, 0.2), (0.0, -0.05), (1.0, 0.1)]]
    for number, seam in enumerate(seams, start=1):
        layout = rs.GridLayout.orthogonal(spacing=0.04, edge=0.01)
        form = rs.find_form(dome, layout, rod, seams=[seam], ends=("clamped",))
        met = form.checks.contact["clamped"]
        yield Row(f"dome with seam {number}", "contacts", float(met.pairs), 0, "", f"{len(form.meetings)} meetings")
    for offset in (0.0, 0.006, 0.013):
        layout = rs.GridLayout.orthogonal(spacing=0.04, edge=0.01, offset=(offset, offset), rotate=0.3)
        popped = rs.find_form(dome, layout, rod, ends=("clamped",)).popped["clamped"]
        met = contact_of(popped.shell, popped.state, rod)
        yield Row(f"hemisphere, offset {1e3 * offset:.0f} mm", "contacts", float(met.pairs), 0)


def strength_rows() -> Iterator[Row]:
    """The strength that is exceeded is told with its figure, and torsion is in it."""
    rod, form = twisted_shells()["laths with pins"]
    alone = bending_of(form.popped["pinned"].shell, form.popped["pinned"].state, rod).stress
    assert alone is not None
    for share, says in ((0.5, "200 %"), (1.25, None)):
        strength = share * float(alone.max())
        result = form.archive(options=rs.OutputOptions(strength=strength, stages=0)).results.plain()
        used = result["bending"]["pinned"]["utilisation"]
        case = f"laths, strength {share:g} of the stress"
        yield Row(case, "utilisation off", abs(used * share - 1), 1e-6, "", f"{100 * used:.0f} %")
        words = [word for word in result["verdict"]["reasons"] if "the given strength" in word and "ends" in word]
        said = len(words) == 1 and says in words[0] if says else not words
        yield Row(case, "said wrongly", float(not said), 0)
    given = rs.Rod(rs.GivenSection(EA=1e5, EI1=1.0, EI2=1.0, GJ=0.7))
    try:
        rs.OutputOptions(strength=1e8).require_known_stress(given, rs.Pin())
        refused = ""
    except rs.InputError as error:
        refused = str(error)
    yield Row("given section with a strength", "not refused", float("fibre_distances" not in refused), 0, "", refused)


def rows() -> Iterator[Row]:
    yield from stress_rows()
    yield from curvature_rows()
    yield from contact_rows()
    yield from design_rows()
    yield from strength_rows()

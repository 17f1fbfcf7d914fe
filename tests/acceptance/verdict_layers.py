"""Rows of rods in two layers, and of wide laths with pins."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache

import numpy as np

import rodshell as rs
from tests.acceptance.cases import ROD, R
from tests.acceptance.rows import Row
from tests.nets.sphere_net import sphere_net_end
from tests.targets.meshes import sheet

TUBE = rs.Rod(rs.Tube(radius=0.021, thickness=0.0035), rs.Material(25e9, 1900.0, 0.3))
LATH = rs.Rod(rs.RectangularSection(width=0.002, height=0.04), rs.Material(10e9, 600.0))  # EI2/EI1 = 400


@dataclass(frozen=True)
class LayeredCase:
    """A target, the spacing, the rod and the eccentricities of its pins [m]."""

    name: str
    target: rs.Target
    eccentricities: tuple[float, ...]
    rod: rs.Rod = ROD
    spacing: float = 0.03


def roof() -> rs.Target:
    """A roof of 12 m by triangles, with no symmetry."""
    x, faces = sheet(lambda x, y: 3.0 - 0.06 * x**2 - 0.045 * y**2 + 0.02 * x * y + 0.002 * x**3, 6.0, 60)
    return rs.Freeform.of(x, faces)


CASES = (
    LayeredCase("hemisphere R 200 mm", rs.Hemisphere(R), (2e-3, 4e-3)),
    LayeredCase("ellipsoid", rs.Ellipsoid(a=0.2, b=0.15, c=0.12), (2e-3, 4e-3)),
    LayeredCase("sphere 10 m, 42 mm tubes", rs.Hemisphere(10.0), (0.042,), TUBE, 1.0),
    LayeredCase("mesh roof, 42 mm tubes", roof(), (0.042,), TUBE, 1.0),
)


@cache
def form_of(case: LayeredCase, eccentricity: float) -> rs.Form:
    layout = rs.GridLayout.orthogonal(spacing=case.spacing)
    return rs.find_form(case.target, layout, case.rod, joint=rs.Pin(eccentricity=eccentricity))


def off_the_sphere(form: rs.Form, eccentricity: float) -> float:
    """Largest difference [m] of a rod's half length from that of the exact nets of two spheres."""
    radius, worst = form.target.size, 0.0
    for rod in form.footprint.rods:
        h = (0.5 if rod.family == "v" else -0.5) * eccentricity
        exact = (radius + h) / radius * sphere_net_end(radius, rod.offset * radius / (radius - h))
        worst = max(worst, abs(rod.end - exact), abs(rod.start + exact))
    return worst


def lattice_error(form: rs.Form) -> float:
    """How far joints and rods' nodes are from a straight lattice at equal spacing in the flat grid [m]."""
    mesh, spacing = form.footprint.mesh, form.layout.spacing
    below, above = mesh.flat[mesh.joint_pairs[:, 0]], mesh.flat[mesh.joint_pairs[:, 1]]
    off = np.abs(below[:, :2] / spacing - np.round(below[:, :2] / spacing)).max() * max(spacing)
    bent = max(
        float(np.ptp(mesh.flat[mesh.nodes_of(k)][:, 1 if rod.family == "u" else 0]))
        for k, rod in enumerate(mesh.grid.rods)
    )
    return max(float(off), float(np.abs(above[:, :2] - below[:, :2]).max()), bent)


def joint_error(form: rs.Form, positions: np.ndarray, eccentricity: float) -> float:
    """Largest difference of the distance of two rods at a joint from the eccentricity [m]."""
    x = positions[form.footprint.mesh.joint_pairs]
    return float(np.abs(np.linalg.norm(x[:, 1] - x[:, 0], axis=1) - eccentricity).max())


def layered_rows(case: LayeredCase, eccentricity: float) -> Iterator[Row]:
    name, plain, form = f"{case.name}, e = {1e3 * eccentricity:g} mm", form_of(case, 0.0), form_of(case, eccentricity)
    yield Row(name, "not converged", float(form.status != "converged"), 0, note=form.status)
    for ends, shell in form.popped.items():
        without = plain.popped[ends].report.factorizations
        note = f"{without} without"
        yield Row(name, f"{ends}: factorisations", shell.report.factorizations, 3 * without, note=note)
        yield Row(name, f"{ends}: negative modes", shell.report.negative_modes, 0)
        gap, before = form.agreement[ends].max_relative, plain.agreement[ends].max_relative
        note = f"{100 * before:.3g} % without"
        yield Row(name, f"{ends}: gap of the middle surface", 100 * gap, 150 * before + 0.05, "%", note)
        off = joint_error(form, shell.positions, eccentricity) / eccentricity
        yield Row(name, f"{ends}: joint distances off e", off, 1e-3, "e")
    if isinstance(case.target, rs.Hemisphere):
        off = off_the_sphere(form, eccentricity)
        longer = max(abs(a.length - b.length) for a, b in zip(plain.footprint.rods, form.footprint.rods, strict=True))
        note = f"layers change lengths by up to {1e3 * longer:.2f} mm"
        yield Row(name, "rod ends off the exact nets of two spheres", 1e3 * off, 0.01, "mm", note)
    yield Row(name, "flat grid off a straight lattice", lattice_error(form) / case.target.size, 1e-12, "size")
    off = joint_error(form, form.trimmed.positions, eccentricity)
    yield Row(name, "draped joint distances off e", off / eccentricity, 1e-12, "e")
    strain = np.abs(edge_strains(form)).max()
    yield Row(name, "draped rods' strain along their layers", float(strain), 2e-5)


def edge_strains(form: rs.Form) -> np.ndarray:
    mesh, x = form.trimmed.mesh, form.trimmed.positions
    return np.linalg.norm(x[mesh.edges[:, 1]] - x[mesh.edges[:, 0]], axis=1) / mesh.edge_lengths - 1.0


def lath_rows() -> Iterator[Row]:
    for name, target, spacing in (
        ("2 x 40 mm laths, hemisphere R 2 m", rs.Hemisphere(2.0), 0.3),
        ("2 x 40 mm laths, cap R 2 m over 1 m", rs.Cap(radius=2.0, base=1.0), 0.3),
        ("2 x 40 mm laths, hemisphere R 200 mm", rs.Hemisphere(R), 0.06),
    ):
        layout = rs.GridLayout.orthogonal(spacing=spacing)
        before = rs.drape(layout, LATH, target, joint=rs.Pin()).warnings
        said = [words for words in before if "EI2/EI1" in words]
        yield Row(name, "not warned of before the pop-up", float(not said), 0, note=said[0] if said else "")
        form = rs.find_form(target, layout, LATH, joint=rs.Pin())
        work = sum(shell.report.factorizations for shell in form.popped.values())
        yield Row(name, "factorisations of both pop-ups", work, 99, note=form.status)
        wrong = [words for words in form.warnings if "dips and ridges" in words]
        yield Row(name, "wrong causes named", len(wrong), 0)


def thick_rows() -> Iterator[Row]:
    thick = rs.Rod(rs.Circle(radius=0.01), rs.Material(10e9, 600.0))
    layout = rs.GridLayout.orthogonal(spacing=0.06)
    for name, joint, wanted in (("centred", rs.Pin(), 1), ("eccentric", rs.Pin(eccentricity=0.02), 0)):
        warnings = rs.drape(layout, thick, rs.Hemisphere(R), joint=joint).warnings
        said = [words for words in warnings if "joint.eccentricity" in words]
        note = said[0] if said else ""
        yield Row("20 mm rods on R 200 mm", f"{name}: not told rightly", float(len(said) != wanted), 0, note=note)


def rows() -> Iterator[Row]:
    for case in CASES:
        for eccentricity in case.eccentricities:
            yield from layered_rows(case, eccentricity)
    yield from lath_rows()
    yield from thick_rows()

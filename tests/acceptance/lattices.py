"""Prints the table of lattices along curves of the target: `python -m tests.acceptance.lattices`; exit 1 on a miss."""

import sys
from collections.abc import Iterator
from functools import cache

import numpy as np
from scipy.optimize import least_squares

import rodshell as rs
from rodshell.arrays import Floats
from rodshell.errors import NetLimitError
from rodshell.formfinding.laid import flat_state, lay
from rodshell.formfinding.pipeline import Stages, find_stages
from rodshell.geometry.frames import cross, unit
from rodshell.layout import GridMesh
from rodshell.nets.surface_curves import SurfaceCurves, geodesic, trace
from rodshell.nets.surface_lattice import surface_net
from rodshell.solve.equilibrium import find_stable
from rodshell.solve.problem import Problem
from tests.acceptance.lattices_gallery import gallery_rows
from tests.acceptance.lattices_studio import studio_rows
from tests.acceptance.lattices_twin import twin_rows
from tests.acceptance.rows import Row, print_table
from tests.refining.test_families import ALONG_CURVES, GEODESIC, errors
from tests.targets.meshes import lattice

LATH = rs.Material(youngs_modulus=10e9, density=600.0)
THIN = 2e-3  # m
CAP = rs.Cap(radius=2.0, base=1.0)
BUMPS = "0.8*(exp(-(((x - 0.9)/0.6)^2 + (y/0.7)^2)/2) + exp(-(((x + 0.9)/0.6)^2 + (y/0.7)^2)/2))"
SADDLES = {
    "Scherk": "0.8*(log(cos(y/0.8)) - log(cos(x/0.8)))",
    "other saddle": "0.35*(x^2 - y^2) + 0.08*x^3 - 0.1*x*y^2 + 0.05*x*y",
}


def lath(ratio: float) -> rs.Rod:
    """A lath 2 mm thick with EI2/EI1 = ratio, flat on the target."""
    return rs.Rod(rs.RectangularSection(width=THIN, height=THIN * float(np.sqrt(ratio))), LATH)


# Geodesics

SURFACES = {  # formula over a square of this half width [m]
    "sphere": ("sqrt(4 - x^2 - y^2)", 1.0),
    "cylinder": ("sqrt(4 - x^2)", 1.2),
    "cone": ("3 - sqrt((x + 3)^2 + y^2)", 1.2),
    "ellipsoid": ("sqrt(1 - (x^2 + y^2)/2.56)", 0.9),
}
PLAN = np.array([[0.0, 0.0], [0.31, -0.2], [-0.5, 0.45], [0.2, 0.6]])
HEIGHTS = {
    "sphere": lambda x, y: np.sqrt(4.0 - x * x - y * y),
    "cylinder": lambda x, y: np.sqrt(4.0 - x * x),
    "cone": lambda x, y: 3.0 - np.hypot(x + 3.0, y),
    "ellipsoid": lambda x, y: np.sqrt(1.0 - (x * x + y * y) / 2.56),
}


def laid(target: rs.Target, heading: Floats) -> SurfaceCurves:
    seeds = target.lift(PLAN)
    normal = target.on_surface(seeds).normal
    across = cross(normal, np.tile([*heading, 0.0], (len(seeds), 1)))
    return trace(target, geodesic, seeds, unit(cross(across, normal)))


def off_closed_form(name: str, curves: SurfaceCurves, k: int) -> float:
    """How far a curve is from the geodesic through its seed [m]; on the ellipsoid by Clairaut's constant."""
    s = np.linspace(*curves.ends[k], 300)
    points, tangents = curves.at(np.full(len(s), k), s)
    seed, way = (array[0] for array in curves.at(np.array([k]), np.zeros(1)))
    if name == "sphere":
        return float(np.abs(points @ unit(np.cross(seed, way))).max())
    if name == "ellipsoid":
        moments = points[:, 0] * tangents[:, 1] - points[:, 1] * tangents[:, 0]
        return float(np.abs(moments - (seed[0] * way[1] - seed[1] * way[0])).max())
    if name == "cylinder":
        flat = 2.0 * np.arcsin(points[:, 0] / 2.0) + 1j * points[:, 1]
    else:
        angle = np.arctan2(points[:, 1], points[:, 0] + 3.0)
        flat = np.sqrt(2.0) * np.hypot(points[:, 0] + 3.0, points[:, 1]) * np.exp(1j * angle / np.sqrt(2.0))
    at_seed = np.interp(0.0, s, flat.real) + 1j * np.interp(0.0, s, flat.imag)
    chord = flat[-1] - flat[0]
    return float(np.abs(((flat - at_seed) * np.conj(chord)).imag / np.abs(chord)).max())


def geodesic_rows() -> Iterator[Row]:
    for name, (formula, half) in SURFACES.items():
        exact = rs.HeightField(formula=formula, domain=rs.Rectangle((2 * half, 2 * half)))
        x, y = np.meshgrid(*[np.linspace(-half, half, 141)] * 2, indexing="ij")
        meshed = rs.Freeform.of(*lattice(x, y, HEIGHTS[name](x, y)))
        for kind, target, bound in (("formula", exact, 1e-7), ("mesh", meshed, 1e-4)):
            off = 0.0
            for heading in ([1.0, 0.3], [-0.4, 1.0]):
                curves = laid(target, np.array(heading))
                off = max(off, *(off_closed_form(name, curves, k) for k in range(len(curves))))
            yield Row(f"geodesics, {name}, {kind}", "off the closed form, over the size", off / target.size, bound)


def straight_rows() -> Iterator[Row]:
    """Laths of a lattice are straight when they are developed: their curvature within the surface, times the width."""
    for name, target in (("cap", CAP), ("ellipsoid 3/2/1.2", rs.Ellipsoid(a=3.0, b=2.0, c=1.2))):
        _, within = surface_net(target, rs.Geodesic(spacing=0.3)).curvatures
        yield Row(f"laths, {name}", "in-plane curvature times width", 0.04 * float(np.abs(within).max()), 1e-6)


# Shells


@cache
def shell(name: str, target: rs.Target, grid: rs.Geodesic | rs.Asymptotic, ratio: float) -> Stages:
    anchor = None if isinstance(target, rs.Cap | rs.Ellipsoid) else (0.0, 0.0)
    rod = lath(ratio)
    if isinstance(grid, rs.Asymptotic):  # upright
        rod = rs.Rod(rs.RectangularSection(width=THIN * ratio, height=THIN), LATH)
    return find_stages(target, grid, rod, joint=rs.Pin(), anchor=anchor)


def shell_rows() -> Iterator[Row]:
    grid = rs.Geodesic(spacing=0.3)
    bumps = rs.HeightField(formula=BUMPS, domain=rs.Disc(2.0))
    cases = (
        ("cap, 2 x 40 mm", CAP, 400.0, {"pinned": (0.12, 20), "clamped": (0.01, 60)}),
        ("cap, 2 x 100 mm", CAP, 2500.0, {"pinned": (0.12, 20), "clamped": (0.01, 60)}),
        (
            "ellipsoid, 2 x 40 mm",
            rs.Ellipsoid(a=3.0, b=2.0, c=1.2),
            400.0,
            {"pinned": (0.1, 100), "clamped": (0.1, 100)},
        ),
        ("two bumps, 2 x 40 mm", bumps, 400.0, {"pinned": (1.2, 100), "clamped": (1.2, 100)}),
    )
    for name, target, ratio, figures in cases:
        form = shell(name, target, grid, ratio)
        for ends, (gap, most) in figures.items():
            report = form.popped[ends].report  # type: ignore[index]
            off = 100 * form.agreement[ends].max_relative if report.stable else np.inf  # type: ignore[index]
            yield Row(f"{name}, {ends}", "gap max over the size", off, gap, "%", report.sentence)
            yield Row(f"{name}, {ends}", "factorisations", report.factorizations, most)


def family_rows() -> Iterator[Row]:
    """What three families carry, over what two do."""
    factors = []
    for families in (2, 3):
        form = shell("cap", CAP, rs.Geodesic(spacing=0.3, families=families), 100.0)
        checks = rs.check(form.popped, form.rod, stages=0)
        factors.append(checks.self_weight["clamped"].load_factor or 0.0)
        yield Row(f"{families} families", "checks that are missing", len(checks.missing), 0)
    note = f"{factors[1]:.1f} against {factors[0]:.1f} times the own weight"
    yield Row("three families, clamped", "1.6 times that of two, at least", -factors[1] / factors[0], -1.6, "", note)


def strip_rows() -> Iterator[Row]:
    grid = rs.Asymptotic(spacing=0.15, edge=0.15 / 8)
    for name, formula in SADDLES.items():
        target = rs.HeightField(formula=formula, domain=rs.Disc(0.9))
        normal, _ = surface_net(target, grid, anchor=(0.0, 0.0)).curvatures
        yield Row(f"strips, {name}", "normal curvature", float(np.abs(normal).max()), 1e-6, "1/m")
        for ratio in (5.0, 10.0, 20.0):
            form = shell(name, target, grid, ratio)
            report = form.popped["pinned"].report
            off = 100 * form.agreement["pinned"].max_relative if report.stable else np.inf
            yield Row(f"strips, {name}, {ratio:g} times as high", "pinned gap over the size", off, 0.03, "%")
    try:
        surface_net(CAP, rs.Asymptotic(spacing=0.3))
        refused = "not refused"
    except NetLimitError as error:
        refused = str(error)
    yield Row("strips, dome", "not refused with the place", float("at (0, 0, 2) m" not in refused), 0, "", refused[:60])


# Rods along given lines


def curve_rows() -> Iterator[Row]:
    """Straight lines in plan are circles of a sphere; broad laths follow a slant grid if they are cut curved."""
    lines = [[(x, -3.0), (x, 3.0)] for x in np.arange(-1.5, 1.51, 0.25)]
    lines += [[point[::-1] for point in line] for line in lines]
    curves, size = surface_net(CAP, rs.Curves(lines=lines)).curves, CAP.size
    worst, lengths = 0.0, np.diff(curves.ends)[:, 0]
    for k, line in enumerate(lines):
        points, _ = curves.at(np.full(200, k), np.linspace(*curves.ends[k], 200))
        offset = min(line[0], key=abs)
        worst = max(worst, float(np.abs(points[:, line[0].index(offset)] - offset).max()))
        radius = np.sqrt(CAP.radius**2 - offset**2)
        lengths[k] -= 2.0 * radius * np.arccos(CAP.base / radius)  # the arc up to the base
    yield Row("curves, circles of a sphere", "off their planes, over the size", worst / size, 1e-9)
    yield Row("curves, circles of a sphere", "off their lengths, over the size", np.abs(lengths).max() / size, 1e-9)
    for width in (0.040, 0.100):
        rod = rs.Rod(rs.RectangularSection(width=THIN, height=width), LATH)
        form = rs.find_form(CAP, rs.Curves(lines=lines, rest="curved"), rod, joint=rs.Pin(), ends="pinned")
        report = form.popped["pinned"].report
        off = 100 * form.agreement["pinned"].max_relative if report.stable else np.inf
        case = f"curves, cut curved, 2 x {1e3 * width:.0f} mm"
        yield Row(case, "pinned gap over the size", off, 0.5, "%", report.sentence)
        yield Row(case, "factorisations", report.factorizations, 60)


# The flat state


def least_bending(mesh: GridMesh, start: Floats) -> Floats:
    """(b,) curvatures in the plane [1/m] of the state of least bending with kept lengths: the slow twin, by Lagrange's
    equations on angles of edges, solved by trust regions on all nodes with stiff edges."""
    edges, bends, lengths = mesh.edges, mesh.bends, mesh.edge_lengths
    weight = 1.0 / np.sqrt(mesh.voronoi_lengths)
    stiff = 3e3 / np.sqrt(lengths)

    def turns(x: Floats) -> Floats:
        a, b, c = (x[bends[:, k]] for k in range(3))
        e, f = b - a, c - b
        angle = np.arctan2(e[:, 0] * f[:, 1] - e[:, 1] * f[:, 0], e[:, 0] * f[:, 0] + e[:, 1] * f[:, 1])
        return np.asarray(2.0 * np.tan(angle / 2.0))

    def residuals(flat: Floats) -> Floats:
        x = flat.reshape(-1, 2)
        return np.concatenate(
            [weight * turns(x), stiff * (np.linalg.norm(x[edges[:, 1]] - x[edges[:, 0]], axis=1) - lengths)]
        )

    from scipy.sparse import coo_array

    rows = np.concatenate([np.repeat(np.arange(len(bends)), 6), len(bends) + np.repeat(np.arange(len(edges)), 4)])
    columns = np.concatenate([(2 * bends[:, :, None] + [0, 1]).ravel(), (2 * edges[:, :, None] + [0, 1]).ravel()])
    pattern = coo_array((np.ones(len(rows)), (rows, columns)), shape=(len(bends) + len(edges), 2 * len(start)))
    found = least_squares(
        residuals, start.ravel(), jac_sparsity=pattern.tocsr(), x_scale=0.01, xtol=1e-12, ftol=1e-12, gtol=1e-10,
        max_nfev=400,
    )  # fmt: skip
    return np.asarray(turns(found.x.reshape(-1, 2)) / mesh.voronoi_lengths)


def flat_rows() -> Iterator[Row]:
    low = rs.Cap(radius=2.0, base=1.6)
    draped = lay(low, rs.Geodesic(spacing=0.3), lath(25.0))
    plan = draped.positions[:, :2] * 1.1
    bent = np.abs(least_bending(draped.mesh, plan)).max()
    for width in (0.010, 0.020):
        rod = rs.Rod(rs.RectangularSection(width=THIN, height=width), LATH)
        found = flat_state(draped.mesh, draped.positions, rod)
        other = 0.5 * width * bent
        note = f"{100 * (found.strain or np.nan):.3f} %, independent {100 * other:.3f} %"
        off = np.inf if found.strain is None else abs(found.strain / other - 1)
        yield Row(f"flat state, low cap, {1e3 * width:.0f} mm", "strain off independent code", off, 0.02, "", note)
        yield Row(f"flat state, low cap, {1e3 * width:.0f} mm", "negative modes", found.report.negative_modes, 0)
    yield from finding_rows()


def finding_rows() -> Iterator[Row]:
    """What is said of the flat state, by the strain that the material withstands, and the way up from there."""
    low, high, gfrp = rs.Cap(radius=2.0, base=1.6), CAP, rs.Material.preset("gfrp")
    for name, target, width, said in (
        ("low", low, 0.010, "lies_flat"), ("low", low, 0.020, "in_place"), ("high", high, 0.010, "in_place")
    ):  # fmt: skip
        rod = rs.Rod(rs.RectangularSection(width=THIN, height=width), gfrp)
        form = rs.find_form(target, rs.Geodesic(spacing=0.3), rod, joint=rs.Pin(), ends="pinned")
        codes = {finding.code for finding in form.verdict.findings} & {"lies_flat", "in_place"}
        assert form.flat_state is not None
        note = f"{form.flat_state.in_plane_strain} of {form.flat_state.limit:.3g}"
        yield Row(f"flat state, {name} cap, {1e3 * width:.0f} mm", f"not {said}", float(codes != {said}), 0, "", note)
        if said == "lies_flat":
            off = up_from_flat(form)
            yield Row("low cap, from flat", "off the popped-up shape, over the size", off, 1e-6)


def up_from_flat(form: rs.Form) -> float:
    """The shape to which the ends lead from the first lift, in equal steps of their way, less that of the pop-up."""
    popped, deployment = form.popped["pinned"], form.checks.deployment
    assert deployment is not None
    (shell, state), first = deployment.shells[0], float(deployment.share[1])
    ends = shell.ends
    last = popped.positions[ends]
    flat = deployment.positions[0][ends]
    for share in np.linspace(first, 1.0, 30)[1:]:
        goals = (1.0 - share) * flat + share * last
        found = find_stable(Problem.of_shell(shell, last, goals=goals), state, np.zeros(len(shell.mesh.edges)))
        shell = shell.with_elements(tuple(element.refreshed(found.state) for element in shell.elements))
        state = found.state
    return float(np.abs(state[: shell.mesh.node_count] - popped.positions).max() / form.target.size)


def derivative_rows() -> Iterator[Row]:
    """Of a shell of laths along geodesics by all variables that it has, against solving again."""
    for family in ALONG_CURVES:
        for what, error in errors(family, True, lattice=GEODESIC).items():
            yield Row(f"geodesic, {family.name}", f"derivative of {what}: relative error", error, 1e-6)


ROWS = (
    geodesic_rows,
    straight_rows,
    shell_rows,
    family_rows,
    strip_rows,
    curve_rows,
    flat_rows,
    twin_rows,
    derivative_rows,
    studio_rows,
    gallery_rows,
)


def main() -> int:
    """All groups of rows, or those that are named: `python -m tests.acceptance.lattices geodesic shell`."""
    chosen = [rows for rows in ROWS if not sys.argv[1:] or rows.__name__.removesuffix("_rows") in sys.argv[1:]]
    return print_table("lattices", (row for rows in chosen for row in rows()))


if __name__ == "__main__":
    sys.exit(main())

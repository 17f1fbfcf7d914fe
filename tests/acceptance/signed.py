"""What an engineer signs: `python -m tests.acceptance.signed [section preset]`.

Timber and GFRP sections are judged by hand from the clauses, with figures that stand here and nowhere else; the program
judges a flat grid whose rods are said to bend, stretch and press so everywhere.
"""

import sys
from collections.abc import Iterator
from dataclasses import dataclass
from math import pi

import numpy as np

import rodshell as rs
from rodshell.checks.bending import bending
from rodshell.loads.strength import Limits
from rodshell.rods.design_strength import DESIGN
from rodshell.rods.materials import PRESETS
from tests.acceptance.rows import Row, print_table
from tests.acceptance.signed_areas import curved_rows, developable_rows, sum_rows
from tests.acceptance.signed_shells import beam_rows, chance_rows, creep_rows, example_rows, snow_rows, support_rows

EXACT = 1e-3


@dataclass(frozen=True)
class Section:
    """A section of a bent rod, and what its clauses make of it by hand.

    Args:
        size: width (along the normal) and height (within the shell) [m]; of a tube radius and wall.
        curvatures: towards the normal and within the shell [1/m].
        force: axial, tension positive [N].
        strength: by hand [MPa]: design strength in bending at the reference depth.
        used: by hand: share of the bending strength.
        stiffness: by hand: the 5 % modulus over the mean, or 1 / gamma_M where that is lower; None: by no code.
        creep: k_def; None: not known.
    """

    preset: str
    size: tuple[float, float]
    service_class: int | None
    duration: str
    curvatures: tuple[float, float]
    force: float
    strength: float
    used: float
    stiffness: float | None
    creep: float | None


def _by_hand() -> dict[str, Section]:
    """Each line by itself: k_mod f_k / gamma_M, k_h, k_m, as a calculation on paper has them."""
    # larch C30, 35 x 50 mm, service class 2, permanent: E 12 GPa, f_m 30, f_t 19
    f_m = 0.6 * 30 / 1.3
    flat, edge = 12e3 * 0.0175 / 8.0, 12e3 * 0.025 / 20.0  # MPa, E h/2 kappa
    k_flat, k_edge = min((150 / 35) ** 0.2, 1.3), min((150 / 50) ** 0.2, 1.3)
    a, b = flat / (k_flat * f_m), edge / (k_edge * f_m)
    pull = 2000.0 / (35 * 50) / (0.6 * 19 * min((150 / 50) ** 0.2, 1.3) / 1.3)
    larch = max(a + 0.7 * b, 0.7 * a + b) + pull
    # spruce C24, 18 x 90 mm, service class 1, short: E 11 GPa, compression 21; bent about both, the edge more
    f_s = 0.9 * 24 / 1.3
    flat, edge = 11e3 * 0.009 / 15.0, 11e3 * 0.045 / 40.0
    a, b = flat / (min((150 / 18) ** 0.2, 1.3) * f_s), edge / (min((150 / 90) ** 0.2, 1.3) * f_s)
    spruce = max(a + 0.7 * b, 0.7 * a + b) + 3000.0 / (18 * 90) / (0.9 * 21 / 1.3)
    # oak D30, 180 x 40 mm on edge, service class 3, medium: deeper than 150 mm, k_h = 1 that way
    f_o = 0.65 * 30 / 1.3
    flat, edge = 11e3 * 0.09 / 120.0, 11e3 * 0.02 / 30.0
    a, b = flat / f_o, edge / (min((150 / 40) ** 0.2, 1.3) * f_o)
    oak = max(a + 0.7 * b, 0.7 * a + b) + 5000.0 / (180 * 40) / (0.65 * 18 / 1.3)  # tension: width 180, k_h = 1
    # glulam GL24h, 60 x 100 mm, service class 2, instantaneous: gamma_M 1.25, reference depth 600 mm
    f_g = 1.1 * 24 / 1.25
    flat, edge = 11.5e3 * 0.03 / 20.0, 11.5e3 * 0.05 / 60.0
    k_flat, k_edge = min((600 / 60) ** 0.1, 1.1), min((600 / 100) ** 0.1, 1.1)
    a, b = flat / (k_flat * f_g), edge / (k_edge * f_g)
    glulam = max(a + 0.7 * b, 0.7 * a + b) + 8000.0 / (60 * 100) / (1.1 * 24 / 1.25)
    # plywood, 12 x 40 mm, long, no service class given, 2 is taken: gamma_M 1.2, no k_h, k_m = 1
    f_p = 0.7 * 40.2 / 1.2
    flat, edge = 10.05e3 * 0.006 / 6.0, 10.05e3 * 0.02 / 50.0
    plywood = (flat + edge) / f_p + 500.0 / (12 * 40) / (0.6 * f_p)
    # GFRP tube 42 x 3.5 mm, permanent, a third of 240 MPa: bends add as vectors, the force to their stress
    area = pi * (21.0**2 - 17.5**2)
    gfrp = (23e3 * 0.021 * np.hypot(1 / 12.0, 1 / 30.0) + 4000.0 / area) / (240 / 3)
    softwood, hardwood = 8.0 / 12.0, 9.2 / 11.0  # 5 % modulus over the mean, EN 338
    return {
        "larch 35 x 50": Section(
            "larch", (0.035, 0.05), 2, "permanent", (1 / 8.0, 1 / 20.0), 2000.0, f_m, larch, softwood, 0.8
        ),
        "spruce 18 x 90": Section(
            "spruce", (0.018, 0.09), 1, "short", (1 / 15.0, 1 / 40.0), -3000.0, f_s, spruce, 7.4 / 11.0, 0.6
        ),
        "oak 180 x 40": Section(
            "oak", (0.18, 0.04), 3, "medium", (1 / 120.0, 1 / 30.0), 5000.0, f_o, oak, min(hardwood, 1 / 1.3), 2.0
        ),
        "glulam 60 x 100": Section(
            "glulam", (0.06, 0.1), 2, "instantaneous", (1 / 20.0, 1 / 60.0), -8000.0, f_g, glulam, 1 / 1.25, 0.8
        ),
        "plywood 12 x 40": Section(
            "plywood", (0.012, 0.04), None, "long", (1 / 6.0, 1 / 50.0), 500.0, f_p, plywood, 1 / 1.2, 1.0
        ),
        "GFRP tube 42 x 3.5": Section(
            "gfrp", (0.021, 0.0035), None, "permanent", (1 / 12.0, 1 / 30.0), 4000.0, 80.0, gfrp, None, None
        ),
    }  # fmt: skip


def section_rows() -> Iterator[Row]:
    """Strength, utilisation, stiffness and creep of each, as the program has them and by hand."""
    for name, each in _by_hand().items():
        shape: rs.Section = (
            rs.Tube(*each.size)
            if each.preset == "gfrp"
            else rs.RectangularSection(width=each.size[0], height=each.size[1])
        )
        rod = rs.Rod(shape, rs.Material.preset(each.preset))  # type: ignore[arg-type]
        limits = Limits.of(rod, rs.Strength(service_class=each.service_class))
        strength = limits.bending[each.duration]  # type: ignore[index]
        yield Row(name, "design strength off", abs(1e-6 * strength / each.strength - 1), EXACT, "", limits.source or "")
        layout = rs.GridLayout.orthogonal(rods=(3, 3), spacing=0.5, edge=0.25, length=1.5)
        mesh = rs.mesh_grid(layout.flat_grid((3, 3), 1.5), 0.25)
        count = len(mesh.rod_nodes)
        bent = bending(
            mesh, mesh.flat, rod, components=np.tile(each.curvatures, (count, 1)), twist_rate=np.zeros(count),
            edge_strains=np.full(len(mesh.edges), each.force / rod.stretch_stiffness),
        )  # fmt: skip
        stress = limits.compared(bent, mesh)
        assert stress is not None
        yield Row(
            name, "utilisation off", abs(float(stress.max()) / strength / each.used - 1), EXACT, "", f"{each.used:.4f}"
        )
        if each.stiffness is not None:
            yield Row(name, "stiffness for stability off", abs((limits.stiffness or 0.0) / each.stiffness - 1), EXACT)
        known = limits.creep == each.creep and (limits.code == "EN 1995-1-1") == (each.preset != "gfrp")
        yield Row(name, "k_def, or the code that is named, wrong", float(not known), 0)


SECOND: dict[str, tuple[float, ...]] = {
    # E, G [GPa], bending, tension, compression, shear [MPa], 5 % modulus [GPa]: timber as eurocodepy has it (by
    # EN 338:2016, EN 14080:2013), C30's moduli from the data sheet of KVH structural timber
    "larch": (12.0, 0.75, 30, 19, 24, 4.0, 8.0),
    "spruce": (11.0, 0.69, 24, 14.5, 21, 4.0, 7.4),
    "oak": (11.0, 0.69, 30, 18, 24, 3.9, 9.2),
    "steel": (210.0, 81.0, 235, 235, 235, 235 / np.sqrt(3), np.nan),  # EN 10025-2, up to 16 mm
    "glulam": (11.5, 0.65, 24, 19.2, 24, 3.5, 9.6),
    # E, and bending, tension and shear strength as the maker Fiberline prints the minima of E23 (EN 13706-3)
    "gfrp": (23.0, np.nan, 240, 240, np.nan, 25, np.nan),
}


def preset_rows() -> Iterator[Row]:
    """Presets against a second source than the one that they cite."""
    for name, second in SECOND.items():
        known, design = PRESETS[name], DESIGN[name]  # type: ignore[index]
        assert known.shear
        assert known.bending_strength
        assert known.shear_strength
        bending = 1e-6 * known.bending_strength
        ours = np.array([
            1e-9 * known.youngs_modulus, 1e-9 * known.shear, bending, design.tension * bending,
            design.compression * bending, 1e-6 * known.shear_strength, design.modulus * 1e-9 * known.youngs_modulus,
        ])  # fmt: skip
        yield Row(name, "figures off a second source", float(np.nanmax(np.abs(ours / second - 1))), EXACT)


ROWS = (
    section_rows, preset_rows, support_rows, beam_rows, creep_rows, chance_rows, developable_rows, sum_rows,
    curved_rows, example_rows, snow_rows,
)  # fmt: skip


def main() -> int:
    """All groups of rows, or those that are named: `python -m tests.acceptance.signed section`."""
    chosen = [rows for rows in ROWS if not sys.argv[1:] or rows.__name__.removesuffix("_rows") in sys.argv[1:]]
    return print_table("signed", (row for rows in chosen for row in rows()))


if __name__ == "__main__":
    sys.exit(main())

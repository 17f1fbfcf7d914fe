"""Rods: preset materials within what the literature says of them, and rods that are not given."""

import contextlib
import io
import json
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

import rodshell as rs
from examples.gallery import gallery
from rodshell.cli import main
from rodshell.results.verdict import verdict_of
from tests.acceptance.rows import Row

Range = tuple[float, float]

LITERATURE: dict[str, tuple[Range, Range, Range]] = {
    # E [GPa], density [kg/m3], bending strength [MPa]. Timber: European species at 12 % moisture, from structural
    # grades to clear wood, strengths of the classes around; the others: what handbooks, other standards (ASTM
    # A228 and A227 for wire) and suppliers give, wide enough for the scatter between them
    "larch": ((10.0, 14.5), (470, 650), (24, 40)),
    "spruce": ((9.0, 13.0), (400, 500), (18, 30)),
    "oak": ((9.5, 13.5), (650, 780), (24, 40)),
    "glulam": ((10.5, 14.5), (380, 500), (24, 36)),
    "bamboo": ((9.0, 20.0), (500, 900), (30, 80)),
    "gfrp": ((17.0, 30.0), (1600, 2100), (170, 450)),
    "plywood": ((8.0, 13.0), (600, 750), (30, 60)),
    "petg": ((1.9, 2.3), (1230, 1300), (45, 80)),
    "spring-steel": ((190.0, 212.0), (7750, 7900), (800, 1700)),
}
GOOD = ("garden pavilion", "dome", "ball below its equator")
ARCHES = "barrel vault"  # whose ends along both arches hang in the air
ROOF = "3*cos(x/6)*cos(y/5)"
BECAUSE = ("not given: chosen to fit", "the permanent strength")


def preset_rows() -> Iterator[Row]:
    """Each preset that builds something; rubber is the paper's, by the paper's numbers."""
    outside = list[str]()
    for name, ranges in LITERATURE.items():
        material = rs.Material.preset(name)  # type: ignore[arg-type]
        found = (material.youngs_modulus / 1e9, material.density, (material.bending_strength or 0.0) / 1e6)
        what = ("E", "density", "strength")
        pairs = zip(what, found, ranges, strict=True)
        outside += [f"{name} {word}" for word, value, (low, high) in pairs if not low <= value <= high]
    note = ", ".join(outside) or f"{len(LITERATURE)} presets"
    yield Row("presets", "E, density or strength off literature", len(outside), 0, note=note)
    rubber = rs.Material.preset("rubber")
    yield Row("presets", "rubber off the paper's", abs(rubber.youngs_modulus / 1e6 - rubber.density / 1e3), 0)


def roof_mesh(folder: Path) -> Path:
    """The roof as a mesh of quads in mm."""
    x, y = np.meshgrid(np.linspace(-6, 6, 25), np.linspace(-4, 4, 17))
    points = 1e3 * np.column_stack([x.ravel(), y.ravel(), (3 * np.cos(x / 6) * np.cos(y / 5)).ravel()])
    corner = (np.arange(16)[:, None] * 25 + np.arange(24)).ravel() + 1
    text = "".join(f"v {a} {b} {c}\n" for a, b, c in points)
    (folder / "roof.obj").write_text(text + "".join(f"f {k} {k + 1} {k + 26} {k + 25}\n" for k in corner))
    return folder / "roof.obj"


def unnamed_rod_rows() -> Iterator[Row]:
    """Targets of which no rod is given, by the command line as a user types it."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        formula = ["heightfield", "--formula", ROOF, "--target.domain", "rectangle", "--target.size", "12 m, 8 m"]
        model = ["heightfield", "--formula", "0.1*cos(6*x)*cos(5*y)"]
        for case, options in (
            ("12 m roof, mesh", [str(roof_mesh(folder)), "--unit", "mm"]),
            ("12 m roof, formula", formula),
            ("40 cm model", model),
        ):
            said, printed = io.StringIO(), io.StringIO()
            with contextlib.redirect_stderr(said), contextlib.redirect_stdout(printed):
                code = main(["form", *options, "--only", "csv", "--out", str(folder / case)])
            result = json.loads((folder / case / "result.json").read_text())
            material, bending = result["rod"]["material"], result["bending"]
            bears = rs.Material.preset(material["preset"]).bending_strength / material["youngs_modulus"]
            used = max(bending[ends]["max_strain"] for ends in ("pinned", "clamped")) / bears
            words = ", ".join(f"{key} {value}" for key, value in result["rod"]["section"].items())
            yield Row(case, "exit code", code, 0)
            yield Row(case, "strain over what the rod bears", used, 0.5, note=f"{material['preset']}: {words}")
            yield Row(case, "rubber used", float(material["youngs_modulus"] < 1e9), 0)
            missing = sum(words not in text.getvalue() for text in (said, printed) for words in BECAUSE)
            yield Row(case, "announcement and summary without a word of it", missing, 0)


def good_rows() -> Iterator[Row]:
    """Good can be reached: by the README's first example, and by three shells of the gallery with the rods it states; a
    vault is to be checked, since its arches have to be held."""
    with tempfile.TemporaryDirectory() as name:
        with contextlib.redirect_stderr(io.StringIO()), contextlib.redirect_stdout(io.StringIO()):
            main(["form", "pavilion", "--only", "csv", "--out", str(Path(name) / "out")])
        verdict = json.loads((Path(name) / "out" / "result.json").read_text())["verdict"]
    yield Row("pavilion", "not good", float(verdict["level"] != "good"), 0, note=verdict["reasons"][0][:60])
    for name in GOOD:
        verdict = verdict_of(gallery()[name].form().archive().results)
        yield Row(name, "not good", float(verdict.level != "good"), 0, note=verdict.headline[:60])
    verdict = verdict_of(gallery()[ARCHES].form().archive().results)
    silent = verdict.level != "check" or "rod ends lie up to" not in verdict.headline
    yield Row(ARCHES, "ends in the air not said first", float(silent), 0, note=verdict.headline[:60])


def rows() -> Iterator[Row]:
    yield from preset_rows()
    yield from unnamed_rod_rows()
    yield from good_rows()

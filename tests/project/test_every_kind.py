"""Every kind of input gives the same net of the same surface; a small job writes every kind of file. Never slow."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import rodshell as rs
from rodshell.cli import main
from tests.targets.meshes import sheet
from tests.targets.stepfile import StepFile

TOP, FALL = 0.1, 2.0  # z = TOP - FALL (x^2 + y^2): a paraboloid that ends at z = 0 in a circle
HALF = 0.25  # of the square on which files give it; the circle's radius is 0.2236 m
RADIUS = (TOP / FALL) ** 0.5
LAYOUT = rs.GridLayout.orthogonal(rods=(5, 5), spacing=0.06)
KINDS = {
    "dxf": "drawings/plan.dxf", "svg": "drawings/plan.svg", "pdf": "drawings/drawings.pdf", "csv": "schedule/rods.csv",
    "obj": "model/*.obj", "gltf": "model/*.glb", "vtp": "model/*.vtp",
    "compas": "model/*.json", "png": "pictures/*.png", "report": "report.html", "3dm": "model/*.3dm",
    "opensees": "opensees/*.json",
}  # fmt: skip


def height(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    return np.asarray(TOP - FALL * (x**2 + y**2))


def controls() -> np.ndarray:
    """(3, 3, 3) control points of the biquadratic Bezier surface that is the paraboloid on its square."""
    i, j = np.meshgrid(np.arange(3) - 1, np.arange(3) - 1, indexing="ij")
    square = np.where(np.array([i, j]) == 0, -1, 1) * HALF**2  # x^2 in Bezier's form: h^2, -h^2, h^2
    return np.stack([HALF * i, HALF * j, TOP - FALL * square.sum(axis=0)], axis=2)


def of_a_formula(_: Path) -> rs.Target:
    return rs.HeightField(formula=f"{TOP} - {FALL}*x^2 - {FALL}*y^2", domain=rs.Disc(RADIUS))


def of_a_mesh(folder: Path) -> rs.Target:
    vertices, faces = sheet(height, HALF, 60)
    lines = [
        *("v {} {} {}".format(*1e3 * vertex) for vertex in vertices),
        *("f {} {} {}".format(*f + 1) for f in faces),
    ]
    (folder / "roof.obj").write_text("\n".join(lines))
    return rs.surface_from(folder / "roof.obj", unit=1e-3, base=0.0)


def of_3dm(folder: Path) -> rs.Target:
    rhino3dm = pytest.importorskip("rhino3dm", reason="no rhino3dm: pip install rhino3dm")
    surface = rhino3dm.NurbsSurface.Create(3, False, 3, 3, 3, 3)
    for knots in (surface.KnotsU, surface.KnotsV):
        for index, value in enumerate((0.0, 0.0, 1.0, 1.0)):
            knots[index] = value
    for (i, j), point in zip(np.ndindex(3, 3), 1e3 * controls().reshape(-1, 3), strict=True):
        surface.Points[i, j] = rhino3dm.Point4d(*point, 1.0)
    model = rhino3dm.File3dm()
    model.Settings.ModelUnitSystem = rhino3dm.UnitSystem.Millimeters
    model.Objects.AddSurface(surface)
    assert model.Write(str(folder / "roof.3dm"), 8)
    return rs.surface_from(folder / "roof.3dm", base=0.0)


def of_step(folder: Path) -> rs.Target:
    pytest.importorskip("OCP", reason="no OpenCASCADE: pip install cadquery-ocp-novtk")
    file = StepFile("m")
    file.patch(controls(), 2, [0.0, 1.0])
    (folder / "roof.step").write_bytes(file.text())
    return rs.surface_from(folder / "roof.step", base=0.0)


def lattice() -> np.ndarray:
    """Heights, a row for each y, the largest first."""
    x = np.linspace(-HALF, HALF, 61)
    return height(x[None, :], -x[:, None])


def of_a_table(folder: Path) -> rs.Target:
    np.savetxt(folder / "roof.csv", lattice(), delimiter=",")
    return rs.heights_from(folder / "roof.csv", size=(2 * HALF, 2 * HALF), base=0.0)


def of_an_image(folder: Path) -> rs.Target:
    """16 bits of grey from the lowest corner up: placed by that much below."""
    grey = lattice() - lattice().min()
    Image.fromarray(np.round(65535 * grey / grey.max()).astype(np.uint16)).save(folder / "roof.png")
    down = rs.Placement(move=(0.0, 0.0, float(lattice().min())))
    return rs.heights_from(
        folder / "roof.png", size=(2 * HALF, 2 * HALF), height=float(grey.max()), base=0.0, placement=down
    )


@pytest.mark.parametrize("read", [of_a_formula, of_a_mesh, of_3dm, of_step, of_a_table, of_an_image])
def test_every_kind_of_surface_gives_the_rod_lengths_of_the_paraboloid(
    read: Callable[[Path], rs.Target], tmp_path: Path
) -> None:
    rods = rs.chebyshev_net(read(tmp_path), LAYOUT).rods
    exact = rs.chebyshev_net(rs.Paraboloid(radius=RADIUS, height=TOP), LAYOUT).rods
    lengths, expected = ([rod.end - rod.start for rod in net] for net in (rods, exact))
    assert lengths == pytest.approx(expected, abs=2e-5)  # a mesh of 60 x 60 squares: 6e-6 m measured


def test_a_small_job_writes_every_kind_of_file_and_pops_up_again_from_its_table(tmp_path: Path) -> None:
    formula = f"{TOP} - {FALL}*x^2 - {FALL}*y^2"
    surface = ("--formula", formula, "--target.radius", str(RADIUS), "--rods", "5x5", "--spacing", "60mm")
    pytest.importorskip("rhino3dm", reason="no rhino3dm: pip install rhino3dm")
    out, again = tmp_path / "out", tmp_path / "again"
    job = ("--edge", "20mm", "--length", "900mm", "--checks.stages", "2", "--only", ",".join(KINDS), "--quiet")
    assert main(["form", "heightfield", *surface, *job, "--out", str(out)]) in (0, 4)
    missing = [kind for kind, pattern in KINDS.items() if not any(path.stat().st_size for path in out.glob(pattern))]
    assert not missing
    assert main(["popup", str(out / KINDS["csv"]), "--only", "csv", "--quiet", "--out", str(again)]) in (0, 4)
    assert (again / KINDS["csv"]).exists()

"""Makes the gallery's files: `python examples/data/make.py`. Lengths are in millimetres."""

from pathlib import Path

import numpy as np
import rhino3dm

HERE = Path(__file__).parent


def lattice(x, y, z):
    """Points of a lattice and the triangles between them."""
    rows, columns = x.shape
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    a, b, c, d = corner, corner + columns, corner + columns + 1, corner + 1
    points = np.column_stack([x.ravel(), y.ravel(), z.ravel()])
    return points, np.vstack([np.column_stack([a, b, c]), np.column_stack([a, c, d])])


def write_obj(name, points, faces):
    lines = [f"v {x:.4f} {y:.4f} {z:.4f}" for x, y, z in points.tolist()]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in faces.tolist()]
    (HERE / name).write_text("\n".join([f"# rodshell gallery, {name}, mm", *lines, ""]))


# control heights of a free surface over 12 m x 9 m, mm: high towards one corner, pulled in on one side
HEIGHTS = np.array([
    [0, 500, 700, 500, 0],
    [900, 2400, 2900, 2100, 600],
    [1300, 3300, 4300, 3000, 900],
    [1100, 2700, 3300, 2300, 700],
    [200, 900, 1200, 800, 100],
])  # fmt: skip
PULL = np.array([[0, 0, 0, 0, 0], [0, 0, 0, 0, 0], [600, 300, 0, -200, -500], [300, 100, 0, 0, -200], [0, 0, 0, 0, 0]])


def freeform():
    """A bicubic NURBS surface."""
    surface = rhino3dm.NurbsSurface.Create(3, False, 4, 4, 5, 5)
    for i, x in enumerate(np.linspace(-6000, 6000, 5)):
        for j, y in enumerate(np.linspace(-4500, 4500, 5)):
            surface.Points[i, j] = rhino3dm.Point4d(x, y + PULL[i, j], float(HEIGHTS[i, j]), 1.0)
    for knots in (surface.KnotsU, surface.KnotsV):
        for k, knot in enumerate((0, 0, 0, 1, 2, 2, 2)):
            knots[k] = float(knot)
    return surface


if __name__ == "__main__":
    roof = freeform()
    file = rhino3dm.File3dm()
    file.Settings.ModelUnitSystem = rhino3dm.UnitSystem.Millimeters
    attributes = rhino3dm.ObjectAttributes()
    attributes.Name = "roof"
    file.Objects.AddSurface(roof, attributes)
    file.Write(str(HERE / "freeform.3dm"), 7)
    u, v = np.linspace(roof.Domain(0).T0, roof.Domain(0).T1, 49), np.linspace(roof.Domain(1).T0, roof.Domain(1).T1, 37)
    p = np.array([[(q.X, q.Y, q.Z) for q in (roof.PointAt(a, b) for b in v.tolist())] for a in u.tolist()])
    write_obj("freeform.obj", *lattice(p[..., 0], p[..., 1], p[..., 2]))

    polar, round_ = np.meshgrid(np.linspace(0, np.pi, 33), np.linspace(0, 2 * np.pi, 65), indexing="ij")
    ball = 4000 * np.stack([np.sin(polar) * np.cos(round_), np.sin(polar) * np.sin(round_), np.cos(polar)])
    write_obj("ball.obj", *lattice(*ball))

    along, tube = np.meshgrid(np.radians(np.linspace(-35, 35, 49)), np.radians(np.linspace(-80, 80, 41)), indexing="ij")
    ring = 9000 + 3500 * np.sin(tube)
    write_obj("torus.obj", *lattice(ring * np.sin(along), ring * np.cos(along) - 9000, 3500 * np.cos(tube)))

    out, round_ = np.meshgrid(np.linspace(0.18, 1, 26), np.linspace(0, 2 * np.pi, 73), indexing="ij")
    peak = 1500 * (1 - out) ** 2 / (1 - 0.18) ** 2 + 1000 * (1 - out**2) + 250 * out**2 * np.cos(2 * round_)
    write_obj("tent.obj", *lattice(5000 * out * np.cos(round_), 5000 * out * np.sin(round_), peak))

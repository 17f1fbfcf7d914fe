"""Small jobs of every kind, which call all kernels between them; each yields what it finds."""

from collections.abc import Callable, Iterator
from math import inf

import numpy as np

import rodshell as rs
from rodshell.output.drawings import drawing_set


def _forms() -> Iterator[object]:
    target = rs.Hemisphere(radius=0.2)
    layout = rs.GridLayout.orthogonal(spacing=0.06, edge=0.02)
    form = rs.find_form(target, layout, _rod())
    yield form
    yield rs.find_form(target, layout, _rod(), warm_start=form)
    yield rs.find_form(rs.HeightField(formula="0.1 - x**2 - y**2", domain=rs.Rectangle((0.4, 0.3))), layout, _rod())


def _commands() -> Iterator[object]:
    """What `rodshell form` does: the checks of a form, and the drawings."""
    small = {"layout.rods": "5x5", "layout.spacing": "80 mm", "layout.edge": "40 mm"}
    form = rs.Job.load("hemisphere", small).run()
    yield form.stages
    yield drawing_set(form.archive())


def _joints() -> Iterator[object]:
    target, rod = rs.Hemisphere(radius=0.2), _rod()
    layout = rs.GridLayout.orthogonal(rods=(5, 5), spacing=0.06, length=0.7, edge=0.02)
    trimmed = rs.trim(rs.drape(layout, rod, target))
    stiff = rs.Spring(shear=1e-5, out_of_plane=inf, twist=inf)
    lath = rs.Rod(rs.RectangularSection(width=2e-3, height=1e-3), rod.material)
    for joint, of in ((rs.Pin(), rod), (stiff, lath), (rs.Linker(), rod), (rs.Pin(eccentricity=2e-3), rod)):
        yield rs.pop_up(rs.map_back(trimmed), trimmed.boundary, of, ends="clamped", joint=joint)


def _meshes() -> Iterator[object]:
    count = 24
    across = np.linspace(-0.2, 0.2, count)
    x, y = (axis.ravel() for axis in np.meshgrid(across, across))
    corner = (np.arange(count - 1)[:, None] * count + np.arange(count - 1)).ravel()
    faces = np.column_stack([corner, corner + 1, corner + count + 1, corner, corner + count + 1, corner + count])
    points = np.column_stack([x, y, 0.15 - 1.5 * x**2 - y**2])
    target = rs.Freeform.of(points, faces.reshape(-1, 3))
    yield rs.find_form(target, rs.GridLayout.orthogonal(spacing=0.07, edge=0.035), _rod())
    yield target.contact(points)


def _gravity() -> Iterator[object]:
    yield rs.drape(_few(), _rod(), rs.Hemisphere(radius=0.2), method=rs.Gravity())


def _falls() -> Iterator[object]:
    couplings = (rs.SharedDofs(), rs.ImplicitPenalty(), rs.ExplicitPenalty())
    for coupling in couplings:
        for joint in (rs.Ball(), rs.Linker()):
            step = 1e-4 if isinstance(coupling, rs.ExplicitPenalty) else 5e-3
            fall = rs.Fall(coupling=coupling, duration=8 * step, time_step=step)
            yield rs.drape(_few(), _rod(), rs.Hemisphere(radius=0.2), method=fall, joint=joint)
    rubbing = rs.Fall(friction=0.3, drag=0.0, duration=0.2, time_step=1e-2, height=1e-3)
    yield rs.drape(_few(), _rod(), rs.Ellipsoid(a=0.2, b=0.15, c=0.12), method=rubbing)


def _single_rods() -> Iterator[object]:
    straight = np.linspace((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), 12)
    round_section, oval = rs.Circle(radius=2e-3), rs.Ellipse(a=3e-3, b=2e-3)
    for section, twist in ((round_section, False), (round_section, True), (oval, True)):
        kind = rs.Rod(section, rs.Material(youngs_modulus=1e7, density=1e3))
        rod = rs.ElasticRod.of(straight, kind, clamped=("start",), twist=twist)
        yield rs.solve_rod(rod, loads=rs.RodLoads(forces={-1: (0.0, 0.0, -1e-4)}))
        motion = rs.Motion.of(rod, forces=(rs.GravityForce(rod.nodes),))
        yield rs.simulate(motion, rod.state(), until=4e-3, step=1e-3)


def _rod() -> rs.Rod:
    return rs.Rod(rs.Circle(radius=1e-3), rs.Material(youngs_modulus=1e6, density=1e3))


def _few() -> rs.GridLayout:
    return rs.GridLayout.orthogonal(rods=(3, 3), spacing=0.06, length=0.7, edge=0.06)


JOBS: dict[str, Callable[[], Iterator[object]]] = {
    "forms": _forms, "commands": _commands, "joints": _joints, "meshes": _meshes, "gravity": _gravity, "falls": _falls,
    "single rods": _single_rods,
}  # fmt: skip

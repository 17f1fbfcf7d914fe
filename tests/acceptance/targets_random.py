"""Random smooth targets, each formed, and what says "converged" checked anew from positions alone."""

from dataclasses import dataclass

import numpy as np

import rodshell as rs
from rodshell.formfinding.popup import PopUp
from rodshell.formfinding.trim import Boundary
from rodshell.model import Shell
from rodshell.targets import Freeform

REASONS = (rs.InputError, rs.NetLimitError)  # what may stop a form, with its sentence
ROD = rs.Rod(section=rs.Circle(radius=1e-3), material=rs.Material(youngs_modulus=1e6, density=1e3))
GAP, STRAIN = 2e-5, 2e-5  # of the size; as the acceptance table of the bound drape has them
RESIDUAL = 1e-4  # of the largest force between two edges


@dataclass(frozen=True)
class Outcome:
    """One random target: "converged" or the reason why not, and what is wrong with that, if anything."""

    seed: int
    kind: str
    said: str
    wrong: str = ""


def random_case(seed: int) -> tuple[str, rs.Target, rs.GridLayout, tuple[float, float]]:
    """Convex, saddle-shaped or mixed; every other one as a mesh; any heading; the anchor off-centre."""
    rng = np.random.default_rng(seed)
    kind = ("convex", "saddle", "mixed")[seed % 3]
    a, b = rng.uniform(0.3, 5.0, 2)
    sign = {"convex": (-1, -1), "saddle": (1, -1), "mixed": tuple(rng.choice([-1, 1], 2))}[kind]
    terms = [f"{sign[0] * a:.6f}*x^2", f"{sign[1] * b:.6f}*y^2", f"{rng.uniform(-0.5, 0.5):.6f}*x*y"]
    for _ in range({"convex": 0, "saddle": 0, "mixed": 3}[kind]):
        (x, y), width, height = rng.uniform(-0.12, 0.12, 2), rng.uniform(0.05, 0.12), rng.uniform(-0.08, 0.08)
        terms.append(f"{height:.6f}*exp(-((x - ({x:.6f}))^2 + (y - ({y:.6f}))^2)/{2 * width**2:.6f})")
    size = tuple(rng.uniform(0.3, 0.4, 2).tolist())
    domain = rs.Disc(0.2) if seed % 2 else rs.Rectangle(size)  # type: ignore[arg-type]
    target: rs.Target = rs.HeightField(formula=" + ".join(terms), domain=domain)
    if seed % 4 > 1:
        target = meshed(target, rng)
    layout = rs.GridLayout.orthogonal(spacing=0.035, edge=0.035 / 4, rotate=float(rng.uniform(0, np.pi / 2)))
    anchor = rng.uniform(-0.05, 0.05, 2)
    return kind, target, layout, (float(anchor[0]), float(anchor[1]))


def meshed(target: rs.HeightField, rng: np.random.Generator) -> Freeform:
    """The same surface as a mesh with vertices strewn at random, its faces turned and in no order."""
    from scipy.spatial import Delaunay

    a, b = target.domain.half_extent
    inner = rng.uniform(-1, 1, (1500, 2)) * 0.97
    if isinstance(target.domain, rs.Disc):
        inner = inner[np.hypot(*inner.T) < 0.97]
        angle = np.arange(150) * 2 * np.pi / 150
        edge = np.column_stack([np.cos(angle), np.sin(angle)])
    else:
        t = np.linspace(-1, 1, 40, endpoint=False)
        edge = np.vstack(
            [np.column_stack(side) for side in ((t, -1 + 0 * t), (1 + 0 * t, t), (-t, 1 + 0 * t), (-1 + 0 * t, -t))]
        )
    plan = np.vstack([inner, edge])
    faces = rng.permutation(Delaunay(plan).simplices)
    p = plan[faces]
    area = np.cross(np.append(p[:, 1] - p[:, 0], 0 * p[:, 0, :1], 1), np.append(p[:, 2] - p[:, 0], 0 * p[:, 0, :1], 1))[
        :, 2
    ]
    plan = plan * [a, b]
    return Freeform.of(np.column_stack([plan, target.height_at(plan)]), faces[np.abs(area) > 1e-9])


def outcome(seed: int) -> Outcome:
    """Form one and judge what it says."""
    kind, target, layout, anchor = random_case(seed)
    try:
        form = rs.find_form(target, layout, ROD, anchor=anchor)
    except REASONS as reason:
        sentence = str(reason)
        return Outcome(seed, kind, sentence, "" if sentence and "\n" not in sentence else "no single sentence")
    if form.status != "converged":
        return Outcome(seed, kind, form.status, "" if len(form.status) > 20 else "no reason")
    return Outcome(seed, kind, "converged", _wrong(form))


def _wrong(form: rs.Form) -> str:
    """What does not hold of a form that says it has converged."""
    x, mesh, target = form.trimmed.positions, form.trimmed.mesh, form.target
    if not np.isfinite(x).all():
        return "NaN in the draped state"
    lengths = np.linalg.norm(np.diff(x[mesh.edges], axis=1)[:, 0], axis=1)
    strain = float(np.abs(lengths / mesh.edge_lengths - 1).max())
    if not strain <= STRAIN:
        return f"strain of the drape {strain:.2g}"
    gap = float(np.linalg.norm(target.closest(x) - x, axis=1).max()) / target.size
    if not gap <= GAP:
        return f"gap of the drape {gap:.2g}"
    for ends, popped in form.popped.items():
        residual = unbalanced(popped, form.trimmed.boundary)
        if not residual <= RESIDUAL:
            return f"{ends} pop-up unbalanced by {residual:.2g}"
    return ""


def unbalanced(popped: PopUp, boundary: Boundary) -> float:
    """Largest force left on a free degree of freedom, over the largest of any rod on its joint."""
    shell = Shell.of(popped.footprint.mesh, ROD, clamped=popped.ends == "clamped")
    state = shell.state(popped.positions, boundary.tangents)
    if not np.isfinite(state).all():
        return np.inf
    held = np.linalg.norm(state[shell.ends] - boundary.points, axis=1).max()
    bending, axial = np.zeros_like(state), np.zeros_like(state)
    for element in shell.elements:
        element.evaluate(state, bending)
    shell.stretch.evaluate(state, axial)
    free = np.ones(len(state), dtype=bool)
    free[shell.ends] = free[len(popped.positions) :] = False
    left = np.abs((bending + axial)[free]).max()
    return max(float(left / np.abs(bending).max()), float(held))

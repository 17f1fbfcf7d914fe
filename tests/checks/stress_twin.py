"""Stress with torsion found another way: strains rod by rod with rotations of SciPy, Saint-Venant's torsion by finite
differences (rectangles) or Prandtl's polynomial (ellipses), and the largest of the stress over the whole section."""

from functools import cache

import numpy as np
from scipy.sparse import diags, identity, kron
from scipy.sparse.linalg import spsolve
from scipy.spatial.transform import Rotation

import rodshell as rs
from rodshell.joints import Joint
from rodshell.model import Shell
from rodshell.rods.bend_twist import BendTwist

Floats = np.ndarray
CELLS = 120  # over each side of a rectangle


def shear_field(section: object) -> tuple[Floats, Floats, Floats]:
    """Places x, y (p,) all over the section [m] and the shear stress of torsion there over G theta' [m]."""
    if isinstance(section, rs.RectangularSection):
        return _rectangle(section.width, section.height)
    a, b = (section.a, section.b) if isinstance(section, rs.Ellipse) else (section.radius, section.radius)  # type: ignore[attr-defined]
    radius, angle = np.meshgrid(np.linspace(0, 1, 20), np.linspace(0, 2 * np.pi, 721))
    x, y = (a * radius * np.cos(angle)).ravel(), (b * radius * np.sin(angle)).ravel()
    # Prandtl's function is -a^2 b^2 / (a^2 + b^2) (x^2/a^2 + y^2/b^2 - 1)
    return x, y, 2 * a**2 * b**2 / (a**2 + b**2) * np.hypot(x / a**2, y / b**2)


@cache
def _rectangle(width: float, height: float) -> tuple[Floats, Floats, Floats]:
    """Prandtl's function by the five-point rule, its gradient by differences, one-sided at the edges: second order."""
    hx, hy = width / CELLS, height / CELLS
    second = diags([1.0, -2.0, 1.0], [-1, 0, 1], shape=(CELLS - 1, CELLS - 1))
    one = identity(CELLS - 1)
    phi = np.zeros((CELLS + 1, CELLS + 1))
    laplacian = (kron(second, one) / hx**2 + kron(one, second) / hy**2).tocsc()
    phi[1:-1, 1:-1] = spsolve(laplacian, np.full((CELLS - 1) ** 2, -2.0)).reshape(CELLS - 1, CELLS - 1)
    slope = np.hypot(*np.gradient(phi, hx, hy, edge_order=2))
    x, y = np.meshgrid(np.linspace(-width / 2, width / 2, CELLS + 1), np.linspace(-height / 2, height / 2, CELLS + 1))
    return x.T.ravel(), y.T.ravel(), slope.ravel()


def largest(rod: rs.Rod, kappa: Floats, axial: float, twist: float, weight: float) -> float:
    """Largest of sqrt(sigma^2 + (weight tau)^2) over the section [Pa]; kappa (2,) towards m1 and m2 [1/m]."""
    assert rod.material is not None
    x, y, lever = shear_field(rod.section)
    bent = kappa[0] * x + kappa[1] * y
    sigma = rod.material.youngs_modulus * np.maximum(np.abs(bent + axial), np.abs(bent - axial))
    return float(np.hypot(sigma, weight * rod.material.shear_modulus * twist * lever).max())


def stresses(shell: Shell, state: Floats, rod: rs.Rod, weight: float = np.sqrt(3.0)) -> Floats:
    """(k,) largest stress at each entry of `rod_nodes` of a pinned shell with material frames [Pa].

    The frames are those of the elements in equilibrium, turned here by the twist angles.
    """
    mesh = shell.mesh
    frames = next(one for one in shell.within if isinstance(one, BendTwist))
    first = {}  # the reference director of each edge
    for row, directors in zip(frames.blocks, frames.source_directors, strict=True):
        first[int(row[1])], first[int(row[3])] = directors
    result = np.zeros(len(mesh.rod_nodes))
    for k in range(len(mesh.grid.rods)):
        here = mesh.rod_slice(k)
        x, s = state[shell.node_blocks[here]], mesh.stations[here]
        step = np.diff(x, axis=0)
        long, rest = np.linalg.norm(step, axis=1), np.diff(s)
        tangents = step / long[:, None]
        angles = shell.first_angle + here.start - k + np.arange(len(step))
        m1 = np.array([
            Rotation.from_rotvec(state[block, 0] * t).apply(first[int(block)])
            for block, t in zip(angles, tangents, strict=True)
        ])  # fmt: skip
        strain = long / rest - 1
        for n in range(len(x)):
            axial = strain[max(n - 1, 0) : n + 1].mean()
            kappa, twist = np.zeros(2), 0.0
            if 0 < n < len(x) - 1:
                voronoi = 0.5 * (s[n + 1] - s[n - 1])
                kappa, twist = _bend(tangents[n - 1], tangents[n], m1[n - 1], m1[n])
                kappa, twist = kappa / voronoi, twist / voronoi
            result[here.start + n] = largest(rod, kappa, axial, twist, weight)
    return result


def _bend(te: Floats, tf: Floats, me: Floats, mf: Floats) -> tuple[Floats, float]:
    """Turn (2,) towards the two directors between two edges, 2 tan(phi/2) in all, and the twist [rad]."""
    axis = np.cross(te, tf)
    sine, cosine = np.linalg.norm(axis), te @ tf
    phi = np.arctan2(sine, cosine)
    turn = Rotation.from_rotvec(axis / max(sine, 1e-300) * phi)
    carried = turn.apply(me)
    twist = float(np.arctan2(np.cross(carried, mf) @ tf, carried @ mf))
    middle = te + tf
    middle /= np.linalg.norm(middle)
    m1 = Rotation.from_rotvec(0.5 * twist * middle).apply(Rotation.from_rotvec(turn.as_rotvec() / 2).apply(me))
    towards = 2 * np.tan(phi / 2) * np.cross(axis / max(sine, 1e-300), middle)
    return np.array([towards @ m1, towards @ np.cross(middle, m1)]), twist


def distance(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray) -> float:
    """Of the segments ab and cd: the least over both ends of each against the other, and over the lines' own."""

    def to_segment(p: np.ndarray, x: np.ndarray, y: np.ndarray) -> float:
        share = np.clip((p - x) @ (y - x) / ((y - x) @ (y - x)), 0, 1)
        return float(np.linalg.norm(p - x - share * (y - x)))

    found = [to_segment(p, c, d) for p in (a, b)] + [to_segment(p, a, b) for p in (c, d)]
    u, v = b - a, d - c
    shares, _, rank, _ = np.linalg.lstsq(np.column_stack([u, -v]), c - a, rcond=1e-9)
    if rank == 2 and (shares >= 0).all() and (shares <= 1).all():
        found.append(float(np.linalg.norm(a + shares[0] * u - c - shares[1] * v)))
    return min(found)


@cache
def twisted_shells() -> dict[str, tuple[rs.Rod, rs.Form]]:
    """Coarse shells whose rods are twisted, by joints or by their two stiffnesses."""
    timber = rs.Material(youngs_modulus=1.1e10, density=450, shear=6.9e8)
    glass = rs.Material(youngs_modulus=2.5e10, density=1900, poisson_ratio=0.3)
    saddle = rs.HeightField(formula="(x^2 - y^2)/0.8", domain=rs.Disc(0.2))
    ellipsoid = rs.Ellipsoid(a=0.2, b=0.15, c=0.12)
    cases: dict[str, tuple[rs.Target, rs.Rod, Joint]] = {
        "laths with pins": (rs.Hemisphere(0.2), rs.Rod(rs.RectangularSection(1e-3, 2e-3), timber), rs.Pin()),
        "laths with balls": (ellipsoid, rs.Rod(rs.RectangularSection(1e-3, 2e-3), timber), rs.Ball()),
        "tubes with pins": (ellipsoid, rs.Rod(rs.Tube(1e-3, 3e-4), glass), rs.Pin()),
        "ellipses with pins": (saddle, rs.Rod(rs.Ellipse(5e-4, 1e-3), glass), rs.Pin()),
        "square battens with pins": (ellipsoid, rs.Rod(rs.RectangularSection(1e-3, 1e-3), timber), rs.Pin()),
    }
    layout = rs.GridLayout.orthogonal(spacing=0.06, edge=0.012)
    return {
        name: (rod, rs.find_form(target, layout, rod, joint=joint, ends=("pinned",)))
        for name, (target, rod, joint) in cases.items()
    }

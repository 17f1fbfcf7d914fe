"""Problems of one rod with exact answers: each function solves one on a given mesh and returns its errors.

The tests in `test_rod_statics.py` and the table of `tests/acceptance/rods.py` both read them. Lengths of the order
of 1 m; rods so slender that their stretch stays below what is measured.
"""

from math import asin, pi, sqrt
from math import sin as sine

import numpy as np
from scipy.integrate import quad, solve_bvp, solve_ivp
from scipy.optimize import brentq
from scipy.sparse import triu
from scipy.spatial.transform import Rotation
from scipy.special import ellipeinc, ellipkinc

import rodshell as rs
from rodshell.geometry.frames import directors_along, parallel_transport, signed_angle, unit
from rodshell.solve.sparse_ldl import Multifrontal

THIN = rs.Rod(rs.Circle(1e-4), rs.Material(1e9, 1e3, 0.5))
EI, GJ = THIN.bend_stiffness, THIN.twist_stiffness
X, Y = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)


def straight(edges, length=1.0):
    nodes = np.zeros((edges + 1, 3))
    nodes[:, 0] = np.linspace(0, length, edges + 1)
    return nodes


def order(sizes, errors):
    """Order of convergence of `errors` in the size of the edges."""
    return float(np.polyfit(np.log(sizes), np.log(np.abs(errors)), 1)[0])


def unstable(rod, state, free):
    """Whether the energy's Hessian in the free directions has a negative eigenvalue."""
    upper = triu(rod.hessian(state, free), format="csc")
    return Multifrontal(upper.indptr.astype(np.int64), upper.indices.astype(np.int64)).factor(upper.data).negative > 0


def threshold(lost, low=0.9, high=1.1):
    """Where `lost` turns from false to true, within 1e-7."""
    assert not lost(low)
    assert lost(high)
    while high - low > 1e-7:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if lost(middle) else (middle, high)
    return high


# Planar elastica: a cantilever of length 1 under a dead force across its end [Bisshopp and Drucker 1945]


class EndLoaded:
    """EI theta'' = -P cos theta, theta(0) = 0, theta'(1) = 0, in terms of theta(1)."""

    def __init__(self, tip):
        k = sqrt((1 + sine(tip)) / 2)
        phi = asin(1 / (k * sqrt(2)))
        alpha = ellipkinc(pi / 2, k**2) - ellipkinc(phi, k**2)
        self.force = alpha**2 * EI
        self.drop = 1 - 2 / alpha * (ellipeinc(pi / 2, k**2) - ellipeinc(phi, k**2))
        self.reach = sqrt(2 * sine(tip)) / alpha
        self.root_moment = self.force * self.reach


def elastica_errors(edges, tip, twist=True):
    """Tip position over the length, root moment over itself, and tip angle [rad]."""
    exact = EndLoaded(tip)
    rod = rs.ElasticRod.of(straight(edges), THIN, clamped={"start": X}, twist=twist)
    shape = rs.solve_rod(rod, loads=rs.RodLoads(forces={-1: (0, 0, -exact.force)}), steps=2)
    place = np.linalg.norm(shape.positions[-1] - [exact.reach, 0, -exact.drop])
    moment = shape.support("start")[1][1] / -exact.root_moment - 1
    last = shape.positions[-1] - shape.positions[-2]
    return float(place), float(moment), float(np.arctan2(-last[2], last[0]) - tip)


# Heavy cantilever


def heavy_tip(weight):
    """Tip (x, z) of a cantilever of length 1 and weight w EI: theta'' = -w (1 - s) cos theta, downwards."""

    def rates(s, y):
        return np.array([y[1], -weight * (1 - s) * np.cos(y[0]), np.cos(y[0]), -np.sin(y[0])])

    def ends(a, b):
        return np.array([a[0], b[1], a[2], a[3]])

    s = np.linspace(0, 1, 50)
    guess = np.array([np.sin(s), np.cos(s), s, -(s**2) / 2])
    found = solve_bvp(rates, ends, s, guess, tol=1e-10, max_nodes=100_000)
    assert found.success
    return found.y[2:, -1]


def heavy_error(edges, weight):
    """Tip position over the length."""
    rod = rs.ElasticRod.of(straight(edges), THIN, clamped={"start": X}, twist=False)
    gravity = weight * EI / THIN.mass_per_length
    shape = rs.solve_rod(rod, loads=rs.RodLoads(gravity=(0, 0, -gravity)))
    return float(np.linalg.norm(shape.positions[-1, ::2] - heavy_tip(weight)))


# A naturally helical rod


def helix_measures(points):
    """Radius and pitch [m] of a discrete helix."""
    e = np.diff(points, axis=0)
    turn = np.cross(e[1] - e[0], e[2] - e[1])
    axis = turn / np.linalg.norm(turn)
    flat = e - (e @ axis)[:, None] * axis
    angle = np.arccos(np.sum(flat[0] * flat[1]) / np.sum(flat[0] ** 2))
    return np.linalg.norm(flat[0]) / (2 * np.sin(angle / 2)), 2 * pi * abs(e[0] @ axis) / angle


def helix_errors(edges, curvature=7.0, torsion=4.0, anisotropic=True):
    """Relative errors of radius and pitch, and the energy over that at the start, after relaxing from straight."""
    section = rs.Ellipse(1e-4, 2e-4) if anisotropic else rs.Circle(1e-4)
    kind = rs.Rod(section, THIN.material)
    rod = rs.ElasticRod.of(straight(edges), kind, natural=(curvature, 0.0), natural_twist=torsion, clamped={"start": X})
    shape = rs.solve_rod(rod, steps=20)
    total = curvature**2 + torsion**2
    radius, pitch = helix_measures(shape.positions)
    return (
        float(radius / (curvature / total) - 1),
        float(pitch / (2 * pi * torsion / total) - 1),
        shape.energy / rod.energy(rod.state()),
    )


# Kirchhoff's rod, bent and twisted between clamps


class Kirchhoff:
    """Initial values of Kirchhoff's equations for an unshearable, inextensible rod of length 1; any wrench is one.

    m' = n x t, n' = 0, d_i' = u x d_i, with u = (m.d1/B1, m.d2/B2, m.d3/C) along (d1, d2, t). B1 resists the turn
    about d1, which bends towards -d2: B1 = EI2, B2 = EI1.
    """

    def __init__(self, ei1, ei2, gj, force, moment):
        self.ei1, self.ei2, self.gj = ei1, ei2, gj

        def rates(s, y):
            d1, d2, t = y[3:12].reshape(3, 3)
            m = y[12:]
            u = (m @ d1) / ei2 * d1 + (m @ d2) / ei1 * d2 + (m @ t) / gj * t
            return np.concatenate([t, np.cross(u, d1), np.cross(u, d2), np.cross(u, t), np.cross(force, t)])

        # at the start t = x, d1 = z, d2 = t x d1 = -y
        begin = np.concatenate([[0, 0, 0], [0, 0, 1], [0, -1, 0], [1, 0, 0], moment])
        self.flow = solve_ivp(rates, (0, 1), begin, rtol=1e-12, atol=1e-14, dense_output=True, method="DOP853").sol

    def positions(self, s):
        return self.flow(s)[:3].T

    def frame(self, s):
        """Rows d1, d2, t."""
        return self.flow(s)[3:12].reshape(3, 3)

    def twist(self, s):
        """Angles [rad] of the material frames at s, from frames that the smallest turn from x takes there."""
        turned = []
        for one in np.atleast_1d(s):
            d1, _, t = self.frame(one)
            carried = parallel_transport(np.array([0.0, 0.0, 1.0]), np.array(X), t)
            turned.append(float(signed_angle(carried, d1, t)))
        return np.unwrap([0.0, *turned])[1:]

    def moment(self, s):
        return self.flow(s)[12:]


def kirchhoff_errors(edges, exact, force):
    """Largest distance of a node from the exact curve, and the errors of the end's force and moment over their sizes.

    The rod is clamped at both exact ends, position, tangent and material frame, and starts bent like the exact one.
    """
    section = rs.GivenSection(EA=1e8, EI1=exact.ei1, EI2=exact.ei2, GJ=exact.gj)
    rod = rs.ElasticRod.of(straight(edges), rs.Rod(section), director=(0, 0, 1), clamped={"start": X, "end": X})
    s = np.linspace(0, 1, edges + 1)
    end = exact.frame(1.0)
    start = rod.state(exact.positions(s), exact.twist((s[1:] + s[:-1]) / 2), {"start": X, "end": end[2]})
    start[rod.ghost_angles[1], 0] = exact.twist(np.linspace(0, 1, 200))[-1]
    shape = rs.solve_rod(rod, rs.RodSupports(tangents={"end": end[2]}, directors={"end": end[0]}), start=start)
    off = np.linalg.norm(shape.positions - exact.positions(s), axis=1).max()
    pull, moment = shape.support("end")
    size = np.linalg.norm(exact.moment(1.0))
    return (
        float(off),
        float(np.linalg.norm(pull - force) / np.linalg.norm(force)),
        float(np.linalg.norm(moment - exact.moment(1.0)) / size),
    )


# Buckling: loads at which the loaded, unbuckled rod gets its first negative mode


def euler_load(edges):
    """Of a pinned column of length 1, over pi^2 EI; EA = 1e6 EI shortens it by 1e-5."""
    section = rs.GivenSection(EA=1e6, EI1=1.0, EI2=1.0, GJ=1.0)
    rod = rs.ElasticRod.of(straight(edges), rs.Rod(section), twist=False)
    free = rod.freedom().with_directions(np.array([0])).with_directions(np.array([edges]), X)

    return threshold(lambda share: unstable(rod, rod.state(rod.rest * (1 - share * pi**2 / 1e6)), free))


def lateral_load(edges):
    """Tip load, at the axis, at which a cantilever strip of length 1 buckles sideways, over its exact value.

    Exact for EI1 >> EI2 [Timoshenko and Gere, section 6.3]: 4.0126 sqrt(EI2 GJ) / L^2. Here EI1 = 1e4 EI2.
    """
    gj = 0.6
    section = rs.GivenSection(EA=1e7, EI1=1e4, EI2=1.0, GJ=gj)  # m1 = z, in the load's plane
    rod = rs.ElasticRod.of(straight(edges), rs.Rod(section), director=(0, 0, 1), clamped={"start": X})
    plane = dict.fromkeys(range(1, edges + 1), (X, (0.0, 0.0, 1.0)))
    upright = dict.fromkeys(range(edges), 0.0)

    def lost(share):
        load = {-1: (0, 0, -share * 4.0126 * sqrt(gj))}
        shape = rs.solve_rod(rod, rs.RodSupports(along=plane, angles=upright), rs.RodLoads(forces=load))
        return unstable(shape.rod, shape.state, shape.rod.freedom())

    return threshold(lost)


def michell_twist(edges):
    """Total twist at which a closed ring, naturally straight, leaves its plane, over 2 pi sqrt(3) EI/GJ.

    The twist is put in as a natural one, evenly: the ring is glued after so many turns. Three supports, as many as
    hold a rigid body and no more, keep the ring in place, and one angle keeps the rod from spinning about itself.
    """
    gj, quarter = 0.7, edges // 4
    kind = rs.Rod(rs.GivenSection(EA=1e7, EI1=1.0, EI2=1.0, GJ=gj))
    angle = 2 * pi * np.arange(edges) / edges
    circle = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle]) / (2 * edges * np.sin(pi / edges))

    def lost(share):
        turns = share * 2 * pi * sqrt(3) / gj
        rod = rs.ElasticRod.of(circle, kind, closed=True, natural_twist=turns)

        def radial(size):
            return float(np.sum(rod.gradient(rod.state(size * circle))[rod.nodes] * circle))

        state = rod.state(brentq(radial, 0.999, 1.001, xtol=1e-15) * circle)
        free = rod.freedom().with_directions(np.array([0, rod.angles.start]))
        free = free.with_directions(np.array([2 * quarter]), X).with_directions(np.array([quarter]), X, Y)
        return unstable(rod.refreshed(state), state, free)

    return threshold(lost)


# Localised buckling of a stretched and twisted rod [Bergou et al. 2008, section on validation]


class Localised:
    """A long rod, EI, GJ, under tension T and moment M, its tangent turned by phi from the line of thrust.

    With z = cos phi and the azimuth psi, the moment about the line is conserved, psi' = M / EI (1 + z), and so is
    the energy, which for ends along the line reads z'^2 = (2T/EI) (1 - z)^2 (z - z0), z0 = M^2 / (2 EI T) - 1. Hence

        (z - z0) / (1 - z0) = tanh^2(s/s*),   1/s* = M / (2 EI) sqrt((1 - z0) / (1 + z0)),

    s from the middle. Ends come nearer by the integral of 1 - z, 2 (1 - z0) s*, and turn by M L / GJ plus the
    integral of psi' (1 - z). Bergou's figures: L 9.29, EI 1.345, GJ 0.789, 27 turns, ends nearer by 0.3. (The paper's
    f(phi) = (cos phi - cos phi0) / (1 - cos phi0) is (z - z0) / (1 - z0), and its bending modulus and its twist
    modulus times the twist are EI and M.)
    """

    length, ei, gj, nearer, turn = 9.29, 1.345, 0.789, 0.3, 54 * pi

    def __init__(self):
        z0 = brentq(lambda z: self._of(z)[1] - self.turn, 0.0, 0.999)
        self.z0, self.moment = z0, self._of(z0)[0]
        self.width = 2 * self.ei / self.moment * sqrt((1 + z0) / (1 - z0))

    def _of(self, z0):
        """Moment and turn of the rod whose ends are nearer by the given distance."""
        width = self.nearer / (2 * (1 - z0))
        moment = 2 * self.ei / width * sqrt((1 + z0) / (1 - z0))
        half = quad(lambda s: self._azimuth_less_spin(s, z0, width, moment), 0, self.length / 2)[0]
        return moment, moment * self.length / self.gj + 2 * half

    def _azimuth_less_spin(self, s, z0, width, moment):
        z = z0 + (1 - z0) * np.tanh(s / width) ** 2
        return moment / (self.ei * (1 + z)) * (1 - z)

    def start(self, edges):
        """Positions (n, 3), from 0 along x, and twist angles (edges,) counted from frames carried from x."""
        fine = np.linspace(0, self.length, 100 * edges + 1)
        middles = (fine[1:] + fine[:-1]) / 2 - self.length / 2
        z = self.z0 + (1 - self.z0) * np.tanh(middles / self.width) ** 2
        step, flat = fine[1], np.sqrt(1 - z * z)
        psi = np.cumsum(self.moment / (self.ei * (1 + z))) * step
        tangents = np.column_stack([z, flat * np.cos(psi), flat * np.sin(psi)])
        positions = np.vstack([np.zeros(3), np.cumsum(tangents, axis=0) * step])[::100]
        spin = np.cumsum(self.moment / self.gj + self.moment / (self.ei * (1 + z)) * (1 - z)) * step
        return positions, spin[50::100]


def localised_error(edges, exact=None):
    """Largest distance of Bergou's f from tanh^2, f being measured with the found rod's own phi0 and moment."""
    exact = exact or Localised()
    kind = rs.Rod(rs.GivenSection(EA=1e6, EI1=exact.ei, EI2=exact.ei, GJ=exact.gj))
    rod = rs.ElasticRod.of(straight(edges, exact.length), kind, clamped={"start": X, "end": X})
    positions, angles = exact.start(edges)
    goal = (exact.length - exact.nearer, 0, 0)
    start = rod.state(positions, angles)
    start[rod.ghost_angles[1], 0] = exact.turn
    # the hump may stand anywhere along so long a rod: the sign of that mode is the mesh's
    shape = rs.solve_rod(rod, rs.RodSupports(positions={-1: goal}), start=start, stable=False)
    z = np.diff(shape.positions, axis=0)[:, 0] / np.linalg.norm(np.diff(shape.positions, axis=0), axis=1)
    moment = exact.gj * shape.strains.twist.mean()
    s = (np.arange(edges) + 0.5) * exact.length / edges - exact.length / 2
    near = np.argsort(z)[:5]
    a, b, c = np.polyfit(s[near], z[near], 2)
    z0 = c - b * b / (4 * a)
    s = s + b / (2 * a)  # from the middle of the hump, wherever it stands
    width = 2 * exact.ei / moment * sqrt((1 + z0) / (1 - z0))
    return float(np.abs((z - z0) / (1 - z0) - np.tanh(s / width) ** 2).max()), shape, z0, moment


# Holonomy


def holonomy(steps, colatitude):
    """How far [rad] the frame of a rod turns whose tangent goes once around a circle about z, by `steps` refreshes."""
    angle = 2 * pi * np.arange(steps + 1) / steps
    tangents = np.column_stack(
        [np.sin(colatitude) * np.cos(angle), np.sin(colatitude) * np.sin(angle), np.full(steps + 1, np.cos(colatitude))]
    )
    line = np.arange(3.0)[:, None]
    rod = rs.ElasticRod.of(line * tangents[0], THIN)
    first = rod.reference_directors(rod.state())[0]
    for tangent in tangents[1:]:
        rod = rod.refreshed(rod.state(line * tangent))
    last = rod.reference_directors(rod.state(line * tangents[-1]))[0]
    return float(signed_angle(first, last, tangents[0]))


def holonomy_along(steps, colatitude):
    """The same of frames carried along the edges of a curve with these tangents."""
    angle = 2 * pi * np.arange(steps + 1) / steps
    tangents = np.column_stack(
        [np.sin(colatitude) * np.cos(angle), np.sin(colatitude) * np.sin(angle), np.full(steps + 1, np.cos(colatitude))]
    )
    directors = directors_along(tangents, np.array([0.0, 0.0, 1.0]))
    return float(signed_angle(directors[0], directors[-1], tangents[0]))


def holonomy_error(carry, colatitude, steps=1000):
    """Distance of the limit (three refinements, Richardson) from the solid angle 2 pi (1 - cos), a whole turn aside."""
    coarse, middle, fine = (carry(k * steps, colatitude) for k in (1, 2, 4))
    better = (4 * middle - coarse) / 3, (4 * fine - middle) / 3
    limit = (16 * better[1] - better[0]) / 15
    return abs((limit - 2 * pi * (1 - np.cos(colatitude)) + pi) % (2 * pi) - pi)


# Rigid motion


def bent_and_twisted(**options):
    """An anisotropic rod with natural curvature and twist, and a random state of it."""
    rng = np.random.default_rng(3)
    s = np.linspace(0, 2, 12)
    kind = rs.Rod(rs.Ellipse(2e-3, 1e-3), rs.Material(1e9, 1e3, 0.3))
    curve = np.column_stack([np.cos(s), np.sin(s), 0.4 * s])
    rod = rs.ElasticRod.of(curve, kind, natural=(0.5, -0.3), natural_twist=0.7, **options)
    free = rod.freedom()
    return rod, rod.state() + free.expand(0.05 * rng.normal(size=free.size))


def rigid_motion_change(**options):
    """Relative change of the energy when positions and material frames turn and move as one.

    The reference frames do not turn rigidly; the twist angles take up the difference.
    """
    rod, state = bent_and_twisted(**options)
    turn = Rotation.from_rotvec([0.5, -1.0, 0.25]).as_matrix()
    moved = state.copy()
    places = np.concatenate([np.arange(rod.node_count), rod.ghosts])
    moved[places] = state[places] @ turn.T + [0.3, -0.2, 0.9]
    blocks = np.concatenate([np.arange(rod.block_count)[rod.angles], rod.ghost_angles])
    edges = moved[np.vstack([rod.stretch.blocks, *_ghost_edges(rod)])]
    tangents = unit(edges[:, 1] - edges[:, 0])
    carried = rod.reference_directors(state) @ turn.T
    moved[blocks, 0] += signed_angle(rod.reference_directors(moved), carried, tangents)
    assert np.abs(rod.material_frames(moved) - rod.material_frames(state) @ turn.T).max() < 1e-12
    return abs(rod.energy(moved) / rod.energy(state) - 1)


def _ghost_edges(rod):
    for k, end in enumerate(rod.clamps):
        pair = rod.ghosts[k], rod.clamped_nodes[k]
        yield pair if end == "start" else pair[::-1]

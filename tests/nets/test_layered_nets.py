"""Nets of two layers: each family of rods on the surface parallel to the target at half the joints' eccentricity."""

import numpy as np
import pytest

import rodshell as rs
from rodshell.geometry.frames import unit
from tests.nets.sphere_net import sphere_net_end

R = 0.2
LAYOUT = rs.GridLayout.orthogonal(spacing=0.03)
TURNED = rs.GridLayout.orthogonal(spacing=0.03, rotate=0.3)
SURFACES = {
    "ellipsoid": rs.Ellipsoid(a=0.2, b=0.15, c=0.12),
    "height field": rs.HeightField(formula="0.1 - .8*x^2 - .5*y^2 + .3*x*y + 2*x^3", domain=rs.Disc(R)),
}


def height(family, eccentricity):
    return -0.5 * eccentricity if family == "u" else 0.5 * eccentricity


def layers_of(net, eccentricity):
    """Points (nu, nv, 3) of the layers of u and of v over the net's points."""
    points = net.net.points
    normals, known = np.full_like(points, np.nan), np.isfinite(points[:, :, 0])
    normals[known] = unit(net.target.level(points[known])[1])
    return [points + height(family, eccentricity) * normals for family in "uv"]


@pytest.mark.slow
@pytest.mark.parametrize("eccentricity", [2e-3, 4e-3])
def test_rod_lengths_on_the_sphere_are_those_of_the_nets_of_two_spheres(eccentricity):
    """A rod at offset c of the other layer lies on the sphere R + h at the angle c/(R - h) from the axis."""
    net = rs.chebyshev_net(rs.Hemisphere(R), LAYOUT, eccentricity=eccentricity)
    for rod in net.rods:
        h = height(rod.family, eccentricity)
        exact = (R + h) / R * sphere_net_end(R, rod.offset * R / (R - h))
        assert [-rod.start, rod.end] == pytest.approx([exact, exact], abs=1e-6)  # 1.1e-7 measured; layers: 3 mm


@pytest.mark.parametrize("name", SURFACES)
def test_joint_spacing_is_equal_along_the_rods_of_both_layers(name):
    net = rs.chebyshev_net(SURFACES[name], TURNED, eccentricity=4e-3)
    below, above = layers_of(net, 4e-3)
    for points, axis, s in ((below, 0, net.net.u), (above, 1, net.net.v)):
        chords = np.linalg.norm(np.diff(points, axis=axis), axis=2)
        steps = np.diff(s)[:, None] if axis == 0 else np.diff(s)
        assert np.nanmax(np.abs(chords / steps - 1)) < 1e-10  # those of the target are off by up to 0.3 to 3 %
    apart = np.linalg.norm(above - below, axis=2)
    assert np.nanmax(np.abs(apart - 4e-3)) < 1e-12


@pytest.mark.parametrize("name", SURFACES)
def test_the_axes_are_geodesics_of_their_layers(name):
    """Straight but for bends about the tangent plane; geodesics of the target would bend within their layer."""
    net = rs.chebyshev_net(SURFACES[name], TURNED, eccentricity=4e-3)
    (i0, j0), (below, above) = net.net.origin, layers_of(net, 4e-3)
    normals = unit(above - below)
    for points, normal in ((below[:, j0], normals[:, j0]), (above[i0], normals[i0])):
        known = np.isfinite(points[:, 0])
        points, normal = points[known], normal[known]
        chords = unit(np.diff(points, axis=0))
        turn = chords[1:] - chords[:-1]
        within = np.einsum("ij,ij->i", turn, np.cross(normal[1:-1], chords[1:]))
        assert np.abs(within).max() < 1e-9 * np.linalg.norm(turn, axis=1).max()


def test_eccentricities_beyond_the_spacing_or_the_radius_are_refused():
    with pytest.raises(rs.InputError, match="eccentricity 60 mm is larger than the spacing 30 mm"):
        rs.chebyshev_net(rs.Hemisphere(R), LAYOUT, eccentricity=0.06)
    dimple = rs.HeightField(formula=".2 - .5*(x^2 + y^2) - .01*exp(-(x^2 + y^2)/(2*.015^2))", domain=rs.Disc(R))
    with pytest.raises(rs.InputError, match="radius of curvature is 23 mm, and half of the joints' eccentricity 25 mm"):
        rs.chebyshev_net(dimple, rs.GridLayout.orthogonal(spacing=0.05, edge=0.005), eccentricity=0.05)


def test_a_layered_net_is_found_alike_near_another_and_from_nothing():
    target = SURFACES["height field"]
    first = rs.chebyshev_net(target, TURNED)
    near, afresh = (rs.chebyshev_net(target, TURNED, warm_start=one, eccentricity=4e-3) for one in (first, None))
    ends = [[(rod.start, rod.end) for rod in net.rods] for net in (near, afresh)]
    assert np.abs(np.subtract(*ends)).max() < 1e-10

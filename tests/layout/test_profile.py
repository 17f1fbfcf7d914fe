"""Profiles of rods: factors between stations, means over parts, and what is refused."""

from math import log

import numpy as np
import pytest

from rodshell.errors import InputError
from rodshell.layout import FlatGrid, Profile, mesh_grid
from rodshell.layout.gridlayout import lattice_rod
from rodshell.layout.mesh import side_by_side

EIGHTFOLD = Profile((0.0, 1.0), (1.0, 8.0))


def test_factors_are_linear_between_stations_and_the_mean_of_both_sides_at_a_step():
    profile = Profile((0.0, 0.5, 0.5, 1.0), (1.0, 2.0, 4.0, 4.0))
    assert profile.at(np.array([0.0, 0.25, 0.5, 0.75, 1.0])).tolist() == [1.0, 1.5, 3.0, 4.0, 4.0]


def test_mean_compliance_of_a_linear_factor_is_its_logarithm_over_the_span():
    low, high = np.array([0.0, 0.0, 0.3]), np.array([1.0, 0.1, 0.301])
    found = EIGHTFOLD.mean(lambda f: 1.0 / f, low, high)[:, 0]
    exact = [log((1 + 7 * b) / (1 + 7 * a)) / (7 * (b - a)) for a, b in zip(low, high, strict=True)]
    assert found == pytest.approx(exact, rel=2e-5)  # five Gauss points on an eightfold growth: 1e-5
    assert found[1:] == pytest.approx(exact[1:], rel=1e-8)  # over a tenth of the rod: 2.4e-9


def test_double_laths_lie_over_the_middle_share():
    profile = Profile.double(0.6)
    assert profile.at(np.array([0.1, 0.5, 0.9])).tolist() == [1.0, 2.0, 1.0]
    assert profile.steps == pytest.approx((0.2, 0.8))
    assert profile.mean(lambda f: f, np.array([0.0]), np.array([1.0]))[0, 0] == pytest.approx(1.6)


def test_symmetric_profile_is_the_same_from_both_ends():
    profile = Profile.symmetric((0.1, 0.6, 1.0))
    s = np.linspace(0.0, 1.0, 23)
    assert profile.at(s) == pytest.approx(profile.at(1.0 - s), abs=1e-15)
    assert profile.at(np.array([0.0, 0.25, 0.5])) == pytest.approx([0.1, 0.6, 1.0])


def test_profiles_stay_with_their_rods_in_meshes_and_side_by_side():
    rods = [lattice_rod(0, "U", 0.0, -1.0, 1.0), lattice_rod(1, "V", 0.0, -1.0, 1.0)]
    mesh = mesh_grid(FlatGrid.of(rods), 0.3).with_profiles((EIGHTFOLD, None))
    assert [rod.profile for rod in mesh.in_layers(0.1).grid.rods] == [EIGHTFOLD, None]
    assert mesh.grid.rods[0].cut(-0.5, 0.5).profile == EIGHTFOLD
    both = side_by_side({"A": mesh, "B": mesh}, 1.0).grid.rods
    assert [rod.profile for rod in both] == [EIGHTFOLD, None, EIGHTFOLD, None]


@pytest.mark.parametrize(
    ("stations", "factors", "varies", "said"),
    [
        ((0.0, 1.0), (1.0,), "size", "1 factors at 2 stations"),
        ((0.0, 0.5), (1.0, 1.0), "size", "ascend from 0 to 1"),
        ((0.0, 0.7, 0.3, 1.0), (1.0,) * 4, "size", "ascend from 0 to 1"),
        ((0.0, 0.5, 0.5, 0.5, 1.0), (1.0,) * 5, "size", "more than twice"),
        ((0.0, 1.0), (1.0, 0.0), "size", "must be positive"),
        ((0.0, 1.0), (1.0, float("nan")), "size", "each of the factors of a profile must be positive, not nan"),
        ((0.0, 1.0), (1.0, 1.0), "colour", "varies"),
        ("ab", (1.0, 1.0), "size", "sequence of numbers"),
    ],
)
def test_profiles_that_make_no_sense_are_refused(stations, factors, varies, said):
    with pytest.raises(InputError, match=said):
        Profile(stations, factors, varies)


@pytest.mark.parametrize("share", [0.0, 1.0, -0.5, float("nan")])
def test_a_share_that_is_no_part_of_the_rod_is_refused(share):
    with pytest.raises(InputError, match=r"double must (lie between 0 and 1|be finite)"):
        Profile.double(share)


def test_as_many_profiles_as_rods():
    grid = FlatGrid.of([lattice_rod(0, "U", 0.0, -1.0, 1.0)])
    with pytest.raises(InputError, match="the grid has 1 rods"):
        grid.with_profiles((None, None))

"""Shells under snow, bare and braced, against `BracedTwin`, which shares none of our mechanics or areas."""

import numpy as np
import pytest

import rodshell as rs
from rodshell.layout.cells import diagonals
from tests.loads.braced_twin import BracedTwin
from tests.loads.shells import LARCH, ROPE, SNOW, TUBE, one, shell

AGREE = 0.01  # of the factor: both stop within 0.2 and 0.4 % below the loss, and their areas differ
SURFACES = {
    "tubes": (lambda x, y: np.sqrt(np.maximum(100.0 - x**2 - y**2, 0.0)), np.sqrt(84.0)),
    "laths": (lambda x, y: 4.0 * (1 - (x**2 + y**2) / 64), 8.0),
}


def twin(name: str, **more: object) -> BracedTwin:
    height, radius = SURFACES[name]
    rod = TUBE if name == "tubes" else LARCH
    return BracedTwin(shell(name).popped["pinned"], rod, snow=SNOW, height=height, radius=radius, **more)


def test_limit_and_linear_factor_of_a_bare_cap_under_snow_agree_with_the_twin() -> None:
    found = rs.check_loads(shell("tubes"), one(rs.Snow(SNOW))).shells["all"]["pinned"]
    other = twin("tubes")
    limit, _ = other.load_factor(accuracy=2e-3)
    assert found.limit_factor == pytest.approx(limit, rel=AGREE)
    assert found.linear_factor == pytest.approx(other.linear_factor(other.state), rel=AGREE)
    assert abs(found.linear_factor / found.limit_factor - 1) < 0.1


@pytest.mark.slow
def test_limit_of_a_cap_braced_by_cables_agrees_with_the_twin() -> None:
    form = shell("tubes")
    bracing = rs.Cables(rod=ROPE, prestrain=1e-3)
    found = rs.check_loads(form, one(rs.Snow(SNOW), bracing=bracing)).shells["all"]["pinned"]
    mesh = form.footprint.mesh
    ropes = mesh.joint_nodes[diagonals(mesh.grid)]
    other = twin("tubes", ropes=ropes, prestrain=1e-3, rope_stiffness=ROPE.stretch_stiffness)
    state, negative = other.settled(other.state, 0.0)
    assert negative == 0
    assert found.linear_factor == pytest.approx(other.linear_factor(state), rel=AGREE)
    other.state, limit = state, found.limit_factor
    below = [share * limit for share in (0.5, 0.8, 0.9, 0.97)]  # nearer, slack cables keep Newton from settling
    assert other.negative_modes([*below, (1 - AGREE) * limit]) == 0
    assert other.negative_modes([*below, (1 + AGREE) * limit]) > 0

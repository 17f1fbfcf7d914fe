"""Pairs of near points against SciPy's tree."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from rodshell.geometry import near_pairs as module
from rodshell.geometry.near_pairs import near_pairs

RNG = np.random.default_rng(5)
LINE = np.column_stack([np.linspace(-1e3, 1e3, 900), np.zeros(900), np.full(900, 7.0)])
CLOUDS = {
    "a cube": RNG.uniform(-1.0, 1.0, (700, 3)),
    "a plane": RNG.uniform(0.0, 3.0, (500, 3)) * (1, 1, 0),
    "a lattice": np.stack(np.meshgrid(*[np.arange(6.0)] * 3), axis=-1).reshape(-1, 3),
    "a long line": LINE,
    "two clusters far apart": np.concatenate([RNG.normal(size=(80, 3)), RNG.normal(size=(80, 3)) + 1e9]),
    "one place": np.zeros((12, 3)),
}


@pytest.mark.parametrize("cloud", CLOUDS)
@pytest.mark.parametrize("radius", [0.13, 1.0000001, 3.3])
@pytest.mark.parametrize("part", [2**15, 37])
def test_pairs_are_those_of_a_tree(cloud: str, radius: float, part: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "PART", part)
    pairs = near_pairs(CLOUDS[cloud], radius)
    assert {*map(tuple, pairs.tolist())} == cKDTree(CLOUDS[cloud]).query_pairs(radius)
    assert len(np.unique(pairs, axis=0)) == len(pairs)
    assert np.all(pairs[:, 0] < pairs[:, 1])


@pytest.mark.parametrize("count", [0, 1])
def test_fewer_than_two_points_have_no_pairs(count: int) -> None:
    assert near_pairs(np.zeros((count, 3)), 1.0).shape == (0, 2)

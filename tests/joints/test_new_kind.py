"""A new kind of joint is one class: everything else follows from what it has."""

from dataclasses import dataclass

import numpy as np

import rodshell as rs
from rodshell.rods.joints import Joint

ROD = rs.Rod(rs.Circle(radius=1e-3), rs.Material(25e9, 1900))


@dataclass(frozen=True)
class Rubber(Joint):
    """Half as stiff out of plane as about its normal."""

    shear: float = 0.02
    name = kind = "rubber"

    @property
    def out_of_plane(self) -> float:
        return 0.5 * self.shear


def test_a_joint_of_a_new_kind_pops_up_as_the_spring_of_its_stiffnesses_does() -> None:
    layout = rs.GridLayout.orthogonal(rods=(5, 5), spacing=0.08, length="auto", edge=0.02)
    form = rs.find_form(rs.Hemisphere(radius=0.2), layout, ROD, ends="pinned")
    joints = (Rubber(), rs.Spring(shear=0.02, out_of_plane=0.01), rs.Ball())
    rubber, spring, ball = (
        rs.pop_up(form.footprint, form.boundary, ROD, ends="pinned", joint=joint) for joint in joints
    )
    np.testing.assert_array_equal(rubber.positions, spring.positions)
    assert np.abs(rubber.positions - ball.positions).max() > 1e-4
    checks = rs.check({"pinned": rubber}, ROD, stages=0)
    assert np.abs(checks.joints["pinned"].shear_moments).max() > 1e-4
    assert (Rubber().turns_frames, Rubber().holds_normals, Rubber().resists_shear) == (True, True, True)
    assert (rs.Ball().turns_frames, rs.Pin().resists_shear, rs.Linker().resists_shear) == (False, False, True)

"""Shells that the tests of checks share, found once."""

from functools import cache

import rodshell as rs

ROD = rs.Rod(section=rs.Circle(radius=1e-3), material=rs.Material(youngs_modulus=1e6, density=1e3))


@cache
def dome() -> rs.Form:
    """A coarse hemisphere: seven rods each way."""
    layout = rs.GridLayout.orthogonal(rods=(7, 7), spacing=0.06, edge=0.015)
    return rs.find_form(rs.Hemisphere(0.2), layout, ROD)


@cache
def wave() -> rs.Form:
    """A shell that cannot be pushed up smoothly: it has ups and downs."""
    target = rs.HeightField(formula="0.08*cos(8*x)*cos(6*y)", domain=rs.Disc(0.15))
    return rs.find_form(target, rs.GridLayout.orthogonal(spacing=0.03, edge=0.01), ROD, ends=("pinned",))

"""Shells that the tests of checks share, found once."""

from functools import cache

import gridshell as gs

ROD = gs.Rod(section=gs.Circle(radius=1e-3), material=gs.Material(youngs_modulus=1e6, density=1e3))


@cache
def dome() -> gs.Form:
    """A coarse hemisphere: seven rods each way."""
    layout = gs.GridLayout.orthogonal(rods=(7, 7), spacing=0.06, edge=0.015)
    return gs.find_form(gs.Hemisphere(0.2), layout, ROD)


@cache
def wave() -> gs.Form:
    """A shell that cannot be pushed up smoothly: it has ups and downs."""
    target = gs.HeightField(formula="0.08*cos(8*x)*cos(6*y)", domain=gs.Disc(0.15))
    return gs.find_form(target, gs.GridLayout.orthogonal(spacing=0.03, edge=0.01), ROD, ends=("pinned",))

"""Shells of few nodes that the tests of loads share, found once; and loads on them."""

from functools import cache

import rodshell as rs

TUBE = rs.Rod(rs.Tube(radius=0.0417 / 2, thickness=0.0035), rs.Material(25e9, 1750, 0.3))
LARCH = rs.Rod(rs.RectangularSection(width=0.035, height=0.05), rs.Material(12e9, 590, shear=0.7e9))
ROPE = rs.Rod(rs.Circle(0.003), rs.Material(160e9, 7850, 0.3))
SNOW = 1000.0  # N/m2


@cache
def shell(name: str) -> rs.Form:
    """A cap of tubes; a paraboloid of laths that pins hold upright; an oval without symmetry, with both ends."""
    if name == "tubes":
        return rs.find_form(rs.Cap(10.0, 4.0), grid(3.0, 1.5), TUBE, ends="pinned")
    if name == "laths":
        return rs.find_form(rs.Paraboloid(8.0, 4.0), grid(3.0, 1.5), LARCH, ends="pinned", joint=rs.Pin())
    assert name == "oval"
    layout = grid(1.6, 0.8, rotate=0.4, offset=(0.3, 0.2))
    return rs.find_form(rs.Ellipsoid(8.0, 6.0, 4.0), layout, TUBE, ends="both", joint=rs.Pin(eccentricity=0.04))


def grid(spacing: float, edge: float, **more: object) -> rs.GridLayout:
    return rs.GridLayout.orthogonal(spacing=spacing, edge=edge, **more)  # type: ignore[arg-type]


def one(load: object, **more: object) -> rs.Loads:
    """A single load as the only combination, "all"."""
    return rs.Loads(loads={"it": load}, combinations={"all": {"it": 1.0}}, **more)  # type: ignore[arg-type, dict-item]

"""Braced shells under snow, against their own form finding: bracing, one path with three linear modes, and the paths of
the shells with imperfections of either sign."""

import rodshell as rs
from benchmarks.rows import Row, Section, ms, timed

TUBE = rs.Rod(rs.Tube(radius=0.02085, thickness=0.0035), rs.Material(25e9, 1750, 0.3))
LARCH = rs.Rod(rs.RectangularSection(width=0.035, height=0.05), rs.Material.preset("larch"))
CABLES = rs.Cables(rod=rs.Rod(rs.Circle(0.003), rs.Material(160e9, 7850, 0.3)), prestrain=1e-3)
LAYOUT = rs.GridLayout.orthogonal(spacing=1.0, edge=1 / 6)


def tubes() -> rs.Form:
    return rs.find_form(rs.Cap(10.0, 4.0), LAYOUT, TUBE, ends="pinned")


def laths() -> rs.Form:
    return rs.find_form(rs.Paraboloid(8.0, 4.0), LAYOUT, LARCH, ends="pinned", joint=rs.Pin())


def loads(runs: int) -> Section:
    """Net, drape and pinned pop-up at 1 m with six edges to a metre; then all that `rs.check_loads` does."""
    rows = list[Row]()
    for name, find in (("tubes, cap of 18 m", tubes), ("laths on pins, paraboloid of 16 m", laths)):
        form, formed = find(), timed(find, runs=runs)
        for words, bracing in (("cables", CABLES), ("a third layer", rs.Laths())):
            asked = rs.Loads(
                loads={"snow": rs.Snow(1000.0)}, combinations={"snow": {"snow": 1.0}}, bracing=bracing,
                stability=rs.Stability(imperfection="span/500", modes=3),
            )  # fmt: skip
            found = rs.check_loads(form, asked).shells["snow"]["pinned"]
            checked = timed(lambda asked=asked, form=form: rs.check_loads(form, asked), runs=runs)
            figure = f"{checked / formed:.0f} ({ms(checked)} / {ms(formed)}; {found.factorizations} factorisations)"
            rows.append(Row(f"{name}, {words}: load check over form finding", figure, "target 20"))
    return Section("Under load: braced shells", __doc__.replace("\n", " "), rows)

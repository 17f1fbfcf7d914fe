"""rodshell: from a target surface to a flat grid of elastic rods that pops up into it.

    import rodshell as rs

    target = rs.Hemisphere(radius=0.2)
    layout = rs.GridLayout.orthogonal(rods=(17, 17), spacing=0.03, length=1.2, edge=0.005)
    rod = rs.Rod(section=rs.Circle(radius=1e-3), material=rs.Material(youngs_modulus=1e6, density=1e3))
    form = rs.find_form(target, layout, rod)
    print(form.summary())
    form.save("out/dome")

Names are imported when they are first used, so that the command line starts at once.
"""

from importlib import import_module
from typing import TYPE_CHECKING

from rodshell.uncached import allow_uncached

allow_uncached()

if TYPE_CHECKING:
    from rodshell.errors import (
        ConvergenceError,
        InputError,
        NetLimitError,
        OutOfTimeError,
        OutputError,
        RodshellError,
        StabilityError,
    )
    from rodshell.fabrication import Fabrication
    from rodshell.form import Form, PoppedUp, Sewn, find_form, pop_up_table, sew
    from rodshell.formfinding import (
        Agreement,
        Bound,
        Boundary,
        Draped,
        DrapeFigures,
        Fall,
        Footprint,
        Gravity,
        Popped,
        Trimmed,
        agreement,
        drape,
        map_back,
        pop_up,
        trim,
    )
    from rodshell.formfinding.rising import Rise, Risen, pop_up_in_time
    from rodshell.formfinding.sewn import PatchLayout
    from rodshell.joints import (
        Ball,
        ExplicitPenalty,
        ImplicitPenalty,
        Linker,
        Pin,
        Rigid,
        SharedDofs,
        Spring,
    )
    from rodshell.layout import FlatGrid, FlatRod, GridLayout, GridMesh, mesh_grid, straight_rods
    from rodshell.model.elastic_rod import ElasticRod, RodStrains
    from rodshell.model.shell import Shell
    from rodshell.nets import ChebyshevNet, chebyshev_net, sphere_net_end, sphere_net_rod
    from rodshell.output.options import DrawingStyle, OutputOptions
    from rodshell.results import Archive, Results, Verdict, read
    from rodshell.rods.materials import Material
    from rodshell.rods.section import Circle, Ellipse, GivenSection, RectangularSection, Rod, Tube
    from rodshell.solve.forces import Damping, ExplicitForce, GravityForce, ImplicitForce, PointLoads
    from rodshell.solve.implicit_euler import ImplicitEuler, Motion
    from rodshell.solve.rod_statics import RodShape, solve_rod
    from rodshell.solve.simulate import simulate
    from rodshell.solve.time_series import Moment, TimeSeries
    from rodshell.targets import (
        Cap,
        Disc,
        Ellipsoid,
        Freeform,
        HeightField,
        Hemisphere,
        Paraboloid,
        Placement,
        Rectangle,
        Target,
        heights_from,
        surface_from,
    )

_HOMES = {
    "rodshell.errors": (
        "ConvergenceError", "RodshellError", "InputError", "NetLimitError", "OutOfTimeError", "OutputError",
        "StabilityError",
    ),
    "rodshell.fabrication": ("Fabrication",),
    "rodshell.form": ("Form", "PoppedUp", "Sewn", "find_form", "pop_up_table", "sew"),
    "rodshell.formfinding": (
        "Agreement", "Bound", "Boundary", "DrapeFigures", "Draped", "Fall", "Footprint", "Gravity", "Popped", "Trimmed",
        "agreement", "drape", "map_back", "pop_up", "trim",
    ),
    "rodshell.formfinding.rising": ("Rise", "Risen", "pop_up_in_time"),
    "rodshell.formfinding.sewn": ("PatchLayout",),
    "rodshell.joints": (
        "Ball", "ExplicitPenalty", "ImplicitPenalty", "Linker", "Pin", "Rigid", "SharedDofs", "Spring",
    ),
    "rodshell.layout": ("FlatGrid", "FlatRod", "GridLayout", "GridMesh", "mesh_grid", "straight_rods"),
    "rodshell.model.elastic_rod": ("ElasticRod", "RodStrains"),
    "rodshell.model.shell": ("Shell",),
    "rodshell.nets": ("ChebyshevNet", "chebyshev_net", "sphere_net_end", "sphere_net_rod"),
    "rodshell.rods.materials": ("Material",),
    "rodshell.rods.section": ("Circle", "Ellipse", "GivenSection", "RectangularSection", "Rod", "Tube"),
    "rodshell.output.options": ("DrawingStyle", "OutputOptions"),
    "rodshell.results": ("Archive", "Results", "Verdict", "read"),
    "rodshell.solve.rod_statics": ("RodShape", "solve_rod"),
    "rodshell.solve.forces": ("Damping", "ExplicitForce", "GravityForce", "ImplicitForce", "PointLoads"),
    "rodshell.solve.implicit_euler": ("ImplicitEuler", "Motion"),
    "rodshell.solve.simulate": ("simulate",),
    "rodshell.solve.time_series": ("Moment", "TimeSeries"),
    "rodshell.targets": (
        "Cap", "Disc", "Ellipsoid", "Freeform", "HeightField", "Hemisphere", "Paraboloid", "Placement", "Rectangle",
        "Target", "heights_from", "surface_from",
    ),
}  # fmt: skip
_HOME_OF = {name: home for home, names in _HOMES.items() for name in names}

__all__ = [
    "Agreement", "Archive", "Ball", "Bound", "Boundary", "Cap", "ChebyshevNet", "Circle", "ConvergenceError",
    "Damping", "Disc", "DrapeFigures", "Draped", "DrawingStyle", "ElasticRod", "Ellipse", "Ellipsoid", "ExplicitForce",
    "ExplicitPenalty", "Fabrication", "Fall", "FlatGrid", "FlatRod", "Footprint", "Form", "Freeform", "GivenSection",
    "Gravity", "GravityForce", "GridLayout", "GridMesh", "RodshellError", "HeightField", "Hemisphere", "ImplicitEuler",
    "ImplicitForce", "ImplicitPenalty", "InputError", "Linker", "Material", "Moment", "Motion", "NetLimitError",
    "OutOfTimeError", "OutputError", "OutputOptions", "Paraboloid", "PatchLayout", "Pin", "Placement", "PointLoads",
    "Popped", "PoppedUp", "Rectangle", "RectangularSection", "Results", "Rigid", "Rise", "Risen", "Rod", "RodShape",
    "RodStrains", "Sewn", "SharedDofs", "Shell", "Spring", "StabilityError", "Target", "TimeSeries", "Trimmed", "Tube",
    "Verdict", "agreement", "chebyshev_net", "drape", "find_form", "heights_from", "map_back", "mesh_grid", "pop_up",
    "pop_up_in_time", "pop_up_table", "read", "sew", "simulate", "solve_rod", "sphere_net_end", "sphere_net_rod",
    "straight_rods", "surface_from", "trim",
]  # fmt: skip


def __getattr__(name: str) -> object:
    if name not in _HOME_OF:
        raise AttributeError(f"module 'rodshell' has no attribute {name!r}")
    return getattr(import_module(_HOME_OF[name]), name)


def __dir__() -> list[str]:
    return __all__

"""gridshell: from a target surface to a flat grid of elastic rods that pops up into it.

    import gridshell as gs

    target = gs.Hemisphere(radius=0.2)
    layout = gs.GridLayout.orthogonal(rods=(17, 17), spacing=0.03, length=1.2, edge=0.005)
    rod = gs.Rod(section=gs.Circle(radius=1e-3), material=gs.Material(youngs_modulus=1e6, density=1e3))
    form = gs.find_form(target, layout, rod)
    print(form.summary())
    form.save("out/dome")

Names are imported when they are first used, so that the command line starts at once.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from gridshell.errors import (
        ConvergenceError,
        GridshellError,
        InputError,
        NetLimitError,
        OutputError,
        StabilityError,
    )
    from gridshell.fabrication import Fabrication
    from gridshell.form import Form, PoppedUp, Sewn, find_form, pop_up_table, sew
    from gridshell.formfinding import (
        Agreement,
        Boundary,
        Draped,
        Fall,
        Footprint,
        Popped,
        Trimmed,
        agreement,
        drape,
        map_back,
        pop_up,
        trim,
    )
    from gridshell.formfinding.rising import Rise, Risen, pop_up_in_time
    from gridshell.formfinding.sewn import PatchLayout
    from gridshell.joints import (
        Ball,
        ExplicitPenalty,
        ImplicitPenalty,
        Linker,
        Pin,
        Rigid,
        SharedDofs,
        Spring,
    )
    from gridshell.layout import FlatGrid, FlatRod, GridLayout, GridMesh, mesh_grid, straight_rods
    from gridshell.model.elastic_rod import ElasticRod, RodStrains
    from gridshell.model.shell import Shell
    from gridshell.nets import ChebyshevNet, chebyshev_net, sphere_net_end, sphere_net_rod
    from gridshell.output.archive import Archive, read
    from gridshell.output.takeaway import DrawingStyle, Takeaway
    from gridshell.rods.section import Circle, Ellipse, GivenSection, Material, RectangularSection, Rod, Tube
    from gridshell.solve.forces import Damping, ExplicitForce, Gravity, ImplicitForce, PointLoads
    from gridshell.solve.implicit_euler import ImplicitEuler, Motion
    from gridshell.solve.rod_statics import RodShape, solve_rod
    from gridshell.solve.simulate import simulate
    from gridshell.solve.time_series import Moment, TimeSeries
    from gridshell.targets import (
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
    "gridshell.errors": (
        "ConvergenceError", "GridshellError", "InputError", "NetLimitError", "OutputError", "StabilityError",
    ),
    "gridshell.fabrication": ("Fabrication",),
    "gridshell.form": ("Form", "PoppedUp", "Sewn", "find_form", "pop_up_table", "sew"),
    "gridshell.formfinding": (
        "Agreement", "Boundary", "Draped", "Fall", "Footprint", "Popped", "Trimmed", "agreement", "drape", "map_back",
        "pop_up", "trim",
    ),
    "gridshell.formfinding.rising": ("Rise", "Risen", "pop_up_in_time"),
    "gridshell.formfinding.sewn": ("PatchLayout",),
    "gridshell.joints": (
        "Ball", "ExplicitPenalty", "ImplicitPenalty", "Linker", "Pin", "Rigid", "SharedDofs", "Spring",
    ),
    "gridshell.layout": ("FlatGrid", "FlatRod", "GridLayout", "GridMesh", "mesh_grid", "straight_rods"),
    "gridshell.model.elastic_rod": ("ElasticRod", "RodStrains"),
    "gridshell.model.shell": ("Shell",),
    "gridshell.nets": ("ChebyshevNet", "chebyshev_net", "sphere_net_end", "sphere_net_rod"),
    "gridshell.rods.section": (
        "Circle", "Ellipse", "GivenSection", "Material", "RectangularSection", "Rod", "Tube",
    ),
    "gridshell.output.archive": ("Archive", "read"),
    "gridshell.output.takeaway": ("DrawingStyle", "Takeaway"),
    "gridshell.solve.rod_statics": ("RodShape", "solve_rod"),
    "gridshell.solve.forces": ("Damping", "ExplicitForce", "Gravity", "ImplicitForce", "PointLoads"),
    "gridshell.solve.implicit_euler": ("ImplicitEuler", "Motion"),
    "gridshell.solve.simulate": ("simulate",),
    "gridshell.solve.time_series": ("Moment", "TimeSeries"),
    "gridshell.targets": (
        "Cap", "Disc", "Ellipsoid", "Freeform", "HeightField", "Hemisphere", "Paraboloid", "Placement", "Rectangle",
        "Target", "heights_from", "surface_from",
    ),
}  # fmt: skip
_HOME_OF = {name: home for home, names in _HOMES.items() for name in names}

__all__ = [
    "Agreement", "Archive", "Ball", "Boundary", "Cap", "ChebyshevNet", "Circle", "ConvergenceError", "Damping",
    "Disc", "Draped", "DrawingStyle", "ElasticRod", "Ellipse", "Ellipsoid", "ExplicitForce", "ExplicitPenalty",
    "Fabrication", "Fall", "FlatGrid", "FlatRod", "Footprint", "Form", "Freeform", "GivenSection", "Gravity",
    "GridLayout", "GridMesh", "GridshellError", "HeightField", "Hemisphere", "ImplicitEuler", "ImplicitForce",
    "ImplicitPenalty", "InputError", "Linker", "Material", "Moment", "Motion", "NetLimitError", "OutputError",
    "Paraboloid", "PatchLayout", "Pin", "Placement", "PointLoads", "Popped", "PoppedUp", "Rectangle",
    "RectangularSection", "Rigid", "Rise", "Risen", "Rod", "RodShape", "RodStrains", "Sewn", "SharedDofs", "Shell",
    "Spring", "StabilityError", "Takeaway", "Target", "TimeSeries", "Trimmed", "Tube", "agreement", "chebyshev_net",
    "drape", "find_form", "heights_from", "map_back", "mesh_grid", "pop_up", "pop_up_in_time", "pop_up_table",
    "read", "sew", "simulate", "solve_rod", "sphere_net_end", "sphere_net_rod", "straight_rods", "surface_from",
    "trim",
]  # fmt: skip


def __getattr__(name: str) -> object:
    if name not in _HOME_OF:
        raise AttributeError(f"module 'gridshell' has no attribute {name!r}")
    return getattr(import_module(_HOME_OF[name]), name)


def __dir__() -> list[str]:
    return __all__

"""rodshell: from a target surface to a flat grid of elastic rods that pops up into it.

    import rodshell as rs

    job = rs.Job.load("hemisphere")              # a case by its name or its file, or rs.Job(target, layout, rod)
    form = job.run(progress=rs.bar)
    print(form.summary())
    form.save("out/dome")
    turned = job.changed(layout__rotate="10 deg").run(warm_start=form)

Names are imported when they are first used, so that the command line starts at once.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rodshell.checks import check
    from rodshell.errors import (
        ConvergenceError,
        InputError,
        NetLimitError,
        OutOfTimeError,
        OutputError,
        RodshellError,
        StabilityError,
    )
    from rodshell.fabrication.fabricate import fabricate
    from rodshell.fabrication.settings import Fabrication
    from rodshell.form import Form, check_loads
    from rodshell.formfinding import (
        Agreement,
        Bound,
        Boundary,
        Draped,
        Fall,
        Footprint,
        Gravity,
        PopUp,
        Trimmed,
        agreement,
        drape,
        map_back,
        pop_up,
        trim,
    )
    from rodshell.formfinding.dynamic_pop_up import DynamicPopUp, DynamicPopUpSettings, dynamic_pop_up
    from rodshell.formfinding.search import search
    from rodshell.formfinding.settle import settle
    from rodshell.job import Job, find_form, pop_up_table, refine
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
    from rodshell.layout import (
        Asymptotic,
        Curves,
        FlatGrid,
        FlatRod,
        Geodesic,
        GridLayout,
        GridMesh,
        Profile,
        mesh_grid,
        straight_rods,
    )
    from rodshell.loads.combinations import Loads
    from rodshell.loads.kinds import LineLoad, PointLoad, SelfWeight, Settlement, Snow, Temperature, Wind
    from rodshell.loads.settings import Cables, Laths, LockedJoints, Stability, Strength
    from rodshell.model.elastic_rod import ElasticRod
    from rodshell.model.shell import Shell
    from rodshell.nets import ChebyshevNet, chebyshev_net
    from rodshell.output.files import export, save
    from rodshell.output.options import OutputOptions
    from rodshell.output.settings import DrawingStyle
    from rodshell.progress import bar
    from rodshell.results import Archive, Results, Verdict, read
    from rodshell.rods.local_energy import LocalEnergy
    from rodshell.rods.materials import Material
    from rodshell.rods.section import Circle, Ellipse, GivenSection, RectangularSection, Rod, Tube, section_from
    from rodshell.rods.support_groups import (
        Arch,
        ClampedEnds,
        EdgeBeam,
        FreeEnds,
        HeldEnds,
        Ring,
        SlidingEnds,
        SprungEnds,
        SupportGroups,
    )  # fmt: skip
    from rodshell.rods.supports import Support
    from rodshell.solve.implicit_euler import ImplicitEuler, Motion
    from rodshell.solve.problem import Damping, ExplicitForce, GravityForce, ImplicitForce, PointLoads
    from rodshell.solve.rod_statics import RodLoads, RodShape, RodSupports, solve_rod
    from rodshell.solve.simulate import Sample, TimeSeries, simulate
    from rodshell.sweeps import optimise, read_sweep, sweep
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
    from rodshell.targets.patch_layout import PatchLayout
    from rodshell.version import __version__

_HOMES = {
    "rodshell.checks": ("check",),
    "rodshell.errors": (
        "ConvergenceError", "InputError", "NetLimitError", "OutOfTimeError", "OutputError", "RodshellError",
        "StabilityError",
    ),
    "rodshell.fabrication.fabricate": ("fabricate",),
    "rodshell.fabrication.settings": ("Fabrication",),
    "rodshell.form": ("Form", "check_loads"),
    "rodshell.formfinding": (
        "Agreement", "Bound", "Boundary", "Draped", "Fall", "Footprint", "Gravity", "PopUp", "Trimmed", "agreement",
        "drape", "map_back", "pop_up", "trim",
    ),
    "rodshell.formfinding.dynamic_pop_up": ("DynamicPopUp", "DynamicPopUpSettings", "dynamic_pop_up"),
    "rodshell.progress": ("bar",),
    "rodshell.formfinding.search": ("search",),
    "rodshell.formfinding.settle": ("settle",),
    "rodshell.job": ("Job", "find_form", "pop_up_table", "refine"),
    "rodshell.joints": ("Ball", "ExplicitPenalty", "ImplicitPenalty", "Linker", "Pin", "Rigid", "SharedDofs", "Spring"),
    "rodshell.layout": (
        "Asymptotic", "Curves", "FlatGrid", "FlatRod", "Geodesic", "GridLayout", "GridMesh", "Profile", "mesh_grid",
        "straight_rods",
    ),
    "rodshell.loads.combinations": ("Loads",),
    "rodshell.loads.settings": ("Cables", "Laths", "LockedJoints", "Stability", "Strength"),
    "rodshell.loads.kinds": ("LineLoad", "PointLoad", "SelfWeight", "Settlement", "Snow", "Temperature", "Wind"),
    "rodshell.model.elastic_rod": ("ElasticRod",),
    "rodshell.model.shell": ("Shell",),
    "rodshell.nets": ("ChebyshevNet", "chebyshev_net"),
    "rodshell.output.files": ("export", "save"),
    "rodshell.output.options": ("OutputOptions",),
    "rodshell.output.settings": ("DrawingStyle",),
    "rodshell.results": ("Archive", "Results", "Verdict", "read"),
    "rodshell.rods.local_energy": ("LocalEnergy",),
    "rodshell.rods.supports": ("Support",),
    "rodshell.rods.support_groups": (
        "Arch", "ClampedEnds", "EdgeBeam", "FreeEnds", "HeldEnds", "Ring", "SlidingEnds", "SprungEnds", "SupportGroups",
    ),
    "rodshell.rods.materials": ("Material",),
    "rodshell.rods.section": ("Circle", "Ellipse", "GivenSection", "RectangularSection", "Rod", "Tube", "section_from"),
    "rodshell.solve.problem": ("Damping", "ExplicitForce", "GravityForce", "ImplicitForce", "PointLoads"),
    "rodshell.solve.implicit_euler": ("ImplicitEuler", "Motion"),
    "rodshell.solve.rod_statics": ("RodLoads", "RodShape", "RodSupports", "solve_rod"),
    "rodshell.solve.simulate": ("Sample", "TimeSeries", "simulate"),
    "rodshell.sweeps": ("optimise", "read_sweep", "sweep"),
    "rodshell.targets": (
        "Cap", "Disc", "Ellipsoid", "Freeform", "HeightField", "Hemisphere", "Paraboloid", "Placement", "Rectangle",
        "Target", "heights_from", "surface_from",
    ),
    "rodshell.targets.patch_layout": ("PatchLayout",),
    "rodshell.version": ("__version__",),
}  # fmt: skip
_HOME_OF = {name: home for home, names in _HOMES.items() for name in names}

__all__ = [
    "Agreement", "Arch", "Archive", "Asymptotic", "Ball", "Bound", "Boundary", "Cables", "Cap", "ChebyshevNet",
    "Circle", "ClampedEnds", "ConvergenceError", "Curves", "Damping", "Disc", "Draped", "DrawingStyle", "DynamicPopUp",
    "DynamicPopUpSettings", "EdgeBeam", "ElasticRod", "Ellipse", "Ellipsoid", "ExplicitForce", "ExplicitPenalty",
    "Fabrication", "Fall", "FlatGrid", "FlatRod", "Footprint", "Form", "FreeEnds", "Freeform", "Geodesic",
    "GivenSection", "Gravity", "GravityForce", "GridLayout", "GridMesh", "HeightField", "HeldEnds", "Hemisphere",
    "ImplicitEuler", "ImplicitForce", "ImplicitPenalty", "InputError", "Job", "Laths", "LineLoad", "Linker", "Loads",
    "LocalEnergy", "LockedJoints", "Material", "Motion", "NetLimitError", "OutOfTimeError", "OutputError",
    "OutputOptions", "Paraboloid", "PatchLayout", "Pin", "Placement", "PointLoad", "PointLoads", "PopUp", "Profile",
    "Rectangle", "RectangularSection", "Results", "Rigid", "Ring", "Rod", "RodLoads", "RodShape", "RodSupports",
    "RodshellError", "Sample", "SelfWeight", "Settlement", "SharedDofs", "Shell", "SlidingEnds", "Snow", "Spring",
    "SprungEnds", "Stability", "StabilityError", "Strength", "Support", "SupportGroups", "Target", "Temperature",
    "TimeSeries", "Trimmed", "Tube", "Verdict", "Wind", "__version__", "agreement", "bar", "chebyshev_net", "check",
    "check_loads", "drape", "dynamic_pop_up", "export", "fabricate", "find_form", "heights_from", "map_back",
    "mesh_grid", "optimise", "pop_up", "pop_up_table", "read", "read_sweep", "refine", "save", "search", "section_from",
    "settle", "simulate", "solve_rod", "straight_rods", "surface_from", "sweep", "trim",
]  # fmt: skip


def __getattr__(name: str) -> object:
    if name not in _HOME_OF:
        raise AttributeError(f"module 'rodshell' has no attribute {name!r}")
    globals()[name] = found = getattr(import_module(_HOME_OF[name]), name)  # asked for once only
    return found


def __dir__() -> list[str]:
    return __all__

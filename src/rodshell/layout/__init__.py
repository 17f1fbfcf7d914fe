"""The flat grid: straight rods, their crossings, and the mesh of nodes and edges on them; and lattices on a target.

Each module is imported when it is first used: a case names lattices, and needs no more.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rodshell.layout.flatgrid import Crossings, FlatGrid, FlatRod, straight_rods
    from rodshell.layout.gridlayout import GridLayout, Layout, require_chebyshev
    from rodshell.layout.lattices import Asymptotic, Curves, Geodesic, SurfaceLattice
    from rodshell.layout.mesh import GridMesh, mesh_grid
    from rodshell.layout.profile import Profile

__all__ = [
    "Asymptotic", "Crossings", "Curves", "FlatGrid", "FlatRod", "Geodesic", "GridLayout", "GridMesh", "Layout",
    "Profile", "SurfaceLattice", "mesh_grid", "require_chebyshev", "straight_rods",
]  # fmt: skip

_HOMES = {
    "flatgrid": ("Crossings", "FlatGrid", "FlatRod", "straight_rods"),
    "gridlayout": ("GridLayout", "Layout", "require_chebyshev"),
    "lattices": ("Asymptotic", "Curves", "Geodesic", "SurfaceLattice"),
    "mesh": ("GridMesh", "mesh_grid"),
    "profile": ("Profile",),
}
_HOME_OF = {name: home for home, names in _HOMES.items() for name in names}


def __getattr__(name: str) -> object:
    if name not in _HOME_OF:
        raise AttributeError(f"module 'rodshell.layout' has no attribute {name!r}")
    return getattr(import_module(f"rodshell.layout.{_HOME_OF[name]}"), name)

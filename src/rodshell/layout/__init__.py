"""The flat grid: straight rods, their crossings, and the mesh of nodes and edges on them."""

from rodshell.layout.flatgrid import Crossings, FlatGrid, FlatRod, straight_rods
from rodshell.layout.gridlayout import GridLayout
from rodshell.layout.mesh import GridMesh, mesh_grid
from rodshell.layout.profile import Profile

__all__ = ["Crossings", "FlatGrid", "FlatRod", "GridLayout", "GridMesh", "Profile", "mesh_grid", "straight_rods"]

"""The assembled shell: free directions of its nodes, and the sum of its energies in them."""

from rodshell.model.assembly import Assembly, BlockRows, Freedom
from rodshell.model.potential import Potential
from rodshell.model.shell import Shell

__all__ = ["Assembly", "BlockRows", "Freedom", "Potential", "Shell"]

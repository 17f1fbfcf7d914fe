"""The assembled shell: free directions of its nodes, and the sum of its energies in them."""

from gridshell.model.assembly import Assembly
from gridshell.model.freedom import Freedom
from gridshell.model.shell import Shell

__all__ = ["Assembly", "Freedom", "Shell"]

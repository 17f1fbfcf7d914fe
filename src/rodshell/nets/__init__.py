"""The inextensible net on a target: geodesics, the compass march, its limit, and the sphere's exact net."""

from rodshell.nets.chebyshev import ChebyshevNet, chebyshev_net
from rodshell.nets.compass import geodesics

__all__ = ["ChebyshevNet", "chebyshev_net", "geodesics"]

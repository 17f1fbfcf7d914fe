"""The inextensible net on a target: geodesics, the compass march, its limit, and the sphere's exact net."""

from rodshell.nets.chebyshev import ChebyshevNet, chebyshev_net
from rodshell.nets.compass import Net, geodesics, march
from rodshell.nets.sphere import sphere_net_end, sphere_net_rod

__all__ = ["ChebyshevNet", "Net", "chebyshev_net", "geodesics", "march", "sphere_net_end", "sphere_net_rod"]

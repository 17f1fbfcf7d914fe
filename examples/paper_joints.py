"""The paper's Fig 4: one of two crossing rods is twisted, or turned [Eq 7], at 10 rpm; does the other follow?

With linkers it does, in both demonstrations. A pin holds the rods together out of their plane and in twist: it passes
(a) and, being free about its axis, cannot pass (b). Rods, supports and steps are in `rodshell/paper/fig4.py`.
"""

import numpy as np

import rodshell as rs
from rodshell.paper.fig4 import RATE, run_in_time

QUARTER = np.pi / 2 / RATE  # s: a quarter of a revolution

for demonstration in ("twisting", "bending"):
    for joint in (rs.Linker(), rs.Pin()):
        for coupling in (rs.SharedDofs(), rs.ImplicitPenalty()):
            run = run_in_time(demonstration, joint, coupling, until=QUARTER)
            turned, lag = np.degrees(run.angles[-1]), np.degrees(run.start_up_lag)
            print(f"{demonstration}, {run.name}: rod 2 turned by {turned:.3f} of 90 degrees; lag at most {lag:.3f}")
            follows = demonstration == "twisting" or isinstance(joint, rs.Linker)
            assert run.follows == follows
            assert (abs(turned - 90.0) < 1e-3) == follows
            assert not follows or lag < 0.5

"""Sweeps: many designs of one job, computed on this machine or on a cluster, none lost and none twice.

A sweep only loads jobs, runs them and reads their results; it knows no stage of form finding.
"""

from rodshell.sweeps.run import Swept, sweep
from rodshell.sweeps.search import Optimised, optimise
from rodshell.sweeps.table import read_sweep

__all__ = ["Optimised", "Swept", "optimise", "read_sweep", "sweep"]

"""Figures of several shells that have nothing to do with each other, as of one."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rodshell.formfinding.agreement import Agreement
from rodshell.solve.report import SolveReport, Status


def joined_report(reports: Sequence[SolveReport]) -> SolveReport:
    """Of solves that have nothing to do with each other."""
    worst = next((one.status for one in reports if not one.converged), Status.CONVERGED)
    total = replace(
        reports[0],
        status=worst,
        reason=next((one.reason for one in reports if one.reason), ""),
        dofs=sum(one.dofs for one in reports),
        force_residual=max(one.force_residual for one in reports),
        max_strain=max(one.max_strain for one in reports),
        negative_modes=sum(one.negative_modes for one in reports),
    )
    return total.after(*reports[1:])


def joined_agreement(parts: Sequence[Agreement]) -> Agreement:
    """Of several patches; each counts by its nodes."""
    worst = max(parts, key=lambda one: one.max)
    count = np.array([len(one.gaps) for one in parts])
    square = np.array([one.rms for one in parts]) ** 2
    rms = float(np.sqrt(np.average(square, weights=count)))
    return replace(worst, gaps=np.concatenate([one.gaps for one in parts]), rms=rms)

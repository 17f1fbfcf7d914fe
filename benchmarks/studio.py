"""The studio: what an update of the page costs while somebody drags."""

import numpy as np

import rodshell as rs
from benchmarks.rows import Row, Section, timed
from rodshell.formfinding import drape
from rodshell.studio.worker import Order, _Worker
from tests.acceptance.studio import INPUTS, Quiet, dragged


def studio(quick: bool) -> Section:
    """The dome of 17 x 17 rods while its spacing, heading and anchor are dragged: the worker's whole update, with what
    the page shows, over net and drape alone. Another update always waits, so that each ends once its grid is shown."""
    quiet, updates, bare = Quiet(), list[float](), list[float]()
    worker = _Worker(quiet)  # type: ignore[arg-type]
    worker.obey(Order(0, "form", dragged(0), True))
    quiet.waits = True
    for k in range(0, INPUTS, 60 if quick else 15):
        at = rs.Job.load(dragged(k)).case.build(None)
        updates.append(timed(lambda k=k: worker.obey(Order(k, "form", dragged(k), True)), runs=3))
        bare.append(timed(lambda at=at: drape(at.layout, at.rod, at.target, anchor=at.anchor), runs=3))
    figure = f"{sum(updates) / sum(bare):.2f} ({1e3 * np.mean(updates):.1f} over {1e3 * np.mean(bare):.1f} ms)"
    row = Row("update of the studio over net and drape, 17 x 17 dome", figure, "at most 1.3")
    return Section("The studio", " ".join((studio.__doc__ or "").split()), [row])

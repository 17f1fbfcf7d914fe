"""The genetic algorithm's run: seeded, in several processes, kept after every generation.

Differential evolution, DE/best/1/bin of pymoo. Each individual has one child: the best of all, moved by the difference
of two others and crossed with the parent, which gives way to it if the child is better.
"""

import os
import signal
import threading
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import repeat
from multiprocessing import get_context, parent_process
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np

from rodshell.arrays import Floats
from rodshell.errors import InputError
from rodshell.paper.drapes import Progress
from rodshell.paper.genetic_design import Design
from rodshell.paper.genetic_history import GAIN, Generation, gain
from rodshell.paper.genetic_kept import Evaluate, Judged, Kept

POPULATION = 100
MOST = 300  # generations
DIFFERENCE, CROSSED = 0.6, 0.9  # smaller steps or populations draw together in a worse minimum
ROUGHNESS = 0.04  # of the first footprints; rougher ones stand more rarely, and after many more iterations


@dataclass(frozen=True)
class Found:
    """The generations of a search and its best variables (n,) [m]."""

    generations: tuple[Generation, ...]
    variables: Floats


def search(
    design: Design, file: Path, *, seed: int, jobs: int = 1, population: int = POPULATION, most: int = MOST,
    progress: Progress,
) -> Found:  # fmt: skip
    """Search from the random footprints of a seed, or go on, until the best gains less than `GAIN` in `WINDOW`
    generations.

    Parameters
    ----------
    file : where all values are kept, after each generation and when interrupted; the search goes on from there.
    jobs : processes; the result does not depend on their number.
    most : generations after which a search that has not converged is given up.

    Raises
    ------
    InputError : pymoo is not installed; the file is broken or of another search.
    OutputError : the file cannot be written.
    """
    algorithm, kept, made = _algorithm(design, seed, population), Kept.read(file), list[Generation]()
    stage = f"{design.target.name}, generation 1"

    def told(k: int) -> None:
        progress(stage, f"then {k} of {population}", 0.0)

    try:
        with _evaluators(design, jobs) as evaluate:
            while len(made) < most and gain([one.best for one in made]) >= GAIN:
                children = algorithm.ask()
                values = kept.complete(len(made), children.get("X"), evaluate, told)
                children.set("F", values[:, None])
                algorithm.tell(children)
                made.append(_generation(made, algorithm, values, kept.seconds[len(made)], design.target.size))
                stage = f"{design.target.name}, generation {len(made)}: {made[-1]}"
    except KeyboardInterrupt:
        raise KeyboardInterrupt(f"{file} keeps what was found; the same command goes on from there") from None
    progress(stage, "done", 0.0)
    return Found(tuple(made), algorithm.pop.get("X")[int(np.argmin(algorithm.pop.get("F")[:, 0]))])


def _generation(made: list[Generation], algorithm: Any, values: Floats, seconds: float, fallen: float) -> Generation:
    living = algorithm.pop.get("F")[:, 0]
    runs, down = (made[-1].runs, made[-1].fallen) if made else (0, 0)
    down += int(np.count_nonzero(values >= fallen))
    return Generation(float(living.min()), float(living.mean()), runs + len(values), down, seconds)


def _algorithm(design: Design, seed: int, population: int) -> Any:
    """pymoo's, ready to be asked."""
    try:
        from pymoo.algorithms.soo.nonconvex.de import DE
        from pymoo.core.problem import Problem
    except ImportError as error:
        raise InputError('the genetic algorithm needs the package pymoo: pip install "rodshell[paper]"') from error

    problem = Problem(n_var=len(design.lower), n_obj=1, xl=design.lower, xu=design.upper)
    first = design.random(np.random.default_rng(seed), population, ROUGHNESS)
    algorithm = DE(pop_size=population, sampling=first, variant="DE/best/1/bin", F=DIFFERENCE, CR=CROSSED, prob_mut=0.0)
    algorithm.setup(problem, seed=seed, termination=("n_gen", np.inf))
    return algorithm


@contextmanager
def _evaluators(design: Design, jobs: int) -> Iterator[Evaluate]:
    """What judges individuals (k, n), in their order."""
    if jobs == 1:
        yield lambda individuals: (_judge(design, one) for one in individuals)
        return
    pool = ProcessPoolExecutor(jobs, get_context("spawn"), initializer=_follow_parent)
    try:
        yield lambda individuals: pool.map(_judge, repeat(design), individuals)
    finally:
        pool.shutdown(cancel_futures=True)


def _follow_parent() -> None:
    """End with the parent however it ends, and not before it: Ctrl-C reaches every process of a terminal."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = parent_process()
    assert parent is not None
    parent.join()
    os._exit(1)


def _judge(design: Design, variables: Floats) -> Judged:
    begun = process_time()
    return design.error(variables), process_time() - begun

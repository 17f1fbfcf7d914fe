"""What a benchmark reports: rows of figures, ratios first, and how long things take."""

import platform
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median

clock = time.process_time  # of one thread: other work on the machine disturbs it little


@dataclass(frozen=True)
class Row:
    """One line of a table. `asked`: the figure that was wanted, where there is one; such rows come first."""

    what: str
    figure: str
    asked: str = ""


@dataclass(frozen=True)
class Section:
    """One benchmark: its title, what was measured and how, and its rows."""

    title: str
    said: str
    rows: Sequence[Row]


def timed(work: Callable[[], object], *, runs: int = 7, patience: float = 20.0) -> float:
    """Median seconds of processor of repeated runs, after one that does not count; fewer runs where they take long."""
    work()
    times = list[float]()
    while len(times) < runs and (len(times) < 3 or sum(times) < patience):
        begin = clock()
        work()
        times.append(clock() - begin)
    return median(times)


def machine() -> str:
    """Processor, cores, memory and versions in one line."""
    import numpy
    import scipy

    from rodshell.kernels import description

    cpu, memory = platform.processor() or platform.machine(), ""
    info, total = Path("/proc/cpuinfo"), Path("/proc/meminfo")
    if info.exists():
        lines = info.read_text().splitlines()
        cpu = next((line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")), cpu)
        cpu += f", {sum(line.startswith('processor') for line in lines)} cores"
    if total.exists():
        memory = f", {int(total.read_text().split()[1]) / 2**20:.0f} GB"
    python = f"Python {platform.python_version()}, NumPy {numpy.__version__}, SciPy {scipy.__version__}"
    return f"{cpu}{memory}; {platform.system()}; {python}, kernels {description()}; one thread"


def ms(seconds: float) -> str:
    return f"{1e3 * seconds:.3g} ms"

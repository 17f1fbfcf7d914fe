"""Whether a shell is braced, and whether its cables can be cut to their lengths."""

from collections.abc import Iterator

from rodshell.figures.findings import Said, said
from rodshell.results.judged.stress import LARGE
from rodshell.results.judged.supports import width
from rodshell.results.results import Results
from rodshell.results.wording import rounded

SCATTER, SURE = 2e-3, 10.0  # m, of cables as cut and fitted on site; times that, lengths decide their forces


def is_braced(results: Results) -> bool:
    """Whether the shell has bracing under its loads; its own weight alone is checked without."""
    return any(shell.bracing for _, _, shell in results.loaded_shells())


def cable_points(results: Results) -> Iterator[Said]:
    """That lengths do not decide the forces of cables which are hardly shortened, and what scatter of them does."""
    known = ((brace.cut, brace.final) for brace in results.bracing if brace.cut and brace.final)
    shortened = [final - cut for cut, final in known if final > cut]
    if not shortened or min(shortened) >= SURE * SCATTER or width(results) <= LARGE:
        return
    least, most = min(shortened), max(shortened)
    slack = "is slack" if most <= SCATTER else "may be slack" if least <= SCATTER else "loses a part of its force"
    short = f"{1e3 * least:.1f} to {1e3 * most:.1f} mm"
    times, scatter = rounded(1.0 + SCATTER / least, 2), f"{1e3 * SCATTER:g} mm"
    yield said("cables_short", None, least, SURE * SCATTER, "m", short=short, scatter=scatter, slack=slack, times=times)

"""Gates: what a refined design must pass before it is accepted, because an optimiser finds what cannot be built.

    stable      the shell is a stable equilibrium
    flat        its rods, straight and with their joints where they are drilled, fit together in a plane
    remeshed    meshed again with the same edge length it is as near to its target
    tolerance   it stays stable, and nearly as near, when it is built with errors
    from_flat   pushed up from flat it comes to the same shape

All sizes are relative to the target's.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import coo_array, csc_array, eye_array
from scipy.sparse.linalg import spsolve

from rodshell.arrays import Floats
from rodshell.formfinding.pipeline import Stages, agreement, meshed_again
from rodshell.formfinding.popup import PopUp, pop_up
from rodshell.layout import GridMesh
from rodshell.model.edge_properties import EI1, LENGTH, PROPERTIES
from rodshell.progress import Progress, silent
from rodshell.refining.structure import Structure, spans
from rodshell.solve.equilibrium import Equilibrium, find_equilibrium, find_stable
from rodshell.solve.problem import Problem
from rodshell.solve.sensitivity import Parameters, Sensitivity
from rodshell.units import length_text, percent_text

GATES = ("stable", "flat", "remeshed", "tolerance", "from_flat")
"""In the order in which they are tried: those that take the least work first."""

SAME_SHAPE = 1e-6  # largest distance of the shape reached from flat
MISFIT = 5e-4  # largest distance of a joint's two holes in the plane: the workshop's error, see SPAN_ERROR
REMESHED, REMESHED_LEAST = 0.05, 2e-5  # change of the rms gap: a share of it, or so much
SAMPLES = 8
MOST_AT_ONCE = 10  # iterations from the state that is foreseen to first order
ERROR_STEPS = (0.25, 0.5, 0.75, 1.0)  # shares of the errors, one after the other, where that leads to no stable state
SPAN_ERROR = 0.1e-3 / 0.2  # largest, of each span's length: 0.1 mm where the target's size is 0.2 m
LARGEST_ERROR = 0.5  # of a span, as a share of its length
STIFFNESS_ERROR = 0.05  # largest, of each rod's EI and GJ
WORSE, WORSE_BY = 1.5, 0.0015  # with errors the rms gap may be so many times its value, and so much more
MOST_FROM_FLAT = 600  # factorisations; the paths that arrive take 25 to 470
FITS = 20  # steps of the fit of rods in a plane


@dataclass(frozen=True)
class Gates:
    """Which gates a design passes.

    Args:
        passed: by name, in the order of `GATES`; a gate that was not reached is not among them.
        reason: why the first one refuses it, beginning with the gate's name; "" where none does.
        factorizations: that all of them took.
    """

    passed: dict[str, bool]
    reason: str
    factorizations: int

    @property
    def open(self) -> bool:
        """Whether a design passes all of them."""
        return not self.reason


def gates(
    form: Stages, *, all_of_them: bool = True, span_error: float | None = None, progress: Progress = silent
) -> Gates:
    """Try a design at every gate.

    Args:
        form: the design, popped up with one end condition.
        all_of_them: try the others too after a gate has refused it.
        span_error: largest error of each span as it is built [m]; None: `SPAN_ERROR` of the target's size.
    """
    passed, first, factorizations = dict[str, bool](), "", 0
    for name in GATES:
        progress("refine", f"gate {name}", 0.0)
        reason, made = _TRIALS[name](form, span_error, progress)
        passed[name], factorizations = not reason, factorizations + made
        if reason and not first:
            first = f"{name}: {reason}"
        if first and (not all_of_them or name == "stable"):
            break
    if all_of_them:
        passed = dict.fromkeys(GATES, False) | passed  # without a stable shell there is nothing to try
    return Gates(passed, first, factorizations)


def _stable(form: Stages, *_: object) -> tuple[str, int]:
    report = _popped(form).report
    if not report.converged:
        return f"the pop-up {report.sentence}", 0
    count = report.negative_modes
    return (f"the shell is not stable, with {count} negative mode{'s' if count > 1 else ''}" if count else ""), 0


def _flat(form: Stages, *_: object) -> tuple[str, int]:
    """Rods along curves of the target keep their holes."""
    if form.flat_state is not None:
        return "", 0
    worst = misfit(form.footprint.mesh) / form.target.size
    if worst <= MISFIT:
        return "", 0
    return (
        f"straight rods with these holes do not fit together in a plane: at a joint they miss each other by "
        f"{percent_text(worst)} of the size, more than {percent_text(MISFIT)}"
    ), 0


def _remeshed(form: Stages, *_: object) -> tuple[str, int]:
    (ends,) = form.popped
    again = meshed_again(form, ends)
    made = _popped(again).report.factorizations
    if not _popped(again).report.stable:
        return "meshed again, the shell is not stable", made
    before, after = _rms(form), _rms(again)
    if abs(after - before) <= max(REMESHED * before, REMESHED_LEAST):
        return "", made
    return f"meshed again, its gap is {percent_text(after)} rms and not {percent_text(before)}", made


def _tolerance(form: Stages, span_error: float | None, progress: Progress) -> tuple[str, int]:
    error = SPAN_ERROR * form.target.size if span_error is None else span_error
    built = f"built with errors of up to {length_text(error)} in every span"
    most = WORSE * _rms(form) + WORSE_BY
    worst, made = worst_with_errors(form, error, progress)
    if worst is None:
        return f"{built}, the shell has no stable state nearby", made
    if worst <= most:
        return "", made
    return f"{built}, its gap is up to {percent_text(worst)} rms, more than {percent_text(most)}", made


def worst_with_errors(form: Stages, span_error: float, progress: Progress = silent) -> tuple[float | None, int]:
    """The largest rms gap of the shell built with errors, over the target's size, and the factorisations that it took.

    Args:
        form: the design, popped up with one end condition.
        span_error: largest error of each span's length [m].

    Returns:
        None in place of the gap where one of them has no stable state nearby.
    """
    worst, made = 0.0, 0
    for sample, popped in enumerate(with_errors(form, span_error=span_error), start=1):
        progress("refine", f"gate tolerance, sample {sample} of {SAMPLES}", 0.0)
        made += popped.report.factorizations
        if not popped.report.stable:
            return None, made
        worst = max(worst, agreement(popped, form.target).rms_relative)
    return worst, made


def _from_flat(form: Stages, _: object, progress: Progress) -> tuple[str, int]:
    """Shells that do not lie straight in the plane may be assembled in place."""
    if form.flat_state is not None:
        return "", 0
    (shell,) = form.popped.values()
    found = pop_up(
        form.footprint, form.boundary, form.rod, ends=shell.support, start="flat", joint=form.joint,
        most_factorizations=MOST_FROM_FLAT, progress=progress,
    )  # fmt: skip
    made = found.report.factorizations
    if not found.report.converged and made >= MOST_FROM_FLAT:
        return f"that it comes to this shape from flat is not shown within {MOST_FROM_FLAT} factorisations", made
    if not found.report.converged:
        return "pushed up from flat, the shell is lost on the way", made
    last = found.equilibrium
    settled = find_equilibrium(last.problem, last.state, last.forces)  # steps end at a looser tolerance
    found, made = replace(found, equilibrium=settled), made + settled.report.factorizations
    apart = float(np.linalg.norm(found.positions - _popped(form).positions, axis=1).max()) / form.target.size
    if apart <= SAME_SHAPE:
        return "", made
    return f"pushed up from flat, it comes to another shape, {percent_text(apart)} of the size away", made


_TRIALS: dict[str, Callable[[Stages, float | None, Progress], tuple[str, int]]] = {
    "stable": _stable, "flat": _flat, "remeshed": _remeshed, "tolerance": _tolerance, "from_flat": _from_flat,
}  # fmt: skip


def with_errors(form: Stages, samples: int = SAMPLES, *, span_error: float | None = None) -> Iterator[PopUp]:
    """The shell built with errors: each span is too long or too short, each rod too stiff or too soft, by chance.

    It is solved from the state that is foreseen to first order. Where that does not lead to a stable equilibrium, the
    errors grow in steps, and a shell that loses its stability on the way slides to the stable state next to it.

    Args:
        form: the design, popped up with one end condition.
        samples: of a random generator with the seeds 0, 1, ...
        span_error: largest error of each span's length [m]; None: `SPAN_ERROR` of the target's size.
    """
    popped = _popped(form)
    found, exact = popped.equilibrium, Structure(popped, form.rod, form.joint, form.target).edges
    errors = np.stack([_errors(form, span_error, seed) for seed in range(samples)])
    by_errors = np.log1p(errors).reshape(samples, -1).T
    foreseen = Sensitivity(found, exact).response(Parameters(csc_array(by_errors)))
    for sample, error in enumerate(errors):

        def built(here: Equilibrium, share: float, error: Floats = error) -> Problem:
            other = exact.at(here.elements).varied(exact.table * (1.0 + share * error)).shell
            return replace(here.problem, elements=other.elements, stretch=other.stretch)

        state, forces = found.state + foreseen.motions[sample], found.forces + foreseen.forces[sample]
        problem = built(found, 1.0).refreshed(state)
        here = find_equilibrium(problem, state, forces, most_iterations=MOST_AT_ONCE)
        reports = [here.report]
        if not here.report.stable:
            here = found
            for share in ERROR_STEPS:
                here = find_stable(built(here, share), here.state, here.forces)
                reports.append(here.report)
                if not here.report.stable:
                    break
        report = here.report.after(*(report for report in reports if report is not here.report))
        other = exact.at(here.elements).varied(exact.table * (1.0 + error)).shell
        yield replace(popped, shell=other.with_elements(here.elements), equilibrium=replace(here, report=report))


def _errors(form: Stages, span_error: float | None, seed: int) -> Floats:
    """(e, 5) relative errors of the edges' properties: of the lengths of spans, and of the EI and GJ of rods."""
    mesh, random = form.footprint.mesh, np.random.default_rng(seed)
    span = spans(mesh)
    result = np.zeros((len(span), PROPERTIES))
    error = SPAN_ERROR * form.target.size if span_error is None else span_error
    lengths = span_lengths(mesh)
    longer = np.minimum(error, LARGEST_ERROR * lengths) * random.uniform(-1.0, 1.0, len(lengths))
    result[:, LENGTH] = (longer / lengths)[span]
    result[:, EI1:LENGTH] = STIFFNESS_ERROR * random.uniform(-1.0, 1.0, len(mesh.grid.rods))[mesh.edge_rods, None]
    return result


def span_lengths(mesh: GridMesh) -> Floats:
    """(spans,) lengths [m]; see `structure.spans`."""
    return np.bincount(spans(mesh), weights=mesh.edge_lengths).astype(float)


def misfit(mesh: GridMesh) -> float:
    """Largest distance between the two holes of a joint where straight rods lie in a plane as well as they can [m].

    Each rod is turned and moved until the sum of the squares of all distances is smallest.

    Args:
        mesh: the rods, with the distances of their joints along them.
    """
    rods, at = mesh.grid.crossings.rods, mesh.stations[mesh.at_crossings]  # from the points of `FlatRod.origin`
    lines = mesh.grid.rods
    origin = np.array([rod.origin for rod in lines])
    direction = np.array([rod.direction for rod in lines])
    angle = np.arctan2(direction[:, 1], direction[:, 0])
    m, c = len(lines), len(rods)
    size = max(rod.length for rod in lines)
    rows, sign = np.arange(c), (1.0, -1.0)
    for _ in range(FITS):
        along = np.column_stack([np.cos(angle), np.sin(angle)])
        across = np.column_stack([-along[:, 1], along[:, 0]])
        a, b = (origin[rods[:, k]] + at[:, k, None] * along[rods[:, k]] for k in range(2))
        apart = a - b
        worst = float(np.linalg.norm(apart, axis=1).max(initial=0.0))
        entries = []
        for k in range(2):
            for axis in range(2):
                entries.append((2 * rows + axis, 3 * rods[:, k] + axis, np.full(c, sign[k])))
                turn = sign[k] * at[:, k] * across[rods[:, k], axis] / size
                entries.append((2 * rows + axis, 3 * rods[:, k] + 2, turn))
        row, column, value = (np.concatenate(parts) for parts in zip(*entries, strict=True))
        jacobian = coo_array((value, (row, column)), shape=(2 * c, 3 * m)).tocsc()
        square = (jacobian.T @ jacobian + 1e-9 * eye_array(3 * m)).tocsc()  # the grid as a whole may move
        step = -spsolve(square, jacobian.T @ apart.ravel()).reshape(m, 3)
        origin, angle = origin + step[:, :2], angle + step[:, 2] / size
        if np.abs(step).max() < 1e-9 * size:
            break
    return worst


def _popped(form: Stages) -> PopUp:
    """Of a form with one end condition."""
    (popped,) = form.popped.values()
    return popped


def _rms(form: Stages) -> float:
    (gap,) = form.agreement.values()
    return gap.rms_relative

"""The paper's own scheme, run as it is written: `python -m tests.acceptance.paper`. Takes some minutes.

Every row needs only one thing of this package, its stepping in time, and holds it against statics, against the exact
net, or against figures of an independent prototype of the paper's scheme.
"""

import re
import sys
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from resource import RUSAGE_CHILDREN, getrusage
from subprocess import run
from tempfile import TemporaryDirectory

import numpy as np

import rodshell as rs
from rodshell.errors import StabilityError
from rodshell.formfinding.dynamic_pop_up import DynamicPopUpSettings, dynamic_pop_up
from rodshell.formfinding.methods import Draped, Fall
from rodshell.joints import Coupling, ExplicitPenalty, ImplicitPenalty, Linker, SharedDofs
from rodshell.paper import genetic
from rodshell.progress import silent
from tests.acceptance.rows import Row, print_table
from tests.formfinding.falls import TARGETS, Particles
from tests.nets.sphere_net import sphere_net_end

ROD = rs.Rod(rs.Circle(radius=1e-3), rs.Material(1e6, 1e3))
COUNTS = {"hemisphere": (17, 17), "paraboloid": (15, 15), "ellipsoid": (11, 15)}
EDGE = 0.015  # [m]: with 17x17 rods 8k unknowns, as the paper says of its own grids
C1 = 1e6 * ROD.bend_stiffness  # the paper's number, taken as N/m
DRAG = 3.0  # [1/s]: tails stop swinging; an equilibrium does not depend on it


def layout(name: str) -> rs.GridLayout:
    return rs.GridLayout.orthogonal(rods=COUNTS[name], spacing=0.03, edge=EDGE, length=1.2)


@cache
def fallen(name: str, fall: Fall, stretch: float = 1.0) -> Draped:
    return rs.drape(layout(name), stretched(stretch), TARGETS[name], method=fall)


@cache
def hanging(name: str) -> Draped:
    return rs.drape(layout(name), ROD, TARGETS[name], method=rs.Gravity())


def stretched(factor: float) -> rs.Rod:
    """The paper's rod with EA times `factor`; EI and mass as they are."""
    section = rs.Circle(radius=1e-3 / np.sqrt(factor))
    return rs.Rod(section, rs.Material(youngs_modulus=1e6 * factor**2, density=1e3 * factor))


def net_errors(draped: Draped) -> np.ndarray:
    """How far G0's rod ends lie beyond those of the hemisphere's exact net [mm]."""
    rods = rs.trim(draped).mesh.grid.rods
    return 1e3 * np.array([end - sphere_net_end(0.2, abs(rod.offset)) for rod in rods for end in (rod.end, -rod.start)])


def rms(errors: np.ndarray) -> float:
    return float(np.sqrt(np.mean(errors**2)))


def apart(draped: Draped, other: Draped) -> float:
    """Largest distance of nodes on the target [mm]; tails that hang swing for longer and are cut off."""
    on = draped.target.margin(other.positions) > 0
    return 1e3 * float(np.linalg.norm(draped.positions - other.positions, axis=1)[on].max())


def command_rows() -> Iterator[Row]:
    """`form hemisphere --method paper`, no other option, in a process of its own: its time, and its ends as printed."""
    with TemporaryDirectory() as folder:
        command = [
            sys.executable,
            "-m",
            "rodshell",
            "form",
            "hemisphere",
            "--method",
            "paper",
            "--out",
            f"{folder}/out",
        ]
        before = getrusage(RUSAGE_CHILDREN)
        done = run(command, capture_output=True, text=True, check=False)
        after = getrusage(RUSAGE_CHILDREN)
        spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        rods = rs.read(f"{folder}/out").results.rods
    first = done.stdout.splitlines()[0]
    errors = [abs(end - sphere_net_end(0.2, abs(rod.offset))) for rod in rods for end in (rod.end, -rod.start)]
    printed = re.search(r"max ([\d.]+) mm, median ([\d.]+) mm", first)
    case = "form hemisphere --method paper"
    yield Row(case, "processor time", spent, 15.0, "s", "with compiled kernels")
    off = np.inf if printed is None else abs(float(printed[1]) - 1e3 * max(errors))
    yield Row(case, "rod ends off the exact net, as printed", off, 0.006, "mm", first)


def example_rows() -> Iterator[Row]:
    """Both examples, in processes of their own."""
    for name in ("paper", "paper_joints"):
        before = getrusage(RUSAGE_CHILDREN)
        code = run([sys.executable, f"examples/{name}.py"], capture_output=True, check=False).returncode
        after = getrusage(RUSAGE_CHILDREN)
        spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        yield Row(f"examples/{name}.py", "does not hold what it asserts", float(code), 0)
        yield Row(f"examples/{name}.py", "processor time", spent, 20.0, "s")


def explicit_rows() -> Iterator[Row]:
    case = "explicit, ball, C1 = 1e6 EI, 15 mm"
    fall = Fall(coupling=ExplicitPenalty(C1=C1), time_step=0.01, duration=2.0, drag=0.0)
    draped = fallen("hemisphere", fall)
    assert draped.rest is not None
    errors, gap = net_errors(draped), 1e3 * draped.rest.joint_gap
    note = f"{draped.report.dofs} unknowns, {draped.report.seconds:.0f} s; at rest: {draped.rest.at_rest}"
    yield Row(case, "joint gap off 5.3 mm, relative", abs(gap / 5.3 - 1), 0.1, "", f"{gap:.2f} mm; {note}")
    for what, found, wanted in (("max", float(np.abs(errors).max()), 10.0), ("rms", rms(errors), 6.5)):
        yield Row(
            case, f"G0 error {what} off {wanted} mm, relative", abs(found / wanted - 1), 0.1, "", f"{found:.2f} mm"
        )
    for name in COUNTS:
        why = refused(name, 0.012)
        note = why.partition(": at ")[2].partition(": ")[0]
        yield Row(f"{name}, explicit", "at 12 ms not refused", float(not why), 0, "", note)


def refused(name: str, step: float) -> str:
    """What the paper's scheme says against a time step [s], or nothing."""
    fall = Fall(coupling=ExplicitPenalty(C1=C1), time_step=step, duration=2.0, drag=0.0)
    try:
        rs.drape(layout(name), ROD, TARGETS[name], method=fall)
    except StabilityError as error:
        return str(error)
    return ""


def shared_rows() -> Iterator[Row]:
    """All three targets, and what stretch has to do with G0."""
    fall = Fall(coupling=SharedDofs(), drag=DRAG)
    for name in COUNTS:
        draped = fallen(name, fall)
        assert draped.rest is not None
        rest = draped.rest
        size = 1e3 * TARGETS[name].size
        note = f"rest after {rest.time:.1f} s, growth {rest.fastest_growth:.2f}/s; {draped.report.seconds:.0f} s"
        yield Row(f"{name}, shared DOFs", "not at rest", float(not rest.at_rest), 0, "", note)
        lost = not hanging(name).converged
        yield Row(f"{name}, gravity statics", "not at rest", float(lost), 0, "", hanging(name).report.status.value)
        if lost:
            continue
        off = apart(draped, hanging(name))
        yield Row(f"{name}, shared DOFs", "nodes off gravity statics", off / size, 1e-3, "R", f"{off:.3f} mm")
        if name == "hemisphere":
            yield Row(f"{name}, shared DOFs", "nodes off gravity statics", off, 0.1, "mm")
            short = rms(net_errors(draped))
            yield Row(
                f"{name}, shared DOFs", "G0 rms off 2.9 mm, relative", abs(short / 2.9 - 1), 0.1, "", f"{short:.2f} mm"
            )
    firm = fallen("hemisphere", fall, 100.0)
    yield Row("hemisphere, shared, EA x100", "G0 error rms", rms(net_errors(firm)), 0.4, "mm", firm.report.status.value)


def linker_rows() -> Iterator[Row]:
    """Linkers as rods of their own with C2 = GJ/l, and as corner elements; then what they differ by, on 7x7 rods."""
    springs = {"C1": C1, "C2": ROD.twist_stiffness / EDGE}
    explicit, corners, same, stiff = (
        ExplicitPenalty(**springs), SharedDofs(), ImplicitPenalty(**springs), ImplicitPenalty(),
    )  # fmt: skip
    whole = {one: with_linkers(layout("hemisphere"), one, 1.0) for one in (explicit, corners)}
    for name, coupling in (("explicit, C2 = GJ/l", explicit), ("corner elements", corners)):
        rest, report = whole[coupling].rest, whole[coupling].report
        assert rest is not None
        note = f"{rest.steps} steps, gap {1e3 * rest.joint_gap:.2f} mm, {report.seconds:.0f} s"
        finite = np.isfinite(whole[coupling].positions).all()
        yield Row(f"linkers, {name}", "no finite state", float(not finite), 0, "", note)
    rest = whole[explicit].rest
    assert rest is not None
    off, gap = apart(whole[explicit], whole[corners]), 1e3 * rest.joint_gap
    note = f"{off:.1f} mm after 1 s"
    yield Row("linkers, explicit and corner elements", "apart, in joint gaps", off / gap, 5.0, "", note)
    coarse, until = rs.GridLayout.orthogonal(rods=(7, 7), spacing=0.06, edge=EDGE, length=0.9), 0.5
    step = until / np.ceil(until * rest.steps)
    ends = {one: with_linkers(coarse, one, until, step) for one in (explicit, corners, same, stiff)}
    case, note = "linkers, what they differ by", f"7x7 rods, steps of {1e3 * step:.2f} ms, after {until} s"
    yield Row(case, "that springs are frozen", apart(ends[explicit], ends[same]), 0.5, "mm", note)
    yield Row(case, "that springs are soft", apart(ends[same], ends[corners]), 5 * gap, "mm", note)
    yield Row(case, "what stiff springs leave", apart(ends[stiff], ends[corners]), 1e-3, "mm", note)
    slow = with_linkers(coarse, corners, until, 0.01)
    note = "taking a node's whole velocity at each step is a drag m/h"
    yield Row(case, "steps of 10 ms", apart(slow, ends[corners]), 20.0, "mm", note)


def with_linkers(grid: rs.GridLayout, coupling: Coupling, until: float, step: float | None = None) -> Draped:
    fall = Fall(coupling=coupling, drag=5.0, duration=until, time_step=step, settle=False)
    return rs.drape(grid, ROD, TARGETS["hemisphere"], method=fall, joint=Linker())


def tail_rows() -> Iterator[Row]:
    turn = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    for depth in (1e-5, 1e-4, 1e-3):
        worst = 0.0
        for low in (1e-6, 1e-3, 0.05, 0.3):
            tails = np.column_stack([(0.2 - depth) * np.cos(turn), (0.2 - depth) * np.sin(turn), np.full(24, -low)])
            particles = Particles(TARGETS["hemisphere"], tails)
            particles.step()
            worst = max(worst, float(np.linalg.norm((particles.state - tails)[:, :2], axis=1).max()))
        yield Row("hanging tails", f"thrown, {1e3 * depth:g} mm inside", worst / depth, 1 + 1e-6, "depths")


def friction_rows() -> Iterator[Row]:
    """The paper's grid, with edges of 30 mm, from 1 mm off the middle: how far it has gone 10 s after its fall."""
    coarse = rs.GridLayout.orthogonal(rods=(17, 17), spacing=0.03, edge=0.03, length=1.2)
    for friction in (0.2, 0.0):
        offsets = []
        for duration in (2.0, 12.0):
            fall = Fall(friction=friction, drag=5.0, stopped="normal", duration=duration, settle=False)
            draped = rs.drape(coarse, ROD, TARGETS["hemisphere"], method=fall, anchor=(1e-3, 0.0))
            middle = draped.positions[np.argmin(np.linalg.norm(draped.mesh.flat, axis=1))]
            offsets.append(1e3 * float(np.linalg.norm(middle[:2])))
        note = f"offset {offsets[0]:.3f} mm after 2 s, {offsets[1]:.3f} mm after 12 s"
        if friction:
            yield Row(f"friction {friction}", "offset grows in 10 s by", offsets[1] - offsets[0], 0.01, "mm", note)
        else:
            yield Row("no friction", "offset after 12 s, at least", -offsets[1], -10.0, "mm", note)


def pop_up_rows() -> Iterator[Row]:
    coarse = rs.GridLayout.orthogonal(rods=(9, 9), spacing=0.04, edge=0.02, length=0.9)
    form = rs.find_form(TARGETS["hemisphere"], coarse, ROD, ends=("pinned",))
    couplings: tuple[Coupling, ...] = (SharedDofs(), ImplicitPenalty(), ExplicitPenalty())
    for coupling in couplings:
        settings = DynamicPopUpSettings(coupling=coupling)
        risen = dynamic_pop_up(form.footprint, form.trimmed.boundary, ROD, settings=settings)
        off = float(np.linalg.norm(risen.positions - form.popped["pinned"].positions, axis=1).max()) / 0.2
        gap = risen.rest.joint_gap / 0.2
        note = f"at rest: {risen.rest.at_rest}, after {risen.rest.time:.1f} s; joint gap {gap:.1e} R"
        yield Row(f"pop-up in time, {coupling.name}", "nodes off statics", off, 1e-3 + 2 * gap, "R", note)


def genetic_rows() -> Iterator[Row]:
    """The kept searches, their best popped up again, and the beginning of one made again."""
    for one in genetic.make(silent).parts:
        name = f"{one.case.target.name}, genetic"
        yield Row(name, "seeds kept, at least", -len(one.searches), -5, "", one.spread())
        for sought in one.searches:
            history, again, seed = sought.history, sought.best, f", seed {sought.history.seed}"
            assert again is not None
            course = [generation.best for generation in history.generations]
            note = f"{len(course)} generations of {history.population}; {history.runs} forward runs, "
            note += f"{history.seconds:.0f} s; direct: one run, {history.direct_seconds:.2g} s"
            yield Row(name + seed, "gained in the last 20 generations", 1 - course[-1] / course[-21], 0.01, "", note)
            note = f"{1e3 * again.rms:.3f} mm"
            yield Row(name + seed, "best popped up again, rms apart", abs(again.rms / history.best - 1), 1e-4, "", note)
        best, off = one.searches[0], 1e3 * one.searches[0].apart
        assert best.best is not None
        note = f"direct {1e3 * one.direct.rms:.3f} mm; G0 apart max {off.max():.2f} mm, rms {rms(off):.2f} mm"
        ratio = best.best.rms / one.direct.rms
        yield Row(f"{name}, best seed", "popped rms over the direct method's", ratio, 1.0, "", note)
    case, kept = genetic.CASES[1], genetic.stored("paraboloid")[0]
    with TemporaryDirectory() as folder:
        again = genetic.find(case, Path(folder), seed=kept.seed, population=kept.population, most=2)
    pairs = zip(again.generations, kept.generations, strict=False)
    apart_again = max(abs(one.best / two.best - 1) + abs(one.mean / two.mean - 1) for one, two in pairs)
    yield Row("paraboloid, genetic", "two generations made again, apart", apart_again, 1e-6, "", f"seed {kept.seed}")


ROWS: tuple[Callable[[], Iterator[Row]], ...] = (
    tail_rows, command_rows, example_rows, explicit_rows, shared_rows, linker_rows, friction_rows, pop_up_rows,
    genetic_rows,
)  # fmt: skip


def main() -> int:
    """All groups of rows, or those that are named: `python -m tests.acceptance.paper tail explicit`."""
    chosen = [rows for rows in ROWS if not sys.argv[1:] or rows.__name__.removesuffix("_rows") in sys.argv[1:]]
    return print_table("paper", (row for rows in chosen for row in rows()))


if __name__ == "__main__":
    sys.exit(main())

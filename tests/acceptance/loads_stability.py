"""Stability against published benchmarks and closed forms: linear factors, paths, frequencies."""

from collections.abc import Iterator

import numpy as np

from rodshell.solve.load_path import LoadPath, load_path
from rodshell.solve.modes import frequencies, linear_buckling
from tests.acceptance.rows import Row
from tests.solve import stability_problems as known
from tests.solve.rod_problems import order

FACTORISATIONS = 60  # of a path to its first loss of stability
CLOSE = 2e-4  # to which the loss is enclosed here


def _work(case: str, path: LoadPath) -> Row:
    return Row(case, "factorisations of the path", path.factorizations, FACTORISATIONS, note=str(path))


def _off(found: float, exact: float) -> float:
    """In %."""
    return 100 * abs(found / exact - 1)


def benchmark_rows() -> Iterator[Row]:
    """Paths past their limits; each also to the first one alone, for what that takes."""
    truss, dome, toggle = known.von_mises(), known.star_dome(), known.williams_toggle()
    path = load_path(truss.unloaded, truss.load, most=600.0, past_limit=True)
    for sign, turn in zip((1, -1), path.turns, strict=False):
        note = f"{turn.factor:.4f}, exact {sign * truss.exact['limit']:.4f}"
        yield Row("von Mises truss", "limit off +-381.087", _off(turn.factor, sign * 381.087), 0.01, "%", note)
    height = path.points[-1].state[truss.node, 1]
    through = len(path.turns) == 2 and height < -1 and path.points[-1].factor > 0
    yield Row(
        "von Mises truss", "does not pass both limits", float(not through), 0, note=f"apex from 1 to {height:.3f}"
    )
    path = load_path(dome.unloaded, dome.load, most=1e-3, past_limit=True)
    turns = ", ".join(f"{turn.factor:.4g}" for turn in path.turns)
    first = path.turns[0].factor
    yield Row("star dome", "first limit off 3.157e-4 EA", _off(first, dome.exact["limit"]), 0.5, "%", f"turns {turns}")
    yield _work("star dome", load_path(dome.unloaded, dome.load))
    frame = known.lees_frame(1.5)
    for case, loaded, most in (("Lee's frame", frame, 3.0), ("Williams' toggle", toggle, 60.0)):
        path = load_path(loaded.unloaded, loaded.load, most=most, past_limit=True)
        for name, turn in zip(("upper", "lower"), path.turns, strict=False):
            exact = loaded.exact[name]
            note = f"{turn.factor:.4f}"
            yield Row(case, f"{name} limit off {exact:g}", _off(turn.factor, exact), 0.5, "%", note)
        yield Row(case, "limits found, off 2", abs(len(path.turns) - 2), 0)
        yield _work(case, load_path(loaded.unloaded, loaded.load, most=most))
    bend = known.bend_of_45_degrees()
    path = load_path(bend.unloaded, bend.load, most=1.0)
    end = path.at(1.0)
    moved = np.full(3, np.nan) if end is None else (end.state - bend.unloaded.state)[bend.node]
    exact = np.array([bend.exact[axis] for axis in "xyz"])
    off = 100 * float(np.linalg.norm(moved - exact) / np.linalg.norm(exact))
    yield Row("45 degree bend", "displacement off, over its length", off, 0.5, "%", f"{moved.round(2).tolist()}")
    yield _work("45 degree bend", path)


def closed_form_rows() -> Iterator[Row]:
    """Euler, Prandtl, Michell, the shallow arch and the ring: by the linear factor and by the path."""
    cases = {
        "Euler's column, 40 edges": known.eulers_column(40),
        "Prandtl's cantilever, 80 edges": known.prandtls_cantilever(80),
        "Michell's ring, 192 edges": known.michells_ring(192),
        "ring under pressure, 96 edges": known.ring_under_pressure(96),
        "shallow arch, a = 4 i, 96 edges": known.shallow_arch(4.0),
        "shallow arch, a = 8 i, 96 edges": known.shallow_arch(8.0),
    }
    for case, loaded in cases.items():
        linear = linear_buckling(loaded.unloaded, loaded.load).factors[0]
        exact = loaded.exact.get("linear", 1.0)
        yield Row(case, "linear factor off", _off(linear, exact), 0.2, "%", f"{linear:.5f}, exact {exact:.5f}")
        path = load_path(loaded.unloaded, loaded.load, most=3.0, close=CLOSE)
        yield Row(case, "path's first loss off", _off(path.factor, 1.0), 0.2, "%", str(path))
        yield _work(case, path)


def vibration_rows() -> Iterator[Row]:
    """A pinned GFRP tube of 5 m; its mass spread along the edges, and lumped at the nodes."""
    sizes = (16, 32, 64)
    spread, lumped = [], []
    for edges in sizes:
        tube, mass, edge_mass, exact = known.tube(edges)
        spread.append(frequencies(tube, mass, 5, edge_mass=edge_mass).frequencies)
        lumped.append(frequencies(tube, mass, 5).frequencies)
    case = "pinned tube, 32 edges"
    note = f"{spread[1][0]:.4f} Hz"
    yield Row(case, "f1 off 3.2208 Hz, mass spread", _off(spread[1][0], 3.2208), 0.1, "%", note)
    yield Row(case, "f1 off 3.2208 Hz, mass lumped", _off(lumped[1][0], 3.2208), 0.1, "%", f"{lumped[1][0]:.4f} Hz")
    off = 100 * float(np.abs(spread[1] / exact - 1).max())
    yield Row(case, "f1 to f5 off, mass spread", off, 0.5, "%", "lumped: (k pi / n)^2 / 12, 2 % of the fifth")
    for what, found, bound in (("lumped", lumped, 2.0), ("spread", spread, 2.0)):
        slope = order(1 / np.array(sizes), [frequency[4] / exact[4] - 1 for frequency in found])
        yield Row("pinned tube", f"order of f5 below 2, {what}", bound - slope, 0.05, note=f"slope {slope:.2f}")

"""Kernels: time of an element's energy, gradient and Hessian against what memory and arithmetic allow.

The memory floor is the time to read the element's blocks and to write its gradient and Hessian at the speed at which
NumPy copies large arrays. The arithmetic floor is the number of its operations, counted by running the kernel as plain
Python on numbers that count, over the rate of independent multiplications and additions of one core: a
square root or a sine counts as one.
"""

import json
import os
import subprocess
import sys

import numba as nb
import numpy as np

import rodshell as rs
from benchmarks.rows import Row, Section, clock, timed
from rodshell.model import Assembly, Freedom
from rodshell.rods.elements import Elements

RODS, EDGES = 41, 6
COUNT = "import json; from benchmarks import kernels; print(json.dumps(kernels.count_operations()))"
SAMPLED = 40  # elements whose operations are counted


def shells(rods: int) -> dict[str, tuple[Elements, np.ndarray]]:
    """Element sets of square shells, and a bent state: bending without and with twist, stretch, joints."""
    rod = rs.Rod(rs.Circle(radius=1e-3), rs.Material(youngs_modulus=1e6, density=1e3))
    lath = rs.Rod(rs.RectangularSection(width=2e-3, height=1e-3), rod.material)
    spacing = 0.4 / rods
    layout = rs.GridLayout.orthogonal(rods=(rods, rods), spacing=spacing, length=0.4, edge=spacing / EDGES)
    mesh = rs.mesh_grid(layout.flat_grid((rods, rods), 0.4), layout.edge)
    bent = mesh.flat + [[0.0, 0.0, 1.0]] * np.sin(8 * mesh.flat[:, :1] + 5 * mesh.flat[:, 1:2]) * 0.05
    plain = rs.Shell.of(mesh, rod)
    turning = rs.Shell.of(mesh, lath, joint=rs.Spring(shear=1e-5, out_of_plane=1e-3, twist=1e-3))
    state, twisted = plain.state(bent), turning.state(bent)
    found: dict[str, tuple[Elements, np.ndarray]] = {
        "bending, round rods": (plain.elements[0], state),
        "stretch": (plain.stretch, state),
        "bending and twist": (turning.within[0].refreshed(twisted), twisted),
    }
    for k, joints in enumerate(turning.between):
        found[f"joints, {joints.blocks.shape[1]} blocks" + " again" * (k > 0)] = (joints.refreshed(twisted), twisted)
    return found


def kernels() -> Section:
    rate, bandwidth = operations_a_second(), bytes_a_second()
    counted = json.loads(
        subprocess.run(
            [sys.executable, "-c", COUNT], check=True, capture_output=True, text=True,
            env=os.environ | {"NUMBA_DISABLE_JIT": "1"},
        ).stdout
    )  # fmt: skip
    rows = [Row("one core", f"{rate / 1e9:.2f} G operations/s, copies {bandwidth / 1e9:.1f} GB/s")]
    for name, (elements, state) in shells(RODS).items():
        m, k = elements.blocks.shape
        hessians, gradient = np.zeros((m, 3 * k, 3 * k)), np.zeros_like(state)
        seconds = timed(lambda e=elements, s=state, g=gradient, h=hessians: e.evaluate(s, g, h)) / m  # type: ignore[misc]
        memory = 8 * (3 * k + 6 * k + 9 * k * k + k) / bandwidth
        arithmetic = counted[name] / rate
        floor = max(memory, arithmetic)
        rows.append(
            Row(
                f"{name}, {m} elements",
                f"{1e9 * seconds:.0f} ns, {seconds / floor:.1f} floors (memory {1e9 * memory:.0f} ns, arithmetic "
                f"{1e9 * arithmetic:.0f} ns for {counted[name]:.0f} operations)",
            )
        )
        free = Freedom.free(len(state))
        plan = Assembly.of([elements.blocks], free)
        data = np.zeros(len(plan.indices))
        seconds = timed(lambda p=plan, h=hessians, e=elements, f=free, d=data: p.add(0, h, e.blocks, f, d)) / m
        memory = 8 * (9 * k * k + k * k + 9 * k * (k + 1)) / bandwidth
        rows.append(
            Row("   its scatter into the matrix", f"{1e9 * seconds:.0f} ns, {seconds / memory:.1f} memory floors")
        )
    return Section("Kernels", __doc__.split("\n\n", 1)[1].replace("\n", " ").strip(), rows)


def bytes_a_second() -> float:
    """Read and written while a large array is copied."""
    source = np.ones(16 * 2**20)
    there = np.empty_like(source)
    return 2 * source.nbytes / timed(lambda: np.copyto(there, source))


def operations_a_second() -> float:
    """Multiplications and additions of eight independent chains, one core."""
    _chains(10)
    count = 2_000_000
    begin = clock()
    _chains(count)
    return 16 * count / (clock() - begin)


@nb.njit
def _chains(count):  # type: ignore[no-untyped-def]
    a = b = c = d = e = f = g = h = 1.0
    for _ in range(count):
        a = a * 0.999 + 1e-3
        b = b * 0.998 + 1e-3
        c = c * 0.997 + 1e-3
        d = d * 0.996 + 1e-3
        e = e * 0.995 + 1e-3
        f = f * 0.994 + 1e-3
        g = g * 0.993 + 1e-3
        h = h * 0.992 + 1e-3
    return a + b + c + d + e + f + g + h


class Counted:
    """A number that counts what is done with it."""

    __array_ufunc__ = None
    done = 0

    def __init__(self, value: float) -> None:
        self.value = value

    def __float__(self) -> float:
        return self.value


def _operation(name: str):  # type: ignore[no-untyped-def]
    def operate(self: Counted, *others: object) -> object:
        Counted.done += 1
        result = getattr(self.value, name)(*(float(other) for other in others))  # type: ignore[arg-type]
        return result if isinstance(result, bool) else Counted(result)

    return operate


for _name in ("add", "sub", "mul", "truediv", "radd", "rsub", "rmul", "rtruediv", "neg", "abs", "pow"):
    setattr(Counted, f"__{_name}__", _operation(f"__{_name}__"))
for _name in ("lt", "gt", "le", "ge", "eq", "ne"):
    setattr(Counted, f"__{_name}__", lambda self, other, n=_name: getattr(self.value, f"__{n}__")(float(other)))


class _Numbers:
    """NumPy, but that arrays hold numbers that count, and functions of one count as one operation."""

    def __getattr__(self, name: str) -> object:
        found = getattr(np, name)
        if name in ("empty", "zeros"):
            return lambda shape, *_, **__: np.full(shape, Counted(0.0), dtype=object)
        if not isinstance(found, np.ufunc):
            return found

        def counted(*given: object) -> object:
            if not any(isinstance(one, Counted) for one in given):
                return found(*given)
            Counted.done += 1
            return Counted(float(found(*(float(one) for one in given))))  # type: ignore[arg-type]

        return counted


def count_operations() -> dict[str, float]:
    """Operations an element, by name; with NUMBA_DISABLE_JIT=1."""
    from dataclasses import replace

    found = {}
    for name, (elements, state) in shells(5).items():
        m = min(SAMPLED, len(elements.blocks))
        some = replace(elements, **{  # type: ignore[type-var]
            key: value[:m] for key, value in vars(elements).items()
            if isinstance(value, np.ndarray) and len(value) == len(elements.blocks)
        })  # fmt: skip
        k = elements.blocks.shape[1]
        changed = [
            module for key, module in sys.modules.items() if key.startswith(("rodshell.rods", "rodshell.joints"))
        ]
        for module in changed:
            if getattr(module, "np", None) is np:
                module.np = _Numbers()  # type: ignore[attr-defined]
        numbers = np.frompyfunc(Counted, 1, 1)
        Counted.done = 0
        try:
            some.evaluate(numbers(state), numbers(np.zeros_like(state)), numbers(np.zeros((m, 3 * k, 3 * k))))
        finally:
            for module in changed:
                if isinstance(getattr(module, "np", None), _Numbers):
                    module.np = np  # type: ignore[attr-defined]
        found[name] = Counted.done / m
    return found

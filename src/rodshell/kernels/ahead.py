"""Kernels that Python calls compiled by Numba at once, and kept: before the first job, or by `rodshell warmup`."""

from collections.abc import Callable
from importlib import import_module
from typing import Any

from rodshell.kernels import KERNELS, PACKAGE, modules
from rodshell.kernels.jit import arguments_of, is_kept

# Kernels of joints, meshes, twist, warm starts and dynamics, which most forms do not call: modules, or single kernels
OF_SOME_JOBS = {
    "contact.modified_mass", "joints.relative_rotation", "joints.ties", "rods.bend_twist",
    "rods.isotropic._isotropic_bend_twist", "solve.implicit_euler", "solve.newton_matrix", "targets.field_fitting",
    "targets.rim", "targets.smooth_field",
}  # fmt: skip


def compile_kernels(progress: Callable[[int, int], None], *, every: bool) -> int:
    """Compile the kernels that are not kept; how many they were.

    Args:
        progress: called with how many of them are done, and how many there are.
        every: those of some jobs as well, which Numba otherwise compiles at their first call.
    """
    missing = [row for row in _rows(every) if not is_kept(*row)]
    for done, (kernel, arguments) in enumerate(missing):
        progress(done, len(missing))
        kernel.compile(arguments)
    return len(missing)


def _rows(every: bool) -> list[tuple[Any, tuple[Any, ...]]]:
    """Each kernel that Python calls, with the types of its arguments."""
    wanted = [module for module in modules() if every or module not in OF_SOME_JOBS]
    sources = {module: import_module(PACKAGE + module) for module in wanted}
    return [
        (getattr(source, name), arguments_of(types))
        for module, source in sources.items()
        for name, types in KERNELS[module].items()
        if every or f"{module}.{name}" not in OF_SOME_JOBS
    ]

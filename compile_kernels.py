"""Compile the kernels of src/rodshell ahead of time: `python compile_kernels.py FOLDER [--level x86-64-v3 ...]`.

hatch_build.py does this when a wheel is built. All that depends on numba.pycc, which Numba deprecates and for which it
has no successor yet, is in this file. Processes share the work: each takes the kernels of a source file that no other
has taken, until none is left, and makes one library for each level of the processor.
"""

import argparse
import gc
import os
import subprocess
import sys
import tempfile
import warnings
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path

SOURCE = Path(__file__).resolve().parent / "src"
GENERIC = "generic"


def compile_kernels(folder: Path, levels: list[str], processes: int | None = None) -> list[Path]:
    """The libraries of all kernels, written to `folder`.

    Parameters
    ----------
    levels : of processors, as LLVM names them.
    processes : at a time, by default one for each core.

    Raises
    ------
    RuntimeError : the compiler or the linker failed; with what they said.
    """
    count = processes or (len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1)
    paths = os.pathsep.join(filter(None, [str(SOURCE), os.environ.get("PYTHONPATH")]))
    for level in levels:
        # Numba's own choice of instructions, within the level; the cache of a checkout is neither read nor written
        chosen = {"NUMBA_CPU_NAME": level, "NUMBA_CPU_FEATURES": ""}
        environment = os.environ | chosen | {"RODSHELL_KERNELS": "jit", "PYTHONPATH": paths}
        with tempfile.TemporaryDirectory() as claims:
            command = [sys.executable, __file__, str(folder), "--level", level, "--claims", claims, "--unit"]
            units = [
                subprocess.Popen([*command, str(k)], env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
                for k in range(count)
            ]
            said = [unit.communicate()[0].decode(errors="replace") for unit in units]
        if any(unit.returncode for unit in units):
            raise RuntimeError("\n".join(said))
    return sorted(folder.glob("compiled_*"))


def level_here() -> str:
    """The highest level of this processor that is compiled for."""
    sys.path.insert(0, str(SOURCE))
    return import_module("rodshell.kernels").levels_here()[0]


def compile_unit(folder: Path, level: str, unit: int, claims: Path) -> None:
    """One library for a level, of the kernels that this process takes."""
    from numba.core import boxing, pythonapi, types  # noqa: F401  boxing declares what is replaced here
    from numba.core.compiler import Flags
    from numba.core.registry import cpu_target
    from numba.core.typing import signature

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the deprecation
        from numba.pycc import CC, compiler
    from rodshell.kernels import KERNELS, jit, library_name, modules

    compile_extra = compiler.compile_extra
    options = dict[object, dict[str, object]]()

    def with_its_options(typing, context, function, args, returned, flags, locals, library):  # type: ignore[no-untyped-def]
        """pycc knows neither error_model nor fastmath nor nogil."""
        flags = Flags()
        cpu_target.options.parse_as_flags(flags, options[function])
        flags.no_compile = flags.no_cfunc_wrapper = True
        return compile_extra(typing, context, function, args, returned, flags, locals, library)

    class Kernels(CC):  # type: ignore[misc, unused-ignore]
        """A library of the kernels that are taken while it is compiled."""

        def _get_extra_cflags(self) -> list[str]:
            """Numba's C sources, which are compiled along, take twice as long by Python's own options, -O3 -g."""
            return [*super()._get_extra_cflags(), *(["-O1", "-g0"] if os.name == "posix" else [])]

        def _get_extra_ldflags(self) -> list[str]:
            return [*super()._get_extra_ldflags(), *(["-s"] if sys.platform == "linux" else [])]  # without symbols

        @property
        def _export_entries(self):  # type: ignore[no-untyped-def]
            return self

        def __iter__(self) -> Iterator[compiler.ExportEntry]:
            """Those that were taken; and, the first time, those that can still be, the longest sources first."""
            yield from self._exported_functions.values()
            for module in sorted(modules(), key=lambda module: -source_of(module).stat().st_size):
                try:
                    (claims / module).touch(exist_ok=False)
                except FileExistsError:
                    continue
                source = import_module(f"rodshell.{module}")
                for name, row in sorted(KERNELS[module].items()):
                    kernel = getattr(source, name)
                    options[kernel.py_func] = {k: v for k, v in kernel.targetoptions.items() if k != "cache"}
                    types_of_row = signature(None, *jit.arguments_of(row))
                    entry = compiler.ExportEntry(f"{module}.{name}", types_of_row, kernel.py_func)
                    self._exported_functions[entry.symbol] = entry
                    yield entry

    compiler.compile_extra = with_its_options
    pythonapi._unboxers.functions[types.Array] = checked_array
    pythonapi._boxers.functions[types.Array] = returned_array
    pythonapi.PythonAPI.get_c_object = c_object
    jit.kernels_are_kept = lambda: False
    index_as_written()
    optimise_once()
    gc.disable()  # it takes a tenth of the time
    library = Kernels(library_name(level, unit), source_module="rodshell.kernels")
    library.output_dir, library.target_cpu = str(folder), level
    library.compile()


def index_as_written() -> None:
    """Let kernels use an index as it is. Numba asks of each whether it counts from the end of its array, which took a
    fourteenth of a form: no kernel counts from an end, but by a constant. With NUMBA_BOUNDSCHECK=1 all are checked."""
    from llvmlite import ir
    from numba.core import types
    from numba.np import arrayobj

    as_numba_does = arrayobj.fix_integer_index

    def index(context, builder, kind, value, size):  # type: ignore[no-untyped-def]
        if isinstance(value, ir.Constant) or not kind.signed:
            return as_numba_does(context, builder, kind, value, size)
        return context.cast(builder, value, kind, types.intp)

    arrayobj.fix_integer_index = index


def optimise_once() -> None:
    """Let kernels that kernels call, and parts of Numba, be optimised once, in the library that they become part of:
    Numba also compiles each on its own, for calls from Python, which takes a quarter of the time. Those that may
    reassociate are optimised as Numba does it, since their bits depend on that."""
    from numba import _dynfunc
    from numba.core import codegen, dispatcher
    from numba.core.registry import cpu_target
    from numba.core.runtime import rtsys

    def without_wrappers(_, flags):  # type: ignore[no-untyped-def]
        flags.no_cpython_wrapper = flags.no_cfunc_wrapper = True
        return flags

    def never_called(library, described, environment):  # type: ignore[no-untyped-def]
        return _dynfunc.make_function(described.lookup_module(), described.qualname, "", 1, environment, (library,))

    def reassociates(part):  # type: ignore[no-untyped-def]
        return " reassoc " in str(part)

    def prepare(library, part):  # type: ignore[no-untyped-def]
        if reassociates(part):
            optimise_functions(library, part)
        part.data_layout = library._codegen._data_layout

    def finish(library):  # type: ignore[no-untyped-def]
        if library.name.startswith("compiled_") or reassociates(library._final_module):
            optimise(library)

    rtsys.initialize(cpu_target.target_context)  # what allocates memory is compiled, and called
    dispatcher._FunctionCompiler._customize_flags = without_wrappers
    cpu_target.target_context.get_executable = never_called
    optimise_functions = codegen.CPUCodeLibrary._optimize_functions
    optimise = codegen.CPUCodeLibrary._optimize_final_module
    codegen.CPUCodeLibrary._optimize_functions = prepare
    codegen.CPUCodeLibrary._optimize_final_module = finish
    codegen.JITCodeLibrary._finalize_specific = lambda library: None
    codegen.JITCPUCodegen._add_module = lambda code, module: None


def source_of(module: str) -> Path:
    return SOURCE.joinpath("rodshell", *module.split(".")).with_suffix(".py")


def c_object(code, name):  # type: ignore[no-untyped-def]
    """A Python object by its C name. The names of exceptions are those of pointers to them, which pycc overlooks: a
    compiled kernel that raises one ends the process."""
    kind = code.pyobj if name.startswith("PyExc_") else code.pyobj.pointee
    place = code.context.get_c_value(code.builder, kind, name, dllimport=True)
    return code.builder.load(place) if name.startswith("PyExc_") else place


def checked_array(kind, given, code):  # type: ignore[no-untyped-def]
    """The array that a kernel is called with, or a TypeError. pycc checks nothing but the size of an element, and an
    array of other dimensions would overwrite memory.

    The kernel does not count its references to the array, which its caller holds meanwhile: Numba's counting, by atomic
    operations, took an eighth of a factorisation.

    Parameters
    ----------
    kind : Numba's type of the argument, an array in C order.
    given : the Python object.
    code : what writes the LLVM code of the call.
    """
    from llvmlite import ir
    from numba.core import cgutils
    from numba.core.pythonapi import NativeValue
    from numba.np.numpy_support import as_dtype

    build, dtype = code.builder, as_dtype(kind.dtype)
    native = code.context.make_array(kind)(code.context, build)
    room = cgutils.alloca_once(build, ir.ArrayType(ir.IntType(64), 5 + 2 * MOST_DIMENSIONS))
    failed = cgutils.alloca_once_value(build, cgutils.true_bit)

    def field(of, offset, bits):  # type: ignore[no-untyped-def]
        return build.load(cgutils.pointer_add(build, of, offset, ir.IntType(bits).as_pointer()))

    adapt_type = ir.FunctionType(ir.IntType(32), [code.pyapi.pyobj, code.pyapi.voidptr])
    adapt = code.pyapi._get_function(adapt_type, name="numba_adapt_ndarray")
    adapted = build.call(adapt, (given, build.bitcast(room, code.pyapi.voidptr)))
    with build.if_then(cgutils.is_null(build, adapted)):  # it is an array
        value = build.load(build.bitcast(room, native._getpointer().type))
        element = build.inttoptr(field(given, DTYPE, 64), code.pyapi.voidptr)
        found = (
            (field(given, DIMENSIONS, 32), kind.ndim),
            (build.and_(field(given, FLAGS, 32), ir.Constant(ir.IntType(32), C_ORDER | ALIGNED)), C_ORDER | ALIGNED),
            (field(element, KIND, 8), ord(dtype.kind)),
            (field(element, BYTE_ORDER, 8), ord("|" if dtype.itemsize == 1 else "=")),
            (build.extract_value(value, ITEM_SIZE), dtype.itemsize),
        )
        wrong = cgutils.false_bit
        for one, expected in found:
            wrong = build.or_(wrong, build.icmp_unsigned("!=", one, ir.Constant(one.type, expected)))
        build.store(wrong, failed)
        build.store(value, native._getpointer())
    with build.if_then(build.load(failed), likely=False):
        said = (
            f"a kernel needs an array of {dtype}, {kind.ndim} dimensions, in C order and in the processor's byte order"
        )
        code.pyapi.err_set_string("PyExc_TypeError", said)
    return NativeValue(build.load(native._getpointer()), is_error=build.load(failed))


def returned_array(kind, value, code):  # type: ignore[no-untyped-def]
    """An array that a kernel returns, as a Python object; a SystemError for a part of an array that it was given, which
    nobody would hold. pycc has pickle look up NumPy's class of arrays each time: a microsecond, as long as a short
    kernel.

    Parameters
    ----------
    kind : Numba's type of it.
    value : what the kernel returns.
    code : what writes the LLVM code of the call.
    """
    from numba.core import cgutils
    from numba.core.boxing import box_array

    build, constants = code.builder, code.env_manager
    code.pyapi.unserialize = lambda _: constants.read_const(constants.add_const(kind.box_type))
    memory = code.context.make_array(kind)(code.context, build, value=value).meminfo
    result = cgutils.alloca_once_value(build, code.pyapi.get_null_object())
    with build.if_else(cgutils.is_null(build, memory), likely=False) as (given, made):
        with given:
            code.pyapi.err_set_string("PyExc_SystemError", "a kernel returns a part of an array that it was given")
        with made:
            build.store(box_array(kind, value, code), result)
    return build.load(result)


# Where NumPy keeps them: in an array, behind its head, data, number of dimensions, shape, strides, base, dtype, flags
DIMENSIONS, DTYPE, FLAGS = 24, 56, 64
C_ORDER, ALIGNED = 0x1, 0x100
KIND, BYTE_ORDER = 24, 26  # in a dtype, behind its head and the type of its numbers
ITEM_SIZE = 3  # in Numba's array: memory, parent, number of elements, size of one
MOST_DIMENSIONS = 64


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.split(":")[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--level", action="append", help="of the processor; repeat it for more than one")
    parser.add_argument("--processes", type=int, help="default: one for each core")
    parser.add_argument("--unit", type=int, help=argparse.SUPPRESS)
    parser.add_argument("--claims", type=Path, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.unit is not None:
        compile_unit(given.folder, given.level[0], given.unit, given.claims)
    else:
        print(*compile_kernels(given.folder, given.level or [level_here()], given.processes), sep="\n")

"""The one dense product that compiled code hands to BLAS: C = beta C - A^T B, rows stored one after the other."""

from functools import lru_cache

import numba as nb
import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.extending import get_cython_function_address, intrinsic
from threadpoolctl import ThreadpoolController


@lru_cache
def dgemm() -> int:
    """Where SciPy's BLAS keeps its matrix product: compiled code takes it as a number, so that it can be cached."""
    return int(get_cython_function_address("scipy.linalg.cython_blas", "dgemm"))


@lru_cache
def blas() -> ThreadpoolController:
    """SciPy's BLAS. Its threads are kept to one: on fronts of a few hundred rows they only wait."""
    dgemm()  # loads that BLAS, so that it is found
    return ThreadpoolController().select(user_api="blas")


@intrinsic
def _call(typing, address, integers, numbers, a, b, c):  # type: ignore[no-untyped-def]
    """Call dgemm('N', 'T', *integers[:3], alpha, a, lda, b, ldb, beta, c, ldc); all by address, as Fortran wants."""

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        target, integer, number, *arrays = arguments
        byte = ir.IntType(8).as_pointer()

        def pointer(value, offset=0):  # type: ignore[no-untyped-def]
            return builder.inttoptr(builder.add(value, ir.Constant(value.type, offset)), byte)

        def letter(one):  # type: ignore[no-untyped-def]
            return cgutils.alloca_once_value(builder, ir.Constant(ir.IntType(8), ord(one)))

        a, b, c = (pointer(array) for array in arrays)
        m, n, k, lda, ldb, ldc = (pointer(integer, 4 * i) for i in range(6))
        alpha, beta = pointer(number), pointer(number, 8)
        function = ir.FunctionType(ir.VoidType(), [byte] * 13).as_pointer()
        builder.call(
            builder.inttoptr(target, function),
            [letter("N"), letter("T"), m, n, k, alpha, a, lda, b, ldb, beta, c, ldc],
        )
        return context.get_dummy_value()

    return types.void(*[types.int64] * 6), generate


def _interpreted(dgemm, integers, numbers, a, b, c):  # type: ignore[no-untyped-def]
    """What `_call` does, where Numba compiles nothing (NUMBA_DISABLE_JIT=1) and there are no intrinsics."""
    import ctypes

    def values(address, kind, count):  # type: ignore[no-untyped-def]
        return np.ctypeslib.as_array(ctypes.cast(ctypes.c_void_p(int(address)), ctypes.POINTER(kind)), (count,))

    def matrix(address, rows, columns, stride):  # type: ignore[no-untyped-def]
        flat = values(address, ctypes.c_double, (rows - 1) * stride + columns)
        return np.lib.stride_tricks.as_strided(flat, (rows, columns), (8 * stride, 8))

    m, n, k, lda, ldb, ldc = values(integers, ctypes.c_int32, 6).tolist()
    alpha, beta = values(numbers, ctypes.c_double, 2).tolist()
    if min(m, n, k) > 0:
        target = matrix(c, n, m, ldc)
        kept = beta * target if beta else 0.0
        target[:] = kept + alpha * matrix(b, k, n, ldb).T @ matrix(a, k, m, lda)


if nb.config.DISABLE_JIT:
    _call = _interpreted


@nb.njit(cache=True, inline="always")
def subtract_product(  # type: ignore[no-untyped-def]
    dgemm, integers, numbers, rows, columns, depth, a, lda, b, ldb, beta, c, ldc
):
    """C (rows, columns) = beta C - A^T B for A (depth, rows) and B (depth, columns), given by their addresses.

    `lda`, `ldb`, `ldc` are the strides of their rows; integers (6,) int32 and numbers (2,) are scratch.
    """
    integers[0], integers[1], integers[2] = columns, rows, depth
    integers[3], integers[4], integers[5] = ldb, lda, ldc
    numbers[0], numbers[1] = -1.0, beta
    _call(dgemm, integers.ctypes.data, numbers.ctypes.data, b, a, c)

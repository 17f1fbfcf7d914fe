"""The innermost loops of dense linear algebra, in the processor's own registers.

A tile is some rows by some registers of columns, from which the product of two tall matrices is subtracted without
leaving the registers (Goto and van de Geijn 2008). BLAS is slow on matrices of ten to fifty rows, which a gridshell's
factorisation is made of, and loops as short as theirs are hardly vectorised by a compiler. So these few are written in
LLVM's vector types, which fit whatever processor they are compiled for.

Such a kernel is called in compiled code, with integers: addresses, strides and counts, the last two in numbers of 8
bytes. Nothing is checked. Each has a twin in NumPy, which serves where nothing is compiled (NUMBA_DISABLE_JIT=1).
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Sequence
from itertools import chain

import numpy as np

from rodshell.arrays import Floats
from rodshell.kernels import COMPILED

Kernel = Callable[..., None]

LANES = 4  # numbers in a register; a wider one than there is is made of two
ROWS, REGISTERS = 4, 3  # of a whole tile: twelve sums under way; of sixteen registers four are left for what is read
BYTES = 8

if COMPILED is None:
    from llvmlite import ir
    from numba.core import cgutils, config, types
    from numba.core.codegen import get_host_cpu_features
    from numba.extending import intrinsic
    from numba.np import arrayobj

    _features = get_host_cpu_features() if config.CPU_FEATURES is None else config.CPU_FEATURES
    if "+avx512f" in _features:
        LANES = 8
    _NUMBER, _INTEGER, _INDEX = ir.DoubleType(), ir.IntType(64), ir.IntType(32)


def subtracting(rows: int, registers: int) -> Kernel:
    """C = keep C - A^T B for A (depth, rows), B and C of so many registers of columns.

    Arguments: C, its stride, A, its stride, B, its stride, depth, and keep, which is 0 or 1.

    Args:
        rows: of C, the columns of A.
        registers: number of registers, of `LANES` numbers each, that a row of B and C takes.
    """

    def emit(code: _Code, c, stride_c, a, stride_a, b, stride_b, depth, keep) -> None:  # type: ignore[no-untyped-def]
        sums = chain(*code.product(rows, registers, a, stride_a, b, stride_b, depth))
        tile = list(zip(chain(*code.addresses(c, stride_c, rows, registers)), sums, strict=True))
        with code.builder.if_else(code.is_not_zero(keep)) as (keeping, fresh):
            with keeping:
                for place, value in tile:
                    code.store(code.builder.fsub(code.load(place), value), place)
            with fresh:
                for place, value in tile:
                    code.store(code.builder.fsub(code.zero, value), place)

    def twin(c: int, stride_c: int, a: int, stride_a: int, b: int, stride_b: int, depth: int, keep: int) -> None:
        columns = LANES * registers
        product = _matrix(a, depth, rows, stride_a).T @ _matrix(b, depth, columns, stride_b)
        target = _matrix(c, rows, columns, stride_c)
        target[:] = target - product if keep else -product

    return _kernel(8, emit, twin)


def eliminating(rows: int, registers: int) -> Kernel:
    """The rows C of some pivots, less A^T B, and each row less its multiples of those above it; and D, which is the
    same divided by the pivots.

    Arguments: C, D, A, B, the stride of all four, depth, and where the factors lie: for each row minus its factors of
    the rows above, then one over its own pivot.
    """

    def emit(code: _Code, c, d, a, b, stride, depth, factors) -> None:  # type: ignore[no-untyped-def]
        sums = code.product(rows, registers, a, stride, b, stride, depth)
        into, scaled = code.addresses(c, stride, rows, registers), code.addresses(d, stride, rows, registers)
        done = list[list[ir.Value]]()
        for r in range(rows):
            row = [code.builder.fsub(code.load(place), value) for place, value in zip(into[r], sums[r], strict=True)]
            for above in done:
                factor, factors = code.spread(factors), code.past(factors, 1)
                row = [code.add_product(factor, other, value) for other, value in zip(above, row, strict=True)]
            inverse, factors = code.spread(factors), code.past(factors, 1)
            for v, value in enumerate(row):
                code.store(value, into[r][v])
                code.store(code.builder.fmul(inverse, value), scaled[r][v])
            done.append(row)

    def twin(c: int, d: int, a: int, b: int, stride: int, depth: int, factors: int) -> None:
        into, scaled = (_matrix(address, rows, LANES * registers, stride) for address in (c, d))
        into -= _matrix(a, depth, rows, stride).T @ _matrix(b, depth, LANES * registers, stride)
        known = _matrix(factors, 1, rows * (rows + 1) // 2, 1)[0]
        for r in range(rows):
            mine = known[r * (r + 1) // 2 :]
            into[r] += mine[:r] @ into[:r]
            scaled[r] = mine[r] * into[r]

    return _kernel(7, emit, twin)


def multiplying(rows: int) -> Kernel:
    """y = A x for A (rows, count), count being a multiple of `LANES`. Arguments: y, A, its stride, x, count."""

    def emit(code: _Code, y, a, stride, x, count) -> None:  # type: ignore[no-untyped-def]
        def onward(k: ir.Value, sums: Sequence[ir.Value]) -> list[ir.Value]:
            right = code.load(code.past(x, k))
            left = (code.load(place) for (place,) in code.addresses(code.past(a, k), stride, rows, 1))
            return [code.add_product(value, right, total) for value, total in zip(left, sums, strict=True)]

        for r, total in enumerate(code.loop(count, LANES, [code.zero] * rows, onward)):
            code.store(code.sum_of_lanes(total), code.past(y, r))

    def twin(y: int, a: int, stride: int, x: int, count: int) -> None:
        _matrix(y, 1, rows, 1)[0] = _matrix(a, rows, count, stride) @ _matrix(x, 1, count, 1)[0]

    return _kernel(5, emit, twin)


def adding() -> Kernel:
    """c += a, both of `count` numbers. Arguments: c, a, count."""

    def emit(code: _Code, c, a, count) -> None:  # type: ignore[no-untyped-def]
        def add(at: ir.Value, lanes: int) -> None:
            place = code.past(c, at)
            code.store(code.builder.fadd(code.load(place, lanes), code.load(code.past(a, at), lanes)), place)

        def onward(k: ir.Value, _: Sequence[ir.Value]) -> list[ir.Value]:
            add(k, LANES)
            return []

        at, lanes = code.builder.and_(count, code.integer(-LANES)), LANES // 2
        code.loop(at, LANES, [], onward)
        while lanes:
            more = code.builder.and_(count, code.integer(lanes))
            with code.builder.if_then(code.is_not_zero(more)):
                add(at, lanes)
            at, lanes = code.builder.add(at, more), lanes // 2

    def twin(c: int, a: int, count: int) -> None:
        target = _matrix(c, 1, count, 1)
        target += _matrix(a, 1, count, 1)

    return _kernel(3, emit, twin)


class _Code:
    """What kernels are made of; it writes where its builder stands."""

    def __init__(self, builder: ir.IRBuilder) -> None:
        self.builder = builder
        self.register = ir.VectorType(_NUMBER, LANES)
        self.zero = ir.Constant(self.register, [0.0] * LANES)
        kind = ir.FunctionType(self.register, [self.register] * 3)
        self._multiply_add = cgutils.get_or_insert_function(builder.module, kind, f"llvm.fmuladd.v{LANES}f64")

    def integer(self, value: int) -> ir.Value:
        return ir.Constant(_INTEGER, value)

    def is_not_zero(self, value: ir.Value) -> ir.Value:
        return self.builder.icmp_signed("!=", value, self.integer(0))

    def past(self, address: ir.Value, numbers: ir.Value | int) -> ir.Value:
        """So many numbers past an address."""
        count = self.integer(numbers) if isinstance(numbers, int) else numbers
        return self.builder.add(address, self.builder.mul(count, self.integer(BYTES)))

    def addresses(self, address: ir.Value, stride: ir.Value, rows: int, registers: int) -> list[list[ir.Value]]:
        """Addresses of a tile's registers, row by row."""
        result = list[list[ir.Value]]()
        for _ in range(rows):
            result.append([self.past(address, LANES * v) for v in range(registers)])
            address = self.past(address, stride)
        return result

    def load(self, address: ir.Value, lanes: int = LANES) -> ir.Value:
        pointer = self.builder.inttoptr(address, ir.VectorType(_NUMBER, lanes).as_pointer())
        return self.builder.load(pointer, align=BYTES)

    def store(self, value: ir.Value, address: ir.Value) -> None:
        self.builder.store(value, self.builder.inttoptr(address, value.type.as_pointer()), align=BYTES)

    def spread(self, address: ir.Value) -> ir.Value:
        """The number at an address, in all lanes."""
        number = self.builder.load(self.builder.inttoptr(address, _NUMBER.as_pointer()))
        vector = self.builder.insert_element(self.zero, number, ir.Constant(_INDEX, 0))
        return self._shuffled(vector, [0] * LANES)

    def sum_of_lanes(self, value: ir.Value) -> ir.Value:
        half = LANES // 2
        while half:
            value = self.builder.fadd(value, self._shuffled(value, [(k + half) % LANES for k in range(LANES)]))
            half //= 2
        return self.builder.extract_element(value, ir.Constant(_INDEX, 0))

    def add_product(self, a: ir.Value, b: ir.Value, c: ir.Value) -> ir.Value:
        """a b + c."""
        return self.builder.call(self._multiply_add, [a, b, c])

    def loop(
        self,
        count: ir.Value,
        step: int,
        values: Sequence[ir.Value],
        onward: Callable[[ir.Value, Sequence[ir.Value]], Sequence[ir.Value]],
    ) -> list[ir.Value]:
        """For k = 0, step, ... below `count`, values = onward(k, values); the last ones."""
        build, before = self.builder, self.builder.block
        head, body, after = (build.append_basic_block(name) for name in ("head", "body", "after"))
        build.branch(head)
        build.position_at_end(head)
        k, *now = [build.phi(value.type) for value in (count, *values)]
        for phi, value in zip((k, *now), (self.integer(0), *values), strict=True):
            phi.add_incoming(value, before)
        build.cbranch(build.icmp_signed("<", k, count), body, after)
        build.position_at_end(body)
        new = (build.add(k, self.integer(step)), *onward(k, now))
        for phi, value in zip((k, *now), new, strict=True):
            phi.add_incoming(value, build.block)
        build.branch(head)
        build.position_at_end(after)
        return now

    def product(
        self,
        rows: int,
        registers: int,
        a: ir.Value,
        stride_a: ir.Value,
        b: ir.Value,
        stride_b: ir.Value,
        depth: ir.Value,
    ) -> list[list[ir.Value]]:
        """A^T B for A (depth, rows) and B (depth, registers)."""

        def onward(_: ir.Value, values: Sequence[ir.Value]) -> list[ir.Value]:
            at_a, at_b, *sums = values
            right, new = [self.load(self.past(at_b, LANES * v)) for v in range(registers)], list[ir.Value]()
            for r in range(rows):
                left = self.spread(self.past(at_a, r))
                mine = sums[r * registers : (r + 1) * registers]
                new += [self.add_product(left, value, total) for value, total in zip(right, mine, strict=True)]
            return [self.past(at_a, stride_a), self.past(at_b, stride_b), *new]

        _, _, *sums = self.loop(depth, 1, [a, b, *[self.zero] * (rows * registers)], onward)
        return [sums[r * registers : (r + 1) * registers] for r in range(rows)]

    def _shuffled(self, value: ir.Value, lanes: list[int]) -> ir.Value:
        return self.builder.shuffle_vector(value, value, ir.Constant(ir.VectorType(_INDEX, LANES), lanes))


def _kernel(count: int, emit: Callable[..., None], twin: Callable[..., None]) -> Kernel:
    """A kernel of so many arguments, compiled from what `emit` writes, or else its twin."""
    if COMPILED is not None or config.DISABLE_JIT:
        return twin

    def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
        emit(_Code(builder), *arguments)
        return context.get_dummy_value()

    kernel: Kernel = intrinsic(_TYPED[count](types.void(*[types.int64] * count), generate))
    return kernel


_TYPED: dict[int, Callable[..., object]] = {  # an intrinsic shows its arguments by name
    3: lambda signature, generate: lambda typing, a, b, c: (signature, generate),
    5: lambda signature, generate: lambda typing, a, b, c, d, e: (signature, generate),
    7: lambda signature, generate: lambda typing, a, b, c, d, e, f, g: (signature, generate),
    8: lambda signature, generate: lambda typing, a, b, c, d, e, f, g, h: (signature, generate),
}


def _view() -> Callable[..., Floats]:
    """Part of an array (n,) of numbers as a matrix, without a copy: Numba's `reshape` takes as long as a short loop.

    Arguments: the array, from which number on, rows, columns. It does not hold the memory.
    """

    def twin(memory: Floats, begin: int, rows: int, columns: int) -> Floats:
        return memory[begin : begin + rows * columns].reshape(rows, columns)

    if COMPILED is not None or config.DISABLE_JIT:
        return twin

    def view(typing, memory, begin, rows, columns):  # type: ignore[no-untyped-def]
        kind = types.Array(types.float64, 2, "C")

        def generate(context, builder, signature, arguments):  # type: ignore[no-untyped-def]
            given, first, *shape = arguments
            numbers = context.make_array(memory)(context, builder, value=given).data
            result, size = context.make_array(kind)(context, builder), ir.Constant(_INTEGER, BYTES)
            arrayobj.populate_array(
                result,
                data=builder.gep(numbers, [first]),
                shape=shape,
                strides=[builder.mul(shape[1], size), size],
                itemsize=size,
                meminfo=None,
            )
            return result._getvalue()

        return kind(memory, *[types.int64] * 3), generate

    kernel: Callable[..., Floats] = intrinsic(view)
    return kernel


matrix_view = _view()


def _matrix(address: int, rows: int, columns: int, stride: int) -> Floats:
    """A matrix that lies in memory."""
    pointer = ctypes.cast(ctypes.c_void_p(int(address)), ctypes.POINTER(ctypes.c_double))
    numbers = np.ctypeslib.as_array(pointer, (max((rows - 1) * stride + columns, 1),))
    return np.lib.stride_tricks.as_strided(numbers, (rows, columns), (BYTES * stride, BYTES))

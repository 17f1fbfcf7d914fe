"""`rodshell warmup`: compile every kernel now, so that the first form does not wait for it."""

import time

import click

from rodshell.cli.options import QUIET
from rodshell.cli.reporting import UNKEPT, compile_before_first
from rodshell.errors import InputError
from rodshell.kernels import COMPILED
from rodshell.kernels.cache import kernels_are_kept


@click.command()
@QUIET
def command(quiet: bool) -> int:
    """Compile all kernels now, once, instead of before the first job.

    It is of use where rodshell was installed without compiled kernels, and takes a minute or two; later there is
    nothing to compile. It is optional: without it, the first job compiles what most jobs need, and later ones the rest.
    """
    if COMPILED is None and not kernels_are_kept():
        raise InputError(f"kernels compiled now would be lost: {UNKEPT}")
    begin = time.perf_counter()
    compiled = compile_before_first(quiet=quiet, every=True)
    if quiet:
        return 0
    if compiled:
        click.echo(f"compiled {compiled} kernels in {time.perf_counter() - begin:.0f} s")
    else:
        click.echo("nothing to do: all kernels were compiled before")
    return 0

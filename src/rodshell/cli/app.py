"""The commands. Only click is imported here, so that --help and --version answer at once."""

import os
import warnings
from difflib import get_close_matches
from importlib import import_module
from typing import Any

import click

from rodshell.cli.interruption import Interrupted
from rodshell.errors import InputError, OutOfMemoryError, OutOfTimeError, OutputWarning, RodshellError
from rodshell.printed import say

COMMANDS = {
    "form": "Find the flat grid that pops up into a target.",
    "refine": "Bring a form nearer to its target, and accept only what can be built.",
    "popup": "Pop up a table of rods, or an earlier result, from flat.",
    "check": "Check a case, or an earlier result, under loads.",
    "advise": "Try what the findings of an earlier result offer, and say what helps.",
    "export": "Write drawings, schedules, models or the report of an earlier result again.",
    "studio": "Design a gridshell on a live page in the browser.",
    "sweep": "Compute many designs: combinations or samples of the values of some keys.",
    "optimise": "Search for the values of some keys for which objectives are smallest.",
    "warmup": "Compile all kernels in advance, once.",
    "paper": "Compute a figure of the paper again, with the errors.",
}


class LazyGroup(click.Group):
    """A group whose commands live in the module of their name and are imported when they are called."""

    def invoke(self, ctx: click.Context) -> object:
        """As click does, but an interrupt is left to `main`."""
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt as stopped:
            raise Interrupted(str(stopped)) from stopped
        except click.UsageError as error:
            name = ctx.invoked_subcommand
            if error.ctx is None and name and (command := self.get_command(ctx, name)):
                error.ctx = click.Context(command, parent=ctx, info_name=name)  # so that its --help is named
            raise

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        if cmd_name not in COMMANDS:
            return None
        command = import_module(f"rodshell.cli.{cmd_name}").command
        assert isinstance(command, click.Command)
        return command

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        if args[0] not in COMMANDS and not args[0].startswith("-"):
            near = get_close_matches(args[0], COMMANDS, n=1)
            hint = f"did you mean {near[0]}?" if near else f"the commands are {', '.join(COMMANDS)}"
            raise InputError(f"unknown command {args[0]}: {hint}")
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl(list(COMMANDS.items()))


@click.group(
    cls=LazyGroup,
    invoke_without_command=True,
    context_settings={"max_content_width": 110, "help_option_names": ["-h", "--help"]},
)
@click.version_option(package_name="rodshell", message="%(package)s %(version)s", help="Print the version and exit.")
@click.pass_context
def app(ctx: click.Context) -> None:
    """Form finding of elastic gridshells: a target surface goes in, a flat grid of rods comes out.

    Try: rodshell form hemisphere --out out/dome
    """
    if ctx.invoked_subcommand is None:
        click.echo(ctx.get_help())
        return
    try:
        os.getcwd()
    except OSError:
        raise InputError("the current folder does not exist any more: change to another one") from None


def print_warnings() -> None:
    """From now on, print a warning about written files as one sentence; others as Python does."""
    usual = warnings.showwarning

    def show(message: Warning | str, category: type[Warning], *where: Any, **more: Any) -> None:
        if issubclass(category, OutputWarning):
            say(f"warning: {message}")
        else:
            usual(message, category, *where, **more)

    warnings.simplefilter("always", OutputWarning)
    warnings.showwarning = show


def failed(error: BaseException) -> int:
    """Say what was wrong in one line; the exit code. Raises errors that are not the user's."""
    if isinstance(error, OutOfTimeError):
        return _fail(f"{error}; nothing was found yet that could be written", error.exit_code)
    if isinstance(error, RodshellError):
        return _fail(str(error), error.exit_code)
    if isinstance(error, click.NoSuchOption):
        names = {name.lstrip("-"): name for name in error.possibilities or ()}  # dashes alone make none alike
        near = get_close_matches(error.option_name.lstrip("-"), names, n=1)
        hint = f": did you mean {names[near[0]]}?" if near else f": see {_command(error)} --help"
        return _fail(f"unknown option {error.option_name}{hint}", 2)
    if isinstance(error, click.UsageError):
        return _fail(f"{error.format_message().rstrip('.')}: see {_command(error)} --help", 2)
    if isinstance(error, click.ClickException):
        return _fail(error.format_message(), 2)
    if isinstance(error, MemoryError):
        return _fail(str(OutOfMemoryError(error)), 2)
    if isinstance(error, OSError):
        return _fail(f"{error.filename or 'the system'}: {error.strerror or error}", 2)
    raise error


def _command(error: click.UsageError) -> str:
    """The command that was called, such as "rodshell form"."""
    return error.ctx.command_path if error.ctx else "rodshell"


def _fail(message: str, code: int) -> int:
    say(f"error: {message}")
    return code

"""The reference of the commands, read off the parser of the command line."""

import re
from inspect import cleandoc

import click

from docs.generators.tables import table
from rodshell.case import case_keys
from rodshell.cli.app import COMMANDS, app
from rodshell.cli.options import ALIASES, CaseOption

HEAD = """# Commands

`rodshell COMMAND --help` prints the same. Exit codes are [in the files](../files.md#exit-codes).

"""


def page() -> str:
    return HEAD + "\n".join(map(_command, COMMANDS))


def _command(name: str) -> str:
    context = click.Context(app, info_name="rodshell")
    command = app.get_command(context, name)
    assert command is not None
    inside = click.Context(command, info_name=name, parent=context)
    usage = re.sub(r"\s+", " ", command.get_usage(inside).removeprefix("Usage: "))
    text = f"## `rodshell {name}`\n\n```text\n{usage}\n```\n\n{cleandoc(command.help or '')}\n\n"
    options = [option for option in command.get_params(inside) if isinstance(option, click.Option)]
    keys = [option.key.path for option in options if isinstance(option, CaseOption)]
    records = [option.get_help_record(inside) for option in options if not isinstance(option, CaseOption)]
    text += table(("option", "meaning"), [(f"`{record[0]}`", record[1]) for record in records if record])
    return text + (_keys(keys) if keys else "")


def _keys(paths: list[str]) -> str:
    """The options that are keys of the case file."""
    short = ", ".join(f"`{ALIASES[path]}` (`{path}`)" for path in paths if path in ALIASES)
    which = (
        "Each key of [the case file](case_file.md)"
        if len(paths) == len(case_keys())
        else (
            "Each key of "
            + ", ".join(f"`[{name}]`" for name in dict.fromkeys(path.split(".")[0] for path in paths))
            + " in [the case file](case_file.md)"
        )
    )
    return f"\n{which} is an option, `--TABLE.KEY VALUE`." + (f" In short: {short}.\n" if short else "\n")

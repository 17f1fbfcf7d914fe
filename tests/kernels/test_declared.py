"""The types that kernels are declared with: those of all that Python calls, and of no other."""

import ast
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import rodshell
from rodshell.kernels import modules

SOURCE = Path(rodshell.__file__).parent


def test_each_kernel_that_python_calls_has_types_and_no_other_has() -> None:
    called = {resolved(module, name) for module in sources() for name in names_outside_kernels(module)} - {None}
    assert called == {(module, name) for module in sources() for name in types_of(module)}


def test_kernels_have_a_type_for_each_argument() -> None:
    for module in modules():
        for name, types in types_of(module).items():
            assert len(kernels_of(module)[name].args.args) == len(types.split()), f"{module}.{name}"


def test_modules_of_kernels_are_those_that_declare_types() -> None:
    assert modules() == sorted(module for module in sources() if types_of(module))


def test_modules_of_kernels_import_without_what_is_not_there_when_a_wheel_is_built() -> None:
    """The build installs `BUILDER` alone."""
    root = Path(__file__).parents[2]
    hooks = tomllib.loads((root / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["hatch"]["metadata"]["hooks"]
    tree = ast.parse((root / "hatch_build.py").read_text(encoding="utf-8"))
    values = {node.targets[0].id: node.value for node in tree.body if isinstance(node, ast.Assign)}  # type: ignore[attr-defined]
    there = {re.split(r"\W", word)[0] for word in ast.literal_eval(values["BUILDER"])}
    missing = {re.split(r"\W", word)[0] for word in hooks["custom"]["dependencies"]} - there
    assert {"pydantic", "pillow"} <= missing
    code = "import sys\n" + "".join(f"sys.modules[{name!r}] = None\n" for name in sorted(missing | {"PIL"}))
    code += "".join(f"import rodshell.{module}\n" for module in modules())
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=300)
    assert not done.returncode, done.stderr


@cache
def sources() -> list[str]:
    """Modules of the package, without its name."""
    return [
        ".".join(path.relative_to(SOURCE).with_suffix("").parts).removesuffix(".__init__")
        for path in SOURCE.rglob("*.py")
    ]


@cache
def tree_of(module: str) -> ast.Module:
    path = SOURCE.joinpath(*module.split("."))
    return ast.parse((path / "__init__.py" if path.is_dir() else path.with_suffix(".py")).read_text(encoding="utf-8"))


@cache
def kernels_of(module: str) -> dict[str, ast.FunctionDef]:
    """Functions that are declared by `njit`."""
    functions = [node for node in tree_of(module).body if isinstance(node, ast.FunctionDef)]
    return {
        one.name: one for one in functions if any(ast.unparse(mark).startswith("njit(") for mark in one.decorator_list)
    }


def types_of(module: str) -> dict[str, str]:
    """The types that kernels of a module are declared with, of those that have some."""
    marks = {
        name: mark
        for name, one in kernels_of(module).items()
        for mark in one.decorator_list
        if isinstance(mark, ast.Call) and mark.args
    }
    return {name: ast.literal_eval(mark.args[0]) for name, mark in marks.items()}


@cache
def imported(module: str) -> dict[str, tuple[str, str]]:
    """Module and name of what a module imports from the package."""
    return {
        alias.asname or alias.name: (node.module.removeprefix("rodshell."), alias.name)
        for node in ast.walk(tree_of(module))
        if isinstance(node, ast.ImportFrom) and node.module is not None and node.module.startswith("rodshell.")
        for alias in node.names
    }


def resolved(module: str, name: str) -> tuple[str, str] | None:
    """The kernel that a name means in a module, the module's own or an imported one."""
    home, own = imported(module).get(name, (module, name))
    return (home, own) if home in sources() and own in kernels_of(home) else None


def names_outside_kernels(module: str) -> Iterator[str]:
    """Names that are read in a module's code, except in that of kernels."""
    waiting: list[ast.AST] = [tree_of(module)]
    while waiting:
        node = waiting.pop()
        if node in kernels_of(module).values():
            continue
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load):
            yield node.id
        waiting += ast.iter_child_nodes(node)

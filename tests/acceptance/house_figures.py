"""Figures of the source by room, at an earlier commit and now: `python -m tests.acceptance.house_figures [names]`.

A room is a folder of `src/rodshell/`, or its files outside of folders. Lines are counted so that nobody adds any
unnoticed, statements (without docstrings) because longer lines do not lower them. Then what a reader stumbles over:
circles of imports, kinds told apart by `isinstance` or by a letter, long files, and, with `names`, public names that no
other module of the source uses. Read with `ast` alone, nothing is imported.
"""

import ast
import io
import json
import re
import subprocess
import sys
import tarfile
import tempfile
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
SOURCE = ROOT / "src" / "rodshell"
BEFORE = "b5d202ba"  # the last commit before the third drawing of the house
STORED = Path(__file__).with_name("house_before.json")  # the rooms of BEFORE, for a checkout without its history
LONG = 500  # lines of a file
LONG_FILES = {
    "formfinding/popup.py": "every solve of a pop-up: from the draped and the flat state, of one grid and of several",
    "model/shell.py": "the shell, put together once of its rods, joints and supports",
    "solve/sparse_ldl.py": "numeric factorisation and solves: kernels that share the layout of the factors",
    "solve/symbolic.py": "the symbolic phase of the same factorisation",
}
"""Longer files, and why each is one thing."""
KINDS_KNOWN = ("rods", "joints")  # rooms that may tell kinds of elements apart
LATTICE = ("nets/", "layout/gridlayout.py")  # which may tell its families apart: the Chebyshev lattice


@dataclass(frozen=True)
class Room:
    """What stands in one room, in numbers; `names` are public ones at module level."""

    statements: int = 0
    lines: int = 0
    names: int = 0
    files: int = 0

    def __add__(self, other: "Room") -> "Room":
        sums = (a + b for a, b in zip(asdict(self).values(), asdict(other).values(), strict=True))
        return Room(*sums)


@dataclass(frozen=True)
class SourceFile:
    """A module: its dotted name, its path within the package, its text, its syntax tree."""

    name: str
    path: str
    text: str
    tree: ast.Module

    @property
    def lines(self) -> int:
        return self.text.count("\n")

    @property
    def room(self) -> str:
        return self.path.partition("/")[0] if "/" in self.path else "(files)"


Source = dict[str, SourceFile]


def read_tree(root: Path) -> Source:
    """Every module below `root` (a package's folder) by its dotted name."""
    found = {}
    for path in sorted(root.rglob("*.py")):
        parts = [root.name, *path.relative_to(root).with_suffix("").parts]
        name = ".".join(parts[:-1] if parts[-1] == "__init__" else parts)
        text = path.read_text()
        found[name] = SourceFile(name, str(path.relative_to(root)), text, ast.parse(text))
    return found


def tree_at(commit: str) -> Source | None:
    """The modules of an earlier commit; None where the checkout has no history that far back."""
    done = subprocess.run(["git", "archive", commit, "src/rodshell"], cwd=ROOT, capture_output=True, check=False)
    if done.returncode:
        return None
    with tempfile.TemporaryDirectory() as folder:
        with tarfile.open(fileobj=io.BytesIO(done.stdout)) as archive:
            archive.extractall(folder, filter="data")
        return read_tree(Path(folder, "src", "rodshell"))


def rooms(source: Source) -> dict[str, Room]:
    """What stands in each room."""
    found: dict[str, Room] = {}
    for file in source.values():
        one = Room(statements(file.tree), file.lines, len(list(public_names(file))), 1)
        found[file.room] = found.get(file.room, Room()) + one
    return found


def statements(tree: ast.Module) -> int:
    """Statements of a module, at any depth; texts that stand alone are docstrings."""
    return sum(isinstance(node, ast.stmt) and not is_text(node) for node in ast.walk(tree))


def is_text(node: ast.AST) -> bool:
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)


def public_names(file: SourceFile) -> Iterator[tuple[str, ast.stmt]]:
    """Names without an underscore that a module defines, and where."""
    if any(part.startswith("_") for part in file.name.split(".")):
        return
    for node in file.tree.body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef | ast.AsyncFunctionDef):
            found = [node.name]
        elif isinstance(node, ast.Assign | ast.AnnAssign):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            found = [each.id for target in targets for each in ast.walk(target) if isinstance(each, ast.Name)]
        else:
            found = []
        yield from ((name, node) for name in found if not name.startswith("_"))


def identifiers(tree: ast.AST) -> Iterator[str]:
    """All that may be a name of another module: names, attributes, imports, and words in texts."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Name):
            yield node.id
        elif isinstance(node, ast.Attribute):
            yield node.attr
        elif isinstance(node, ast.alias):
            yield from node.name.split(".")
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and node.value.isidentifier():
            yield node.value


def unused_names(source: Source) -> list[str]:
    """Public names that no other module of the source has, as `path:name`."""
    words = {name: set(identifiers(file.tree)) for name, file in source.items()}
    homes: dict[str, int] = {}
    for each in words.values():
        for word in each:
            homes[word] = homes.get(word, 0) + 1
    return [
        f"{file.path}:{name}"
        for module, file in source.items()
        for name, _ in public_names(file)
        if homes.get(name, 0) - (name in words[module]) == 0
    ]


def imports(file: SourceFile, names: set[str]) -> set[str]:
    """Modules of the tree that `file` imports anywhere in it, within functions and for types, too."""
    package = file.name if file.path.endswith("__init__.py") else file.name.rpartition(".")[0]
    found: set[str] = set()
    for node in ast.walk(file.tree):
        if isinstance(node, ast.Import):
            found.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            base = node.module or ""
            if node.level:
                above = package.split(".")[: len(package.split(".")) - node.level + 1]
                base = ".".join([*above, base] if base else above)
            for alias in node.names:
                submodule = f"{base}.{alias.name}"
                found.add(submodule if submodule in names else base)
    return (found & names) - {file.name}


def in_circles(source: Source) -> list[str]:
    """Modules that import themselves by way of others, and those between two circles."""
    above = {name: imports(file, set(source)) for name, file in source.items()}
    while True:  # what imports nothing that is left, or is imported by nothing that is left, is in no circle
        used = set().union(*above.values())
        left = {name: those & above.keys() for name, those in above.items() if those & above.keys() and name in used}
        if left == above:
            return sorted(left)
        above = left


def element_kinds(source: Source) -> set[str]:
    """Public classes of energies: those with `evaluate` and `refreshed`, and what is derived from them."""
    classes = [node for file in source.values() for node in ast.walk(file.tree) if isinstance(node, ast.ClassDef)]
    found = {
        each.name
        for each in classes
        if {"evaluate", "refreshed"} <= {node.name for node in each.body if isinstance(node, ast.FunctionDef)}
    }
    while more := {each.name for each in classes if found & set(map(ast.unparse, each.bases))} - found:
        found |= more
    return {name for name in found if not name.startswith("_")} - {"Elements", "Stressed"}  # protocols of all kinds


def told_apart(source: Source) -> list[str]:
    """`isinstance` on kinds of elements outside the rooms that know them."""
    kinds = element_kinds(source)
    return [
        f"{file.path}:{node.lineno} {ast.unparse(node)}"
        for file in source.values()
        for node in ast.walk(file.tree)
        if file.room not in KINDS_KNOWN
        and isinstance(node, ast.Call)
        and ast.unparse(node.func) == "isinstance"
        and kinds & set(identifiers(node.args[1]))
    ]


def families_told_apart(source: Source) -> list[str]:
    """Comparisons with the letter of a family outside the lattice whose families they are."""
    return [
        f"{file.path}:{node.lineno} {ast.unparse(node)}"
        for file in source.values()
        if not file.path.startswith(LATTICE)
        for node in ast.walk(file.tree)
        if isinstance(node, ast.Compare)
        and {"u", "v"} & {each.value for each in ast.walk(node) if isinstance(each, ast.Constant)}
    ]


def files_naming(source: Source, kind: str) -> list[str]:
    """Files whose code has a kind's name in it; those that only hand it on, and what is said of it, are not counted."""
    found, name = [], re.compile(rf"(?<![A-Za-z]){kind}(?![a-z])")
    for file in source.values():
        said = {node.value for node in ast.walk(file.tree) if is_text(node)}
        words = (node for node in ast.walk(file.tree) if node not in said)
        texts = (getattr(node, part, "") for node in words for part in ("id", "attr", "name", "value"))
        if not file.path.endswith("__init__.py") and any(isinstance(text, str) and name.search(text) for text in texts):
            found.append(file.path)
    return found


def unexplained(source: Source) -> list[str]:
    """Long files that nobody gives a reason for, and reasons of files that are not long."""
    long = {file.path: file.lines for file in source.values() if file.lines > LONG}
    return [f"{path} {long.get(path, 'is not long')}" for path in sorted(long.keys() ^ LONG_FILES.keys())]


def targets(source: Source) -> dict[str, list[str]]:
    """What no place of the source should be: where it is so still."""
    return {
        "modules in circles of imports": in_circles(source),
        "kinds of elements told apart outside rods/ and joints/": told_apart(source),
        'comparisons with "u" or "v" outside the Chebyshev lattice': families_told_apart(source),
        f"files over {LONG} lines without a reason": unexplained(source),
    }


def array_aliases(source: Source) -> list[str]:
    """Names at module level that stand for an NDArray type, outside their home."""
    return [
        f"{file.path}:{node.lineno}"
        for file in source.values()
        for node in file.tree.body
        if file.path != "arrays.py"
        and isinstance(node, ast.Assign | ast.AnnAssign)
        and isinstance(node.value, ast.Subscript)
        and ast.unparse(node.value.value).split(".")[-1] in ("NDArray", "ndarray")
    ]


def main(details: bool) -> None:
    earlier, now = tree_at(BEFORE), read_tree(SOURCE)
    stored = {name: Room(**room) for name, room in json.loads(STORED.read_text()).items()}
    before, after = (rooms(earlier) if earlier else stored), rooms(now)
    columns = list(Room.__annotations__)
    print(f"{'':<14}" + "".join(f"{f'{name}: {BEFORE}, now, net':>34}" for name in columns))
    for room in [*sorted({*before, *after}), "all"]:
        of_all = [sum(each.values(), Room()) if room == "all" else each.get(room, Room()) for each in (before, after)]
        then, here = map(asdict, of_all)
        print(f"{room:<14}" + "".join(f"{then[c]:>18} {here[c]:>7} {here[c] - then[c]:>+7}" for c in columns))
    for what, found in targets(now).items():
        print(f"\n{len(found)} {what}{'' if found else ': reached'}", *found, sep="\n  ")
    print(f"\nfiles over {LONG} lines, and why they are one thing")
    lines = {file.path: file.lines for file in now.values()}
    print(*(f"  {path} ({lines.get(path, 0)}): {why}" for path, why in LONG_FILES.items()), sep="\n")
    unused = unused_names(now)
    print(
        f"\n{len(unused)} public names that no other module of the source uses",
        *(unused if details else ()),
        sep="\n  ",
    )


if __name__ == "__main__":
    main("names" in sys.argv[1:])

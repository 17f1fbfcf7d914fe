"""Figures of a source tree, before and after side by side: `python -m tests.acceptance.house_figures [FOLDER]`.

What a reader meets: how long files and functions are, which files have a single importer, which import each other in a
circle, how much is typed, how many functions say what their parameters are. Read with `ast` alone, nothing is imported.
"""

import ast
import io
import json
import subprocess
import sys
import tarfile
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass
from itertools import chain
from pathlib import Path
from statistics import median

ROOT = Path(__file__).parents[2]
BEFORE = "c7aa8f6"  # the last commit before the second drawing of the house
LONG_FUNCTION = 60  # lines
SHORT_FILE = 90  # lines
STORED = Path(__file__).with_name("house_before.json")  # the figures of BEFORE, for a checkout without its history
Function = ast.FunctionDef | ast.AsyncFunctionDef


@dataclass(frozen=True)
class Figures:
    """One tree, in numbers; the tuples name what is counted, worst first."""

    files: int
    lines_median: float
    lines_p90: float
    lines_max: int
    single_importer: int
    single_importer_short: int
    repeated_names: tuple[str, ...]
    any_dicts: int
    any_names: int
    get_calls: int
    circles: tuple[tuple[str, ...], ...]
    array_aliases: int
    long_functions: int
    longest: tuple[str, ...]
    most_arguments: tuple[str, ...]
    public_functions: int
    documented: int
    taking_parameters: int
    parameter_sections: int
    classes_with_fields: int
    class_sections: int


@dataclass(frozen=True)
class SourceFile:
    """A module: its dotted name, its text, its syntax tree."""

    name: str
    path: str
    text: str
    tree: ast.Module

    @property
    def lines(self) -> int:
        return self.text.count("\n")


def read_tree(root: Path) -> dict[str, SourceFile]:
    """Every module below `root` (a package's folder) by its dotted name."""
    found = {}
    for path in sorted(root.rglob("*.py")):
        parts = [root.name, *path.relative_to(root).with_suffix("").parts]
        name = ".".join(parts[:-1] if parts[-1] == "__init__" else parts)
        text = path.read_text()
        found[name] = SourceFile(name, str(path.relative_to(root)), text, ast.parse(text))
    return found


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


def strong_components(graph: dict[str, set[str]]) -> list[tuple[str, ...]]:
    """Sets of files that reach each other, largest first (Tarjan, without recursion)."""
    index: dict[str, int] = {}
    low: dict[str, int] = {}
    stack: list[str] = []
    found = []
    for root in graph:
        if root in index:
            continue
        work: list[tuple[str, Iterator[str]]] = [(root, iter(sorted(graph[root])))]
        index[root] = low[root] = len(index)
        stack.append(root)
        while work:
            node, successors = work[-1]
            for successor in successors:
                if successor not in index:
                    index[successor] = low[successor] = len(index)
                    stack.append(successor)
                    work.append((successor, iter(sorted(graph[successor]))))
                    break
                if successor in stack:
                    low[node] = min(low[node], index[successor])
            else:
                work.pop()
                if work:
                    low[work[-1][0]] = min(low[work[-1][0]], low[node])
                if low[node] == index[node]:
                    start = stack.index(node)
                    found.append(tuple(sorted(stack[start:])))
                    del stack[start:]
    return sorted((component for component in found if len(component) > 1), key=len, reverse=True)


def functions(file: SourceFile) -> Iterator[tuple[str, Function, bool]]:
    """Every function with its qualified name, and whether it is public: no underscore, not within another function."""

    def walk(node: ast.AST, prefix: str, public: bool) -> Iterator[tuple[str, Function, bool]]:
        for child in ast.iter_child_nodes(node):
            if isinstance(child, Function):
                seen = public and not child.name.startswith("_")
                yield f"{prefix}{child.name}", child, seen
                yield from walk(child, f"{prefix}{child.name}.", False)
            elif isinstance(child, ast.ClassDef):
                yield from walk(child, f"{prefix}{child.name}.", public and not child.name.startswith("_"))
            else:
                yield from walk(child, prefix, public)

    private = any(part.startswith("_") for part in file.name.split("."))
    yield from walk(file.tree, "", not private)


def length(function: Function) -> int:
    return (function.end_lineno or function.lineno) - function.lineno + 1


def arguments(function: Function) -> int:
    """Parameters without `self` and `cls`."""
    spec = function.args
    names = [argument.arg for argument in (*spec.posonlyargs, *spec.args, *spec.kwonlyargs)]
    return sum(name not in ("self", "cls") for name in names) + (spec.vararg is not None) + (spec.kwarg is not None)


def described(node: ast.AST) -> bool:
    """Whether a docstring has a section that says what the parameters or fields are."""
    text = ast.get_docstring(node) or ""  # type: ignore[arg-type]
    return "Parameters\n---" in text or "Attributes\n---" in text


def public_records(file: SourceFile) -> Iterator[ast.ClassDef]:
    """Public classes of a module with annotated fields: records and settings."""
    for node in file.tree.body:
        public = isinstance(node, ast.ClassDef) and not node.name.startswith("_")
        if public and any(isinstance(child, ast.AnnAssign) for child in node.body):
            yield node


def is_any_dict(node: ast.AST) -> bool:
    """`dict[str, Any]` as an annotation or an alias."""
    return isinstance(node, ast.Subscript) and ast.unparse(node).replace(" ", "") == "dict[str,Any]"


def is_get_call(node: ast.AST) -> bool:
    """`x.get("key"...)`: a key by a string that no type checker sees."""
    return (
        isinstance(node, ast.Call)
        and isinstance(node.func, ast.Attribute)
        and node.func.attr == "get"
        and bool(node.args)
        and isinstance(node.args[0], ast.Constant)
        and isinstance(node.args[0].value, str)
    )


def is_array_alias(node: ast.AST) -> bool:
    """A name at module level that stands for an NDArray type."""
    value = getattr(node, "value", None) if isinstance(node, (ast.Assign, ast.AnnAssign)) else None
    return isinstance(value, ast.Subscript) and ast.unparse(value.value).split(".")[-1] in ("NDArray", "ndarray")


def worst(rows: list[tuple[int, str]], count: int) -> tuple[str, ...]:
    return tuple(f"{number} {name}" for number, name in sorted(rows, key=lambda row: (-row[0], row[1]))[:count])


def figures(root: Path) -> Figures:
    """The figures of the package in the folder `root`."""
    files = read_tree(root)
    graph = {name: imports(file, set(files)) for name, file in files.items()}
    importers = Counter(chain.from_iterable(graph.values()))
    single = [files[name] for name, count in importers.items() if count == 1 and "__init__" not in files[name].path]
    lines = sorted(file.lines for file in files.values())
    bases = Counter(Path(file.path).stem for file in files.values() if not file.path.endswith("__init__.py"))
    modules = [file for name, file in files.items() if name != f"{root.name}.arrays"]  # which is their home
    nodes = [node for file in files.values() for node in ast.walk(file.tree)]
    every = [(f"{file.path}:{name}", node, public) for file in files.values() for name, node, public in functions(file)]
    public = [node for _, node, seen in every if seen]
    records = [node for file in files.values() for node in public_records(file)]
    lengths = [(length(node), name) for name, node, _ in every]
    return Figures(
        files=len(files),
        lines_median=median(lines),
        lines_p90=lines[int(0.9 * (len(lines) - 1))],
        lines_max=lines[-1],
        single_importer=len(single),
        single_importer_short=sum(file.lines < SHORT_FILE for file in single),
        repeated_names=tuple(sorted(name for name, count in bases.items() if count > 1)),
        any_dicts=sum(map(is_any_dict, nodes)),
        any_names=sum(isinstance(node, ast.Name) and node.id == "Any" for node in nodes),
        get_calls=sum(map(is_get_call, nodes)),
        circles=tuple(strong_components(graph)),
        array_aliases=sum(is_array_alias(node) for file in modules for node in file.tree.body),
        long_functions=sum(count > LONG_FUNCTION for count, _ in lengths),
        longest=worst(lengths, 10),
        most_arguments=worst([(arguments(node), name) for name, node, _ in every], 5),
        public_functions=len(public),
        documented=sum(ast.get_docstring(node) is not None for node in public),
        taking_parameters=sum(arguments(node) > 0 for node in public),
        parameter_sections=sum(map(described, public)),
        classes_with_fields=len(records),
        class_sections=sum(map(described, records)),
    )


def figures_at(commit: str) -> Figures | None:
    """The figures of an earlier commit's sources; None where the checkout has no history that far back."""
    done = subprocess.run(["git", "archive", commit, "src/rodshell"], cwd=ROOT, capture_output=True, check=False)
    if done.returncode:
        return None
    with tempfile.TemporaryDirectory() as folder:
        with tarfile.open(fileobj=io.BytesIO(done.stdout)) as archive:
            archive.extractall(folder, filter="data")
        return figures(Path(folder, "src", "rodshell"))


def share(part: int, whole: int) -> str:
    return f"{part} of {whole}, {part / max(whole, 1):.0%}"


COLUMNS: tuple[tuple[str, Callable[[Figures], object]], ...] = (
    ("files", lambda f: f.files),
    ("lines of a file: median", lambda f: f"{f.lines_median:g}"),
    ("lines of a file: nine tenths have at most", lambda f: f.lines_p90),
    ("lines of a file: largest", lambda f: f.lines_max),
    ("files with a single importer", lambda f: f.single_importer),
    (f"of these under {SHORT_FILE} lines", lambda f: f.single_importer_short),
    ("file names that occur twice", lambda f: len(f.repeated_names)),
    ("dict[str, Any]", lambda f: f.any_dicts),
    ("Any", lambda f: f.any_names),
    ('.get("...")', lambda f: f.get_calls),
    ("circles of imports", lambda f: len(f.circles)),
    ("files in the largest circle", lambda f: max(map(len, f.circles), default=0)),
    ("definitions of array types outside arrays", lambda f: f.array_aliases),
    (f"functions over {LONG_FUNCTION} lines", lambda f: f.long_functions),
    ("most parameters of a function", lambda f: f.most_arguments[0].split()[0]),
    ("public functions with a docstring", lambda f: share(f.documented, f.public_functions)),
    ("with a Parameters section, of all public", lambda f: share(f.parameter_sections, f.public_functions)),
    ("with a Parameters section, of those that take any", lambda f: share(f.parameter_sections, f.taking_parameters)),
    ("records whose fields are described", lambda f: share(f.class_sections, f.classes_with_fields)),
)
DETAILS: tuple[tuple[str, Callable[[Figures], tuple[str, ...]]], ...] = (
    ("file names that occur twice", lambda f: f.repeated_names),
    ("circles of imports", lambda f: tuple(", ".join(circle) for circle in f.circles)),
    ("longest functions (lines)", lambda f: f.longest),
    ("functions with most parameters", lambda f: f.most_arguments),
)


def main(root: Path) -> None:
    earlier, after = figures_at(BEFORE), figures(root)
    before = {what: column(earlier) for what, column in COLUMNS} if earlier else json.loads(STORED.read_text())
    rows = [{"what": what, "before": before[what], "after": column(after)} for what, column in COLUMNS]
    print(f"{'':<52} {BEFORE:>20} {'now':>20}")
    for row in rows:
        print(f"{row['what']:<52} {row['before']!s:>20} {row['after']!s:>20}")
    for what, detail in DETAILS:
        print(f"\n{what}:", *detail(after), sep="\n  ")
    folder = ROOT / "accept"
    folder.mkdir(exist_ok=True)
    body = {"rows": rows, "details": asdict(after)}
    (folder / "house_figures.json").write_text(json.dumps(body, indent=1) + "\n")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else ROOT / "src" / "rodshell"))

"""Prints the acceptance table of the house: `python -m tests.acceptance.house`; exit 1 on a miss.

Nothing that worked is lost: ten jobs give the states and every field of the results that are kept of them; results of
all earlier formats open, are exported and run again; what users get wrong is refused in one sentence.
"""

import sys
import tempfile
from collections.abc import Iterable, Iterator
from pathlib import Path

from tests.acceptance import house_figures
from tests.acceptance.kept import (
    EARLIER,
    FOUND,
    JOBS,
    STAGES,
    compared,
    quiet,
    run,
    unexpected,
    unneeded,
    unpacked,
)
from tests.acceptance.misuses import MISUSES, case_fault, option_fault, python_fault
from tests.acceptance.rows import Row, print_table
from tests.acceptance.same_results import Difference

KINDS = "dxf,svg,pdf,csv,obj,gltf,vtp,compas,png,report,3dm"
NAMED = {
    "energy": "LocalEnergy", "format": "vtp", "goal": "Prestress", "joint": "Rigid", "load": "LineLoad",
    "material": "bamboo", "section": "RectangularSection",
    "support": "largest displacement of a rod end",
}  # fmt: skip
"""By kinds of things that a new one may be added to: the name of one, which stands in as many files as one takes. Of
supports it is a figure that they say of themselves: pinned and clamped ends are also what others ask for by name."""
SUFFIXES = (".dxf", ".svg", ".pdf", ".csv", ".obj", ".gl*", ".vtp", ".json", ".png", ".html", ".3dm")  # one of each


def same_row(case: str, found: list[Difference]) -> Row:
    """How many values differ that `CHANGED_ON_PURPOSE` does not name."""
    others = unexpected(found)
    return Row(case, "values that differ from the kept result", len(others), 0, note="; ".join(map(str, others[:20])))


def result_rows(names: Iterable[str], work: Path) -> Iterator[Row]:
    """Jobs run again as they were, and entries of `CHANGED_ON_PURPOSE` that none of them needs."""
    every = list[Difference]()
    for name in names:
        found = run(name, work / "now" / name) in FOUND
        yield Row(name, "jobs without a result", float(not found), 0)
        if found:
            differences = compared(name, unpacked(name, work / "kept"), work / "now" / name)
            every += differences
            yield same_row(name, differences)
    if {*names} == {*JOBS}:
        stale = list(unneeded(every))
        yield Row("CHANGED_ON_PURPOSE", "entries that nothing needs", len(stale), 0, note=", ".join(stale))


def again_rows(name: str, work: Path) -> Iterator[Row]:
    """A kept result, run from what it holds; states of an earlier commit need not be those of today."""
    kept, again = unpacked(name, work / "kept"), work / "again" / name
    own = ("form", str(kept / "case.toml")) if (kept / "case.toml").exists() else ("popup", str(kept), *STAGES)
    code = quiet([*own, "--out", str(again), "--only", "csv", "--force"])
    yield Row(f"{name}, from its result", "not run again", float(code not in FOUND), 0)
    if code in FOUND and name in JOBS:
        found = compared(name, kept, again)  # whose records say that its rod is given, not chosen
        yield same_row(f"{name}, from its result", [each for each in found if each.path.startswith(f"{name}.states.")])


def export_rows(name: str, work: Path) -> Iterator[Row]:
    """A kept result, and every kind of file made from it."""
    kept, exported = unpacked(name, work / "kept"), work / "exported" / name
    code = quiet(["export", str(kept), "--only", KINDS, "--out", str(exported), "--force"])
    yield Row(f"{name}, from its result", "exit code of export", code, 0)
    missing = [suffix for suffix in SUFFIXES if not any(exported.rglob(f"*{suffix}"))]
    yield Row(f"{name}, from its result", "kinds of files not exported", len(missing), 0, note=" ".join(missing))


def misuse_rows(work: Path) -> Iterator[Row]:
    """What users get wrong, at each door."""
    folder = work / "misuse"
    folder.mkdir(parents=True, exist_ok=True)
    for misuse in MISUSES:
        for door, fault in (
            ("Python", python_fault(misuse)),
            ("case file", case_fault(misuse, folder)),
            ("option", option_fault(misuse, folder)),
        ):
            yield Row(misuse.what, f"not refused in one sentence, {door}", float(bool(fault)), 0, note=fault)


def tree_rows() -> Iterator[Row]:
    """What a reader of the source stumbles over, and where a new kind would have to be added; its lengths by room are
    printed by `make house`."""
    source = house_figures.read_tree(house_figures.SOURCE)
    arrays = {"definitions of array types outside arrays": house_figures.array_aliases(source)}
    for what, found in {**house_figures.targets(source), **arrays}.items():
        yield Row("source tree", what, len(found), 0, note="; ".join(found))
    for kind, name in NAMED.items():
        found = house_figures.files_naming(source, name)
        yield Row(f"a new {kind}", f"files that name {name}", len(found), 2, note=", ".join(found))


def all_rows(work: Path) -> Iterator[Row]:
    yield from result_rows(JOBS, work)
    for name in (*JOBS, *EARLIER):
        yield from again_rows(name, work)
        yield from export_rows(name, work)
    yield from misuse_rows(work)
    yield from tree_rows()


def main() -> int:
    with tempfile.TemporaryDirectory() as folder:
        return print_table("house", all_rows(Path(folder)))


if __name__ == "__main__":
    sys.exit(main())

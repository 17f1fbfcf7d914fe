"""Ten small jobs whose results are kept, each in kept/NAME.zip: what is computed stays as it is meanwhile.

    python -m tests.acceptance.kept [NAME...]

makes them again with the program at hand: after a change on purpose, which `CHANGED_ON_PURPOSE` names until then. An
archive is that of a result folder (case.toml, result.json, states.npz), and a job is run as a user runs it.
"""

import json
import os
import shutil
import sys
import tempfile
from collections.abc import Iterator
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import replace
from fnmatch import fnmatchcase
from functools import cache
from importlib.metadata import version
from io import StringIO
from pathlib import Path
from zipfile import ZIP_DEFLATED, ZipFile

import numpy as np
from threadpoolctl import threadpool_info

from rodshell.cli import main as command
from rodshell.kernels import description
from tests.acceptance.same_results import ELSEWHERE, HERE, SOLVED_ANEW, Difference, Tolerances, differences

ROOT = Path(__file__).parents[2]
KEPT = Path(__file__).with_name("kept")
PLACES = {"data": ROOT / "examples" / "data", "kept": KEPT}
MACHINE = KEPT / "machine.json"  # on which the archives were made
FILES = ("case.toml", "result.json", "states.npz")
EARLIER = ("1e8fd146", "c7aa8f6", "2affb956", "b5d202ba")
"""Commits whose result of the patched hemisphere is kept in kept/earlier: the format as gridshell-result, version 1
with `own_ends`, the first of version 2, and the last without findings."""
FOUND = (0, 4)  # exit codes: built or not, that is not the question here
GFRP = ("--rod.section.kind", "tube", "--rod.section.radius", "8 mm", "--rod.section.thickness", "2.5 mm",
        "--rod.material.preset", "gfrp")  # fmt: skip
CABLES = ("--bracing.kind", "cables", "--bracing.section.kind", "circle", "--bracing.section.radius", "2 mm",
          "--bracing.material.preset", "spring-steel", "--bracing.prestrain", "0.001")  # fmt: skip
LATH = ("--rod.section.kind", "rectangle", "--rod.section.width", "1 mm", "--rod.section.height", "3 mm",
        "--joint.kind", "pin", "--joint.eccentricity", "1 mm", "--checks.strength", "20 kPa")  # fmt: skip
BUMPS = "2.2*exp(-((x - 2.2)^2 + y^2)/4.5) + 1.8*exp(-((x + 2.2)^2 + y^2)/4.5)"
SMALL = ("--rods", "auto", "--length", "auto", "--spacing", "0.06", "--edge", "0.03")
STOCK = ("--fabrication.stock_length", "6 m", "--fabrication.kerf", "3 mm", "--fabrication.end_allowance", "0.1 m")
JOBS: dict[str, tuple[str, ...]] = {
    "hemisphere": ("form", "hemisphere", *SMALL),
    "ellipsoid": ("form", "ellipsoid", "--rotate", "45 deg", *SMALL),
    "bumps": ("form", "heightfield", "--formula", BUMPS, "--target.radius", "5", "--spacing", "1.5", "--edge", "0.75",
              *GFRP, "--loads", "{kept}/loads.toml", *CABLES, "--pop_up.ends", "pinned"),
    "freeform": ("form", "{data}/freeform.obj", "--unit", "mm", "--spacing", "1.6", "--edge", "0.8", *STOCK),
    "oculus": ("form", "{data}/tent.obj", "--unit", "mm", "--spacing", "1.2", "--edge", "0.6", "--anchor", "0,0"),
    "patches": ("form", "hemisphere", "--seams.lines", "-1,-1; 1,1", *SMALL),
    "laths": ("form", "hemisphere", *LATH, *SMALL),
    "gravity": ("form", "hemisphere", "--method", "gravity", *SMALL),
    "table": ("popup", "{kept}/rods.csv"),  # the ellipsoid's schedule
    "fall": ("form", "hemisphere", "--method", "paper", "--spacing", "0.07", "--rods", "5x5", "--edge", "0.035"),
}  # fmt: skip
STAGES = ("--checks.stages", "2")
SYMMETRIC = JOBS.keys() - {"freeform", "oculus"}  # whose shells have mirror images

_NEW, _AS_ONE = "a new key", "all patches are one shell, carry their weight on one path, and are searched together"
_TRADE = "offers name a section as the trade does"
_OFFERS = "every finding that options can mend has offers"
_CELLS = "nodes take exact cells of the target, and their loads with them"
CHANGED_ON_PURPOSE: dict[str, str] = {
    "*.flat_state": _NEW,
    "bumps.loads.*.bracing_unloaded": _NEW,
    "bumps.states.acting_*": _NEW,
    "bumps.fabrication.cable_*": _NEW,
    "*.layout.kind": _NEW,
    "*.case.refine.offer": "the key is gone",
    "*.states.target_*": "the whole target is shown",
    "freeform.rods[[]*[]].splice_*": _NEW,
    "freeform.fabrication.stock.fewest": "a bound by what can be cut from bars, not by the total length",
    "table.rods[[]*[]].offset": "a rod of a table has no offset",
    "*.snow": _NEW,
    "*.verdict.unloaded": _NEW,
    "*.verdict.findings*.offers*": _OFFERS,
    "freeform.verdict.reasons*": _TRADE,
    "bumps.ends_in_the_air.*": _CELLS,
    "bumps.loads.*": _CELLS,
    "bumps.states.loaded_*": _CELLS,
    "bumps.verdict.*": _CELLS,
    "patches": "all patches are popped up as one shell",
    "patches.other_shapes.*": _AS_ONE,
    "patches.self_weight.*": _AS_ONE,
    "patches.verdict.findings*.figure": _AS_ONE,
}
"""What differs from the archives on purpose, and why.

Keys are "JOB.path.of.a.field", in which * stands for anything, such as "*.joint_loads.*.moment" (arrays are
"JOB.states.NAME"); or "JOB" alone: its equations are solved in another way, so that states agree to 1e-9 of the size
and counts of iterations may differ. An entry that nothing needs is a miss.
"""


def run(name: str, out: Path) -> int:
    """The exit code of job `name`, whose result is written into `out`."""
    arguments = [argument.format(**PLACES) for argument in JOBS[name]]
    return quiet([*arguments, *STAGES, "--out", str(out), "--only", "csv", "--force"])


def quiet(arguments: list[str]) -> int:
    """The exit code of a command, of which only a refusal is printed."""
    said = StringIO()
    with redirect_stdout(StringIO()), redirect_stderr(said):
        code = command([*arguments, "--quiet"])
    if code not in FOUND:
        print(said.getvalue()[-400:], file=sys.stderr)
    return code


def unpacked(name: str, folder: Path) -> Path:
    """The kept result of a job, as a folder in `folder`."""
    shutil.unpack_archive(KEPT / ("earlier" if name in EARLIER else "") / f"{name}.zip", folder / name)
    for argument in JOBS.get(name, ()):
        if argument.startswith("{data}"):  # what the case names
            (folder / name / "inputs").mkdir(exist_ok=True)
            shutil.copy(argument.format(**PLACES), folder / name / "inputs")
    return folder / name


@cache
def machine() -> dict[str, object]:
    """All that decides how numbers are rounded here: instructions, and who uses them."""
    features = np._core._multiarray_umath.__cpu_features__  # type: ignore[attr-defined]  # as numpy.show_runtime does
    return {
        "kernels": description(),
        "blas": sorted({str(pool.get("architecture")) for pool in threadpool_info()}),
        "instructions": sorted(name for name, there in features.items() if there),
        "versions": {name: version(name) for name in ("numpy", "scipy", "numba", "llvmlite")},
    }


def tolerances(name: str) -> Tolerances:
    """Within which the kept result of a job is found again on this machine."""
    if machine() != json.loads(MACHINE.read_text()):
        return ELSEWHERE
    return SOLVED_ANEW if name in CHANGED_ON_PURPOSE else HERE


def compared(name: str, kept: Path, found: Path) -> list[Difference]:
    """All that a result has otherwise than the kept one, without what may depend on round-off."""
    symmetric = name in SYMMETRIC
    return [
        replace(each, path=f"{name}{each.path}")
        for each in differences(kept, found, tolerances(name), symmetric=symmetric)
    ]


def unexpected(found: list[Difference]) -> list[Difference]:
    """Those of them that `CHANGED_ON_PURPOSE` does not name."""
    return [each for each in found if not any(fnmatchcase(each.path, key) for key in CHANGED_ON_PURPOSE)]


def unneeded(found: list[Difference]) -> Iterator[str]:
    """Entries of `CHANGED_ON_PURPOSE` on fields that are as they were, of the differences of all jobs."""
    for key in CHANGED_ON_PURPOSE.keys() - JOBS.keys():
        if not any(fnmatchcase(each.path, key) for each in found):
            yield key


def keep(name: str) -> None:
    """Run a job and keep its result."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder, name)
        if run(name, out) not in FOUND:
            raise SystemExit(f"no result of {name}")
        with ZipFile(KEPT / f"{name}.zip", "w", ZIP_DEFLATED) as archive:
            for file in FILES:
                if (out / file).exists():
                    archive.write(out / file, file)
    print(f"{name}: {os.path.getsize(KEPT / f'{name}.zip') / 1e3:.0f} kB")


if __name__ == "__main__":
    for chosen in sys.argv[1:] or JOBS:
        keep(chosen)
    MACHINE.write_text(json.dumps(machine(), indent=1) + "\n")

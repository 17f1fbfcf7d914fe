"""Time of a whole `gridshell form hemisphere` process against the bare imports that it cannot do without.

`python benchmarks/startup.py` measures this environment; `fresh=True` installs the checkout into a new one first.
"""

import json
import subprocess
import sys
import tempfile
import time
import venv
from pathlib import Path
from statistics import median

RUNS = 5
QUICK = (
    "--only",
    "csv,svg,obj,report",
    "--checks.stages",
    "0",
)  # what a designer looks at first; the rest takes longer
ROOT = Path(__file__).parent.parent
SOLVE = """
import json, time
from gridshell.case import load_case
from gridshell.form import find_form
target, layout, rod, options = load_case("hemisphere").build()
start = time.perf_counter()
find_form(target, layout, rod, **options)
print(json.dumps(time.perf_counter() - start))
"""


def startup_ratio(*, fresh: bool) -> tuple[float, float, float]:
    """Median seconds of the whole process, of the bare imports, and of the solve alone within a process."""
    with tempfile.TemporaryDirectory() as folder:
        scripts = Path(sys.executable).parent
        if fresh:
            venv.create(Path(folder) / "venv", with_pip=True)
            scripts = Path(folder) / "venv" / "bin"
            subprocess.run([scripts / "pip", "install", "--quiet", str(ROOT)], check=True)
        whole = [str(scripts / "gridshell"), "form", "hemisphere", "--quiet", "--out", f"{folder}/out", *QUICK]
        bare = [str(scripts / "python"), "-c", "import numpy, scipy.sparse, numba"]
        solve = [str(scripts / "python"), "-c", SOLVE]
        _seconds(whole, folder)  # compiles the kernels, once
        _seconds(bare, folder)
        runs = [
            (_seconds(whole, folder), _seconds(bare, folder), json.loads(_output(solve, folder))) for _ in range(RUNS)
        ]
    columns = list(zip(*runs, strict=True))
    return median(columns[0]), median(columns[1]), median(columns[2])


def _seconds(command: list[str], folder: str) -> float:
    start = time.perf_counter()
    _output(command, folder)
    return time.perf_counter() - start


def _output(command: list[str], folder: str) -> str:
    return subprocess.run(command, check=True, cwd=folder, capture_output=True, text=True).stdout


if __name__ == "__main__":
    whole, bare, solve = startup_ratio(fresh="--fresh" in sys.argv)
    print(f"whole process {whole:.2f} s, bare imports {bare:.2f} s, solve {solve:.2f} s")
    print(f"(whole - solve) / bare imports = {(whole - solve) / bare:.2f}")

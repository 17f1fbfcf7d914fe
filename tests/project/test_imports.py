"""What is not needed is not imported: a command starts as fast as what it does."""

import subprocess
import sys
from pathlib import Path

import pytest

OF_FILES = ("ezdxf", "reportlab", "PIL", "jinja2", "trimesh", "rhino3dm", "OCP", "pymoo")
FORM = "from rodshell.cli import main; main(['form', 'cap', '--only', 'csv', '--checks.stages', '0', '--quiet'])"


def imported(code: str, folder: Path) -> set[str]:
    """The names of all modules that a new process has after some code."""
    script = f"import sys\n{code}\nprint(*sys.modules, file=sys.stderr)"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True, cwd=folder)
    return set(done.stderr.splitlines()[-1].split())


def packages(modules: set[str]) -> set[str]:
    return {name.partition(".")[0] for name in modules}


def test_the_package_alone_imports_nothing(tmp_path: Path) -> None:
    assert not packages(imported("import rodshell", tmp_path)) & {
        "numpy", "scipy", "numba", "pydantic", "click", *OF_FILES
    }  # fmt: skip


@pytest.mark.slow
def test_a_form_imports_no_library_of_files_that_it_does_not_write(tmp_path: Path) -> None:
    modules = imported(FORM, tmp_path)
    assert (tmp_path / "out" / "cap" / "schedule" / "rods.csv").is_file()
    assert not packages(modules) & {*OF_FILES}


@pytest.mark.slow
def test_drawings_and_the_report_import_no_writer_of_dxf_and_no_network(tmp_path: Path) -> None:
    modules = imported(FORM.replace("csv", "svg,report"), tmp_path)
    assert (tmp_path / "out" / "cap" / "report.html").is_file()
    assert not modules & {"ezdxf", "urllib.request"}

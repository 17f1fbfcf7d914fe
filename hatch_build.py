"""How a wheel is built: with compiled kernels where there is a C compiler, else with Numba among its requirements.

RODSHELL_KERNELS=jit builds without kernels, RODSHELL_KERNELS=compiled fails where they cannot be compiled;
RODSHELL_LEVELS="x86-64-v3 generic" names the levels of the processor that are compiled for, by default that of this
machine alone. An editable installation compiles its kernels by Numba, as its sources change.
"""

import os
import shutil
import sys
import sysconfig
import tempfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface
from hatchling.metadata.plugin.interface import MetadataHookInterface

NUMBA = "numba>=0.61.2"
BUILDER = ["numba==0.68.1", "setuptools>=70", "numpy>=2.2", "scipy>=1.14", "qdldl>=0.1.7.post5"]
CHOSEN = os.environ.get("RODSHELL_KERNELS", "")


def compilable() -> bool:
    """Whether kernels are to be compiled, and there is what that takes."""
    if CHOSEN == "jit":
        return False
    command = os.environ.get("CC") or sysconfig.get_config_var("CC") or ("cl" if os.name == "nt" else "cc")
    header = Path(sysconfig.get_paths()["include"]) / "Python.h"
    return CHOSEN == "compiled" or (shutil.which(command.split()[0]) is not None and header.exists())


class Requirements(MetadataHookInterface):
    """Numba is required where kernels are not compiled."""

    def update(self, metadata: dict[str, Any]) -> None:
        metadata["dependencies"] = [*self.config["dependencies"], *([] if compilable() else [NUMBA])]


class Kernels(BuildHookInterface[Any]):
    """Compiled kernels in a wheel for this platform."""

    def dependencies(self) -> list[str]:
        return BUILDER if self.target_name == "wheel" and compilable() else []

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        if self.target_name != "wheel" or not compilable():
            return
        if version == "editable":
            build_data["dependencies"].append(NUMBA)
            return
        sys.path.insert(0, self.root)
        from compile_kernels import compile_kernels, level_here

        self._folder = tempfile.TemporaryDirectory()
        levels = os.environ.get("RODSHELL_LEVELS", "").split() or [level_here()]
        try:
            libraries = compile_kernels(Path(self._folder.name), levels)
        except RuntimeError as error:
            if CHOSEN == "compiled":
                raise
            self.app.display_warning(f"kernels could not be compiled: Numba will compile them. {error}")
            build_data["dependencies"].append(NUMBA)
            return
        build_data["force_include"] |= {str(path): f"rodshell/kernels/{path.name}" for path in libraries}
        build_data["pure_python"], build_data["infer_tag"] = False, True

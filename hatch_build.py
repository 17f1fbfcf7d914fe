"""How a wheel is built: with Numba among its requirements, which compiles the kernels when they are first called; or,
by RODSHELL_KERNELS=compiled, with kernels that are compiled now, by Numba and a C compiler, and without Numba.

RODSHELL_LEVELS="x86-64-v3 generic" names the levels of the processor that are compiled for, by default that of this
machine alone. An editable installation compiles its kernels by Numba, as its sources change.
"""

import os
import sys
import tempfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface
from hatchling.metadata.plugin.interface import MetadataHookInterface

NUMBA = "numba>=0.61.2,<0.69"  # up to the last minor version with which `kernels/jit.py` was tried
BUILDER = ["numba==0.68.1", "setuptools>=70", "numpy>=2.2", "scipy>=1.14", "threadpoolctl>=3.8"]
COMPILED = os.environ.get("RODSHELL_KERNELS") == "compiled"


class Requirements(MetadataHookInterface):
    """Numba is required where kernels are not compiled."""

    def update(self, metadata: dict[str, Any]) -> None:
        metadata["dependencies"] = [*self.config["dependencies"], *([] if COMPILED else [NUMBA])]


class Kernels(BuildHookInterface[Any]):
    """Compiled kernels in a wheel for this platform."""

    def dependencies(self) -> list[str]:
        return BUILDER if self.target_name == "wheel" and COMPILED else []

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        if self.target_name != "wheel" or not COMPILED:
            return
        if version == "editable":
            build_data["dependencies"].append(NUMBA)
            return
        sys.path.insert(0, self.root)
        from compile_kernels import compile_kernels, level_here

        self._folder = tempfile.TemporaryDirectory()
        levels = os.environ.get("RODSHELL_LEVELS", "").split() or [level_here()]
        libraries = compile_kernels(Path(self._folder.name), levels)
        build_data["force_include"] |= {str(path): f"rodshell/kernels/{path.name}" for path in libraries}
        build_data["pure_python"], build_data["infer_tag"] = False, True

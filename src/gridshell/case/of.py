"""The case file of objects that were made in Python."""

from typing import Any

from gridshell.case.schema import Case
from gridshell.layout import GridLayout
from gridshell.rods.section import Rod, Tube
from gridshell.targets import Target


def case_text(
    target: Target, layout: GridLayout, rod: Rod, *, method: str, anchor: tuple[float, float] | None, gravity: float
) -> str:
    """A case file that gives these objects again; of a target that is a Python function, a note that says so."""
    shape = target.parameters()
    if "function" in shape:
        return f"# the target was the Python function {shape['function']}: no case file can give it again\n"
    section: dict[str, Any] = {"kind": "circle", "radius": rod.section.radius}
    if isinstance(rod.section, Tube):
        section = {"kind": "tube", "radius": rod.section.radius, "thickness": rod.section.thickness}
    material = rod.material
    drape: dict[str, Any] = {"method": method, "gravity": gravity}
    if anchor is not None:
        drape["anchor"] = anchor
    case = Case.model_validate(
        {
            "target": shape,
            "layout": {
                "rods": layout.rods,
                "spacing": layout.spacing,
                "length": layout.length,
                "edge": layout.edge,
                "rotate": layout.rotate,
                "offset": layout.offset,
            },
            "rod": {
                "section": section,
                "material": {
                    "youngs_modulus": material.youngs_modulus,
                    "poisson_ratio": material.poisson_ratio,
                    "density": material.density,
                },
            },
            "drape": drape,
        }
    )
    return case.to_toml()

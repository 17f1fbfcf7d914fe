"""Options of checks, fabrication and drawings: all that does not decide the form."""

import datetime
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

from rodshell.checks.bending import VON_MISES, require_known_stress
from rodshell.checks.check import MOST_STAGES
from rodshell.errors import InputError
from rodshell.fabrication.settings import Fabrication
from rodshell.joints import Joint
from rodshell.loads.strength import Limits
from rodshell.output.drawing import FORBIDDEN, LAYERS
from rodshell.rods.section import Rod
from rodshell.units import shown
from rodshell.validation import choice, instance, keep, listed, positive, whole

if TYPE_CHECKING:
    from rodshell.loads.settings import Strength

PAPERS = {"A4": (297.0, 210.0), "A3": (420.0, 297.0), "A2": (594.0, 420.0), "A1": (841.0, 594.0), "A0": (1189.0, 841.0)}


@dataclass(frozen=True)
class DrawingStyle:
    """What the drawings of a set have in common.

    Parameters
    ----------
    paper : of the PDF's sheets, landscape: A4 to A0.
    tolerance : of lengths [m], by which they are also rounded (see `wording.rounding_of`); None:
        the title block says that it is not given.
    layers : for some of the layers (CUT, MARK, LABEL, BOUNDARY-FLAT, BOUNDARY-FINAL, DIM, TITLE) another name.
    name : of the drawings; "": the target's. author : for the title block.
    date : for the title block, "2026-11-22"; "": the day on which the drawings are written.
    """

    paper: str = "A3"
    project: str = ""
    revision: str = ""
    tolerance: float | None = None
    layers: Mapping[str, str] = field(default_factory=dict)
    name: str = ""
    author: str = ""
    date: str = ""

    def __post_init__(self) -> None:
        for key in ("paper", "project", "revision", "name", "author", "date"):
            instance(f"the {key} of drawings", getattr(self, key), str, "text")
        if self.paper not in PAPERS:
            raise InputError(f"unknown paper size {shown(self.paper)}: use {', '.join(PAPERS)}")
        keep(self, positive, "m", "tolerance", what="the {} of drawings")
        try:
            datetime.date.fromisoformat(self.date or "2000-01-01")
        except ValueError:
            raise InputError(
                f'the date of drawings cannot be {shown(self.date)}: write a day as "2026-11-22"'
            ) from None
        instance("the layers of drawings", self.layers, Mapping, "a mapping from layers to their new names")
        if self.layers:
            _require_names(self.layers)

    def parameters(self) -> dict[str, Any]:
        """As it is kept in a result."""
        return {**vars(self), "layers": dict(self.layers)}


def _require_names(layers: Mapping[str, str]) -> None:
    """Refuse new names of layers that a DXF file cannot have."""
    for layer, name in layers.items():
        if layer not in LAYERS:
            raise InputError(f'there is no layer "{layer}" to rename: there are {", ".join(LAYERS)}')
        instance(f"the name of layer {layer}", name, str, "text")
        if not name.strip() or any(letter in FORBIDDEN or not letter.isprintable() for letter in name):
            raise InputError(f'a layer cannot be called "{name}": a name has none of {FORBIDDEN}')
    shown = [layers.get(layer, layer).upper() for layer in LAYERS]
    if len(set(shown)) < len(shown):
        twice = next(name for name in shown if shown.count(name) > 1)
        raise InputError(f'two layers would be called "{twice}": give each its own name')


@dataclass(frozen=True)
class OutputOptions:
    """What is checked, made and drawn.

    Parameters
    ----------
    strength : of the rods' material [Pa], by which utilisation is counted; None: it is not counted.
    stages : equilibria of the deployment from flat; 0: it is not followed.
    rod_chosen : which of the rod's "material" and "section" the program chose to fit the target.
    shear_strength : of the rods' material [Pa], in addition to `strength`; None: in the proportion of a preset, or
        stress is counted by von Mises.
    strength_of : the preset material that the strengths are of, where they were not given.
    """

    strength: float | None = None
    stages: int = 8
    fabrication: Fabrication = field(default_factory=Fabrication)
    drawings: DrawingStyle = field(default_factory=DrawingStyle)
    rod_chosen: tuple[str, ...] = ()
    shear_strength: float | None = None
    strength_of: str | None = None

    def __post_init__(self) -> None:
        keep(self, positive, "Pa", "strength", what="the {}")
        keep(self, positive, "Pa", "shear_strength", what="the shear strength")
        if self.shear_strength is not None and self.strength is None:
            raise InputError(
                f"a shear strength of {self.shear_strength:g} Pa does not say what bending may be: "
                "give the strength too (checks.strength), or leave it out"
            )
        object.__setattr__(self, "stages", whole("stages", self.stages, 0, MOST_STAGES))
        instance("fabrication", self.fabrication, Fabrication)
        instance("drawings", self.drawings, DrawingStyle)
        chosen = listed("rod_chosen", self.rod_chosen, 'parts of a rod such as ("section",)')
        for part in chosen:
            choice("each of rod_chosen", part, ("material", "section"))
        object.__setattr__(self, "rod_chosen", chosen)
        if self.strength_of is not None:
            instance("strength_of", self.strength_of, str, "the name of a material")

    @property
    def shear_weight(self) -> float:
        """Strength over shear strength; that of von Mises where no shear strength is given."""
        if self.strength is None or self.shear_strength is None:
            return VON_MISES
        return self.strength / self.shear_strength

    def judged_by(self, rod: Rod) -> "OutputOptions":
        """The same with the strengths of the rod's preset material, where none was given.

        A strength that is given alone, such as a reduced one, has a shear strength in the preset's proportion.

        Parameters
        ----------
        rod : section and material of every rod.
        """
        material = rod.material
        if material is None or material.bending_strength is None:
            return self
        if self.strength is not None:
            if self.shear_strength is not None or material.shear_strength is None:
                return self
            return replace(self, shear_strength=self.strength * material.shear_strength / material.bending_strength)
        return replace(
            self,
            strength=material.bending_strength,
            shear_strength=material.shear_strength,
            strength_of=material.name,
        )

    def limits(self, rod: Rod, asked: "Strength") -> "Limits":
        """What rods are judged by, with loads and without.

        Parameters
        ----------
        rod : section and material of every rod.
        asked : what was given for it.

        Raises
        ------
        InputError : a service class is given, and nothing depends on it.
        """
        judged_by = self.judged_by(rod)
        return Limits.of(
            rod, asked,
            characteristic=judged_by.strength, of_preset=self.strength is None, shear_weight=judged_by.shear_weight,
        )  # fmt: skip

    def require_known_stress(self, rod: Rod, joint: Joint) -> None:
        """InputError where a strength is given and the stress that it stands against cannot be known.

        Parameters
        ----------
        rod : section and material of every rod.
        """
        if self.strength is not None:
            require_known_stress(rod, twisted=joint.turns_frames or len(set(rod.bend_stiffnesses)) > 1)

    def parameters(self) -> dict[str, dict[str, Any]]:
        """As it stands in a case file."""
        layers = {name.lower().replace("-", "_"): shown for name, shown in self.drawings.layers.items()}
        return {
            "checks": {"strength": self.strength, "stages": self.stages, "shear_strength": self.shear_strength},
            "fabrication": dict(vars(self.fabrication)),
            "drawings": self.drawings.parameters() | {"layers": layers},
        }

"""What is checked, and what the drawings of a set have in common: what a user gives for them."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal

from rodshell.errors import InputError
from rodshell.output.drawing import FORBIDDEN, LAYERS
from rodshell.quantities import IsoDate, Length, Stages, Stress
from rodshell.schema import checked
from rodshell.units import shown
from rodshell.validation import instance

PAPERS = {"A4": (297.0, 210.0), "A3": (420.0, 297.0), "A2": (594.0, 420.0), "A1": (841.0, 594.0), "A0": (1189.0, 841.0)}


@dataclass(frozen=True)
class CheckOptions:
    """What is checked, and by which strength of the material."""

    strength: Annotated[Stress | None, "design strength in bending; default: a preset's by its code"] = None
    stages: Annotated[Stages, "equilibria of the deployment from flat; 0: it is not computed"] = 8
    shear_strength: Annotated[
        Stress | None, "shear strength along the fibres; default: a preset's, or von Mises"
    ] = field(default=None, kw_only=True)  # fmt: skip

    def __post_init__(self) -> None:
        checked(self, {"strength": "the strength", "shear_strength": "the shear strength"})
        if self.shear_strength is not None and self.strength is None:
            raise InputError(
                f"a shear strength of {self.shear_strength:g} Pa does not say what bending may be: "
                "give the strength too (checks.strength), or leave it out"
            )


@dataclass(frozen=True, kw_only=True)
class Layers:
    """Other names for the layers of DXF files."""

    cut: Annotated[str | None, "name of the DXF layer CUT"] = None
    mark: Annotated[str | None, "name of the DXF layer MARK"] = None
    label: Annotated[str | None, "name of the DXF layer LABEL"] = None
    boundary_flat: Annotated[str | None, "name of the DXF layer BOUNDARY-FLAT"] = None
    boundary_final: Annotated[str | None, "name of the DXF layer BOUNDARY-FINAL"] = None
    dim: Annotated[str | None, "name of the DXF layer DIM"] = None
    title: Annotated[str | None, "name of the DXF layer TITLE"] = None

    def __post_init__(self) -> None:
        for layer, name in self.renamed.items():
            instance(f"the name of layer {layer}", name, str, "text")
            if not name.strip() or any(letter in FORBIDDEN or not letter.isprintable() for letter in name):
                raise InputError(f'a layer cannot be called "{name}": a name has none of {FORBIDDEN}')
        names = [self.renamed.get(layer, layer).upper() for layer in LAYERS]
        if twice := next((name for name in names if names.count(name) > 1), ""):
            raise InputError(f'two layers would be called "{twice}": give each its own name')

    @staticmethod
    def of(renamed: "Layers | Mapping[str, str]") -> "Layers":
        """The names of a mapping, {"CUT": "LASER"}."""
        if isinstance(renamed, Layers):
            return renamed
        instance("the layers of drawings", renamed, Mapping, "a mapping from layers to their new names")
        for layer in renamed:
            if layer not in LAYERS:
                raise InputError(f'there is no layer "{layer}" to rename: there are {", ".join(LAYERS)}')
        return Layers(**{layer.lower().replace("-", "_"): name for layer, name in renamed.items()})

    @property
    def renamed(self) -> dict[str, str]:
        """The new names by layer."""
        return {layer.upper().replace("_", "-"): name for layer, name in vars(self).items() if name is not None}


@dataclass(frozen=True)
class DrawingStyle:
    """What the drawings of a set have in common, and which kinds of files a job writes beyond the usual ones.

    Args:
        tolerance: of lengths [m], by which they are also rounded (see `wording.rounding_of`); None:
            the title block says that it is not given.
        layers: for some of the layers (CUT, MARK, LABEL, BOUNDARY-FLAT, BOUNDARY-FINAL, DIM, TITLE) another name; a
            mapping becomes `Layers`.
    """

    paper: Annotated[Literal["A4", "A3", "A2", "A1", "A0"], "size of the PDF's sheets, landscape"] = "A3"
    project: Annotated[str, "project, for the title block"] = ""
    revision: Annotated[str, "revision, for the title block"] = ""
    tolerance: Annotated[Length | None, "tolerance of lengths, which are shown to a tenth of it or finer"] = None
    layers: Layers | Mapping[str, str] = field(default_factory=Layers)
    name: Annotated[str, "title of the drawings; default: the target's name"] = ""
    author: Annotated[str, "who drew them or is responsible for them, for the title block"] = ""
    date: Annotated[IsoDate, 'date for the title block, such as "2026-11-22"; default: today'] = ""
    files: Annotated[str, 'files beyond those written by default, such as "pdf, obj", or "all"'] = ""

    def __post_init__(self) -> None:
        for key in ("paper", "project", "revision", "name", "author", "date", "files"):
            instance(f"the {key} of drawings", getattr(self, key), str, "text")
        if self.paper not in PAPERS:
            raise InputError(f"unknown paper size {shown(self.paper)}: use {', '.join(PAPERS)}")
        object.__setattr__(self, "layers", Layers.of(self.layers))
        checked(self, "the {} of drawings")

    def parameters(self) -> dict[str, Any]:
        """As it is kept in a result."""
        kept = {key: value for key, value in vars(self).items() if key != "files"}
        return {**kept, "layers": Layers.of(self.layers).renamed}

"""Options of checks, fabrication and drawings: all that does not decide the form."""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from rodshell.checks.bending import require_known_stress
from rodshell.fabrication.settings import Fabrication
from rodshell.joints import Joint
from rodshell.loads.strength import Limits
from rodshell.output.settings import CheckOptions, DrawingStyle
from rodshell.rods.section import Rod
from rodshell.validation import choice, instance, listed

if TYPE_CHECKING:
    from rodshell.loads.settings import Strength


@dataclass(frozen=True)
class OutputOptions(CheckOptions):
    """What is checked, made and drawn.

    Args:
        rod_chosen: which of the rod's "material" and "section" the program chose to fit the target.
    """

    fabrication: Fabrication = field(default_factory=Fabrication)
    drawings: DrawingStyle = field(default_factory=DrawingStyle)
    rod_chosen: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        super().__post_init__()
        instance("fabrication", self.fabrication, Fabrication)
        instance("drawings", self.drawings, DrawingStyle)
        if self.drawings.files:
            from rodshell.output.files import wanted_kinds  # here, as it needs the modules of all files

            wanted_kinds(None, self.drawings.files)
        chosen = listed("rod_chosen", self.rod_chosen, 'parts of a rod such as ("section",)')
        for part in chosen:
            choice("each of rod_chosen", part, ("material", "section"))
        object.__setattr__(self, "rod_chosen", chosen)

    def limits(self, rod: Rod, asked: "Strength") -> "Limits":
        """What rods are judged by, with loads and without.

        Raises:
            InputError: a service class is given, and nothing depends on it.
        """
        return Limits.of(rod, asked, given=self.strength, shear_given=self.shear_strength)

    def require_known_stress(self, rod: Rod, joint: Joint) -> None:
        """InputError where a strength is given and the stress that it stands against cannot be known."""
        if self.strength is not None:
            require_known_stress(rod, twisted=joint.turns_frames or len(set(rod.bend_stiffnesses)) > 1)

    @property
    def tables(self) -> dict[str, Any]:
        """As they stand in a case."""
        checks = CheckOptions(self.strength, self.stages, shear_strength=self.shear_strength)
        return {"checks": checks, "fabrication": self.fabrication, "drawings": self.drawings}

"""The table of rods, whose section or material may be left to the target."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

from rodshell.case.held import Holding
from rodshell.errors import InputError
from rodshell.quantities import Length, LengthOrAuto
from rodshell.rods.materials import Material
from rodshell.rods.section import IN_WORDS, SECTION_HELP, Circle, GivenSection, Rod, Section, Sized, Tube
from rodshell.schema import Twice

if TYPE_CHECKING:
    from rodshell.checks.sizing import Fit
_UNSIZED = 1.0  # m, in place of a radius that is still to be found


@dataclass(frozen=True)
class AutoSection:
    """A section that is chosen to fit its target."""

    kind: ClassVar = "auto"
    radius: ClassVar = "auto"


@dataclass(frozen=True, kw_only=True)
class OpenCircle:
    """A circle whose radius may be left to the target."""

    kind: ClassVar = "circle"
    radius: Annotated[
        LengthOrAuto, Twice("diameter"), 'radius (of a tube: outer), or "auto": from the bends on the target'
    ] = "auto"  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class OpenTube:
    """A tube whose radius may be left to the target."""

    kind: ClassVar = "tube"
    radius: Annotated[LengthOrAuto, Twice("diameter"), "outer radius"] = "auto"
    thickness: Annotated[Length, "thickness of the tube's wall"]


@dataclass(frozen=True, kw_only=True)
class RodTable(Holding):
    """Section and material; what is left out, or "auto", is chosen to fit the target."""

    section: Annotated[
        AutoSection | OpenCircle | OpenTube | Sized | GivenSection, IN_WORDS, SECTION_HELP
    ] = field(default_factory=AutoSection)  # fmt: skip
    material: Material | None = None

    @classmethod
    def completed(cls, given: Mapping[str, Any], path: str) -> Mapping[str, Any]:
        """As it is, unless there is a material with a section that needs none."""
        section = given.get("section")
        if isinstance(section, dict) and section.get("kind") == "given" and given.get("material"):
            raise InputError(f"{path}.material: a given section says all stiffnesses and masses itself; leave it out")
        return given

    @property
    def left_open(self) -> tuple[str, ...]:
        """Which of "material" and "section" are left to the target."""
        section = self.section
        sized = getattr(section, "radius", None) == "auto"
        material = self.material is None and section.kind != "given"
        return (*(["material"] if material else []), *(["section"] if sized else []))

    @property
    def given_section(self) -> Section | GivenSection | None:
        """The section; None where its size is left to the target."""
        if self.held is not None:
            return self.held.value.section  # type: ignore[no-any-return]
        return None if "section" in self.left_open else self._section

    def build(
        self, fit: "Callable[[], Fit] | None" = None, *, strength: "Callable[[Material], float | None] | None" = None
    ) -> Rod:
        """The rod.

        fit : what material and section have to fit; called where one is left open.
        strength : the permanent one of a material [Pa]; default: a preset's.

        Raises:
            InputError: something is left open, and there is nothing to fit.
        """
        if not self.left_open:
            return Rod(self._section, self.material)
        if fit is None:
            raise InputError("rod: there is no target that material and section could be taken from: give both")
        room = fit()
        material = self.material or Material.preset(room.preset)
        if "section" not in self.left_open:
            return Rod(self._section, material)
        withstood = strength(material) if strength is not None else None
        return Rod(room.section(material, strength=withstood, shape=self.shape), material)

    @property
    def _section(self) -> Section | GivenSection:
        """The section; one whose radius is still to be found has `_UNSIZED`."""
        section = self.section
        if isinstance(section, Sized | GivenSection):
            return section
        radius = _UNSIZED if isinstance(section.radius, str) else section.radius
        return Tube(radius, section.thickness) if isinstance(section, OpenTube) else Circle(radius)

    @property
    def shape(self) -> "Circle | Tube | None":
        """The circle or tube of which only the radius is looked for; None: of any shape that is sold."""
        section = self._section
        round_one = isinstance(section, Circle | Tube) and self.section.kind != "auto"
        return section if round_one else None  # type: ignore[return-value]

"""From characteristic strengths to design strengths: what building codes make of the presets' figures.

A design strength is f_d = k f_k / gamma_M. The factor k depends on how long a load acts and, for timber, on moisture:
the load that acts for the shortest time decides for a combination [EN 1995-1-1:2004, 3.1.3]. Rods of a shell stay bent,
so that the bending of the erected shell is judged by the permanent strength.
"""

from dataclasses import dataclass
from typing import Literal

from rodshell.rods.materials import Material, PresetName

Duration = Literal["permanent", "long", "medium", "short", "instantaneous"]
DURATIONS: tuple[Duration, ...] = ("permanent", "long", "medium", "short", "instantaneous")
_ServiceClass = Literal[1, 2, 3]
_COVERED: _ServiceClass = 2  # where none is given
RESERVED = (
    0.5  # share of a characteristic, short-term strength that rods may use permanently where no factors are known
)


@dataclass(frozen=True, kw_only=True)
class DesignFactors:
    """What a code makes of characteristic strengths.

    Args:
        factors: for each service class, by duration in the order of `DURATIONS`; a single row: it does not matter.
        axial: axial strength over bending strength, of tension and compression the lower.
        cracked: share of the section that carries shear forces in spite of cracks.
        creep: for each service class, how much larger a deflection under permanent loads becomes, k_def; empty:
            unknown.
    """

    factors: tuple[tuple[float, ...], ...]
    partial: float
    axial: float
    cracked: float = 1.0
    creep: tuple[float, ...] = ()
    source: str

    def by_duration(self, service_class: int) -> dict[Duration, float]:
        """Design strength over characteristic strength.

        Args:
            service_class: 1 (inside), 2 (covered) or 3 (in the weather).
        """
        row = self.factors[service_class - 1 if len(self.factors) > 1 else 0]
        return {name: factor / self.partial for name, factor in zip(DURATIONS, row, strict=True)}


_DRY, _WET = (0.6, 0.7, 0.8, 0.9, 1.1), (0.5, 0.55, 0.65, 0.7, 0.9)  # k_mod, EN 1995-1-1 table 3.1
_EC5 = "EN 1995-1-1:2004 (k_mod table 3.1, gamma_M table 2.3, k_def table 3.2, k_cr 6.1.7)"


def _solid(axial: float) -> DesignFactors:
    return DesignFactors(
        factors=(_DRY, _DRY, _WET), partial=1.3, axial=axial, cracked=0.67, creep=(0.6, 0.8, 2.0), source=_EC5
    )


DESIGN: dict[PresetName, DesignFactors] = {
    "larch": _solid(19 / 30),  # EN 338:2016, C30: tension 19, compression 24 MPa
    "spruce": _solid(14.5 / 24),  # C24: 14.5 and 21 MPa
    "oak": _solid(18 / 30),  # D30: 18 and 24 MPa
    "plywood": DesignFactors(
        factors=(_DRY, _DRY, _WET), partial=1.2, axial=0.6, creep=(0.8, 1.0, 2.5),
        source=f"{_EC5}; its axial strength taken as 0.6 of the bending strength, as EN 384 does for softwood",
    ),
    "gfrp": DesignFactors(
        factors=((1.0, 1.0, 1.0, 1.5, 1.5),), partial=3.0, axial=1.0,  # EN 13706-3, E23: tension 240 MPa as bending
        source="a third of the characteristic strength for permanent and half of it for short loads, as at the "
        "cathedral of Creteil (du Peloux, Tayeb, Baverel and Caron, Structural Engineering International 2/2016)",
    ),
    "spring-steel": DesignFactors(
        factors=((1.0,) * 5,), partial=1.0, axial=1.0, creep=(0.0,),
        source="the preset's strength is already that of static springs and is not reduced",
    ),
}  # fmt: skip
"""Of presets for which they could be cited. Bamboo, PETG and rubber have none: give `[strength]` for them."""


def permanent_strength(material: Material, service_class: int | None = None) -> float | None:
    """What a preset withstands permanently [Pa]; without cited factors `RESERVED` of its strength; None: not known.

    Args:
        material: a preset; of other materials nothing is known.
    """
    if material.name is None or material.bending_strength is None:
        return None
    factors = DESIGN.get(material.name)
    share = RESERVED if factors is None else factors.by_duration(service_class or _COVERED)["permanent"]
    return share * material.bending_strength

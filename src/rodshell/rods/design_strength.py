"""From characteristic strengths to design strengths: what building codes make of the presets' figures.

A design strength is f_d = k f_k / gamma_M. The factor k depends on how long a load acts and, for timber, on moisture:
the load that acts for the shortest time decides for a combination [EN 1995-1-1:2004, 3.1.3]. Rods of a shell stay bent,
so that the bending of the erected shell is judged by the permanent strength.

Shallow timber is stronger: k_h raises its strength in bending by its depth, in tension by its width
[EN 1995-1-1, 3.2(3), 3.3(3)]. Where a rectangle bends about both axes, the smaller share counts with k_m [6.1.6(2)]:

    max(s1/k_h1 + k_m s2/k_h2, k_m s1/k_h1 + s2/k_h2) / f_m + s_t/(k_h f_t) + s_c/f_c

s1 and s2 are the stresses of bends towards m1 and m2, s_t and s_c those of tension and of compression [6.2.3; 6.3.2
with k_c = 1, as the paths of loaded shells have buckling in them].
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from rodshell.arrays import Floats
from rodshell.rods.materials import Material, PresetName

Duration = Literal["permanent", "long", "medium", "short", "instantaneous"]
DURATIONS: tuple[Duration, ...] = ("permanent", "long", "medium", "short", "instantaneous")
_ServiceClass = Literal[1, 2, 3]
COVERED: _ServiceClass = 2  # where none is given
RESERVED = (
    0.5  # share of a characteristic, short-term strength that rods may use permanently where no factors are known
)
EC5 = "EN 1995-1-1"


@dataclass(frozen=True, kw_only=True)
class DesignFactors:
    """What a code makes of characteristic strengths.

    Args:
        code: by which all of these are, and the rule above; "": none.
        factors: for each service class, by duration in the order of `DURATIONS`; a single row: it does not matter.
        tension, compression: strength along the rod over bending strength.
        deepest: up to which depth of a rectangle k_h counts [m], to which `power` of this over the depth, and `most`.
        biaxial: k_m of rectangles.
        cracked: share of the section that carries shear forces in spite of cracks.
        modulus: 5 % quantile of Young's modulus over its mean, by which members buckle [EN 1995-1-1, 6.3.2(2)]; 1:
            unknown.
        creep: for each service class, how much larger a deflection under permanent loads becomes, k_def; empty:
            unknown.
    """

    code: str = ""
    factors: tuple[tuple[float, ...], ...]
    partial: float
    tension: float
    compression: float
    deepest: float = 0.0
    power: float = 0.0
    most: float = 1.0
    biaxial: float = 1.0
    cracked: float = 1.0
    modulus: float = 1.0
    creep: tuple[float, ...] = ()
    source: str

    def by_duration(self, service_class: int) -> dict[Duration, float]:
        """Design strength over characteristic strength.

        Args:
            service_class: 1 (inside), 2 (covered) or 3 (in the weather).
        """
        row = self.factors[service_class - 1 if len(self.factors) > 1 else 0]
        return {name: factor / self.partial for name, factor in zip(DURATIONS, row, strict=True)}

    @property
    def stiffness(self) -> float:
        """Young's modulus for stability over its mean: the 5 % quantile, or the mean over gamma_M of a second-order
        analysis [EN 1995-1-1, 2.4.1(2)] where that is lower."""
        return min(self.modulus, 1.0 / self.partial)

    def depth_factor(self, depth: Floats | float) -> Floats:
        """k_h of rectangles, by their depth [m]."""
        return np.clip((self.deepest / np.asarray(depth)) ** self.power, 1.0, self.most)

    def compared(self, bends: Floats, axial: Floats, widths: Floats | None) -> Floats:
        """(k,) the stress that stands against the bending strength of the reference depth [Pa], by the rule above.

        Args:
            bends: (k, 2) stresses of bends towards m1 and m2; of round sections along any axes.
            axial: (k,) stress of the axial force, tension positive.
            widths: (2,) or (k, 2) of a rectangle along m1 and m2 [m]; None: another section, which has no k_h and k_m.
        """
        if widths is None:
            bent, wide = np.hypot(*bends.T), np.ones(1)
        else:
            first, second = (np.abs(bends) / self.depth_factor(widths)).T
            bent = np.maximum(first, second) + self.biaxial * np.minimum(first, second)
            wide = self.depth_factor(np.max(widths, axis=-1))
        drawn = np.where(axial > 0, axial / (self.tension * wide), -axial / self.compression)
        return np.asarray(bent + drawn)


_DRY, _WET = (0.6, 0.7, 0.8, 0.9, 1.1), (0.5, 0.55, 0.65, 0.7, 0.9)  # k_mod, EN 1995-1-1 table 3.1
_CLAUSES = "k_mod table 3.1, gamma_M table 2.3, k_def table 3.2"


def _solid(bending: float, tension: float, compression: float, modulus: float, strengths: str) -> DesignFactors:
    """Of a strength class of solid timber, by its strengths [MPa]."""
    return DesignFactors(
        code=EC5, factors=(_DRY, _DRY, _WET), partial=1.3, tension=tension / bending, compression=compression / bending,
        deepest=0.15, power=0.2, most=1.3, biaxial=0.7, cracked=0.67, modulus=modulus, creep=(0.6, 0.8, 2.0),
        source=f"{EC5}:2004 ({_CLAUSES}, k_h 3.2(3), k_m 6.1.6(2), k_cr 6.1.7(2)); {strengths}",
    )  # fmt: skip


DESIGN: dict[PresetName, DesignFactors] = {
    "larch": _solid(30, 19, 24, 8.0 / 12.0, "EN 338:2016, C30"),
    "spruce": _solid(24, 14.5, 21, 7.4 / 11.0, "EN 338:2016, C24"),
    "oak": _solid(30, 18, 24, 9.2 / 11.0, "EN 338:2016, D30"),
    "glulam": DesignFactors(
        code=EC5, factors=(_DRY, _DRY, _WET), partial=1.25, tension=19.2 / 24, compression=1.0,
        deepest=0.6, power=0.1, most=1.1, biaxial=0.7, cracked=0.67, modulus=9.6 / 11.5, creep=(0.6, 0.8, 2.0),
        source=f"{EC5}:2004 ({_CLAUSES}, k_h 3.3(3), k_m 6.1.6(2), k_cr 6.1.7(2)); EN 14080:2013, GL24h",
    ),
    "plywood": DesignFactors(
        code=EC5, factors=(_DRY, _DRY, _WET), partial=1.2, tension=0.6, compression=0.6, creep=(0.8, 1.0, 2.5),
        source=f"{EC5}:2004 ({_CLAUSES}, without k_h, k_m = 1); strength along the strips taken as 0.6 of the bending "
        "strength, as EN 384 does for softwood; its 5 % modulus is not known",
    ),
    "gfrp": DesignFactors(
        factors=((1.0, 1.0, 1.0, 1.5, 1.5),), partial=3.0, tension=1.0, compression=1.0,  # E23: 240 MPa
        source="a third of the characteristic strength for permanent and half of it for short loads, as at the "
        "cathedral of Creteil (du Peloux, Tayeb, Baverel and Caron, Structural Engineering International 2/2016)",
    ),
    "steel": DesignFactors(
        factors=((1.0,) * 5,), partial=1.0, tension=1.0, compression=1.0, creep=(0.0,),
        source="EN 1993-1-1:2005, 6.1(1): gamma_M0 = 1.0, elastic",
    ),
    "spring-steel": DesignFactors(
        factors=((1.0,) * 5,), partial=1.0, tension=1.0, compression=1.0, creep=(0.0,),
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
    share = RESERVED if factors is None else factors.by_duration(service_class or COVERED)["permanent"]
    return share * material.bending_strength

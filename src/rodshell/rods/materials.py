"""Materials of rods: elastic constants and density, and named presets with their characteristic strengths.

The figures of a preset are characteristic, short-term values at the moisture and temperature that their source names.
What building codes make of them for duration of load, moisture and safety is in `rods.design_strength`.
"""

from dataclasses import dataclass
from typing import Annotated, Any, Literal, Self, get_args

from rodshell.errors import InputError
from rodshell.quantities import Density, PoissonRatio, Stress
from rodshell.schema import Key, Missing, Table, checked, written
from rodshell.units import shown
from rodshell.validation import brief

_REPLACEABLE = ("youngs_modulus", "density", "shear", "poisson_ratio")
PresetName = Literal[
    "larch", "spruce", "oak", "glulam", "bamboo", "gfrp", "plywood", "petg", "steel", "spring-steel", "rubber"
]


@dataclass(frozen=True)
class Preset:
    """A named material.

    Args:
        youngs_modulus, shear, density: mean values [Pa, Pa, kg/m3]; shear None: incompressible, Poisson's ratio 0.5.
        bending_strength, shear_strength: characteristic and short-term [Pa]; None: the source has none.
        grade: to which the figures apply.
        strength_note: what the strengths mean, and for what they must be reduced.
    """

    youngs_modulus: float
    shear: float | None
    density: float
    bending_strength: float | None
    shear_strength: float | None
    grade: str
    strength_note: str
    source: str


_MOISTURE = "characteristic, short-term"

PRESETS: dict[PresetName, Preset] = {
    "larch": Preset(
        12.0e9, 0.75e9,  # EN 338:2016, C30: mean, parallel to the grain; mean shear modulus
        600.0,  # EN 350: European larch 470 to 650, mean 600 at 12 % moisture; the class itself says 460 at least
        30e6, 4.0e6,  # EN 338:2016, C30
        "strength class C30",
        _MOISTURE,
        "EN 338:2016 (C30, to which EN 1912 assigns larch of a high visual grade); density of the species by EN 350",
    ),
    "spruce": Preset(
        11.0e9, 0.69e9,  # EN 338:2016, C24
        460.0,  # EN 350: Norway spruce 440 to 470
        24e6, 4.0e6,  # EN 338:2016, C24
        "strength class C24",
        _MOISTURE,
        "EN 338:2016 (class C24); density of the species by EN 350",
    ),
    "oak": Preset(
        11.0e9, 0.69e9,  # EN 338:2016, D30
        710.0,  # EN 350: European oak 670 to 760
        30e6, 3.9e6,  # EN 338:2016, D30
        "strength class D30",
        _MOISTURE,
        "EN 338:2016 (class D30); density of the species by EN 350",
    ),
    "glulam": Preset(
        11.5e9, 0.65e9,  # EN 14080:2013, GL24h: mean, parallel to the grain; mean shear modulus
        420.0,  # EN 14080:2013, GL24h, mean
        24e6, 3.5e6,  # EN 14080:2013, GL24h
        "strength class GL24h",
        _MOISTURE,
        "EN 14080:2013 (class GL24h)",
    ),
    "bamboo": Preset(
        11.8e9,  # mean, bending
        0.6e9,  # torsion tests of culms scatter between 0.55 and 0.65 GPa
        700.0,  # air-dry
        46e6, 4e6,  # 5th percentiles of tests
        "Guadua angustifolia, round culms",
        _MOISTURE,
        "Trujillo, Bamboo structures in Colombia, The Structural Engineer 2007 (5th percentiles and mean modulus of "
        "tests like those of ISO 22157); shear modulus and density typical of the species' literature",
    ),
    "gfrp": Preset(
        23e9,  # EN 13706-3, E23: full-section modulus, at least
        3.0e9,  # in plane, as pultruders' design manuals give it; the standard asks for none
        1850.0,  # E-glass and polyester, 55 to 65 % of glass by mass: 1750 to 1950
        240e6, 25e6,  # EN 13706-3, E23: axial flexural strength, interlaminar shear strength, at least
        "pultruded profile, class E23",
        _MOISTURE,
        "EN 13706-3:2002, E23, minimum properties; shear modulus and density typical of pultruders' design manuals",
    ),
    "plywood": Preset(
        10.05e9,  # mean, bending parallel to the face grain
        0.62e9,  # panel shear
        680.0,  # mean
        40.2e6, 2.67e6,  # characteristic; planar (rolling) shear, the lower of the two
        "birch throughout, 18 mm, strips along the face grain",
        _MOISTURE,
        "Handbook of Finnish Plywood, birch of 1.4 mm veneers (EN 636, EN 789)",
    ),
    "petg": Preset(
        2.1e9,  # flexural modulus
        0.76e9,  # E / 2(1 + nu) with nu = 0.38
        1270.0,
        50e6,  # tensile yield stress; flexural strengths of data sheets are higher, 70 MPa
        29e6,  # yield stress over the square root of 3
        "unfilled copolyester, extruded",
        "typical, short-term: reduce for duration and temperature, it creeps",
        "manufacturers' data sheets: flexural modulus 2.0 to 2.2 GPa, tensile yield stress 45 to 55 MPa",
    ),
    "steel": Preset(
        210e9, 81e9, 7850.0,  # EN 1993-1-1, 3.2.6
        235e6, 135.7e6,  # yield strength up to 40 mm; over the square root of 3
        "structural steel S235",
        "yield strength",
        "EN 1993-1-1:2005 (3.2.6; table 3.1)",
    ),
    "spring-steel": Preset(
        206e9, 81.5e9, 7850.0,  # EN 10270-1
        1140e6,  # 0.7 of the tensile strength, EN 10270-1: 1630 MPa at least at 3 mm (1980 at 1 mm, 1240 at 10 mm)
        815e6,  # 0.5 of it
        "patented cold drawn wire SM, up to 3 mm",
        "seven tenths of the least tensile strength",
        "EN 10270-1, SM, least tensile strength at 3 mm; 0.7 of it in bending, 0.5 in torsion, as for static springs",
    ),
    "rubber": Preset(
        1e6, None, 1000.0,
        None, None,
        "the paper's",
        "",
        "Huang, Qin and Khalid Jawed 2021, section 3.1; it gives no strength",
    ),
}  # fmt: skip
"""Rubber is the material of the paper's examples, not one for shells of metres."""


@dataclass(frozen=True)
class Material:
    """Linear elastic material.

    Args:
        poisson_ratio: [-], above -1 and up to 0.5, which is incompressible.
        shear: shear modulus [Pa] in place of Poisson's ratio, as for timber, which is not isotropic.
        name: of the preset, which has the strengths; set by `Material.preset`.

    Raises:
        InputError: a value is out of range; Poisson's ratio and a shear modulus are both given; no such preset.
    """

    youngs_modulus: Annotated[
        Stress, "Young's modulus", Missing(f"give it, or a preset ({', '.join(get_args(PresetName))})")
    ]  # fmt: skip
    density: Annotated[Density, "density"]
    poisson_ratio: Annotated[PoissonRatio, "Poisson's ratio; default 0.5"] = 0.5
    shear: Annotated[Stress | None, "shear modulus, in place of Poisson's ratio, as for timber"] = None
    name: Annotated[
        PresetName | None, Key("preset", first=True), "a named material; other keys of its table replace its values"
    ] = None  # fmt: skip

    __repr__ = brief

    @classmethod
    def completed(cls, given: Table, path: str) -> Table:
        """What a preset says of the keys that are left out; a density of 1000 kg/m3 without."""
        given = {key: value for key, value in given.items() if value is not None}
        if "shear" in given and "poisson_ratio" in given:
            raise InputError(f"{path}.shear stands in place of poisson_ratio: leave one of them out")
        if isinstance(name := given.get("preset"), str) and name in get_args(PresetName):
            given = _preset_values(name, given)
        return {"density": 1000.0, **given}

    def __post_init__(self) -> None:
        if self.name is not None:
            _preset_named(self.name)
        names = {"youngs_modulus": "Young's modulus", "poisson_ratio": "Poisson's ratio", "shear": "shear modulus"}
        checked(self, names)
        if not -1 < self.poisson_ratio <= 0.5:
            raise InputError(f"Poisson's ratio must lie above -1 and not above 0.5, not {self.poisson_ratio}")
        if self.shear is not None and self.poisson_ratio != 0.5:
            raise InputError(f"give Poisson's ratio ({self.poisson_ratio}) or a shear modulus, not both")

    @classmethod
    def preset(cls, name: PresetName, **changed: float) -> Self:
        """A named material.

        Args:
            name: of the preset, such as "larch".
            changed: values that replace the preset's: youngs_modulus, density, shear or poisson_ratio.

        Raises:
            InputError: there is no such preset; a value cannot be used.
        """
        for key in changed:
            if key not in _REPLACEABLE:
                raise InputError(f"a preset has no {key} to replace: its values are {', '.join(_REPLACEABLE)}")
        return cls(**_preset_values(name, changed), name=name)

    @property
    def shear_modulus(self) -> float:
        """As given, or E / 2(1 + nu) [Pa]: E/3 for an incompressible material, as in the paper."""
        return self.youngs_modulus / (2 * (1 + self.poisson_ratio)) if self.shear is None else self.shear

    @property
    def bending_strength(self) -> float | None:
        """Of the preset, characteristic and short-term [Pa]; None: not known."""
        return None if self.name is None else PRESETS[self.name].bending_strength

    @property
    def shear_strength(self) -> float | None:
        """Of the preset, characteristic and short-term [Pa]; None: not known."""
        return None if self.name is None else PRESETS[self.name].shear_strength

    def parameters(self) -> dict[str, object]:
        """The values in SI as they stand in a case file; with the preset's name, if it has one."""
        return written(self)

    def as_written(self, keys: dict[str, Any]) -> dict[str, Any]:
        """Without Poisson's ratio where the shear modulus stands in its place."""
        return {key: value for key, value in keys.items() if key != "poisson_ratio" or self.shear is None}


def _preset_named(name: str) -> Preset:
    """The preset of this `name`; an InputError where there is none."""
    if not isinstance(name, str) or name not in get_args(PresetName):
        raise InputError(f"there is no material {shown(name)}: use {', '.join(get_args(PresetName))}")
    return PRESETS[name]  # type: ignore[index]


def _preset_values(name: str, changed: dict[str, Any]) -> dict[str, Any]:
    """Keyword arguments of `Material` for the preset `name` with some values `changed`."""
    known = _preset_named(name)
    values: dict[str, Any] = {key: getattr(known, key) for key in ("youngs_modulus", "shear", "density")}
    if "poisson_ratio" in changed or known.shear is None:
        del values["shear"]
    return values | changed

"""Preset materials: what they hold, and that what is given beside them replaces it."""

from pathlib import Path
from typing import get_args

import pytest

import rodshell as rs
from rodshell.case import load_case
from rodshell.errors import InputError
from rodshell.rods.materials import PRESETS, PresetName


@pytest.mark.parametrize("name", get_args(PresetName))
def test_a_preset_is_a_material_with_its_numbers_a_grade_and_a_source(name: PresetName) -> None:
    material, known = rs.Material.preset(name), PRESETS[name]
    assert (material.youngs_modulus, material.density) == (known.youngs_modulus, known.density)
    assert material.shear_modulus == (known.shear or known.youngs_modulus / 3)
    assert material.bending_strength == known.bending_strength
    assert known.grade
    assert known.source
    assert rs.Material(**{key: value for key, value in material.parameters().items() if key != "preset"}).name is None


def test_isotropic_presets_have_a_poissons_ratio_that_is_possible() -> None:
    for name in ("petg", "spring-steel"):
        material = rs.Material.preset(name)  # type: ignore[arg-type]
        assert 0.2 < material.youngs_modulus / (2 * material.shear_modulus) - 1 < 0.5


def test_a_value_given_beside_a_preset_replaces_its_own() -> None:
    timber = rs.Material.preset("larch", youngs_modulus=14e9)
    assert (timber.youngs_modulus, timber.density, timber.bending_strength) == (14e9, 600.0, 30e6)
    assert rs.Material.preset("gfrp", poisson_ratio=0.3).shear_modulus == 23e9 / 2.6
    case = load_case("hemisphere", {"rod.material.preset": "larch", "rod.material.density": "650 kg/m3"})
    assert case.build().rod.material == rs.Material.preset("larch", density=650.0)


def test_another_preset_on_the_command_line_replaces_the_whole_material_of_the_case() -> None:
    assert load_case("hemisphere", {"rod.material.preset": "oak"}).build().rod.material == rs.Material.preset("oak")
    assert load_case("pavilion", {"rod.material.preset": "oak"}).build().rod.material == rs.Material.preset("oak")


def test_an_unknown_preset_and_a_material_without_a_modulus_are_refused_in_one_sentence() -> None:
    with pytest.raises(InputError, match='there is no material "larsh": use larch, spruce'):
        rs.Material.preset("larsh")  # type: ignore[arg-type]
    with pytest.raises(InputError, match=r'rod\.material\.preset must be .*, not "larsh": did you mean "larch"\?'):
        load_case("hemisphere", {"rod.material.preset": "larsh"})
    with pytest.raises(InputError, match=r"rod\.material\.youngs_modulus is missing: give it, or a preset"):
        load_case("heightfield", {"target.formula": "x*y", "rod.material.density": 700.0})


def test_the_documentation_lists_every_preset_with_its_numbers() -> None:
    text = (Path(__file__).parents[2] / "docs" / "files.md").read_text()
    rows = {row.split("`")[1]: row for row in text.splitlines() if row.startswith("| `")}
    for name, known in PRESETS.items():
        cells = [cell.strip() for cell in rows[name].strip("|").split("|")]
        strengths = (known.bending_strength, known.shear_strength)
        said = ", ".join(f"{value / 1e6:.4g}" for value in strengths if value is not None) or "not known"
        assert cells[1] == f"{known.youngs_modulus / 1e9:.4g}"
        assert float(cells[2]) == pytest.approx(rs.Material.preset(name).shear_modulus / 1e9, rel=1e-3)
        assert cells[3:] == [f"{known.density:g}", said, known.grade, known.source]

"""The case file: what is left out, what is written back, and what is refused."""

import os
import tomllib
from dataclasses import replace
from math import cos, pi, tau
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rodshell.case import BUILT_IN, Case, case_keys, load_case
from rodshell.case.load import RenamedKeyWarning
from rodshell.errors import InputError
from rodshell.schema import written

DESIGN = """
[target]
kind = "hemisphere"
radius = "200 mm"
[layout]
rods = [17, 17]
spacing = "30 mm"
length = "1.2 m"
edge = "5 mm"
rotate = "0 deg"
offset = [0.0, 0.0]
[rod]
section = { kind = "circle", radius = "1 mm" }
material = { youngs_modulus = "1 MPa", poisson_ratio = 0.5, density = "1000 kg/m3" }
[joint]
kind = "ball"
[drape]
method = "bound"
gravity = 9.81
height = "50 mm"
"""
"""The example of design.md, but for its anchor, which is the default."""

WEIGHT = 'loads = [{ name = "own", kind = "self_weight" }, '
FORMULA = {"target.kind": "heightfield", "target.formula": "0.1 - x**2"}


@pytest.fixture
def load(tmp_path: Path) -> Any:
    def from_text(text: str, overrides: dict[str, object] | None = None) -> Case:
        path = tmp_path / "dome.toml"
        path.write_text(text, encoding="utf-8")
        return load_case(path, overrides)

    return from_text


def test_the_built_in_hemisphere_is_the_example_of_the_design(load: Any) -> None:
    assert load(DESIGN) == load_case("hemisphere")


@pytest.mark.parametrize(
    ("name", "target", "rods"),
    [
        ("hemisphere", {"kind": "hemisphere", "radius": 0.2}, (17, 17)),
        ("paraboloid", {"kind": "paraboloid", "radius": 0.2, "height": 0.12}, (15, 15)),
        ("ellipsoid", {"kind": "ellipsoid", "a": 0.2, "b": 0.15, "c": 0.12}, (11, 15)),
        ("cap", {"kind": "cap", "radius": 0.25, "base": 0.1}, (17, 17)),
    ],
)
def test_built_in_cases_have_the_papers_values(name: str, target: dict[str, object], rods: tuple[int, int]) -> None:
    case = load_case(name)
    assert written(case.target) == target
    assert written(case.layout) == {
        "kind": "chebyshev",
        "rods": rods,
        "spacing": (0.03, 0.03),
        "length": 1.2,
        "edge": 0.005,
        "rotate": 0.0,
        "offset": (0.0, 0.0),
        "left_out": (),
        "crossing": pi / 2,
    }
    assert written(case.rod) == {
        "section": {"kind": "circle", "radius": 0.001},
        "material": {"youngs_modulus": 1e6, "poisson_ratio": 0.5, "density": 1000.0},
    }


def test_what_a_file_leaves_out_is_the_default_but_counts_and_lengths_are_auto(load: Any) -> None:
    automatic = dict.fromkeys(("layout.rods", "layout.length", "layout.spacing", "layout.edge"), "auto")
    asked, without = load(""), {"rod": None}
    assert replace(asked, **without) == replace(load_case("hemisphere", automatic), **without)
    assert asked.rod.left_open == ("material", "section")


@pytest.mark.parametrize("size", [0.2, 6.0, 150.0])
def test_lengths_left_out_grow_with_the_target(load: Any, size: float) -> None:
    """So every scale has the same net: the spacing is a round length, and all else follows it or the size."""
    text = f'target = {{ kind = "heightfield", formula = "0", radius = {size} }}\nrod.material.preset = "rubber"'
    _, layout, rod, *_ = load(text).build()
    assert size / 12 < layout.spacing[0] <= size / 8  # rounded down to 1, 1.5, 2, 3, 5 or 7 times a power of ten
    assert layout.edge == layout.spacing[0] / 6
    assert rod.section.radius == pytest.approx(size / 200, rel=1e-3)
    _, layout, *_ = load(text, {"layout.spacing": [size / 5, size / 10]}).build()
    assert layout.edge == pytest.approx(size / 60, rel=1e-15)


def test_seams_take_the_rods_of_the_whole_from_a_built_in_case_but_not_from_the_user() -> None:
    seams = {"seams.lines": "-1,-1; 1,1"}
    for name in ("hemisphere", "paraboloid", "ellipsoid", "cap"):
        case = load_case(name, seams)
        whole = load_case(name, {"layout.rods": "auto", "layout.length": "auto"})
        assert case.layout == whole.layout
        assert case.build().layout.spacing == (0.03, 0.03)
    for key, value in (("layout.rods", "17x17"), ("layout.length", "1.2 m"), ("drape.method", "gravity")):
        with pytest.raises(InputError, match=f"{key} = .*: (use|each patch .* use|seams need .* use)"):
            load_case("hemisphere", {**seams, key: value}).build()


def test_an_empty_table_is_written_without_a_gap_in_it() -> None:
    assert "\nlayers = {}\n" in load_case("hemisphere").to_toml()


@pytest.mark.parametrize(
    ("name", "overrides"),
    [
        *((name, {}) for name in BUILT_IN if name != "heightfield"),
        ("heightfield", {"target.formula": 'x*y + "é𝑥\\ \x7f\n"', "layout.rotate": "45 deg"}),
        ("heightfield", {**FORMULA, "target.domain": "rectangle", "target.size": "0.1 m,7 in"}),
        ("hemisphere", {"rod.section.kind": "tube", "rod.section.thickness": "0.1 mm"}),
        ("cap", {"target.base": "-180 mm", "drape.anchor": "0.1,1e-7", "layout.spacing": "17 mm, 31 mm"}),
        ("hemisphere", {"drape.method": "gravity", "pop_up.ends": "clamped", "layout.rods": "auto"}),
    ],
)
def test_case_to_toml_to_case_is_identical(load: Any, name: str, overrides: dict[str, object]) -> None:
    case = load_case(name, overrides)
    text = case.to_toml()
    again = load(text)
    assert again == case
    assert again.to_toml() == text


def test_toml_is_in_si_numbers() -> None:
    text = load_case("hemisphere", {"target.radius": "10 in", "layout.rotate": "180 deg"}).to_toml()
    data = tomllib.loads(text)
    assert data["target"] == {"kind": "hemisphere", "radius": 0.254}
    assert data["layout"]["rotate"] == pytest.approx(3.141592653589793, rel=1e-15)
    assert data["rod"]["material"]["youngs_modulus"] == 1e6


def test_an_override_is_what_the_file_would_say(load: Any) -> None:
    overrides = {"target.radius": "250mm", "layout.rods": "13x11", "layout.spacing": "40 mm,50 mm"}
    overrides |= {"drape.anchor": "0.1,0", "rod.material.youngs_modulus": "25 GPa"}
    text = """
    target.radius = "250 mm"
    layout = { rods = [13, 11], spacing = [0.04, "50 mm"], length = "1.2 m", edge = 0.005 }
    drape.anchor = ["100 mm", 0]
    rod.section.radius = "1 mm"
    rod.material.youngs_modulus = 25e9
    """
    assert load_case("hemisphere", overrides) == load(text)


def test_another_kind_keeps_the_keys_that_it_has_too(load: Any) -> None:
    dome = '[target]\nkind = "cap"\nradius = 0.3\nbase = 0.05\n'
    assert written(load(dome, {"target.kind": "hemisphere"}).target) == {
        "kind": "hemisphere",
        "radius": 0.3,
    }
    tube = load("", {"rod.section.kind": "tube", "rod.section.thickness": "0.2 mm"}).rod.section
    assert written(tube) == {"kind": "tube", "radius": "auto", "thickness": 0.0002}
    disc = '[target]\nkind = "heightfield"\nformula = "x"\nradius = 1\n'
    plan = load(disc, {"target.domain": "rectangle", "target.size": "1,2"}).target
    assert (plan.radius, plan.size) == (None, (1.0, 2.0))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('target.radius = "-3 mm"', 'target.radius = "-3 mm": must be larger than zero; give a length'),
        ("target.radius = 0", "target.radius = 0: must be larger than zero"),
        ("layout.edge = 0.0", "layout.edge = 0.0: must be larger than zero"),
        ('layout.length = "-1 m"', 'or "auto"'),
        ('layout.spacing = ["30 mm", 0]', 'layout.spacing = ["30 mm", 0]: second value: must be larger'),
        ("layout.spacing = [1, 2, 3]", "needs one or two values"),
        ('target.radius = "3 parsec"', 'unknown unit "parsec"'),
        ('rod.material.density = "3 mm"', "mm is a unit of length; give a density"),
        ("target.radius = true", "target.radius = true: not a number"),
        ("target.radius = nan", "target.radius = nan: not finite"),
        ("target.radius = [1]", "target.radius = [1]: not a number"),
        ("target.radus = 1", "unknown key target.radus: did you mean target.radius?"),
        ("radius = 1", "unknown key radius: did you mean target.radius?"),
        ("layot.rods = [3, 3]", "unknown key layot: did you mean layout?"),
        ("rod.material.E = 1", "unknown key rod.material.E: [rod.material] has preset, youngs_modulus,"),
        ("xyzzy = 1", "the tables are target, layout, rod, joint, drape, pop_up"),
        ("target.base = 1", 'kind "hemisphere" has no base: leave it out, or set target.kind to "cap"'),
        ("rod.section.thickness = 1", 'kind "circle" has no thickness'),
        ('target = { kind = "cap", cap = 1 }', "unknown key target.cap"),
        ("target = 3", "target = 3: must be a table; [target] has kind, radius"),
        ("rod.section = 3", "rod.section = 3: must be a table"),
        ("[[layout]]\nedge = 1", "layout = [{ edge = 1 }]: must be a table"),
        ('target.kind = "mesh"', "target.file is missing: give the path of the file"),
        ('[target]\nkind = "heights"\nfile = "h.csv"', "target.size is missing: give the width along x and depth"),
        ('[target]\nkind = "mesh"\nfile = "a.obj"\nunit = "furlong"', 'target.unit = "furlong"'),
        ('[target]\nkind = "mesh"\nfile = "a.obj"\nturn = [1, 2]', "target.turn = [1, 2]: needs three values"),
        ('target.kind = "hemispher"', 'did you mean "hemisphere"?'),
        ("target.kind = 3", 'target.kind must be "hemisphere"'),
        ("target.kind = []", ", not a list"),
        ('target.file = "dome.obj"', 'a target of kind "hemisphere" has no file'),
        ('joint.kind = "glue"', 'joint.kind must be "ball", "pin", "spring", "linker" or "rigid", not "glue"'),
        ("joint.shear = 1", 'a joint of kind "ball" has no shear: leave it out, or set joint.kind to "spring"'),
        ('joint = { kind = "spring", shear = -1 }', "joint.shear = -1: must not be negative"),
        ('joint = { kind = "spring", twist = "2 mm" }', "mm is a unit of length"),
        ('joint = { kind = "linker", corners = 3 }', "joint.corners = 3: give 2, opposite corners"),
        ('joint = { kind = "pin", eccentricity = "-1 mm" }', "must not be negative"),
        ('drape.method = "magic"', 'drape.method must be "bound", "gravity" or "paper", not "magic"'),
        ("drape.anchor = 1", "drape.anchor = 1: needs two values"),
        ("drape.gravity = -9.81", "drape.gravity = -9.81: must be larger than zero"),
        ('pop_up.ends = "clampd"', '"both", not "clampd": did you mean "clamped"?'),
        ('rod.section.kind = "tube"', "rod.section.thickness is missing: give the thickness"),
        ("rod.material.poisson_ratio = 0.6", "must lie above -1 and not above 0.5"),
        ("layout.rods = 17", "layout.rods = 17: give two counts of at least 2"),
        ("layout.rods = [1, 17]", "two counts of at least 2"),
        ("layout.rods = [5.0, 17]", "two counts of at least 2"),
        ("layout.rods = [true, 17]", "two counts of at least 2"),
        ('layout.rods = "17y17"', "two counts of at least 2"),
        ('target.kind = "heightfield"', "target.formula is missing: give the height z = f(x, y)"),
        ('target = { kind = "heightfield", formla = "x" }', "did you mean target.formula?"),
        ('target = { kind = "heightfield", formula = 3 }', "target.formula = 3: must be text"),
        ('target = { kind = "heightfield", formula = "x", size = [1, 1] }', "target.size is for domain"),
        ('target = { kind = "heightfield", formula = "x", domain = "rectangle" }', "target.size is missing"),
        (
            'target = { kind = "heightfield", formula = "x", domain = "rectangle", radius = 1 }',
            "target.radius is for domain",
        ),
        ('target = { kind = "heightfield", formula = "x", domain = "square" }', '"disc" or "rectangle"'),
        ("target = ", "dome.toml is not valid TOML"),
        ("layout.rotate = 30", "layout.rotate = 30: a plain number is in radians, and this is more than a full turn; "),
        ('[target]\nkind = "mesh"\nfile = "a.obj"\nturn = [0, 0, 30]', "third value: a plain number is in radians"),
        (
            'layout.spacing = "700,5 mm"',
            'a decimal takes a point, not a comma: give each its unit, such as "700 mm, 5 mm"',
        ),
        ('layout.offset = "10 mm, 20"', "only some of these have a unit"),
        ('[target]\nkind = "mesh"\nfile = "a.obj"\nmove = "1,0,2 m"', "only some of these have a unit"),
        ('seams.lines = "0, -1000; 0, 1000 mm"', "only some of these have a unit"),
        ("drape.friction = 0.3", 'method "bound" has no friction: leave it out, or set drape.method to "paper"'),
        ("drape.gravity = 1.6", 'has no gravity: leave it out, or set drape.method to "gravity" or "paper"'),
        ('drape = { method = "gravity", height = "1 m" }', 'method "gravity" has no height'),
        ('drape = { method = "paper", C1 = 3 }', 'coupling "shared" has no springs'),
        ('seams.unit = "mm"', "seams.unit is the unit of seams.file, which is missing"),
        ('seams.patches = [{ name = "B" }]', "seams.patches needs seams"),
        ('seams.patches = "B"', 'seams.patches = "B": give tables in a case file, such as [{ name'),
        ("seams.patches = [3]", "patch 1 = 3: give tables"),
        ("seams.patches = [{ rotate = 1 }]", "name of patch 1 is missing: give the name of the patch"),
        ("seams.patches = [{ name = 1 }]", "name of patch 1 = 1: must be text, the name of the patch"),
        (
            WEIGHT + '{ name = "ice", kind = "snow", value = "x" }]',
            'value of load 2 ("ice") = "x": not a finite number',
        ),
        (WEIGHT + '{ name = "ice", kind = "snow" }]', 'value of load 2 ("ice") is missing: give the snow load'),
        (WEIGHT + '{ name = "ice", kind = "hail" }]', 'kind of load 2 ("ice") must be "self_weight", "snow"'),
        (WEIGHT + '{ name = "ice" }]', 'kind of load 2 ("ice") is missing: give "self_weight"'),
        (WEIGHT + '{ kind = "snow", value = 1 }]', "name of load 2 is missing: give the name of the load"),
        (WEIGHT + '{ name = "ice", kind = "snow", value = 1, deep = 1 }]', 'unknown key deep of load 2 ("ice")'),
        (WEIGHT + "5]", "load 2 = 5: give tables"),
        (
            'combinations = [{ name = "c", factors = { a = "x" } }]',
            'factors of combination 1 ("c") = { a = "x" }: a = "x"',
        ),
    ],
)
def test_a_bad_case_is_refused_in_one_clear_sentence(load: Any, text: str, message: str) -> None:
    with pytest.raises(InputError) as caught:
        load(text)
    said = str(caught.value)
    assert message in said
    assert "\n" not in said
    assert len(said) < 220
    assert "pydantic" not in said


def test_loads_from_a_generator_are_named_as_those_of_a_list() -> None:
    with pytest.raises(InputError, match=r'value of load 2 \("ice"\) = "x": not a finite number'):
        load_case("hemisphere", {"loads": ({"name": "ice", "kind": "snow", "value": value} for value in (1.0, "x"))})


def test_an_unknown_override_names_the_nearest_key() -> None:
    with pytest.raises(InputError, match=r"unknown key layout.spaceing: did you mean layout.spacing\?"):
        load_case("hemisphere", {"layout.spaceing": "30 mm"})
    with pytest.raises(InputError, match='kind "hemisphere" has no formula'):
        load_case("hemisphere", {"target.formula": "x"})


def test_only_keys_of_the_kinds_at_hand_are_proposed() -> None:
    """A hemisphere has no height, a circle no thickness: neither is offered to one who misspells them."""
    for path, absent in (
        ("target.heigth", "height?"),
        ("rod.section.thicknes", "thickness?"),
        ("joint.eccentricty", "eccentricity?"),
        ("drape.frictn", "friction?"),
    ):
        with pytest.raises(InputError) as caught:
            load_case("hemisphere", {path: "1 mm"})
        assert absent not in str(caught.value)
    with pytest.raises(InputError, match=r"did you mean target.height\?"):
        load_case("paraboloid", {"target.heigth": "1 m"})
    with pytest.raises(InputError, match=r"did you mean joint.eccentricity\?"):
        load_case("hemisphere", {"joint.kind": "pin", "joint.eccentricty": "1 mm"})


def test_a_key_by_its_old_name_is_read_with_a_warning(load: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rodshell.case.load.RENAMED", {"drape.weight": "drape.gravity", "grid.edge": "layout.edge"})
    wanted = load('drape = { method = "gravity", gravity = 1.6 }\nlayout.edge = 0.004')
    with pytest.warns(RenamedKeyWarning, match="drape.weight is now called drape.gravity"):
        assert load('drape = { method = "gravity", weight = 1.6 }\ngrid.edge = 0.004') == wanted
    with pytest.warns(RenamedKeyWarning):
        assert load('drape.method = "gravity"\nlayout.edge = 0.004', {"drape.weight": 1.6}) == wanted


def test_a_key_that_is_gone_is_read_with_a_warning_and_left_out(load: Any) -> None:
    with pytest.warns(RenamedKeyWarning, match=r"the key refine.offer is no longer read: leave it out"):
        assert load('refine = { vary = "taper", offer = "off" }') == load('refine.vary = "taper"')


def test_a_case_is_also_its_text_or_its_tables() -> None:
    case = load_case("cap", {"target.base": "50 mm", "rod.section.radius": "2 mm"})
    assert load_case(case.to_toml()) == case
    assert load_case(tomllib.loads(case.to_toml())) == case
    tables = {"target": {"kind": "cap", "base": "50 mm"}, "rod.section.radius": "2 mm", "rod": {"material.density": 9}}
    tables["rod"]["material.youngs_modulus"] = 1e6  # type: ignore[index]
    mixed = load_case(tables)
    assert (mixed.target.base, mixed.rod.section.radius, mixed.rod.material.density) == (0.05, 0.002, 9.0)
    with pytest.raises(InputError, match="the text is not valid TOML"):
        load_case("target = ")
    with pytest.raises(InputError, match=r"unknown key target.radus: did you mean target.radius\?"):
        load_case({"target": {"radus": 1}})
    with pytest.raises(InputError, match="target = 3: must be a table"):
        load_case({"target": 3})


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("hemispher", "did you mean hemisphere?"),
        ("nothing.toml", 'no file named "nothing.toml"'),
        (".", "is a folder"),
    ],
)
def test_a_case_that_is_not_there_is_named(name: str, message: str) -> None:
    with pytest.raises(InputError) as caught:
        load_case(name)
    assert message in str(caught.value)


def test_a_file_that_is_not_text_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "dome.toml"
    path.write_bytes(b"\xff\xfe[target]")
    with pytest.raises(InputError, match="save it as UTF-8"):
        load_case(path)


def test_a_file_of_another_type_is_named_with_what_would_do(tmp_path: Path) -> None:
    for name, content in (("roof.skp", b"\xff\xfe\x00"), ("make.py", b"import rodshell")):
        (tmp_path / name).write_bytes(content)
        with pytest.raises(
            InputError, match=rf"unknown file type \{Path(name).suffix}; use a case \(.toml\) or a surf"
        ):
            load_case(tmp_path / name)


def test_a_folder_is_answered_with_a_file_that_is_in_it(tmp_path: Path) -> None:
    for name, said in (
        ("notes.txt", r"give a case \(.toml\) or a surface \(.obj, "),
        ("roof.obj", r"such as .*roof\.obj$"),
        ("zoo.toml", r"such as .*zoo\.toml$"),
    ):
        (tmp_path / name).write_text("")
        with pytest.raises(InputError, match=said):
            load_case(tmp_path)


def test_a_byte_order_mark_is_no_obstacle(tmp_path: Path) -> None:
    path = tmp_path / "dome.toml"
    path.write_bytes(b"\xef\xbb\xbf" + DESIGN.encode())
    assert load_case(path) == load_case("hemisphere")


@pytest.mark.parametrize("name", ["hemisphere", "paraboloid", "ellipsoid", "cap"])
def test_a_built_target_has_the_numbers_of_its_case(name: str) -> None:
    case = load_case(name)
    assert case.build().target.parameters() == written(case.target)


def test_build_makes_the_layout_the_rod_and_the_drape_options() -> None:
    from rodshell.formfinding import Gravity
    from rodshell.joints import Ball, Pin
    from rodshell.layout import GridLayout
    from rodshell.rods.section import Circle, Material, Rod, Tube
    from rodshell.rods.supports import SUPPORTS

    overrides = {"drape.anchor": "0.1,0", "drape.method": "gravity", "layout.rotate": 0.5}
    case = load_case("ellipsoid", overrides)
    _, layout, rod, *options = case.build()
    assert layout == GridLayout.orthogonal(
        rods=(11, 15), spacing=0.03, length=1.2, edge=0.005, rotate=0.5, offset=(0.0, 0.0)
    )
    assert rod == Rod(Circle(0.001), Material(1e6, 1000.0, 0.5))
    assert options == [Gravity(), (0.1, 0.0)]
    assert (case.joint, case.popped_on) == (Ball(), tuple(SUPPORTS.values()))
    tube = {"rod.section.kind": "tube", "rod.section.thickness": "0.1 mm", "pop_up.ends": "pinned"}
    tube |= {"joint.kind": "pin", "joint.eccentricity": "2 mm"}
    case = load_case("hemisphere", tube)
    built = case.build()
    assert built.rod.section == Tube(0.001, 0.0001)
    assert case.popped_on == (SUPPORTS["pinned"],)
    assert case.joint == Pin(eccentricity=0.002)
    assert built.anchor is None


def test_a_height_field_gets_its_formula_and_its_domain(monkeypatch: pytest.MonkeyPatch) -> None:
    from rodshell import targets

    monkeypatch.setattr(targets, "HeightField", lambda **given: given, raising=False)
    disc = load_case("heightfield", {"target.formula": "x*y"}).target.build()
    assert disc == {"formula": "x*y", "domain": targets.Disc(0.2)}
    overrides = {"target.formula": "x*y", "target.domain": "rectangle", "target.size": "0.4 m, 300 mm"}
    plan = load_case("heightfield", overrides).target.build()
    assert plan == {"formula": "x*y", "domain": targets.Rectangle((0.4, 0.3))}


@pytest.mark.parametrize(
    "overrides",
    [
        {"layout.edge": "31 mm"},
        {"rod.section.kind": "tube", "rod.section.thickness": "2 mm"},
        {"target.kind": "cap", "target.base": "0.3 m"},
    ],
)
def test_values_that_do_not_fit_together_are_refused_when_built(overrides: dict[str, object]) -> None:
    case = load_case("hemisphere", overrides)
    with pytest.raises(InputError):
        case.build()


@pytest.mark.parametrize(
    ("overrides", "message"),
    [
        ({"drape.objective": "gap"}, "nothing is searched for: set drape.anchor or layout.rotate"),
        (
            {"fabrication.end_allowance": "1 km"},
            "fabrication.end_allowance = 1000.0: more than the 200 mm of the target's",
        ),
        ({"fabrication.kerf": "3 mm"}, "kerf of 0.003 m is lost where stock is cut: give its stock_length"),
        (
            {"fabrication.stock_length": "1 mm"},
            "fabrication.stock_length = 0.001: shorter than the 30 mm between joints",
        ),
    ],
)
def test_what_would_do_nothing_is_refused_before_the_job(overrides: dict[str, object], message: str) -> None:
    with pytest.raises(InputError) as caught:
        load_case("hemisphere", overrides).build()
    assert message in str(caught.value)


def test_seams_have_no_objective() -> None:
    case = load_case("hemisphere", {"seams.lines": "-1,0;1,0", "layout.rotate": "auto", "drape.objective": "gap"})
    with pytest.raises(InputError, match=r"drape\.objective"):
        case.build()


def test_a_patch_of_finer_spacing_may_have_shorter_stock() -> None:
    seams = {"seams.lines": "-1,0;1,0", "seams.patches": [{"name": "A", "spacing": "8 mm"}]}
    short = {"layout.edge": "5 mm", "fabrication.stock_length": "10 mm"}
    with pytest.raises(InputError, match="stock_length"):
        load_case("hemisphere", short).build()
    case = load_case("hemisphere", {**seams, **short})
    assert case.build()
    assert case.output_options().fabrication.stock_length == 0.01


def test_another_method_keeps_what_it_uses_alone(load: Any) -> None:
    fall = '[drape]\nmethod = "paper"\ngravity = 3\nfriction = 0.3\ncoupling = "implicit"\nC1 = 5\n'
    assert load(fall).drape.C1 == 5
    hung = load(fall, {"drape.method": "gravity"}).drape
    assert (hung.gravity, hung.friction, hung.coupling, hung.C1) == (3, 0, "shared", None)
    assert load(fall, {"drape.method": "bound"}).drape == load("").drape
    with pytest.raises(InputError, match="has no friction"):
        load(fall, {"drape.method": "gravity", "drape.friction": 0.1})


def test_a_found_anchor_leaves_a_case_that_can_be_run_again(load: Any) -> None:
    asked = load_case("hemisphere", {"drape.anchor": "auto", "drape.objective": "gap"})
    asked.build()
    again = load(asked.decided((0.0, 0.0), 0.1).to_toml())
    again.build()
    assert again.drape.anchor == (0.0, 0.0)
    assert again.layout.rotate == 0.1


@pytest.mark.parametrize(
    ("text", "spacing"),
    [("300 mm, 40 mm", (0.3, 0.04)), ("0.3,0.4", (0.3, 0.4)), ("0.3 m,40 mm", (0.3, 0.04)), ("5 mm", (0.005, 0.005))],
)
def test_pairs_are_read_where_all_values_have_a_unit_or_none(text: str, spacing: tuple[float, float]) -> None:
    assert load_case("hemisphere", {"layout.spacing": text}).layout.spacing == spacing


def test_a_zero_needs_no_unit_beside_others() -> None:
    assert load_case("hemisphere", {"layout.offset": "0, 5 mm"}).layout.offset == (0.0, 0.005)


@pytest.mark.parametrize("angle", [7.0, -30.0, 0.3])
def test_a_case_of_python_objects_can_be_read_again_whatever_its_angle(load: Any, angle: float) -> None:
    import rodshell as rs

    layout = rs.GridLayout.orthogonal(rods=(5, 5), spacing=0.06, length=0.7, edge=0.02, rotate=angle)
    rod = rs.Rod(rs.Circle(radius=1e-3), rs.Material(youngs_modulus=1e6, density=1e3))
    case = load(rs.Job(rs.Hemisphere(radius=0.2), layout, rod).to_toml())
    assert cos(case.layout.rotate - angle) == pytest.approx(1)
    assert abs(case.layout.rotate) < tau


def test_each_method_of_draping_is_written_to_a_case_and_read_again(load: Any) -> None:
    import rodshell as rs

    layout = rs.GridLayout.orthogonal(rods=(5, 5), spacing=0.06, length=0.7, edge=0.02)
    rod = rs.Rod(rs.Circle(radius=1e-3), rs.Material(youngs_modulus=1e6, density=1e3))
    ties = rs.ExplicitPenalty(C1=2.0, C2=3e-5)
    timed = {"time_step": 1e-3, "duration": 2.0, "friction": 0.1, "drag": 4.0}
    slow = rs.Fall(acceleration=1.6, height=0.1, coupling=ties, **timed)
    for method in (rs.Bound(), rs.Gravity(acceleration=1.6), rs.Fall(), slow):
        text = rs.Job(rs.Hemisphere(radius=0.2), layout, rod, method=method).to_toml()
        assert load(text).build().method == method


def test_each_key_has_one_line_of_help() -> None:
    for key in case_keys().values():
        assert key.help
        assert len(key.help) < 70, key


def test_strengths_and_stabilities_without_loads_are_written_too(load: Any) -> None:
    keys = {"strength.permanent": "20 MPa", "stability.modes": 2, "locked_joints.shear": 5}
    case = load_case("hemisphere", keys)
    assert load(case.to_toml()) == case
    assert "[strength]" not in load_case("hemisphere").to_toml()


def test_arrays_do_in_place_of_lists() -> None:
    given = {"layout.spacing": np.array([0.03, 0.04]), "layout.edge": np.float64(0.002)}
    same = {"layout.spacing": [0.03, 0.04], "layout.edge": 0.002}
    assert load_case("hemisphere", given) == load_case("hemisphere", same)
    with pytest.raises(InputError, match=r"target.kind must be .*, not a list"):
        load_case({"target": {"kind": np.zeros(3)}})


@pytest.mark.skipif(not Path("/dev/fd").exists(), reason="needs /dev/fd")
def test_files_of_a_case_from_a_shell_s_pipe_lie_in_the_current_folder() -> None:
    read, write = os.pipe()
    os.write(write, b'[target]\nkind = "mesh"\nfile = "roof.obj"\nunit = "m"\n')
    os.close(write)
    assert load_case(f"/dev/fd/{read}").target.file == "roof.obj"
    os.close(read)

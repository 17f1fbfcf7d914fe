"""A rod that is not given: its material by name, its section by the bends of the target's net."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import rodshell as rs
from rodshell.case import load_case
from rodshell.case.rod_ends import RodEnds
from rodshell.checks import sizing
from rodshell.checks.bending import bending_of
from rodshell.checks.sizing import Bends, Fit, bends_of, bends_of_pop_ups, largest_strain, net_bends
from rodshell.cli import main
from rodshell.errors import InputError, NetLimitError
from rodshell.formfinding import pop_up_stages
from rodshell.layout import straight_rods
from rodshell.progress import silent
from rodshell.results.summary import summary_text
from rodshell.results.verdict import verdict
from rodshell.results.wording import percent
from rodshell.rods.section import TRADE_SIZES, size_text
from tests.acceptance.targets_broken import as_obj
from tests.targets.meshes import sheet


def roof(**keys: Any) -> Any:
    """A roof of 12 m as a formula."""
    shape = {"target.formula": "3*cos(x/6)*cos(y/5)", "target.domain": "rectangle", "target.size": "12 m, 8 m"}
    return load_case("heightfield", {**shape, **keys})


def half_sphere(radius: float) -> tuple[rs.Target, rs.GridLayout]:
    return rs.Hemisphere(radius), rs.GridLayout.orthogonal(spacing=radius / 6)


def test_on_a_sphere_every_rod_bends_by_its_radius_along_the_normal() -> None:
    bends = bends_of(*half_sphere(5.0))
    np.testing.assert_allclose(bends.normal, 1 / 5.0, rtol=2e-3)  # second differences: (step / R)^2 / 12
    assert 0.5 / 5.0 < bends.geodesic.max() < 2 / 5.0


def test_on_a_cylinder_a_rod_bends_by_its_heading() -> None:
    """Euler: cos(heading)^2 / R; its rods are geodesics."""
    target = rs.HeightField(formula="sqrt(25 - x^2) - 4", domain=rs.Rectangle((6.0, 6.0)))
    net = rs.chebyshev_net(target, rs.GridLayout.orthogonal(spacing=0.5, rotate=np.pi / 6), anchor=(0.0, 0.0))
    bends = net_bends(net)
    expected = np.array([np.cos(np.pi / 6) ** 2 / 5, np.sin(np.pi / 6) ** 2 / 5])
    off = np.abs(bends.normal[:, None] - expected).min(axis=1)
    assert off.max() < 1e-3 / 5
    assert bends.geodesic.max() < 1e-3 / 5


def test_the_net_is_found_once_while_a_section_is_chosen(monkeypatch: pytest.MonkeyPatch) -> None:
    marched = list[rs.Target]()
    monkeypatch.setattr(sizing, "bends_of", lambda target, *_: marched.append(target) or Bends(np.ones(3), np.ones(3)))
    fit = Fit.on(*half_sphere(5.0))
    material = rs.Material.preset("larch")
    fit.reason(fit.section(material), material)
    assert len(marched) == 1


# Over the characteristic strength: k_mod / gamma_M of covered timber, a third of GFRP's, half where no code was cited
PERMANENT = {
    "larch": 0.6 / 1.3, "oak": 0.6 / 1.3, "plywood": 0.6 / 1.2, "gfrp": 1 / 3, "spring-steel": 1.0, "bamboo": 0.5,
    "petg": 0.5,
}  # fmt: skip


@pytest.mark.parametrize("name", ["larch", "oak", "bamboo", "gfrp", "plywood", "petg", "spring-steel"])
@pytest.mark.parametrize("radius", [0.1, 5.0])
def test_bends_use_at_most_three_quarters_of_the_permanent_strength_and_the_next_stock_size_would_use_more(
    name: Any, radius: float
) -> None:
    """Or would be thicker than rods of this target are, or is not thinner than the thinnest in stock."""
    target, layout = half_sphere(radius)
    material = rs.Material.preset(name)
    section = Fit.on(target, layout, joint=rs.Pin()).section(material)
    bends = bends_of(target, layout)

    def used(section: Any) -> float:
        """Share of the strength by the corner, or the fibre farthest away, of a section that bends both ways."""
        strain = depth_strain(section, bends.normal, bends.geodesic)
        return strain * material.youngs_modulus / (material.bending_strength or np.nan)

    allowed = PERMANENT[name] * 3 / 4
    assert used(section) <= allowed
    if section in TRADE_SIZES[material.name]:  # type: ignore[index]
        at = TRADE_SIZES[material.name].index(section)  # type: ignore[index, arg-type]
        for thicker in TRADE_SIZES[material.name][at + 1 : at + 2]:  # type: ignore[index]
            room = min(target.size / 100, min(layout.spacing) / 6)
            assert used(thicker) > allowed or thicker.depth > room


@pytest.mark.slow
def test_a_lath_whose_joints_let_it_roll_is_thicker_for_it_bends_towards_its_thin_side_alone() -> None:
    target, layout = half_sphere(5.0)
    larch = rs.Material.preset("larch")
    held, free = (Fit.on(target, layout, joint=joint).section(larch) for joint in (rs.Pin(), rs.Ball()))
    assert free.depth > held.depth
    form = rs.find_form(target, layout, rs.Rod(free, larch), ends=("clamped",))
    bending = form.archive(options=rs.OutputOptions(stages=0)).results.plain()["bending"]["clamped"]
    assert 0.4 < bending["max_stress"] / (30e6 * PERMANENT["larch"]) <= 1


def depth_strain(section: Any, normal: Any, geodesic: Any) -> float:
    """Worked out anew: half the side times the curvature, added at a corner, by Pythagoras round a circle."""
    if isinstance(section, rs.RectangularSection):
        return float((section.width / 2 * normal + section.height / 2 * geodesic).max())
    return float((section.radius * np.sqrt(normal**2 + geodesic**2)).max())


def test_a_wide_target_without_a_rod_is_of_gfrp_and_a_model_of_petg() -> None:
    assert roof().build().rod.material == rs.Material.preset("gfrp")
    small = load_case("heightfield", {"target.formula": "0.1*cos(6*x)"})
    assert small.build().rod.material == rs.Material.preset("petg")


def test_the_built_in_cases_of_the_paper_keep_its_rod() -> None:
    for name in ("hemisphere", "paraboloid", "ellipsoid", "cap"):
        rod = load_case(name).build().rod
        assert rod == rs.Rod(rs.Circle(0.001), rs.Material(1e6, 1e3, 0.5))
        assert load_case(name).rod.left_open == ()


def test_what_is_given_is_kept_and_only_the_rest_is_chosen() -> None:
    timber = roof(**{"rod.material.preset": "spruce"})
    assert timber.rod.left_open == ("section",)
    assert timber.build().rod.section in TRADE_SIZES["spruce"]
    rod = roof(**{"rod.section.radius": "20 mm"})
    assert rod.rod.left_open == ("material",)
    assert rod.build().rod == rs.Rod(rs.Circle(0.02), rs.Material.preset("gfrp"))
    wall = roof(**{"rod.section.kind": "tube", "rod.section.thickness": "2 mm"}).build().rod.section
    assert isinstance(wall, rs.Tube)
    assert wall.thickness == 0.002
    with pytest.raises(
        InputError, match=r"a wall of 50 mm: tubes that withstand .* at most 30 mm thick: give a thinner wall"
    ):
        roof(**{"rod.section.kind": "tube", "rod.section.thickness": "50 mm"}).build()


def test_a_given_strength_decides_in_place_of_the_presets() -> None:
    strong, weak = (roof(**{"checks.strength": s, "rod.material.preset": "larch"}).build().rod for s in (60e6, 10e6))
    assert strong.section.depth > weak.section.depth


@pytest.mark.slow
def test_rods_leave_room_between_them_and_are_no_thicker_than_the_papers() -> None:
    flat = {"target.formula": "0.1*x*y/36", "target.radius": "6 m"}
    assert load_case("heightfield", flat).build().rod.section.depth <= 6.0 / 100
    dense = load_case("heightfield", {**flat, "layout.spacing": "100 mm"}).build()
    assert dense.rod.section.depth <= 0.1 / 6


def test_a_target_that_no_net_covers_is_sized_by_its_own_curvature() -> None:
    """A cap of more than the half sphere, which seams cut."""
    target = rs.Cap(radius=5.0, base=-3.5)
    layout = rs.GridLayout.orthogonal(spacing=0.8)
    with pytest.raises(NetLimitError):
        rs.chebyshev_net(target, layout)
    np.testing.assert_allclose(bends_of(target, layout).normal, 1 / 5.0, rtol=1e-6)


def test_the_rod_that_was_chosen_is_announced_said_in_the_summary_and_kept(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    options = ["--formula", "2*cos(x/6)*cos(y/5)", "--target.radius", "6 m", "--spacing", "1.5 m", "--pop_up.ends"]
    out = str(tmp_path / "roof")
    assert main(["form", "heightfield", *options, "clamped", "-v", "--only", "csv", "--out", out]) == 0
    said = capsys.readouterr()
    (announced,) = [line for line in said.err.splitlines() if line.startswith("rodshell: rod: ")]
    assert "gfrp, E = 23 GPa" in announced
    chosen = "material and section were not given: chosen to fit, "
    assert (
        f"{chosen}by an estimate of the bends, aiming at 75 % of the permanent strength at most and coming to "
        in announced
    )
    assert "; the next size that is sold, tube 76 x 6 mm, would use 87 % at the sharpest bend" in announced
    assert "bending strength 240 MPa, characteristic, short-term\n" in said.out
    assert "design strength 80 MPa permanently, 120 MPa during erection\n" in said.out
    assert "of gfrp's permanent design strength" in said.out
    saved = rs.read(out)
    assert saved.results.plain()["rod"]["chosen"] == {"material": True, "section": True}
    assert saved.results.plain()["bending"]["strength_of"] == "gfrp"
    used = saved.results.plain()["bending"]["clamped"]["utilisation"]
    assert used <= 1
    assert f"{chosen}sized for the permanent strength; reached {percent(used)} in the final" in said.out
    again = load_case(Path(out) / "case.toml")
    assert again.rod.left_open == ()
    assert again.build().rod.parameters() == {key: saved.results.plain()["rod"][key] for key in ("section", "material")}


def table_of_rods(path: Path, rods: int, share: float) -> str:
    """A square of crossing rods of 10 m whose ends come together to a share of that."""
    names = [
        f"{when}_{axis}{end}" for when, axes in (("flat", "xy"), ("final", "xyz")) for end in "01" for axis in axes
    ]
    rows = [",".join(names)]
    for off in 8 * ((np.arange(rods) + 0.5) / rods - 0.5):
        for flip in (1, -1):
            flat = np.array([[-5.0, off][::flip], [5.0, off][::flip]])
            final = np.column_stack([share * flat, np.zeros(2)])
            rows.append(",".join(map(repr, [*flat.ravel().tolist(), *final.ravel().tolist()])))
    path.write_text("\n".join(rows))
    return str(path)


@pytest.mark.slow
@pytest.mark.parametrize(("rods", "share"), [(4, 0.92), (8, 0.92), (8, 0.98), (18, 0.95)])
def test_rods_of_a_table_use_what_they_are_chosen_for_and_the_summary_says_so(
    rods: int, share: float, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """They are bound to each other, and bend several times as sharply as single rods. Timber is chosen without k_h and
    k_m, so that it uses less."""
    table, out = table_of_rods(tmp_path / "rods.csv", rods, share), str(tmp_path / "out")
    main(["popup", table, "--unit", "m", "--rod.material.preset", "larch", "--checks.stages", "0", "--out", out, "-v"])
    said = capsys.readouterr()
    bent = rs.read(out).results.plain()["bending"]["pinned"]
    estimate = bent["max_stress"] / (30e6 * PERMANENT["larch"])
    assert 0.75 / 2 < estimate <= 0.75
    assert (
        f"by the bends of a pop-up, aiming at 75 % of the permanent strength at most and coming to {percent(estimate)}"
        in (said.err)
    )
    assert estimate / 1.3 / 1.2 < bent["utilisation"] < estimate
    assert f"reached {percent(bent['utilisation'])} in the final shape" in said.out


def permanent_use(form: rs.Form) -> float:
    """Share of larch's permanent strength (0.6/1.3 of 30 MPa) by the largest stress in any popped-up shell."""
    shells = form.stages.popped.values()
    stresses = [bending_of(shell.shell, shell.state, form.rod, shear_weight=30 / 4).stress for shell in shells]
    assert all(stress is not None for stress in stresses)
    return max(float(stress.max()) for stress in stresses if stress is not None) / (30e6 * PERMANENT["larch"])


def net_table(target: rs.Target, spacing: float) -> RodEnds:
    """Rods whose ends lie on a target where its net has them, so that each bends as the target does."""
    layout = rs.GridLayout.orthogonal(spacing=spacing)
    stages = rs.find_form(target, layout, rs.Rod(rs.Circle(0.005), rs.Material.preset("gfrp")), ends=()).stages
    flat = np.array([rod.point([rod.start, rod.end]) for rod in stages.footprint.mesh.grid.rods])
    return RodEnds(straight_rods(flat), stages.boundary.points.reshape(-1, 2, 3))


@pytest.mark.parametrize("spacing", [1.6, 0.9])
def test_rods_of_a_table_with_many_joints_are_as_thick_as_those_with_few(spacing: float) -> None:
    """On a cap of radius 12 m laths bend by 1/12 m and in their own plane not at all; ends bend a quarter more."""
    form = rs.Job.of_table(net_table(rs.Cap(radius=12.0, base=10.5), spacing), rod__material__preset="larch").run(
        until="pop-up"
    )
    assert form.status == "converged"
    assert 0.75 / 2 < permanent_use(form) <= 0.75
    section = form.rod.section
    assert isinstance(section, rs.RectangularSection)
    strain = 30e6 * PERMANENT["larch"] / form.rod.material.youngs_modulus  # type: ignore[union-attr]
    assert section.width / 2 / 12.0 < 0.75 * strain < 2 * 1.25 * section.width / 2 / 12.0


def test_shells_that_were_popped_up_are_kept_where_the_size_that_fits_better_is_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    tried, said = list[rs.Rod](), list[str]()

    def late(*_: object) -> None:
        raise rs.OutOfTimeError("the time limit is over")

    def found(grid: Any, final: Any, rod: rs.Rod, **options: Any) -> Any:
        tried.append(rod)
        return pop_up_stages(grid, final, rod, **{**options, "progress": late if len(tried) > 1 else silent})

    monkeypatch.setattr("rodshell.run.pop_up_stages", found)
    table = table_of_rods(tmp_path / "rods.csv", 4, 0.92)
    job = rs.Job.of_table(table, unit="m", rod__material__preset="larch")
    form = job.run(until="pop-up", announce=said.append)
    assert len(tried) == 2
    assert form.rod == tried[0] != tried[1]
    assert form.status == "converged"
    assert f"{size_text(tried[1].section)} fits better, but was not popped up: the time limit is over" in said
    assert f"coming to {percent(permanent_use(form))}; " in said[-1]


@pytest.mark.parametrize("joint", [rs.Ball(), rs.Rigid()])
def test_shells_of_any_size_of_rod_bend_alike(joint: rs.Ball | rs.Rigid) -> None:
    """Moments grow with EI; what is left is stretch, as the square of slenderness. One shell may be the mirror image of
    the other."""
    target, layout = half_sphere(5.0)
    shapes = []
    for radius in (1e-3, 4e-3):
        rod = rs.Rod(rs.Circle(radius), rs.Material.preset("gfrp"))
        form = rs.find_form(target, layout, rod, joint=joint, ends=("pinned",))
        shapes.append(bends_of_pop_ups(form.stages.popped.values(), rod))
    thin, thick = ([np.sort(np.abs(values)) for values in bends[:3]] for bends in shapes)
    for one, other in zip(thin, thick, strict=True):
        assert np.abs(one - other).max() <= 0.01 * other.max()


@pytest.mark.parametrize("keys", [{}, {"rod.section.kind": "circle"}])
def test_moments_of_rigid_joints_count_when_a_section_is_chosen(keys: dict[str, str]) -> None:
    """By the net alone the laths would use three times the permanent strength."""
    said = list[str]()
    rigid = {"joint.kind": "rigid", "layout.spacing": "0.9 m", "rod.material.preset": "larch", **keys}
    job = rs.Job.of_case(roof(**rigid))
    form = job.run(until="pop-up", announce=said.append)
    assert form.status == "converged"
    used = permanent_use(form)
    assert 0.75 / 2 < used <= 0.75
    assert (
        f"by the bends of a pop-up, aiming at 75 % of the permanent strength at most and coming to {percent(used)}"
        in (said[-1])
    )
    by_net = rs.Rod(job.case.build().rod.section, form.rod.material)
    thick = rs.find_form(form.target, form.layout, by_net, joint=rs.Rigid(), ends=("clamped",))
    assert permanent_use(thick) > 1.5
    assert form.case.rod.left_open == ()
    solved = list[str]()
    again = job.run(until="pop-up", warm_start=form, progress=lambda stage, *_: solved.append(stage))
    assert again.rod == form.rod
    assert "pop-up" in again.reused
    assert not {"drape", "pop-up"} & set(solved)


def test_without_a_pop_up_rigid_joints_are_said_not_to_be_in_the_estimate() -> None:
    said = list[str]()
    rs.Job.of_case(roof(**{"joint.kind": "rigid"})).run(until="drape", announce=said.append)
    assert "chosen to fit, by an estimate of the bends without the moments of the joints, aiming at 75 %" in said[-1]


def test_elastic_joints_bend_thin_rods_more_than_thick_ones_and_the_section_that_is_kept_is_checked() -> None:
    """The stiffness of the joints stays, while EI falls with the fourth power of the radius."""
    spring = {"joint.kind": "spring", "joint.shear": "20 N m/rad", "joint.out_of_plane": "5 kN m/rad"}
    keys = {**spring, "layout.spacing": "0.9 m", "rod.material.preset": "larch", "rod.section.kind": "circle"}
    saddle = {"target.formula": "2 + 0.08*x^2 - 0.1*y^2", "target.size": "8 m, 7 m"}
    form = rs.Job.of_case(roof(**saddle, **keys)).run(until="pop-up")
    assert form.status == "converged"
    assert 0.75 / 2 < permanent_use(form) <= 0.75


def test_a_bolt_as_wide_as_the_rod_that_rigid_joints_leave_room_for_is_refused() -> None:
    """The net alone would have allowed laths of 8 x 20 mm."""
    keys = {"joint.kind": "rigid", "layout.spacing": "0.9 m", "rod.material.preset": "larch", "strength.hole": "8 mm"}
    with pytest.raises(InputError, match="hole"):
        rs.Job.of_case(roof(**keys)).run(until="pop-up")


def test_torsion_counts_where_rods_are_twisted_and_hardly_bent() -> None:
    """On z = c x y rods along the axes are straight, and pins twist them by c per length at the middle; a round rod's
    stress is that of bending and torsion at its outline [Timoshenko and Goodier, section 101]."""
    c = 0.1
    target = rs.HeightField(formula=f"{c}*x*y", domain=rs.Rectangle((6.0, 6.0)))
    rod = rs.Rod(rs.Circle(0.01), rs.Material.preset("larch"))
    form = rs.find_form(
        target, rs.GridLayout.orthogonal(spacing=1.0), rod, anchor=(0.0, 0.0), joint=rs.Pin(), ends=("pinned",)
    )
    bends = bends_of_pop_ups(form.stages.popped.values(), rod)
    assert np.abs(bends.twist).max() == pytest.approx(c, rel=0.1)
    assert np.hypot(bends.normal, bends.geodesic).max() < 0.3 * c
    alone = Bends(np.array([0.02]), np.array([0.0]), np.array([0.1]))
    assert rod.material is not None
    young, shear = rod.material.youngs_modulus, rod.material.shear_modulus
    expected = 0.01 * np.hypot(0.02, 7.5 * shear / young * 0.1)
    assert largest_strain(rod, alone, shear_weight=7.5) == pytest.approx(expected, rel=1e-6)


def test_a_summary_claims_no_share_of_the_strength_that_is_not_so(tmp_path: Path) -> None:
    """The same result, had its rods bent more sharply than estimated."""
    table, out = table_of_rods(tmp_path / "rods.csv", 4, 0.92), str(tmp_path / "out")
    main(["popup", table, "--unit", "m", "--checks.stages", "0", "--quiet", "--out", out])
    found = rs.read(out).results
    bent = found.bending.model_copy(update={"pinned": found.bending.pinned.model_copy(update={"utilisation": 0.98})})
    assert "sized for the permanent strength; reached 98 % in the final" in (
        summary_text(found.model_copy(update={"bending": bent}), verbose=True)
    )
    assert "thinner than any size" not in summary_text(found, verbose=True)
    thin = found.rod.model_copy(update={"section": rs.figures.form.Section(kind="circle", radius=0.4e-3)})
    unsold = found.model_copy(update={"rod": thin})
    assert "; thinner than any size that is sold, the first of which is rod 1 mm\n" in summary_text(
        unsold, verbose=True
    )
    assert any(
        reason.startswith("the chosen section is thinner than any size that is sold") and "rod 1 mm" in reason
        for reason in verdict(unsold).reasons
    )
    assert not any("thinner than any" in reason for reason in verdict(found).reasons)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("keys", "limit"),
    [
        ({}, "the next size that is sold, lath 15 x 40 mm, would use 78 % at the sharpest bend"),
        ({"joint.kind": "pin"}, "at the sharpest bend, since the joints keep it from rolling and bend it edgewise too"),
        ({"layout.spacing": "150 mm"}, "lath 10 x 30 mm, is wider than a sixth of the spacing, 25 mm"),
        (
            {"rod.material.preset": "gfrp"},
            "tube 50 x 4 mm, would use 86 % at the sharpest bend",
        ),
        ({"rod.material.preset": "spring-steel", "layout.spacing": "1.5 m"}, "; no thicker one is sold"),
        ({"checks.strength": "2 MPa"}, "no size that is sold fits: the thinnest, lath 3 x 10 mm, would use "),
        ({"rod.section.kind": "circle"}, "a thicker one would use more at the sharpest bend"),
    ],
)
def test_what_keeps_a_chosen_section_from_being_thicker_is_named(keys: dict[str, str], limit: str) -> None:
    case = roof(**{"rod.material.preset": "larch", **keys})
    target, layout, rod, *_ = case.build()
    fit = case.fit_on(target, layout)
    assert isinstance(rod.section, rs.Circle | rs.Tube | rs.RectangularSection)
    assert rod.material
    why = fit.reason(rod.section, rod.material, strength=case.permanent_strength(rod.material), shape=case.rod.shape)
    assert limit in why


def test_the_thickest_lath_that_is_sold_is_taken_before_thinner_ones_that_are_not() -> None:
    """Bends by which the thinnest of the sizes uses 0.33 of the strength: 0.72 of the permanent one."""
    larch, thin = rs.Material.preset("larch"), TRADE_SIZES["larch"][0]
    assert larch.bending_strength
    curvature = 0.33 * larch.bending_strength / larch.youngs_modulus / 1.5e-3
    bends = Bends(np.array([curvature]), np.zeros(1))
    assert Fit(10.0, 0.025, 0.05, lambda: bends).section(larch) == thin


@pytest.mark.slow
def test_a_given_strength_wins_over_the_presets(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    target, layout = half_sphere(5.0)
    rod = rs.Rod(rs.Circle(0.005), rs.Material.preset("gfrp"))
    form = rs.find_form(target, layout, rod, ends=("clamped",))
    bending = form.archive(options=rs.OutputOptions(strength=100e6, stages=0)).results.plain()["bending"]
    assert (bending["strength"], bending["strength_of"]) == (100e6, None)
    bending = form.archive(options=rs.OutputOptions(stages=0)).results.plain()["bending"]
    assert (bending["strength"], bending["strength_of"]) == (80e6, "gfrp")
    assert bending["clamped"]["utilisation"] == bending["clamped"]["max_stress"] / 80e6


def test_the_provisional_rod_of_a_table_is_sized_by_how_far_its_ends_come_together() -> None:
    """A rod whose tangent turns by 0.3 cos(pi s / L) is bent by 0.3 pi / L at its middle; its chord is the integral."""
    s = (np.arange(1000) + 0.5) / 1000
    chord = 2.0 * float(np.mean(np.cos(0.3 * np.cos(np.pi * s))))
    fit = Fit.between(np.array([2.0]), np.array([[[0.0, 0.0, 0.0], [chord, 0.0, 0.0]]]))
    np.testing.assert_allclose(fit.bends().normal, 0.3 * np.pi / 2.0, rtol=0.01)  # theta^2 / 32 of it
    assert fit.preset == "gfrp"


def test_a_table_whose_rods_bend_to_rings_still_has_a_size() -> None:
    fit = Fit.between(np.array([2.0]), np.zeros((1, 2, 3)))
    assert 0 < fit.section(rs.Material.preset("petg")).depth < 0.01


def test_a_rod_fits_the_heading_that_a_search_finds(tmp_path: Path) -> None:
    """On a barrel rods bend least at 45 degrees: half as sharply as across it, so that twice as thick ones fit."""
    options = ["--formula", "sqrt(25 - x^2) - 4", "--target.domain", "rectangle", "--target.size", "6 m, 6 m"]
    options += ["--spacing", "1.5 m", "--rotate", "auto", "--objective", "curvature", "--pop_up.ends", "clamped"]
    options += ["--rod.material.preset", "larch", "--checks.strength", "14 MPa"]
    out = tmp_path / "barrel"
    assert main(["form", "heightfield", *options, "--only", "csv", "--quiet", "--out", str(out)]) == 0
    case = load_case(out / "case.toml")
    target, layout, rod, *_ = case.build()
    assert layout.rotate == pytest.approx(np.pi / 4)
    assert rod.section == Fit.on(target, layout, anchor=case.drape.anchor).section(
        rs.Material.preset("larch"), strength=14e6
    )
    across = rs.GridLayout.orthogonal(spacing=1.5)
    assert rod.section.depth > Fit.on(target, across).section(rs.Material.preset("larch"), strength=14e6).depth


# Sizes of which one was given in another unit than was meant


@pytest.mark.parametrize(
    ("case", "keys", "said"),
    [
        (
            "pavilion",
            {"rod.section": {"kind": "rectangle", "width": 35, "height": 50}, "rod.material.preset": "larch"},
            "the section of 50 m is as wide as the shell of 12 m: check its unit .a section of 50 mm would be usual",
        ),
        (
            "pavilion",
            {"rod.section.radius": 0.7, "rod.section.thickness": 0.001},
            "the section of 1.4 m is as thick as the spacing of the rods, 800 mm: check its unit .a section of 14 mm",
        ),
        (
            "hemisphere",
            {"target.radius": 200, "layout.spacing": "auto", "layout.edge": "auto"},
            "the section of 2 mm is thin for the shell of 400 m, .*: check its unit .a shell of 400 mm would be.* to",
        ),
        (
            "hemisphere",
            {"target.radius": "0.2 mm", "layout.spacing": "auto", "layout.edge": "auto"},
            "the section of 2 mm is as wide as the shell of 0.4 mm: .*a section of 0.002 mm or a shell of 400 mm would",
        ),
    ],
)  # fmt: skip
def test_sizes_that_do_not_suit_each_other_are_refused_before_the_net(
    case: str, keys: dict[str, Any], said: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("rodshell.run.find_stages", None)
    whole = {"layout.rods": "auto", "layout.length": "auto"}
    with pytest.raises(InputError, match=said):
        rs.Job.load(case, whole | keys).run()


LENGTH = {"m": 1.0, "mm": 1e-3, "cm": 0.01, "in": 0.0254, "ft": 0.3048}  # m


@pytest.mark.parametrize("given", LENGTH)
@pytest.mark.parametrize("drawn", LENGTH)
def test_a_saddle_of_18_m_that_is_read_in_another_unit_is_told_with_its_own(
    drawn: str, given: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Refused if rods or spacing are given; with both left open it is said before the net."""
    monkeypatch.setattr("rodshell.run.find_stages", lambda *stages, **options: {}["drape"])
    x, faces = sheet(lambda x, y: 3 + (x * x - y * y) / 60, 9.0, 12)
    (tmp_path / "saddle.obj").write_bytes(as_obj(x / LENGTH[drawn], faces))
    width = 18 * LENGTH[given] / LENGTH[drawn]
    rods = {"rod.section": {"kind": "circle", "radius": "8 mm"}, "rod.material.preset": "gfrp"}
    sized = ({"layout.spacing": "1 m"}, rods, rods | {"layout.spacing": "1 m"}) if width < 100 else ()
    for keys in ({}, *sized):
        said = list[str]()
        with pytest.raises((InputError, KeyError)) as end:
            rs.Job.load(tmp_path / "saddle.obj", {"target.unit": given} | keys).run(announce=said.append)
        words = " ".join([*said, str(end.value)])
        if width > 1e3:
            assert f"give another unit, such as {drawn}" in words
        elif width < (1 if keys else 2):
            assert re.search(rf"check its unit.*18 m(, drawn)? in {drawn}\b", words)
        elif not keys:
            assert ("check its unit" in words) == (width > 200)
        elif drawn == given:
            assert isinstance(end.value, KeyError)


def test_micro_structures_with_rods_to_match_are_not_spoken_of(tmp_path: Path) -> None:
    """27 um wide, from a file in um, and as a hemisphere; with rods as slender as those of roofs."""
    x, faces = sheet(lambda x, y: 3 + (x * x - y * y) / 40, 13.5, 12)
    (tmp_path / "saddle.obj").write_bytes(as_obj(x, faces))
    rods = {"layout.spacing": "2 um", "rod.material.preset": "petg"}
    rods["rod.section"] = {"kind": "circle", "radius": "0.05 um"}
    said = list[str]()
    form = rs.Job.load(tmp_path / "saddle.obj", {"target.unit": "um"} | rods).run(announce=said.append, until="pop-up")
    assert form.status == "converged"
    assert not any("check its unit" in words for words in said)


def test_sizes_are_compared_for_objects_and_tables_too(tmp_path: Path) -> None:
    larch = rs.Material.preset("larch")
    with pytest.raises(InputError, match="the section of 50 m is as wide as the shell of 10 m"):
        rs.find_form(*half_sphere(5.0), rs.Rod(rs.RectangularSection(35.0, 50.0), larch))
    table = table_of_rods(tmp_path / "rods.csv", 4, 0.92)
    with pytest.raises(InputError, match="the section of 16 m is as wide as the shell of"):
        rs.Job.of_table(table, unit="m", rod=rs.Rod(rs.Circle(8.0), larch)).run()


@pytest.mark.parametrize("scale", [1e-4, 1.0, 40.0])
@pytest.mark.parametrize("slender", [12, 200, 20_000])  # width of the shell over the diameter of its rods
def test_sizes_that_suit_each_other_are_taken_at_every_scale(scale: float, slender: float) -> None:
    rod = rs.Rod(rs.Circle(scale / slender), rs.Material.preset("gfrp"))
    target = rs.Hemisphere(scale)
    rs.Job(target, rs.GridLayout.orthogonal(spacing=scale / 5), rod).case.build(target)


def weighed(form: rs.Form, ends: str) -> float:
    """Times its own weight that the shell carries; above 100: infinite."""
    return form.checks.self_weight[ends].load_factor or np.inf


@pytest.mark.slow
def test_a_chosen_section_carries_its_weight_with_its_reserve_where_the_whole_strength_allows_it() -> None:
    """The next thinner size, which three quarters of the strength allow, does not."""
    wide = {"target.kind": "paraboloid", "target.radius": 12.0, "target.height": 8.0, "checks.stages": 2}
    said: list[str] = []
    form = rs.Job.load(wide).run(announce=said.append)
    assert min(weighed(form, ends) for ends in form.ends) >= 1.5
    assert any("as its own weight asks for" in line for line in said)
    sizes = TRADE_SIZES["gfrp"]
    thinner = sizes[sizes.index(form.rod.section) - 1]
    section = {f"rod.section.{key}": value for key, value in vars(thinner).items()} | {"rod.section.kind": thinner.kind}
    other = rs.Job.load({**wide, **section, "rod.material.preset": "gfrp"}).run()
    assert min(weighed(other, ends) for ends in other.ends) < 1.5 * 1.05
    used = {name: form.archive().results.bending.shapes()[name].utilisation for name in form.ends}  # type: ignore[union-attr]
    assert 0.75 < max(value or 0.0 for value in used.values()) <= 1


@pytest.mark.slow
def test_where_no_size_carries_its_weight_the_place_that_is_too_sharp_is_named() -> None:
    """The radius of the shell that was found is that of the place, whose x and y are on one of its rods."""
    spruce = {"target.kind": "paraboloid", "target.radius": 6.0, "target.height": 3.0, "rod.material.preset": "spruce"}
    form = rs.Job.load({**spruce, "pop_up.ends": "pinned", "checks.stages": 2}).run()
    reason = form.verdict.reasons[0]
    named = re.search(
        r"its weight asks for (lath \S+ x \S+ mm), and the radius of (\S+) m at (\S+), (\S+) m is too sharp for it: "
        r"make it flatter than (\S+) m there",
        reason,
    )
    assert named is not None, reason
    bent, mesh = form.checks.bending["pinned"], form.footprint.mesh
    assert float(named[2]) == pytest.approx(1 / bent.curvature.max(), rel=0.01)
    at = form.popped["pinned"].positions[mesh.rod_nodes[int(np.argmax(bent.stress))]]
    assert np.abs([float(named[3]), float(named[4])]) == pytest.approx(np.abs(at[:2]), abs=0.01)  # or a mirror image
    size = next(each for each in TRADE_SIZES["spruce"] if size_text(each) == named[1])
    used = form.archive().results.bending.shapes()["pinned"].utilisation  # type: ignore[union-attr]
    assert isinstance(size, rs.RectangularSection)
    assert isinstance(form.rod.section, rs.RectangularSection)
    sharper = max(size.width / form.rod.section.width, size.height / form.rod.section.height)
    assert float(named[5]) / float(named[2]) == pytest.approx((used or 0.0) * sharper, rel=0.02)

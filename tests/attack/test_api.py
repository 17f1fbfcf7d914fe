"""Hostile arguments: every parameter of everything public gets values of other kinds and at the edges, the others stay
valid. What comes back is an object whose figures are finite, or one sentence of rodshell's."""

import inspect
import math
import os
import random
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from fractions import Fraction
from functools import cache
from numbers import Number
from typing import Any

import numpy as np
import pytest

import rodshell as rs

pytestmark = pytest.mark.attack

TRIES = 40 * int(os.environ.get("RODSHELL_ATTACK", "1"))  # of each call that computes something
LONGEST = 2000  # characters of a message

ITSELF: list[Any] = []
ITSELF.append(ITSELF)
NESTED: dict[str, Any] = {}
NESTED["target"] = NESTED


def hostile() -> list[Any]:
    """Values that are hardly ever what a parameter wants; made anew, since some can be used up."""
    return [
        None, True, float("nan"), math.inf, -math.inf, -1, 0, 1, 2.5, 1e300, -1e300, 1e-300, 10**400, 10**5000, 1j,
        Fraction(1, 3), "", "x", "auto", "1 mm", "a\0b", "x" * 5000, b"x", [], {}, (), [1], (0.0, 1.0, 2.0), ["x", "x"],
        {"x": 1}, {0: "x"}, ITSELF, NESTED, np.array(0.0), np.array("x"), np.float64("nan"), np.int8(-1), np.zeros(3),
        np.zeros((2, 2)), np.full((2, 3), np.nan), np.array([None]), object(), int, lambda: None, (n for n in range(3)),
        np.zeros((0, 3)), range(3), slice(None), rs.Pin, rs.Ball(),
    ]  # fmt: skip


@cache
def parts() -> dict[str, Any]:
    """What calls are made of: a small form, its parts, and a rod that moves."""
    target, layout = rs.Hemisphere(radius=0.2), rs.GridLayout.orthogonal(spacing=0.08)
    rod = rs.Rod(rs.Circle(radius=1e-3), rs.Material(youngs_modulus=1e6, density=1e3))
    form = rs.find_form(target, layout, rod, ends="pinned")
    trimmed = rs.trim(rs.drape(layout, rod, target))
    line = rs.ElasticRod.of(np.linspace([0.0, 0.0, 0.0], [1.0, 0.0, 0.0], 5), rod, clamped=("start",))
    return {
        "target": target, "layout": layout, "rod": rod, "form": form, "trimmed": trimmed, "line": line,
        "footprint": rs.map_back(trimmed), "boundary": trimmed.boundary, "popped": form.popped["pinned"],
        "motion": rs.Motion.of(line, forces=(rs.GravityForce(line.nodes),)), "state": line.state(),
        "cross": rs.straight_rods([[(-1.0, 0.0), (1.0, 0.0)], [(0.0, -1.0), (0.0, 1.0)]]),
    }  # fmt: skip


class Call:
    """A call of something public with valid arguments by their names, of which one after the other is replaced."""

    def __init__(self, made: Callable[..., Any], **arguments: Any) -> None:
        self.made, self.arguments = made, arguments

    def parameters(self) -> list[str]:
        known = inspect.signature(self.made).parameters.values()
        return [known_one.name for known_one in known if known_one.kind in (1, 3) and known_one.name != "self"]

    def fault(self, parameter: str, value: Any) -> str:
        """What is wrong with what comes back; "" where nothing is."""
        try:
            made = self.made(**{**self.arguments, parameter: value})
            said = repr(made)
            return next(_not_finite(made, allowed=_is_infinite(value)), "") or ("" if said else "no repr")
        except rs.RodshellError as error:
            said = str(error)
            return f"{len(said)} characters" if len(said) > LONGEST else "two lines" if "\n" in said else ""
        except Exception as error:
            return f"{type(error).__name__}: {error}"[:300]


def _is_infinite(value: object) -> bool:
    """As `inf` is, and an integer larger than any float."""
    return isinstance(value, float | int) and abs(value) > 1e308


def _not_finite(value: Any, name: str = "it", *, allowed: bool = False, depth: int = 0) -> Iterator[str]:
    """Figures in an object, its properties and what it is made of that are not numbers."""
    if isinstance(value, bool) or depth > 3:
        return
    if isinstance(value, Number):
        if not allowed and isinstance(value, float | np.floating) and not np.isfinite(value):
            yield f"{name} is {value}"
    elif isinstance(value, np.ndarray):
        if value.dtype.kind == "f" and np.isnan(value).any():
            yield f"{name} has nan"
    elif isinstance(value, Mapping | list | tuple):
        for item in value.values() if isinstance(value, Mapping) else value:
            yield from _not_finite(item, name, allowed=allowed, depth=depth + 1)
    elif type(value).__module__.startswith("rodshell.") and not isinstance(value, type):
        inner = dict(getattr(value, "__dict__", {}))
        if depth == 0:
            for kind in type(value).__mro__:
                for key, found in vars(kind).items():
                    if isinstance(found, property) and not key.startswith("_"):
                        with suppress(rs.RodshellError):
                            inner[key] = getattr(value, key)
        inner.pop("net", None)  # which has nan outside the target
        for key, item in inner.items():
            yield from _not_finite(item, f"{name}.{key}", allowed=allowed, depth=depth + 1)


def values() -> dict[str, Call]:
    """Everything public that makes a value, which takes no time."""
    own, rod = parts(), parts()["rod"]
    load = rs.PointLoad(at=(0.0, 0.0), force=(0.0, 0.0, -1.0))
    calls = {
        "Archive": Call(rs.Archive, results=own["form"].results, states={}),
        "Asymptotic": Call(rs.Asymptotic, spacing=0.1),
        "Curves": Call(rs.Curves, lines=[[(-1.0, 0.0), (1.0, 0.1)], [(0.0, -1.0), (0.1, 1.0, )]], spacing=0.1),
        "Ball": Call(rs.Ball, mass=0.1),
        "Boundary": Call(rs.Boundary, points=np.zeros((4, 3)), tangents=np.eye(4, 3)),
        "Cables": Call(rs.Cables, rod=rod),
        "Cap": Call(rs.Cap, radius=0.2, base=0.1),
        "Circle": Call(rs.Circle, radius=1e-3),
        "Damping": Call(rs.Damping),
        "Disc": Call(rs.Disc, radius=0.2),
        "DrawingStyle": Call(rs.DrawingStyle),
        "DynamicPopUpSettings": Call(rs.DynamicPopUpSettings),
        "Ellipse": Call(rs.Ellipse, a=1e-3, b=2e-3),
        "Ellipsoid": Call(rs.Ellipsoid, a=0.2, b=0.15, c=0.12),
        "ExplicitForce": Call(rs.ExplicitForce, force=lambda time, state, velocity: state),
        "ExplicitPenalty": Call(rs.ExplicitPenalty),
        "Fabrication": Call(rs.Fabrication, stock_length=1.0),
        "Fall": Call(rs.Fall),
        "FlatGrid.of": Call(rs.FlatGrid.of, rods=own["cross"].rods),
        "Footprint": Call(rs.Footprint, mesh=own["footprint"].mesh),
        "Geodesic": Call(rs.Geodesic, spacing=0.1),
        "GivenSection": Call(rs.GivenSection, EA=1.0, EI1=1.0, EI2=1.0, GJ=1.0),
        "Gravity": Call(rs.Gravity),
        "GravityForce": Call(rs.GravityForce, nodes=slice(None)),
        "GridLayout": Call(rs.GridLayout, rods="auto", spacing=(0.1, 0.1), length="auto", edge=0.01),
        "GridLayout.orthogonal": Call(rs.GridLayout.orthogonal, spacing=0.1),
        "HeightField": Call(rs.HeightField, formula="0.1 - x**2 - y**2", domain=rs.Disc(0.2)),
        "Hemisphere": Call(rs.Hemisphere, radius=0.2),
        "ImplicitEuler": Call(rs.ImplicitEuler),
        "ImplicitForce": Call(rs.ImplicitForce, force=lambda *now: (now[1], None, None), blocks=np.zeros((0, 1), int)),
        "ImplicitPenalty": Call(rs.ImplicitPenalty),
        "Job": Call(rs.Job, target=own["target"], layout=own["layout"], rod=rod),
        "Job.load": Call(lambda **keys: rs.Job.load("hemisphere", **keys)),
        "Job.of_case": Call(rs.Job.of_case, case=own["form"].case),
        "Laths": Call(rs.Laths, rod=rod),
        "LineLoad": Call(rs.LineLoad, line=((0.0, 0.0), (1.0, 0.0)), force=(0.0, 0.0, -1.0)),
        "Linker": Call(rs.Linker),
        "LocalEnergy": Call(rs.LocalEnergy, blocks=[[0, 1]], formula=lambda x: x[:, 0, 0]),
        "Loads": Call(rs.Loads, loads={"point": load}, combinations={"all": {"point": 1.0}}),
        "LockedJoints": Call(rs.LockedJoints, shear=1.0),
        "Material": Call(rs.Material, youngs_modulus=1e6, density=1e3),
        "Material.preset": Call(rs.Material.preset, name="larch"),
        "Motion": Call(rs.Motion, elements=own["motion"].elements, mass=own["motion"].mass,
                       constraint=own["motion"].constraint),
        "Motion.of": Call(rs.Motion.of, body=own["line"]),
        "OutputOptions": Call(rs.OutputOptions),
        "Paraboloid": Call(rs.Paraboloid, radius=0.2, height=0.1),
        "PatchLayout": Call(rs.PatchLayout),
        "Pin": Call(rs.Pin),
        "Placement": Call(rs.Placement),
        "PointLoad": Call(rs.PointLoad, at=(0.0, 0.0), force=(0.0, 0.0, -1.0)),
        "PointLoads": Call(rs.PointLoads, blocks=[0], forces=[[0.0, 0.0, 1.0]]),
        "Profile": Call(rs.Profile, stations=(0.0, 1.0), factors=(1.0, 2.0)),
        "Profile.double": Call(rs.Profile.double, share=0.5),
        "Profile.symmetric": Call(rs.Profile.symmetric, factors=(1.0, 2.0)),
        "Rectangle": Call(rs.Rectangle, size=(0.2, 0.3)),
        "RectangularSection": Call(rs.RectangularSection, width=1e-3, height=2e-3),
        "Results": Call(rs.Results),
        "Results.of": Call(rs.Results.of, content={}),
        "Rigid": Call(rs.Rigid),
        "Rod": Call(rs.Rod, section=rod.section, material=rod.material),
        "RodLoads": Call(rs.RodLoads),
        "RodSupports": Call(rs.RodSupports),
        "SelfWeight": Call(rs.SelfWeight),
        "Settlement": Call(rs.Settlement, supports=("U01.1",), move=(0.0, 0.0, -0.1)),
        "SharedDofs": Call(rs.SharedDofs),
        "Snow": Call(rs.Snow, value=500.0),
        "Spring": Call(rs.Spring, shear=1.0),
        "FreeEnds": Call(rs.FreeEnds, at="y > 3 m"),
        "HeldEnds": Call(rs.HeldEnds, at="U01.0"),
        "SlidingEnds": Call(rs.SlidingEnds, along=(1.0, 0.0, 0.0)),
        "SprungEnds": Call(rs.SprungEnds, stiffness=1e5),
        "ClampedEnds": Call(rs.ClampedEnds, turning=1e3),
        "EdgeBeam": Call(rs.EdgeBeam, rod=rod),
        "Ring": Call(rs.Ring, rod=rod),
        "Arch": Call(rs.Arch, rod=rod),
        "Support": Call(rs.Support, name="posts"),
        "SupportGroups": Call(rs.SupportGroups, groups=(rs.FreeEnds(),)),
        "Stability": Call(rs.Stability),
        "Strength": Call(rs.Strength),
        "Temperature": Call(rs.Temperature, change=30.0, expansion=1e-5),
        "Tube": Call(rs.Tube, radius=1e-2, thickness=1e-3),
        "Verdict": Call(rs.Verdict, level="good", reasons=("It stands.",)),
        "Wind": Call(rs.Wind, value=500.0, coefficient=0.5),
        "heights_from": Call(rs.heights_from, file="none.csv", size=(1.0, 1.0)),
        "mesh_grid": Call(rs.mesh_grid, grid=own["cross"], edge=0.1),
        "optimise": Call(rs.optimise, source={}, out="none"),
        "read": Call(rs.read, folder="none"),
        "read_sweep": Call(rs.read_sweep, folder="none"),
        "straight_rods": Call(rs.straight_rods, ends=[[(-1.0, 0.0), (1.0, 0.0)], [(0.0, -1.0), (0.0, 1.0)]]),
        "section_from": Call(rs.section_from, words="tube 32x3"),
        "surface_from": Call(rs.surface_from, file="none.obj"),
        "sweep": Call(rs.sweep, source={}, out="none"),
    }  # fmt: skip
    for name in ("Results", "Verdict"):  # their keys are those of result.json
        fields = list(getattr(rs, name).model_fields)
        calls[name].parameters = lambda fields=fields: fields  # type: ignore[method-assign, misc]
    calls["Job.load"].parameters = lambda: ["target__radius", "layout__rods", "loads", "target", "key"]  # type: ignore[method-assign]
    return calls


def work() -> dict[str, Call]:
    """Everything public that computes something of such values."""
    own = parts()
    target, layout, rod, form = own["target"], own["layout"], own["rod"], own["form"]
    shell = {"footprint": own["footprint"], "boundary": own["boundary"], "rod": rod}
    ends = np.array([[(-1.0, 0.0, 0.0), (1.0, 0.0, 0.0)], [(0.0, -1.0, 0.0), (0.0, 1.0, 0.0)]])
    return {
        "ElasticRod.of": Call(rs.ElasticRod.of, rest=np.eye(4, 3).cumsum(axis=0), rod=rod),
        "Job.run": Call(rs.Job(target, layout, rod, ends="pinned").run, warm_start=form, until="pop-up"),
        "Shell.of": Call(rs.Shell.of, mesh=own["footprint"].mesh, rod=rod),
        "agreement": Call(rs.agreement, popped=own["popped"], target=target),
        "chebyshev_net": Call(rs.chebyshev_net, target=target, layout=layout),
        "check": Call(rs.check, popped={"pinned": own["popped"]}, rod=rod, stages=1),
        "check_loads": Call(rs.check_loads, form=form, loads=rs.Loads(
            loads={"own": rs.SelfWeight()}, combinations={"all": {"own": 1.0}})),
        "drape": Call(rs.drape, layout=layout, rod=rod, target=target),
        "dynamic_pop_up": Call(rs.dynamic_pop_up, **shell, settings=rs.DynamicPopUpSettings(
            moving_time=0.02, duration=0.02)),
        "export": Call(rs.export, archive=form.unchecked(), folder="none", kinds="csv"),
        "fabricate": Call(rs.fabricate, mesh=own["footprint"].mesh, rod=rod, options=rs.Fabrication()),
        "find_form": Call(rs.find_form, target=target, layout=layout, rod=rod, ends="pinned", warm_start=form),
        "map_back": Call(rs.map_back, trimmed=own["trimmed"]),
        "pop_up": Call(rs.pop_up, **shell, ends="pinned"),
        "pop_up_table": Call(rs.pop_up_table, grid=own["cross"], rod=rod, finals=0.9 * ends),
        "refine": Call(rs.refine, form=form, vary=()),
        "save": Call(rs.save, archive=form.unchecked(), folder="none", kinds=[]),
        "search": Call(rs.search, target=target, layout=layout, rod=rod, anchors=[(0.0, 0.0)], headings=[0.0]),
        "settle": Call(rs.settle, popped=own["popped"], energies=[], free={0: [(1, 0, 0)]}),
        "simulate": Call(rs.simulate, motion=own["motion"], state=own["state"], until=1e-3, step=1e-3),
        "solve_rod": Call(rs.solve_rod, rod=own["line"]),
        "trim": Call(rs.trim, draped=own["trimmed"].draped),
    }  # fmt: skip


MADE = {  # by the calls above: what they are made of is not for users
    "Agreement", "Bound", "ChebyshevNet", "Draped", "DynamicPopUp", "ElasticRod", "FlatGrid", "FlatRod", "Form",
    "Freeform", "GridMesh", "PopUp", "RodShape", "Sample", "Shell", "Target", "TimeSeries", "Trimmed", "__version__",
    "bar", "ConvergenceError", "InputError", "NetLimitError", "OutOfTimeError", "OutputError", "RodshellError",
    "StabilityError",
}  # fmt: skip


def test_everything_public_is_attacked() -> None:
    assert set(rs.__all__) == MADE | ({*values(), *work()} & set(rs.__all__))


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


# what other folders refuse: results and sweeps
ELSEWHERE = {
    *((name, "folder") for name in ("export", "read", "read_sweep", "save")), ("sweep", "source"),
    ("optimise", "source"), ("Results", "version"), ("Results", "crossings_without_joint"),
}  # fmt: skip


def faults_of(calls: Mapping[str, Call], most: int | None) -> dict[str, str]:
    """What is wrong with what comes back, by call, parameter and value; of each call all tries, or at most so many."""
    faults, tried = {}, 0
    for name, call in calls.items():
        every = [(name, parameter, k) for parameter in call.parameters() for k in range(len(hostile()))]
        chosen = every if most is None else random.Random(name).sample(every, min(most, len(every)))
        for _, parameter, k in chosen:
            value = hostile()[k]
            tried += 1
            if (fault := call.fault(parameter, value)) and (name, parameter) not in ELSEWHERE:
                faults[f"{name}: {parameter} = {_shown(value)}"] = fault
    print(f"{tried} calls, {len(faults)} faults")
    return faults


def test_a_value_is_refused_in_a_sentence_or_is_sound() -> None:
    assert not faults_of(values(), None)


def test_work_begins_with_sound_arguments_only() -> None:
    assert not faults_of(work(), TRIES)


def _shown(value: object) -> str:
    try:
        return repr(value)[:40]
    except ValueError:
        return "a huge number"

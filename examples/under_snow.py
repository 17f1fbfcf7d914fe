"""Eight shells of the gallery under snow: with which rods, spacing and bracing they stand, and how much they carry.

Each was found by `rodshell form ... --snow "..."`, from pinned ends, or from clamped ones (`--pop_up.ends clamped`).
`python examples/under_snow.py NAME ...` checks some of them ("all": each, for some minutes) under 1.35 times their
weight with 1.5 times their snow, with imperfections of span/500 in three modes, and after years of creep; without
names it checks the garden pavilion. Ends that are in the air need beams, and most are erected over a scaffold: their
verdicts say which.
"""

import sys
from pathlib import Path
from typing import Any, NamedTuple

import rodshell as rs

DATA = Path(__file__).parent / "data"
LATHS = {"kind": "laths"}  # of the grid's rods, over the joints
BOTH_WAYS = {"kind": "laths", "pattern": "both"}
ROPES = {
    "kind": "cables", "pattern": "both", "prestrain": 5e-4, "ends_at": "supports", "section": "rod 4",
    "material": {"preset": "spring-steel", "youngs_modulus": "160 GPa"},
}  # fmt: skip


class Shell(NamedTuple):
    """A target, what it is made of, and the snow that it is checked under."""

    target: dict[str, Any]
    rod: str
    spacing: str
    bracing: dict[str, Any]
    snow: str
    ends: str = "pinned"


def formula(text: str, **domain: Any) -> dict[str, Any]:
    return {"kind": "heightfield", "formula": text, **(domain or {"radius": "5 m"})}


def mesh(name: str, **more: Any) -> dict[str, Any]:
    return {"kind": "mesh", "file": str(DATA / f"{name}.obj"), "unit": "mm", **more}


VAULT = formula("4*cos(0.28*x)", domain="rectangle", size=["9 m", "12 m"])
SHELLS = {
    "garden pavilion": Shell(
        {"kind": "paraboloid", "radius": "4.5 m", "height": "1.8 m"}, "tube 25x3", "500 mm", BOTH_WAYS, "0.5 kN/m2"
    ),
    "saddle": Shell(formula("(x^2 - y^2)/16"), "tube 42x3.5", "500 mm", {"kind": "none"}, "0.5 kN/m2"),
    "monkey saddle": Shell(formula("(x^3 - 3*x*y^2)/90"), "tube 16x2.5", "300 mm", ROPES, "0.5 kN/m2"),
    "freeform, OBJ": Shell(mesh("freeform"), "tube 20x2.5", "350 mm", BOTH_WAYS, "0.15 kN/m2"),
    "dome": Shell({"kind": "hemisphere", "radius": "5 m"}, "tube 16x2.5", "500 mm", ROPES, "0.25 kN/m2", "clamped"),
    "ball below its equator": Shell(mesh("ball", base="-1 m"), "rod 12", "500 mm", LATHS, "0.1 kN/m2", "clamped"),
    "torus": Shell(mesh("torus"), "tube 16x2.5", "600 mm", BOTH_WAYS, "0.05 kN/m2"),
    "barrel vault": Shell(VAULT, "tube 20x2.5", "290 mm", BOTH_WAYS, "0.1 kN/m2", "clamped"),
}  # fmt: skip


def job(name: str) -> rs.Job:
    shell = SHELLS[name]
    return rs.Job.load({
        "target": shell.target,
        "rod": {"section": shell.rod, "material": {"preset": "gfrp"}},
        "layout": {"spacing": shell.spacing},
        "pop_up": {"ends": shell.ends},
        "bracing": shell.bracing,
        "loads": [{"name": "own", "kind": "self_weight"}, {"name": "snow", "kind": "snow", "value": shell.snow}],
        "combinations": [
            {"name": "permanent", "factors": {"own": 1.35}},
            {"name": "winter", "factors": {"own": 1.35, "snow": 1.5}},
        ],
        "strength": {"creep": 0.3},
    })  # fmt: skip


def factors_of(name: str) -> dict[str, tuple[float, float]]:
    """By combination, how many times a shell carries it, and what rods or bracing use of their strength."""
    asked = job(name)
    loads = asked.case.built_loads()
    assert loads is not None
    shells = rs.check_loads(asked.run(until="pop-up"), loads).shells
    found = {}
    for combination, by_ends in shells.items():
        (shell,) = by_ends.values()
        years = shell.after_years
        factors = [shell.limit_factor, shell.imperfect_factor]
        factors += [years.limit_factor, years.imperfect_factor] if years else []
        kinds = [shell.limit_kind, shell.imperfect_kind]
        kinds += [years.limit_kind, years.imperfect_kind] if years else []
        assert "not followed" not in kinds, f"{name}: {kinds}"
        used = max(shell.utilisation or 0.0, shell.bracing_utilisation or 0.0)
        found[combination] = min(f for f in factors if f is not None), used
    return found


def main() -> None:
    names = sys.argv[1:] or ["garden pavilion"]
    for name in SHELLS if names == ["all"] else names:
        shell, found = SHELLS[name], factors_of(name)
        assert all(factor >= 1.5 and used <= 1 for factor, used in found.values()), f"{name}: {found}"
        said = ", ".join(f"{each} {factor:.2f} times, {100 * used:.0f} %" for each, (factor, used) in found.items())
        print(f"{name}, {shell.rod} at {shell.spacing}, {shell.ends}, {shell.snow}: {said}", flush=True)


if __name__ == "__main__":
    main()

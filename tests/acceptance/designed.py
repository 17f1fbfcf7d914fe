"""Prints the table of roofs that are designed to their loads: `python -m tests.acceptance.designed [count]`.

Forty random roofs of 4 to 24 m are given as meshes, with nothing but snow of 0.5 kN/m2. Where none stands, the cause
that is named is confirmed: of the size that was kept and the next thinner one the shell falls short of its reserve,
and the next thicker one uses more than its permanent strength.
"""

import json
import os
import resource
import subprocess
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import rodshell as rs
from rodshell.rods.section import TRADE_SIZES, Circle, Section, Tube, size_text
from tests.acceptance.rows import Row, print_table

SEED, ROOFS = 45, 40
SNOW = "0.5 kN/m2"
LEAST_GOOD = 0.5
MOST_FORMS = 150  # times the CPU time of a form without loads
KINDS = ("dome", "cap", "bump", "vault")
AROUND, OUT = 240, 24  # points of a mesh around and outwards


@dataclass(frozen=True)
class Roof:
    """A roof as its mesh.

    Args:
        width: the smaller one in plan [m].
    """

    name: str
    width: float
    points: np.ndarray
    faces: np.ndarray

    def write(self, folder: Path) -> Path:
        """An OBJ in mm, y up, as modelling programs write it."""
        path = folder / f"{self.name.replace(' ', '-')}.obj"
        rows = [f"v {1e3 * x:.1f} {1e3 * z:.1f} {-1e3 * y:.1f}" for x, y, z in self.points.tolist()]
        rows += ["f " + " ".join(str(k + 1) for k in face) for face in self.faces.tolist()]
        path.write_text("\n".join(rows) + "\n")
        return path


def roof(k: int) -> Roof:
    """The k-th: its plan an ellipse or a rounded rectangle, its edge level."""
    rng = np.random.default_rng((SEED, k))
    kind = KINDS[k % len(KINDS)]
    width = float(rng.uniform(4.0, 24.0))
    rise = width * float(rng.uniform(0.12, 0.35))
    long = (
        1.0
        if kind in ("dome", "cap")
        else float(rng.uniform(1.0, 1.4))
        if kind == "bump"
        else float(rng.uniform(1.4, 2.2))
    )
    angle = np.linspace(0.0, 2 * np.pi, AROUND, endpoint=False)
    if kind == "vault":  # a superellipse
        c, s = np.cos(angle), np.sin(angle)
        rim = np.column_stack([np.sign(c) * np.abs(c) ** 0.7, np.sign(s) * np.abs(s) ** 0.7])
    else:
        rim = np.column_stack([np.cos(angle), np.sin(angle)])
    share = np.linspace(0.0, 1.0, OUT + 1)[1:]
    unit = np.vstack([np.zeros((1, 2)), *(t * rim for t in share)])  # the widths are 1
    from_middle = np.concatenate([[0.0], np.repeat(share, AROUND)])
    if kind == "dome":
        height = rise * (1 - from_middle**2)
    elif kind == "cap":
        radius = (width**2 / 4 + rise**2) / (2 * rise)
        height = np.sqrt(radius**2 - (from_middle * width / 2) ** 2) - (radius - rise)
    elif kind == "vault":
        height = rise * (1 - from_middle**2)
    else:
        u, v = unit.T
        tilt, turn = rng.uniform(0.1, 0.35), rng.uniform(0, 2 * np.pi)
        height = rise * (1 - from_middle**2) * (1 + tilt * (u * np.cos(turn) + v * np.sin(turn)))
    points = np.column_stack([unit[:, 0] * width * long / 2, unit[:, 1] * width / 2, height])
    ring = np.arange(AROUND)
    following = (ring + 1) % AROUND
    faces = [np.column_stack([np.zeros(AROUND, dtype=int), 1 + ring, 1 + following])]
    for t in range(OUT - 1):
        inner, outer = 1 + t * AROUND, 1 + (t + 1) * AROUND
        faces += [np.column_stack([inner + ring, outer + ring, outer + following])]
        faces += [np.column_stack([inner + ring, outer + following, inner + following])]
    return Roof(f"{kind} {k}", width, points, np.vstack(faces))


def formed(path: Path, *more: str) -> tuple[dict, float]:
    """The result of a command, and its CPU time [s]."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    words = [sys.executable, "-m", "rodshell", "form", str(path), "--target.unit", "mm", "--target.up", "y", *more]
    found = subprocess.run(
        [*words, "--only", "csv", "--out", str(path.with_suffix("")), "--json", "--force", "-q"],
        capture_output=True, text=True, check=False, env=os.environ,
    )  # fmt: skip
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    assert found.stdout, found.stderr
    return json.loads(found.stdout), cpu


def neighbours(section: Section) -> tuple[Section | None, Section | None]:
    """The next thinner and the next thicker size that is sold."""
    sizes = TRADE_SIZES["gfrp"]
    k = sizes.index(section)
    return (sizes[k - 1] if k else None), (sizes[k + 1] if k + 1 < len(sizes) else None)


def judged(case: Path, section: Section) -> tuple[float, float]:
    """What the grid of a case carries made of another size, times its loads with imperfections, and what it uses of its
    permanent strength before they act."""
    sized = {f"rod.section.{key}": value for key, value in vars(section).items()} | {"rod.section.kind": section.kind}
    form = rs.Job.load(str(case), sized).run(until="pop-up")
    loads = form.case.built_loads()
    assert loads is not None
    shells = [shell for by_ends in rs.check_loads(form, loads).shells.values() for shell in by_ends.values()]
    known = [f for s in shells for f in (s.limit_factor, s.imperfect_factor) if f is not None]
    return min(known, default=np.inf), max(shell.utilisations.permanent for shell in shells)


def unconfirmed(result: dict, folder: Path) -> str:
    """Why the cause that a result names is not confirmed, or ""."""
    kept = result["rod"]["section"]
    size: Section = Tube(kept["radius"], kept["thickness"]) if kept["kind"] == "tube" else Circle(kept["radius"])
    reserve = next(iter(next(iter(result["loads"].values())).values()))["reserve"]
    if not result["design"]["limits"].startswith("strength:"):
        return f"another cause: {result['design']['limits']}"
    (thinner, thicker), case = neighbours(size), folder / "case.toml"
    factor, used = judged(case, size)
    if factor >= reserve or used > 1:
        return f"{size_text(size)} carries {factor:.3g} at {used:.3g} of its strength"
    if thicker is not None and (more := judged(case, thicker)[1]) <= 1:
        return f"{size_text(thicker)} uses {more:.3g} of its strength only"
    if thinner is not None and (less := judged(case, thinner)[0]) >= reserve:
        return f"{size_text(thinner)} carries {less:.3g}"
    return ""


def rows(count: int) -> Iterator[Row]:
    """Each roof as it was found, and the figures of all."""
    levels, times = Counter[str](), list[tuple[float, float]]()
    with tempfile.TemporaryDirectory() as folder:
        for k in range(count):
            each = roof(k)
            path = each.write(Path(folder))
            plain = formed(path)[1]
            result, cpu = formed(path, "--snow", SNOW)
            times.append((cpu, plain))
            level, design = result["verdict"]["level"], result["design"]
            levels[level] += 1
            last = design["steps"][-1]
            what = f"{last['section']}, {last['bracing']}, {last['spacing']:.3g} m"
            said = what if design["found"] else design["limits"]
            codes = [finding["code"] for finding in result["verdict"]["findings"] if finding["level"] != "good"]
            note = f"{each.width:.1f} m, {cpu:.0f} s, {level}: {said} {' '.join(codes)}"
            reason = "" if design["found"] else unconfirmed(result, path.with_suffix(""))
            yield Row(each.name, "the cause is not confirmed", float(bool(reason)), 0, "", f"{note} {reason}")
    good = levels["good"]
    yield Row("all", "not good", count - good, (1 - LEAST_GOOD) * count, "", str(dict(levels)))
    ratio = float(np.median([cpu for cpu, _ in times]) / np.median([plain for _, plain in times]))
    yield Row("all", "median CPU time over a form's", ratio, MOST_FORMS)


if __name__ == "__main__":
    sys.exit(print_table("designed", rows(int(sys.argv[1]) if len(sys.argv) > 1 else ROOFS)))

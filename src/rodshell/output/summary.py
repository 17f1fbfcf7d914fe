"""One screen of text about a result."""

from collections.abc import Iterator
from math import degrees
from typing import Any

from rodshell.output.verdict import unknown_below, utilisation
from rodshell.output.wording import NAMES, case_rows, percent, rounded, stage, stress

RUBBER = {"youngs_modulus": 1e6, "density": 1e3, "poisson_ratio": 0.5}  # [HQK section 3.1], what a case has by default


def summary_text(result: dict[str, Any]) -> str:
    """What was found, how good it is, and what to read first."""
    rods = result["rods"]
    joints = sum(len(rod["joints"]) for rod in rods) // 2
    verdict = "converged" if result["status"] == "converged" else f"NOT CONVERGED: {result['status']}"
    if (utilisation(result) or 0.0) > 1:
        verdict += ", but the rods would break"
    lines = [f"{result['name']}: {verdict}", f"  grid      {len(rods)} rods, {joints} joints"]
    lines += _rod(result["rod"])
    lines += _sewn(result)
    if net := result.get("net"):
        lines.append(
            f"  footprint known within {_mm(net['error_estimate'])} before extrapolation; "
            f"smallest angle {net['min_angle_deg']:.1f} deg"
        )
    if drape := result.get("drape"):
        work = sum(level["factorizations"] for level in drape["levels"])
        line = f"  drape     {drape['method']}: {drape['dofs']} unknowns, {work} factorisations, "
        line += f"{drape['seconds']:.2f} s, "
        gap = "gap" if drape["method"] == "bound" else "deepest node inside by"
        line += f"{gap} {_mm(drape['max_gap'])}, strain {drape['max_strain']:.1e}, "
        lines.append(line + f"negative modes {drape['negative_modes']}")
        if own := drape.get("own_ends"):
            lines.append(f"            its own rod ends within {_mm(own['max'])}, median {_mm(own['median'])}")
    for ends, shell in result.get("pop_up", {}).items():
        state = "stable" if shell["stable"] else shell["status"] + ", NOT STABLE"
        line = f"  pop-up    {ends:<8}{state}, {shell['factorizations']} factorisations, {shell['seconds']:.2f} s"
        if gap := result.get("agreement", {}).get(ends):
            line += f"; gap max {_mm(gap['max'])} ({percent(gap['max_relative'])}), "
            line += f"rms {_mm(gap['rms'])} ({percent(gap['rms_relative'])})"
        lines.append(line)
    lines += _checked(result)
    lines += _paths(result)
    lines += [f"  dropped   {rod['id']}: {rod['reason']}" for rod in result["dropped"][:6]]
    if len(result["dropped"]) > 6:
        lines.append(f"            and {len(result['dropped']) - 6} more, named in result.json")
    lines += [f"  WARNING   {warning}" for warning in result["warnings"]]
    return "\n".join(lines)


def _rod(rod: dict[str, Any]) -> Iterator[str]:
    """Section and material in one line, and whether it is the paper's rubber."""
    line = "  rod       " + ", ".join(" ".join(row) for row in case_rows(rod["section"])).removeprefix("kind ")
    if material := rod.get("material"):
        line += f"; E = {stress(material['youngs_modulus'])}, {rounded(material['density'], 4)} kg/m3"
        rubber = [NAMES.get(key, key) for key, value in RUBBER.items() if material.get(key) == value]
        if len(rubber) == len(RUBBER):
            line += " (the paper's rubber; for another: rod.material)"
        elif rubber:
            verb = "are" if len(rubber) > 1 else "is"
            line += f" ({' and '.join(rubber)} {verb} the paper's rubber's; for another: rod.material)"
    yield line


def _sewn(result: dict[str, Any]) -> Iterator[str]:
    """Each patch and each seam in a line of the summary."""
    for patch in result.get("patches") or []:
        line = f"  patch {patch['id']:<4}{patch['rods']} rods, heading {degrees(patch['rotate']):.1f} deg; "
        line += f"smallest angle {patch['net']['min_angle_deg']:.1f} deg"
        for ends, gap in patch["agreement"].items():
            line += f"; {ends} gap rms {percent(gap['rms_relative'])}"
        yield line
    moved = max((patch["ends_moved"] for patch in result.get("patches") or []), default=0.0)
    for number, seam in enumerate(result.get("seams") or [], start=1):
        line = f"  seam {number:<5}{len(seam['meetings'])} rods of either side meet, ends moved by {_mm(moved)} at most"
        for ends, force in (seam.get("forces") or {}).items():
            line += f"; {ends} it carries {rounded(force['largest'])} N at most"
        yield line


def _checked(result: dict[str, Any]) -> list[str]:
    """Bending and reactions, in a line each."""
    lines, unknown = [], unknown_below(result)
    for place, bent in result.get("bending", {}).items():
        if place == "pop_up" and unknown >= 1:
            continue
        if isinstance(bent, dict) and bent.get("min_radius") is not None:
            name = "way up" if place == "pop_up" else place
            line = f"  bending   {name:<8}smallest radius {_mm(bent['min_radius'])}"
            if bent.get("max_stress") is not None:
                line += f", largest stress {stress(bent['max_stress'])}"
            if bent.get("utilisation") is not None:
                line += f", {percent(bent['utilisation'])} of the strength"
            if place == "pop_up" and unknown:
                line += f"; unknown below {stage(unknown)} of it"
            lines.append(line)
    for ends, held in result.get("reactions", {}).items():
        sums = f"forces {held['force_imbalance']:.1e}, moments {held['moment_imbalance']:.1e} of the largest"
        lines.append(f"  reactions {ends:<8}largest {rounded(held['largest_force'])} N; sums of {sums}")
    return lines


def _paths(result: dict[str, Any]) -> Iterator[str]:
    """Whether the shell is reached from flat, and what other shapes it has."""
    way = result.get("deployment") or {}
    if "reached_from_flat" in way:
        snaps = f", snapping at {', '.join(stage(low) for low, _ in way['snaps'])}" if way["snaps"] else ""
        words = {True: f"reached{snaps}", False: "ends in another shape", None: "not known whether it is reached"}
        yield f"  from flat {way['ends']:<8}{words[way['reached_from_flat']]}"
        if way.get("clamped", {}).get("reached_from_flat"):
            yield "  from flat clamped reached: the ends are turned into their clamps after the deployment"
    for ends, searched in (result.get("other_shapes") or {}).items():
        others = [one for one in searched["found"] if not one["mirror"]]
        found = ["its mirror image"] if len(others) < len(searched["found"]) else []
        if others:
            near = min(others, key=lambda one: float(one["distance"]))
            found.append(
                f"{len(others)} other stable shape{'s' if len(others) > 1 else ''}, the nearest "
                f"{percent(near['distance'])} of half its width away at {rounded(near['energy'])} times the energy"
            )
        elif searched["tried"]:
            found.append("no other stable shape found")
        yield f"  shapes    {ends:<8}{'; '.join([*found, searched['searched']])}"


def _mm(metres: float) -> str:
    if abs(metres) >= 1.0:
        return f"{rounded(metres)} m"
    return f"{1e3 * metres:.3g} mm" if abs(metres) >= 1e-9 else "0 mm"

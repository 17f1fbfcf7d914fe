"""One screen of text about a result."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from math import degrees
from typing import Any

from rodshell.output.rounding import rounding_of
from rodshell.output.verdict import unknown_below, verdict_of
from rodshell.output.wording import NAMES, case_rows, millimetres, percent, rounded, share_of_weight, stage, stress

RUBBER = {"youngs_modulus": 1e6, "density": 1e3, "poisson_ratio": 0.5}  # [HQK section 3.1]

STAGES = ("pop_up", "deployment")  # of the deployment: with the final shape, and without
STRAIGHT = 1e-6  # 1/m, rad/m: what is less is round-off


def summary_text(result: dict[str, Any]) -> str:
    """What was found, how good it is, and what to read first."""
    rods = result["rods"]
    joints, mm = sum(len(rod["joints"]) for rod in rods) // 2, _lengths(result)
    verdict = verdict_of(result)
    lines = [f"{result['name']}: {verdict.headline}"]
    lines += [f"            {reason}" for reason in verdict.reasons[1:]]
    lines.append(f"  grid      {len(rods)} rods, {joints} joints")
    lines += _rod(result["rod"], result.get("bending") or {})
    lines += _sewn(result)
    if net := result.get("net"):
        lines.append(
            f"  footprint error {mm(net['error_estimate'])} before extrapolation; "
            f"smallest angle {net['min_angle_deg']:.1f} deg"
        )
    if drape := result.get("drape"):
        work = sum(level["factorizations"] for level in drape["levels"])
        line = f"  drape     {drape['method']}: {drape['dofs']} unknowns, {work} factorisations, "
        gap = "gap" if drape["method"] == "bound" else "deepest node inside by"
        line += f"{gap} {mm(drape['max_gap'])}, strain {drape['max_strain']:.1e}, "
        lines.append(line + f"negative modes {drape['negative_modes']}")
        if own := drape.get("own_ends"):
            lines.append(f"            drape against net, rod ends: max {mm(own['max'])}, median {mm(own['median'])}")
    for ends, shell in result.get("pop_up", {}).items():
        state = "stable, unloaded" if shell["stable"] else shell["status"] + ", NOT STABLE"
        line = f"  pop-up    {ends:<8}{state}, {shell['factorizations']} factorisations"
        if gap := result.get("agreement", {}).get(ends):
            line += f"; gap max {mm(gap['max'])} ({percent(gap['max_relative'])}), "
            line += f"rms {mm(gap['rms'])} ({percent(gap['rms_relative'])})"
        lines.append(line)
    lines += _checked(result)
    lines += _paths(result)
    lines += [f"  dropped   {rod['id']}: {rod['reason']}" for rod in result["dropped"][:6]]
    if len(result["dropped"]) > 6:
        lines.append(f"            and {len(result['dropped']) - 6} more, named in result.json")
    return "\n".join(lines)


def _rod(rod: dict[str, Any], bending: Mapping[str, Any]) -> Iterator[str]:
    """Section and material in a line; what is known of a preset, and what the program chose, in lines of their own."""
    yield f"  rod       {rod_text(rod)}"
    if chosen_here := rod.get("chosen"):
        reached = _reached(bending) if "section" in chosen_here else ""
        yield f"            {chosen(chosen_here)}{reached}"
    if known := rod.get("preset"):
        line = f"            {known['name']}: {known['grade']}"
        if known["bending_strength"] is not None:
            line += f"; bending strength {stress(known['bending_strength'])}, {known['strength_note']}"
        yield line


def chosen(what: Iterable[str]) -> str:
    """That the program chose a rod's material, section or both."""
    parts = list(what)
    return f"{' and '.join(parts)} {'were' if len(parts) > 1 else 'was'} not given: chosen to fit"


def _reached(bending: Mapping[str, Any]) -> str:
    """By what a section was chosen, and what the final shapes use of the strength."""
    if bending.get("strength") is None:
        return ", as slender as the paper's rods, since no strength is known"
    final = [(bending.get(ends) or {}).get("utilisation") for ends in ("pinned", "clamped")]
    known = [used for used in final if used is not None]
    reached = f"reached {percent(max(known))} in the final shape" if known else "what is reached is not known"
    return f", aiming at half of the bending strength at most by an estimate of the bends; {reached}"


def rod_text(rod: Mapping[str, Any]) -> str:
    """Section and material in a few words, and whether it is the paper's rubber."""
    line = ", ".join(" ".join(row) for row in case_rows(rod["section"])).removeprefix("kind ")
    if material := rod.get("material"):
        preset = material.get("preset")
        line += f"; {preset}, " if preset and preset != "rubber" else "; "
        line += f"E = {stress(material['youngs_modulus'])}, {rounded(material['density'], 4)} kg/m3"
        if preset and preset != "rubber":
            known = rod.get("preset") or {}
            changed = [NAMES.get(key, key) for key, value in material.items() if known.get(key, value) != value]
            return line + (f" ({' and '.join(changed)} not {preset}'s own)" if changed else "")
        rubber = [NAMES.get(key, key) for key, value in RUBBER.items() if material.get(key) == value]
        if len(rubber) == len(RUBBER):
            line += " (the paper's rubber; for another: rod.material)"
        elif rubber:
            verb = "are" if len(rubber) > 1 else "is"
            line += f" ({' and '.join(rubber)} {verb} the paper's rubber's; for another: rod.material)"
    return line


def _sewn(result: dict[str, Any]) -> Iterator[str]:
    """Each patch and each seam in a line of the summary."""
    mm = _lengths(result)
    for patch in result.get("patches") or []:
        line = f"  patch {patch['id']:<4}{patch['rods']} rods, heading {degrees(patch['rotate']):.1f} deg; "
        line += f"smallest angle {patch['net']['min_angle_deg']:.1f} deg"
        for ends, gap in patch["agreement"].items():
            line += f"; {ends} gap rms {percent(gap['rms_relative'])}"
        yield line
    moved = max((patch["ends_moved"] for patch in result.get("patches") or []), default=0.0)
    for number, seam in enumerate(result.get("seams") or [], start=1):
        line = f"  seam {number:<5}{len(seam['meetings'])} rods of either side meet, ends moved by {mm(moved)} at most"
        for ends, force in (seam.get("forces") or {}).items():
            line += f"; {ends} it carries {rounded(force['largest'])} N at most"
        yield line


def _checked(result: dict[str, Any]) -> list[str]:
    """Bending, own weight and reactions, in a line each."""
    lines, unknown, mm = [], unknown_below(result), _lengths(result)
    of = (result.get("bending") or {}).get("strength_of")
    strength = f"{of}'s bending strength" if of else "the strength"
    flat = (result.get("target") or {}).get("flat")
    for place, bent in ({} if flat else result.get("bending", {})).items():
        if place == "pop_up" and "deployment" in result["bending"]:
            continue  # the same with the final shape
        if place in STAGES and unknown >= 1:
            continue
        if isinstance(bent, dict) and bent.get("min_radius") is not None:
            name = "stages" if place in STAGES else place
            line = f"  bending   {name:<8}smallest radius {mm(bent['min_radius'])}{_curved(bent, mm)}"
            if bent.get("max_stress") is not None:
                line += f", largest stress {stress(bent['max_stress'])}"
            if bent.get("torsion_stress"):
                line += f" (torsion alone {stress(bent['torsion_stress'])})"
            if bent.get("utilisation") is not None:
                line += f", {percent(bent['utilisation'])} of {strength}"
            if place in STAGES and unknown:
                line += f"; unknown below {stage(unknown)} of it"
            lines.append(line)
    least = " (weakest patch, its seam held)" if result.get("patches") else ""
    for ends, weighed in result.get("self_weight", {}).items():
        line = f"  weight    {ends:<8}own weight borne: {share_of_weight(weighed)}{least}"
        if weighed.get("deflection") is not None:
            line += f"; deflection under it: {mm(weighed['deflection'])}"
        lines.append(line)
    for ends, held in result.get("reactions", {}).items():
        sums = f"forces {held['force_imbalance']:.1e}, moments {held['moment_imbalance']:.1e} of the largest"
        lines.append(f"  reactions {ends:<8}largest {rounded(held['largest_force'])} N; sums of {sums}")
    return lines


def _curved(bent: dict[str, Any], mm: Callable[[float], str]) -> str:
    """How the rods are curved out of the shell and within it, by radii, and twisted."""
    parts = [("normal_curvature", "out of the shell"), ("geodesic_curvature", "within it")]
    words = [f"{where} {mm(1 / bent[key])}" for key, where in parts if (bent.get(key) or 0.0) > STRAIGHT]
    if (bent.get("twist_rate") or 0.0) > STRAIGHT:
        words.append(f"twist {rounded(degrees(bent['twist_rate']))} deg/m")
    return f" ({', '.join(words)})" if words else ""


def _lengths(result: dict[str, Any]) -> Callable[[float], str]:
    """How lengths [m] are shown: to three figures, no finer than on the drawings."""
    rounding = rounding_of(result)

    def shown(metres: float) -> str:
        if abs(metres) >= 1.0:
            return f"{rounded(metres)} m"
        return millimetres(metres, rounding=rounding) if abs(metres) >= 1e-9 else "0 mm"

    return shown


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

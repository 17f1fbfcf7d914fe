"""A result in six lines of text, and in full."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from math import degrees, isinf

from rodshell.figures.checks import OTHER_SHAPES, Bending, SelfWeight, WorstBent
from rodshell.figures.form import Bent, RodType
from rodshell.figures.loads import DesignStrength
from rodshell.figures.records import printable
from rodshell.results.facts import mass_text
from rodshell.results.judged.deployment import unknown_below
from rodshell.results.judged.loads import UNLOADED, is_braced, least_carried
from rodshell.results.judged.shape import CONVERGED
from rodshell.results.judged.stress import strength_name
from rodshell.results.judged.supports import share_of_span, width
from rodshell.results.laths import laths_text, lengths_text
from rodshell.results.results import Results
from rodshell.results.sizes_sold import thinner_than_sold
from rodshell.results.verdict import verdict_of
from rodshell.results.wording import (
    NAMES,
    figure,
    percent,
    rounded,
    rounded_down,
    rounding_of,
    section_text,
    share_of_weight,
    shown_factor,
    shown_length,
    small,
    snow_text,
    stress,
    whole_percent,
)
from rodshell.rods.supports import CLAMPED, PINNED, clamped_among
from rodshell.units import places_text

RUBBER = {"youngs_modulus": 1e6, "density": 1e3, "poisson_ratio": 0.5}  # [HQK section 3.1]

STAGES = ("pop_up", "deployment")  # of the deployment: with the final shape, and without
STRAIGHT = 1e-6  # 1/m, rad/m: what is less is round-off
MOST_DROPPED = 6  # rods that are listed

Length = Callable[[float | None], str]


def summary_text(results: Results, *, verbose: bool = False) -> str:
    """Six lines: verdict, grid, rod, gap, stress, weight and snow; and what else was found, if `verbose`."""
    length, verdict = shown_length(results), verdict_of(results)
    said = [*_fallen(results, length), verdict.headline, *verdict.reasons[1:]]
    more = " (there are more reasons: --verbose, or the report)" * (verdict.level != "good" and len(said) > 1)
    laths = f"; {lengths_text(results)}" if laths_text(results) else ""
    lines = [
        f"{results.name or 'rodshell'}: {said[0]}{'' if verbose else more}",
        *(f"            {reason}" for reason in said[1:] if verbose),
        f"  grid      {len(results.rods)} rods{_apart(results, length)}, {_joints(results, length)}{laths}"
        f"{_braced(results)}{_extent(results, length)}",
        *([f"  rod       {rod_text(results.rod)}"] if results.rod else []),
        *_gap(results, length),
        *_stress(results),
        *_carried(results),
        *(_details(results, length) if verbose else ()),
    ]
    return "\n".join(map(printable, lines))


def _apart(results: Results, length: Length) -> str:
    """How far neighbouring rods are from each other, where the case says it."""
    spacing = results.layout.spacing if results.layout else None
    return f" {' x '.join(map(length, dict.fromkeys(spacing)))} apart" if spacing else ""


def _braced(results: Results) -> str:
    """By what the shell under loads is braced."""
    if not is_braced(results):
        return ""
    cables = any(brace.cut is not None for brace in results.bracing)
    return f"; braced by {'cables' if cables else 'laths'} along {len(results.bracing)} diagonals"


def _extent(results: Results, length: Length) -> str:
    """How wide the shell is, and how heavy."""
    wide, mass = width(results), mass_text(results)
    return f"; {length(wide)} wide" * (wide > 0) + (f", {mass}" if mass else "")


def _gap(results: Results, length: Length) -> Iterator[str]:
    """How near each shell comes to the target."""
    gaps = results.agreement.items()
    near = [f"{ends} {length(gap.max)} ({percent(gap.max_relative)} of its size)" for ends, gap in gaps]
    yield from _line("gap", {"largest": near})


def _stress(results: Results) -> Iterator[str]:
    """Largest stress and utilisation of each shape, and utilisation under loads."""
    said, known, unknown = dict[str, list[str]](), "", unknown_below(results)
    for shape, bent in _shapes(results):
        if bent.max_stress is None:
            continue
        text = f"{'while erected' if shape in STAGES else shape} {stress(bent.max_stress)}"
        if bent.utilisation is not None:
            strength = strength_name(results, shape)
            text += f" ({percent(bent.utilisation)}" + f" of {strength}" * (strength != known) + ")"
            known = strength
        text += f", unknown below {whole_percent(unknown)} of it" * (shape in STAGES and unknown > 0)
        said.setdefault("unloaded", []).append(text)
    for name, ends, found in results.loaded_shells():
        if found.utilisation is not None:
            said.setdefault(name, []).append(f"{ends} {percent(found.utilisation)} of the strength")
    yield from _line("stress", said)


def _carried(results: Results) -> Iterator[str]:
    """How much of its own weight and of the loads each shell carries, and how much snow."""
    least = " (weakest patch, its seam held)" if results.patches else ""
    weighed = results.self_weight.items()
    said = {
        f"own weight{' without bracing' * is_braced(results)}": [
            f"{ends} {share_of_weight(found)}{least}" for ends, found in weighed
        ],
        "with bracing": [
            f"{ends} {share_of_weight(SelfWeight(load_factor=found.braced_factor, limit=found.braced_limit))}"
            for ends, found in weighed
            if found.braced_limit is not None
        ],
        "even snow on top of it": [f"{ends} {snow_text(found)}" for ends, found in results.snow.items()],
    }
    for name, ends, loaded in results.loaded_shells():
        factor, what = least_carried(loaded)
        said.setdefault(name, []).append(f"{ends} {shown_factor(None if isinf(factor) else factor)} times {what}")
    yield from _line("carries", said)


def _line(label: str, said: Mapping[str, list[str]]) -> Iterator[str]:
    """A line of the six, of what is known of each thing on each support."""
    if known := [f"{what}: {', '.join(each)}" for what, each in said.items() if each]:
        yield f"  {label:<10}{'; '.join(known)}"


def _details(results: Results, length: Length) -> Iterator[str]:
    """What else was found, of rods, net, equilibria, bends, loads and deployment."""
    if results.rod:
        yield from _rod(results.rod, results.bending, results.strength)
    yield from _patches(results, length)
    yield from _net_and_drape(results, length)
    yield from _refinement(results)
    yield from _pop_up(results, length)
    yield from _bending(results, length)
    yield from _deflection_and_reactions(results, length)
    yield from _edge_beams(results, length)
    yield from _loads(results, length)
    yield from _deployment(results)
    yield from (f"  dropped   {rod.id}: {rod.reason}" for rod in results.dropped[:MOST_DROPPED])
    if len(results.dropped) > MOST_DROPPED:
        yield f"            and {len(results.dropped) - MOST_DROPPED} more, named in result.json"


def chosen(parts: Iterable[str]) -> str:
    """That the program chose a rod's "material", "section" or both."""
    parts = list(parts)
    return f"{' and '.join(parts)} {'were' if len(parts) > 1 else 'was'} not given: chosen to fit"


def rod_text(rod: RodType) -> str:
    """Section and material in a few words, and whether it is the paper's rubber."""
    line = section_text(rod.section)
    material = rod.material
    if material is None:
        return line
    preset = material.preset if material.preset != "rubber" else None
    line += f"; {preset}, " if preset else "; "
    if material.youngs_modulus is not None and material.density is not None:
        line += f"E = {stress(material.youngs_modulus)}, {rounded(material.density, 4)} kg/m3"
    values = material.plain()
    if preset:
        known = rod.preset.plain() if rod.preset else {}
        changed = [
            NAMES.get(key, key)
            for key, value in values.items()
            if known.get(key, value) != value or (key == "poisson_ratio" and "shear" in known)
        ]
        return line + (f" ({' and '.join(changed)} not {preset}'s)" if changed else "")
    rubber = [NAMES.get(key, key) for key, value in RUBBER.items() if values.get(key) == value]
    if len(rubber) == len(RUBBER):
        line += " (the paper's rubber; for another: rod.material)"
    elif rubber:
        verb = "are" if len(rubber) > 1 else "is"
        line += f" ({' and '.join(rubber)} {verb} the paper's rubber's; for another: rod.material)"
    return line


def _rod(rod: RodType, bending: Bending | None, judged_by: DesignStrength | None) -> Iterator[str]:
    """What the program chose of it and how, and what is known of its material."""
    if rod.chosen:
        reached = _reached(bending) if "section" in rod.chosen else ""
        thin = thinner_than_sold(rod)
        yield f"  chosen    {chosen(rod.chosen)}{reached}{thin and '; '}{thin}"
    if rod.preset:
        line = f"  material  {rod.preset.name}: {rod.preset.grade}"
        if rod.preset.bending_strength is not None:
            line += f"; bending strength {stress(rod.preset.bending_strength)}, {rod.preset.strength_note}"
        yield line
    if judged_by is not None and judged_by.permanent is not None:
        erection = "" if judged_by.erection is None else f", {stress(judged_by.erection)} during erection"
        if judged_by.code is not None:
            known = judged_by.service_class
            erection += f", by {judged_by.code}, service class {known or '2 (not given)'}"
            depths = [f"{factor:.3g}" for factor in judged_by.depth.tolist()]
            erection += f"; {' and '.join(dict.fromkeys(depths))} times that by its depth (k_h)" if depths else ""
        yield f"            design strength {stress(judged_by.permanent)} permanently{erection}"


def _reached(bending: Bending | None) -> str:
    """How a section was chosen, and the share of the strength that the final shapes use."""
    if bending is None or bending.strength is None:
        return ", as slender as the paper's rods, since no strength is known"
    final = [bent.utilisation for shape, bent in bending.shapes().items() if shape not in OTHER_SHAPES]
    known = [used for used in final if used is not None]
    reached = f"reached {percent(max(known))} in the final shape" if known else "what is reached is not known"
    return f", sized for the permanent strength; {reached}"


def _refinement(results: Results) -> Iterator[str]:
    """What the refinement gained, or why it was refused."""
    found = results.refinement
    if found is None or found.before is None or found.after is None:
        return
    gain = f"gap rms {percent(found.before.rms_relative)} -> {percent(found.after.rms_relative)}"
    if found.before == found.after:
        gain = f"gap rms {percent(found.before.rms_relative)} as before"
    yield (
        f"  refined   {found.ends}  {', '.join(found.vary)}: {gain}; "
        f"{found.factorizations} factorisations and {found.gate_factorizations} for its gates"
    )
    if found.refused:
        what = "the design" if found.before == found.after else "a nearer design"
        yield f"            {what} was refused, {found.refused}"


def _patches(results: Results, length: Length) -> Iterator[str]:
    """Each patch and each seam in a line."""
    for patch in results.patches:
        line = f"  patch {patch.id:<4}{patch.rods} rods, heading {degrees(patch.rotate or 0.0):.1f} deg"
        if patch.net and patch.net.min_angle_deg is not None:
            line += f"; smallest angle {patch.net.min_angle_deg:.1f} deg"
        yield line + "".join(f"; {ends} gap rms {percent(gap.rms_relative)}" for ends, gap in patch.agreement.items())
    moved = max((patch.ends_moved or 0.0 for patch in results.patches), default=0.0)
    for number, seam in enumerate(results.seams, start=1):
        line = f"  seam {number:<5}{len(seam.meetings)} rods of each side meet, ends moved by {length(moved)} at most"
        for ends, force in seam.forces.items():
            line += f"; {ends} force {rounded(force.largest or 0.0)} N at most"
        yield line


def _fallen(results: Results, length: Length) -> Iterator[str]:
    """How a fall onto the target ended, of which the rest is a consequence."""
    if results.drape is None or (fall := results.drape.fall) is None:
        return
    if not fall.at_rest:
        yield f"the grid fell on the target and is NOT AT REST after {rounded(fall.time or 0.0)} s"
        return
    off = results.drape.net_deviation
    net = f"; rod ends off the exact net's: max {length(off.max)}, median {length(off.median)}" if off else ""
    yield f"the grid fell on the target and is at rest after {rounded(fall.time or 0.0)} s{net}"


def _net_and_drape(results: Results, length: Length) -> Iterator[str]:
    """How exact the surface, the net and the drape are."""
    if results.target and (fit := results.target.deviation):
        yield f"  target    smooth surface against the mesh: max {length(fit.max)}, rms {length(fit.rms)}"
    if net := results.net:
        angle = "not known" if net.min_angle_deg is None else f"{net.min_angle_deg:.1f} deg"
        yield f"  footprint error {length(net.error_estimate)} before extrapolation; smallest angle {angle}"
    drape, layout = results.drape, results.layout
    if drape and layout and layout.families:
        along = "given" if layout.kind == "curves" else f"{layout.families} families of {layout.kind}"
        yield f"  drape     along {along} curves; gap {length(drape.max_gap)}"
    elif drape:
        work = sum(level.factorizations or 0 for level in drape.levels)
        gap = "gap" if drape.method == "bound" else "deepest node inside by"
        edges = f", edges of {length(results.layout.edge)}" if drape.fall and results.layout else ""
        yield (
            f"  drape     {drape.method}: {drape.dofs} unknowns{edges}, {work} factorisations, "
            f"{gap} {length(drape.max_gap)}, "
            f"strain {small(drape.max_strain)}, negative modes {drape.negative_modes}"
        )
        if (off := drape.net_deviation) and not drape.fall:
            yield f"            drape against net, rod ends: max {length(off.max)}, median {length(off.median)}"


def _pop_up(results: Results, length: Length) -> Iterator[str]:
    """Whether each shell is stable, and how near it comes to the target."""
    for ends, shell in results.pop_up.items():
        state = "stable, unloaded" if shell.stable else shell.status or CONVERGED
        if state == CONVERGED:
            state += ", NOT STABLE" if shell.stable is False else ", stability not checked"
        line = f"  pop-up    {ends:<8}{state}, {shell.factorizations} factorisations"
        if gap := results.agreement.get(ends):
            line += f"; gap rms {length(gap.rms)} ({percent(gap.rms_relative)})"
        yield line


def _shapes(results: Results) -> Iterator[tuple[str, WorstBent]]:
    """The bends of each shape, and those while it is erected."""
    bending, unknown = results.bending, unknown_below(results)
    if bending is None or (results.target and results.target.flat):
        return
    for shape, bent in bending.shapes().items():
        if (shape == "pop_up" and bending.deployment) or (shape in STAGES and unknown >= 1) or bent.min_radius is None:
            continue  # the first is the deployment with the final shape
        yield shape, bent


def _bending(results: Results, length: Length) -> Iterator[str]:
    """Bends and torsion, a line for each shape."""
    for shape, bent in _shapes(results):
        name = "stages" if shape in STAGES else shape
        line = f"  bending   {name:<8}smallest radius {length(bent.min_radius)}{_curved(bent, length)}"
        if bent.torsion_stress:
            line += f", stress of torsion alone {stress(bent.torsion_stress)}"
        yield line + ", holes at joints counted" * bool(results.strength and results.strength.hole)


def _curved(bent: Bent, length: Length) -> str:
    """How the rods are curved out of the shell and within it, by radii, and twisted."""
    curved = ((bent.normal_curvature, "out of the shell"), (bent.geodesic_curvature, "within it"))
    words = [f"{where} {length(1 / value)}" for value, where in curved if value is not None and value > STRAIGHT]
    if bent.twist_rate is not None and bent.twist_rate > STRAIGHT:
        words.append(f"twist {rounded(degrees(bent.twist_rate))} deg/m")
    return f" ({', '.join(words)})" if words else ""


def _joints(results: Results, length: Length) -> str:
    """How many there are, and where rods pass each other without one."""
    joints = f"{sum(len(rod.joints) for rod in results.rods) // 2} joints"
    if not (bare := results.crossings_without_joint):
        return joints
    tails = [
        (max(rod.joints[0].at, (rod.end or 0.0) - (rod.start or 0.0) - rod.joints[-1].at), rod.id)
        for rod in results.rods
        if rod.joints
    ]
    far, name = max(tails)
    where = f"{bare} crossing{'s' * (bare > 1)} near rod ends"
    return f"{joints}, none at {where}; longest span from an end to a joint {length(far)} ({name})"


def _deflection_and_reactions(results: Results, length: Length) -> Iterator[str]:
    """How far the shell moves under its own weight, and the forces at its supports."""
    for ends, weighed in results.self_weight.items():
        if weighed.deflection is not None:
            yield f"  weight    {ends:<8}deflection under it: {length(weighed.deflection)}"
    for ends, held in results.reactions.items():
        sums = f"forces {small(held.force_imbalance)}, moments {small(held.moment_imbalance)} of the largest"
        yield f"  reactions {ends:<8}largest {rounded(held.largest_force or 0.0)} N unloaded; sums of {sums}"
        if said := [f"{name} {figure(*each, rounding_of(results))}" for name, each in held.figures.items()]:
            yield f"  support   {ends:<8}{'; '.join(said)}"


def _edge_beams(results: Results, length: Length) -> Iterator[str]:
    """Of each beam along the edge what it is, and what it uses of its strength at most."""
    loaded = [beam for _, _, shell in results.loaded_shells() for beam in shell.edge_beams]
    for beam in results.edge_beams:
        used = [each for each in (beam.unloaded, *loaded) if each is not None and each.name == beam.name]
        shares = [each.utilisation for each in used if each.utilisation is not None]
        push, pull = (
            max((getattr(each, name) or 0.0 for each in used), default=0.0) for name in ("compression", "tension")
        )
        line = f"  beam      {beam.name}: {beam.kind} along {len(beam.ends)} rod ends, {length(beam.length)}"
        line += f", {rounded(beam.mass or 0.0)} kg; {rod_text(beam.rod) if beam.rod else 'section not known'}"
        line += f"; {rounded(push)} N in compression and {rounded(pull)} N in tension at most"
        yield line + (f", {percent(max(shares))} of its design strength" if shares else "")


def _loads(results: Results, length: Length) -> Iterator[str]:
    """What each combination of loads does, a line for each end condition."""
    for name, ends, found in results.loaded_shells():
        limit = f"up to {shown_factor(found.limit_factor)} times the loads ({found.limit_kind})"
        if found.limit_factor is None and found.limit_kind == "none":
            limit = "beyond 100 times the loads"
        line = f"  loads     {ends:<8}{name}: stable {limit}"
        if found.linear_factor is not None:
            line += f", linear {shown_factor(found.linear_factor)}"
        if found.imperfect_factor is not None:
            line += f", with imperfections {shown_factor(found.imperfect_factor)}"
        if (years := found.after_years) is not None:
            line += f"; after years {shown_factor(years.limit_factor)}"
            if years.imperfect_factor is not None:
                line += f", with imperfections {shown_factor(years.imperfect_factor)}"
            if years.max_deflection is not None:
                line += f", deflection {length(years.max_deflection)}"
        at = "" if found.at_factor == 1 else f" at {rounded_down(found.at_factor or 0.0)} times"
        line += f"; deflection{at} {length(found.max_deflection)}"
        if share := share_of_span(results, found.max_deflection):
            line += f" ({share})"
        if found.utilisation is not None:
            worst = found.governs
            of = f"the design strength{f' ({worst.by}, {worst.rod})' if worst and worst.by else ''}"
            if worst and worst.by in ("slip", "slip_unloaded"):
                of = f"the force at which a joint slips ({worst.rod})"
            if worst and worst.by in UNLOADED:
                of += " before loads act"
            line += f", {percent(found.utilisation)} of {of}"
        yield line


def _deployment(results: Results) -> Iterator[str]:
    """Whether the shell is reached from flat, and what other shapes it has."""
    if deployment := results.deployment:
        snaps = places_text([start for start, _ in deployment.snaps]) if deployment.snaps else ""
        words = {
            True: f"reached, snapping {snaps}" if snaps else "reached",
            False: "ends in another shape",
            None: "not known whether it is reached",
        }
        yield f"  from flat {deployment.ends or PINNED.name:<8}{words[deployment.reached_from_flat]}"
        if deployment.clamped and deployment.clamped.reached_from_flat is not None:
            turned = {
                True: "reached: the ends are turned into their clamps after the deployment",
                False: "turning the ends into their clamps ends in another shape",
            }
            held = clamped_among(results.pop_up) or CLAMPED.name
            yield f"  from flat {held:<8}{turned[deployment.clamped.reached_from_flat]}"
    for ends, searched in results.other_shapes.items():
        others = [shape for shape in searched.found if not shape.mirror]
        found = ["its mirror image"] if len(others) < len(searched.found) else []
        if others:
            near = min(others, key=lambda shape: shape.distance or 0.0)
            found.append(
                f"{len(others)} other stable shape{'s' if len(others) > 1 else ''}, the nearest "
                f"{percent(near.distance)} of half its width away at {rounded(near.energy or 0.0)} times the energy"
            )
        elif searched.tried:
            found.append("no other stable shape found")
        yield f"  shapes    {ends:<8}{'; '.join([*found, searched.searched])}"

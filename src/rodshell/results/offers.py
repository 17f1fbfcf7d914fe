"""What may mend a finding: options to paste, by its code, for the case that it was found on; and whether they did.

An offer is a guess, which `rodshell advise` tries. It helps if the figure of its finding is better, and the result as
a whole by `standing`: in that one order no two results are each better than the other, so that no offers that help
lead in a circle.
"""

import re
from collections.abc import Callable, Iterator
from math import degrees, inf, log, sqrt

from rodshell.figures.findings import RANKS, Finding, Tried
from rodshell.figures.form import Layout
from rodshell.figures.loads import LoadedShell
from rodshell.results.judged.loads import is_braced, least_carried
from rodshell.results.judged.own_weight import self_weights
from rodshell.results.judged.stress import bent_of
from rodshell.results.results import LEVELS, Results, Verdict
from rodshell.results.sizes_sold import sizes_sold
from rodshell.results.wording import FORM_AGAIN, figure, rounded, rounded_down
from rodshell.rods.section import SHAPES, Section, size_text
from rodshell.rods.supports import CLAMPED, PINNED
from rodshell.schema import read

WEIGHT = "thicker clamped cables laths"  # as many times its weight a grid carries of closer rods
LOADED = "cables laths closer thicker clamped"
BENT = "thinner rotated pinned clamped"
REMEDIES = {
    **dict.fromkeys(("falls", "none_stands", "reserve", "sinks"), WEIGHT),
    **dict.fromkeys((
        "deflection", "falls_after_years", "falls_under_loads", "imperfect", "linear_buckling", "low_stiffness",
        "reserve_under_loads",
    ), LOADED),
    **dict.fromkeys(("strength", "strength_not_reduced", "too_thick"), BENT),
    **dict.fromkeys(("erection_strength", "erection_too_thick"), "thinner rotated"),
    **dict.fromkeys(("contact", "erection_contact", "no_room"), "thinner wider searched"),
    "assumed_class": "inside outside",
    "imperfect_unknown": f"finer {LOADED}",
    "lost": "stages finer",
    "needs_bracing": "thicker clamped",
    "no_design": "open open-clamped",
    "no_imperfections": "imperfect",
    "no_loads": "snow",
    "not_checked": "deployed",
    "not_computed": "finer searched",
    "not_followed": f"finer {WEIGHT}",
    "not_spliced": "closer",
    "off_target": "double taper clamped closer",
    "slip": "closer cables laths",
    "slots": "thinner wider",
    "slots_weaken": "bolted",
    "strength_of_bracing": "closer",
    "strength_under_loads": f"thinner {LOADED}",
    "turned": "pinned",
    "unstable": "clamped cables laths closer",
}  # fmt: skip
"""What may mend a finding, by its code, that which helps most first; no option mends the others."""

FIXED = {
    "inside": "--strength.service_class 1", "outside": "--strength.service_class 3", "bolted": "--joint.kind pin",
    "imperfect": '--stability.imperfection "span/500"', "snow": '--snow "0.5 kN/m2"', "stages": "--checks.stages 24",
}  # fmt: skip
BRACINGS = {
    "none": {"kind": "none"},
    "cables": {
        "kind": "cables", "pattern": "both", "ends_at": "supports", "prestrain": "0.0005", "section": "rod 6",
        "material.preset": "spring-steel", "material.youngs_modulus": "160 GPa",
    },
    "laths": {"kind": "laths"},
    "laths both ways": {"kind": "laths", "pattern": "both"},
}  # fmt: skip
"""Keys of bracing: ropes both ways to the supports, or a third layer of the grid's laths."""
OPEN = ("section", "bracing", "spacing")
ALL_OPEN = f'--rod auto --spacing auto --bracing.kind none --design.open "{", ".join(OPEN)}"'
THIN, THIN_ROPE = 0.025, "rod 4"  # rods up to that depth [m] have such cables

NAMED_EDGE = re.compile(r"layout\.edge of ([\d.]+ m{1,2})\b")  # in warnings of a mesh that is too coarse
CLOSER, WIDER, FINER = 0.75, 1.3, 0.5  # of a spacing; of an edge
THICKER, STEP, SAME = 2.0, 1.25, 0.999  # times a depth: at most, at once; where no sizes are known; as good as that
USUAL = {PINNED.name, CLAMPED.name}  # other supports are given in the case file alone
BETTER = 0.01  # of a figure: by less it has not changed


def offers_of(results: Results, finding: Finding, sentence: str = "") -> tuple[str, ...]:
    """The commands that may mend a finding, to be run in the folder of the result; none of a table of rods."""
    if results.target is None:
        return ()
    remedies = REMEDIES.get(finding.code, "").split()
    options = [f'--edge "{edge}"' for edge in NAMED_EDGE.findall(sentence)]
    options += [option for remedy in remedies for option in _options(results, finding, remedy)]
    return tuple(f"{FORM_AGAIN} {option}" for option in dict.fromkeys(options))


def offered(verdict: Verdict) -> dict[str, Finding]:
    """The offers of the findings that are not good, each with the first finding that has it; the gravest first."""
    found = dict[str, Finding]()
    for level in reversed(RANKS[1:]):
        for finding in verdict.findings:
            if finding.level == level:
                found |= {offer: finding for offer in finding.offers if offer not in found}
    return found


def bracing_keys(name: str, depth: float) -> dict[str, str]:
    """The keys of one of `BRACINGS`, for rods of a depth [m]."""
    keys = BRACINGS[name] | ({"section": THIN_ROPE} if name == "cables" and depth <= THIN else {})
    return {f"bracing.{key}": value for key, value in keys.items()}


def _options(results: Results, finding: Finding, remedy: str) -> Iterator[str]:
    """The options of a remedy that the case has."""
    layout, ends, short = results.layout, set(results.pop_up), (finding.limit or 0.0) / (finding.figure or inf)
    square = layout is not None and layout.kind == "chebyshev" and not results.seams
    spacing = layout.spacing if layout and layout.kind != "curves" else None
    pinned = PINNED.name in ends and finding.support != CLAMPED.name
    if remedy in FIXED:
        yield FIXED[remedy]
    elif remedy == "thicker":  # the next size, and that of which as much as is asked for is carried, by similarity
        yield from _sizes(results, 1.0, thicker=True)
        yield from _sizes(results, sqrt(min(max(short, 1.0), THICKER**2)), thicker=True)
    elif remedy == "thinner":  # strains are in proportion to the depth
        yield from _sizes(results, short if 0 < short < 1 else 1.0, thicker=False)
    elif remedy in ("closer", "wider") and layout and spacing:
        yield _spacing(layout, [(CLOSER if remedy == "closer" else WIDER) * each for each in dict.fromkeys(spacing)])
    elif remedy == "finer" and layout and layout.edge:
        yield f'--edge "{rounded(1e3 * FINER * layout.edge)} mm"'
    elif remedy in ("open", "open-clamped") and results.design and square:
        further = remedy == "open-clamped" and pinned and ends <= USUAL
        if further or len(results.design.open) < len(OPEN):
            yield ALL_OPEN + f" --ends {CLAMPED.name}" * further
    elif remedy == "rotated" and layout and square:
        yield f'--rotate "{(degrees(layout.rotate or 0.0) + 45) % 90:.3g} deg"'
    elif remedy == "deployed" and results.deployment is None and ends <= USUAL:
        yield "--checks.stages 8" + " --ends both" * (PINNED.name not in ends)
    elif remedy == "searched" and square:
        yield "--anchor auto --rotate auto"
    elif remedy == CLAMPED.name and pinned and ends <= USUAL:
        yield f"--ends {CLAMPED.name}"
    elif remedy == PINNED.name and finding.support == CLAMPED.name and ends <= USUAL:
        yield f"--ends {PINNED.name}"
    elif remedy in ("double", "taper") and finding.support == PINNED.name and not results.refinement:
        yield f"--vary {remedy} --ends {PINNED.name}"
    elif remedy in BRACINGS and not is_braced(results):  # bracing counts under loads: the own weight, if there are none
        now = _section(results)
        keys = bracing_keys(remedy, now.depth if now else 0.0).items()
        words = [f'--{key} "{value}"' if " " in value else f"--{key} {value}" for key, value in keys]
        yield " ".join([*([] if results.loads else ["--own"]), *words])


def _sizes(results: Results, factor: float, *, thicker: bool) -> Iterator[str]:
    """The next size beyond so many times the depth, of those that are sold, or else in proportion."""
    now, sold = _section(results), sizes_sold(results.rod) if results.rod else ()
    if now is None:
        return
    depth, step = factor * now.depth, factor * (STEP if thicker else 1 / STEP)
    made = {side: float(f"{step * size:.3g}") for side, size in vars(now).items()}
    sizes = sold or (read(type(now), made),)
    beyond = [size for size in sizes if (size.depth > depth / SAME if thicker else size.depth < depth * SAME)]
    yield from (f'--rod "{size_text(size)}"' for size in (beyond[:1] if thicker else beyond[-1:]))


def _section(results: Results) -> Section | None:
    """The rods' section; None where stiffnesses were given."""
    given = results.rod.section if results.rod else None
    shape = SHAPES.get((given.kind if given else None) or "")
    return read(shape, given.plain()) if given and shape else None


def _spacing(layout: Layout, spacings: list[float]) -> str:
    """Another spacing, over the whole target."""
    given = [key for key in ("rods", "length") if getattr(layout, key) not in (None, "auto")]
    given += ["edge"] * ((layout.edge or 0.0) > 0.5 * min(spacings))
    lengths = ", ".join(f"{rounded(1e3 * each, 2)} mm" for each in spacings)
    return " ".join([f'--spacing "{lengths}"', *(f"--{key} auto" for key in given)])


# What an offer came to

ADVICE = ("", "finding", "before", "after", "limit", "verdict", "option")
CARRIED = ("falls_under_loads", "imperfect", "falls_after_years", "reserve_under_loads")
OF_LOADS: dict[str, Callable[[LoadedShell], float | None]] = {
    **dict.fromkeys(CARRIED, lambda shell: least_carried(shell)[0]),
    "deflection": lambda shell: shell.max_deflection,
    "linear_buckling": lambda shell: inf if shell.linear_factor is None else shell.linear_factor,
    "strength_of_bracing": lambda shell: shell.bracing_utilisation,
    "strength_under_loads": lambda shell: shell.utilisation,
}
OF_WEIGHT, OF_BENDS = ("falls", "reserve"), ("strength", "too_thick", "erection_strength", "erection_too_thick")
MEASURED = {*OF_LOADS, *OF_WEIGHT, *OF_BENDS, "off_target"}  # codes whose figures are known without a finding


def advice_rows(results: Results, verdict: Verdict) -> list[tuple[str, ...]]:
    """What is offered for the findings of a result, what was tried first, under `ADVICE`."""
    tried, rows = {each.offer: each for each in results.advice}, list[tuple[str, ...]]()
    offers = offered(verdict)
    for offer in sorted(offers, key=lambda each: [*tried, *offers].index(each)):
        finding, each = offers[offer], tried.get(offer) or Tried(offer=offer, code="", before=offers[offer].figure)
        of = " ".join(filter(None, (finding.code, finding.support, finding.place)))
        figures = (shown(value, finding) for value in (each.before, each.after, finding.limit))
        level = next((words for name, words in LEVELS.items() if name == each.level), "no form" if each.code else "")
        mark = "" if not each.code else "tried, helps" if each.helps else "tried, no help"
        rows.append((mark, of, *figures, level, offer.removeprefix(f"{FORM_AGAIN} ")))
    return rows


def standing(verdict: Verdict) -> tuple[int, list[tuple[int, float]]]:
    """A result by its level, then by how grave its findings are, the gravest first: smaller is better."""
    grave = ((RANKS.index(each.level or "check"), each) for each in verdict.findings if each.level != "good")
    return RANKS.index(verdict.level), sorted(((rank, _beyond(each)) for rank, each in grave), reverse=True)


def _beyond(finding: Finding) -> float:
    """How many times a figure is off its limit, in percents, so that round-off decides nothing. Where no figure says
    it, what only has to be looked at comes last, and what rules a shell out first."""
    if finding.figure and finding.limit and finding.figure > 0:
        return round(abs(log(finding.figure / finding.limit)), 2)
    return 0.0 if finding.level == "check" else inf


def helps(before: Verdict, finding: Finding, now: Results) -> bool:
    """Whether a result is better than an earlier one, a finding of that in the first place."""
    if now.verdict is None or standing(now.verdict) >= standing(before):
        return False
    was, after = finding.figure, figure_of(now, finding)
    if was is None or finding.limit is None or (after is None and finding.code not in MEASURED):
        return finding.code not in [each.code for each in now.verdict.findings]
    gain = 0.0 if after is None else after - was if _rises(finding) else was - after
    return gain > BETTER * abs(was)


def figure_of(results: Results, finding: Finding) -> float | None:
    """The figure of an earlier finding in other results, also where nothing is found there; None: not known."""
    code, known = finding.code, list[float | None]()
    ends = [finding.support] if finding.support in results.pop_up else list(results.pop_up)
    if code in OF_WEIGHT:
        weighed = self_weights(results, ends).values()
        known = [inf if each.load_factor is None else each.load_factor for each in weighed if each.limit]
    elif code in OF_LOADS and (code not in CARRIED or _rises(finding)):
        known = [OF_LOADS[code](shell) for name, _, shell in results.loaded_shells() if name == finding.place]
    elif code in OF_BENDS:
        bent = [bent_of(results, shape) for shape in (["deployment"] if code.startswith("erection_") else ends)]
        known = [each.utilisation if code.endswith("strength") else each.max_bending_strain for each in bent]
    elif code == "off_target":
        known = [min(gap.max_relative or 0.0 for gap in results.agreement.values())] if results.agreement else []
    elif results.verdict:
        found = results.verdict.findings
        known = [each.figure for each in found if (each.code, each.unit) == (code, finding.unit)]
    worst = min if _rises(finding) else max
    return worst((each for each in known if each is not None), default=None)


def shown(value: float | None, finding: Finding) -> str:
    """A figure of a finding, or its limit, in words: a factor is not promised too high."""
    if value is None or finding.unit or not _rises(finding):
        return figure(value, finding.unit)
    return "over 100" if value == inf else rounded_down(max(value, 0.0))


def _rises(finding: Finding) -> bool:
    """Whether a larger figure is better."""
    return (finding.figure or 0.0) < (finding.limit or 0.0)

"""The verdict on a result, computed once from all that was found: good, check or unbuildable, and the reasons.

Summary, report, JSON and exit code show what stands here and judge nothing themselves. A figure that is missing was
not checked, and then the result is not good.
"""

from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from typing import Any, Literal

from rodshell.output.rounding import rounding_of
from rodshell.output.wording import millimetres, percent, place, rounded, stage

Level = Literal["good", "check", "unbuildable"]
Result = Mapping[str, Any]

ENDS = ("clamped", "pinned")
WORDS: dict[Level, str] = {"good": "Good", "check": "Check", "unbuildable": "Not buildable"}

FAR_OFF, OFF = 0.05, 0.02  # largest gap over the size: another shape than the target; with clamped ends a convex shell
# leaves a tenth of the second
THIN = 0.05  # bending strain up to which the theory of thin rods holds: radii of ten depths
RESERVED = 0.5  # share of a preset's strength, characteristic and short-term, that a shell may use for good
FLAT = "the target is flat, nothing pops up"
NEAR, AKIN = 0.6, 1.5  # distance over the size and energy ratio below which another stable shape may be met by accident
LARGE = 1.0  # m; a wider shell is built by people who have to know whether the rods hold
MUCH_LESS = 0.5  # clamped supports are recommended when they leave less than this share of the pinned gap,
NEGLIGIBLE = 1e-3  # unless that gap is below this share of the target's size already


@dataclass(frozen=True)
class Verdict:
    """What a result is worth.

    Parameters
    ----------
    level : "good": it pops up, stands under its own weight and can be built; "check": something has to be looked at
        first; "unbuildable": no end condition that was asked for gives a shell that can be built.
    reasons : sentences, the gravest first; of a good result what makes it good.
    """

    level: Level
    reasons: tuple[str, ...]

    @property
    def headline(self) -> str:
        """The first sentence that everybody is shown."""
        return f"{WORDS[self.level]}: {self.reasons[0]}"

    def table(self) -> dict[str, Any]:
        """As it stands in result.json."""
        return {**asdict(self), "reasons": list(self.reasons)}


def verdict_of(result: Result) -> Verdict:
    """The verdict that a result holds, or that on its figures (results of versions before verdicts)."""
    held = result.get("verdict")
    return Verdict(held["level"], tuple(held["reasons"])) if held else verdict(result)


def verdict(result: Result) -> Verdict:
    """The verdict on the figures of a result.

    An end condition can be used if its shell converged and is stable, its rods do not touch, hold, and are thin
    enough for their bends. Without one that can be used, or far off the target, the result is unbuildable.
    """
    shells = entries(result, "pop_up")
    faults = {ends: [*_shell_faults(result, ends)] for ends in shells}
    usable = [ends for ends, found in faults.items() if not found]
    deployment = [*_fibre_faults(result, "deployment"), *_contact_faults(result, "deployment")]
    grave = [sentence for found in faults.values() for sentence in found] + deployment
    if (result.get("target") or {}).get("flat"):
        said = [str(word) for word in result.get("warnings") or [] if str(word).startswith(FLAT)]
        return Verdict("unbuildable", (*(said or [FLAT]),))
    if not shells:
        status = result.get("status", "unknown")
        why = "there is no pop-up in this result" if status == "converged" else f"it did not converge: {status}"
        return Verdict("unbuildable", (why,))
    best = _best(result, usable)
    off = 0.0 if best is None else float(best[1]["max_relative"])
    far = [_off_words(result, best)] if best is not None and off > OFF else []
    open_points = [*_open_points(result, usable), *map(str, result.get("warnings") or [])]
    if not usable or deployment or off > FAR_OFF:
        gravest = [*far, *grave] if off > FAR_OFF else [*grave, *far]
        return Verdict("unbuildable", tuple(dict.fromkeys([*gravest, *open_points])))
    if to_check := [*grave, *far, *open_points]:
        return Verdict("check", tuple(dict.fromkeys(to_check)))
    return Verdict("good", tuple(_merits(result, usable)))


def entries(result: Result, table: str) -> dict[str, dict[str, Any]]:
    """What `result[table]` holds for each kind of ends; empty where nothing is known."""
    known = result.get(table) or {}
    return {ends: entry for ends, entry in known.items() if isinstance(entry, dict)}


def unknown_below(result: Result) -> float:
    """Share of the way from flat below which nothing is known: 0 all of it was followed, 1 the final shape alone is."""
    way = result.get("deployment") or {}
    if way and way.get("lost_at") is None:
        return 0.0
    return min((float(stage["share"]) for stage in way.get("stages") or [] if stage["share"] > 0), default=1.0)


def utilisation(result: Result) -> float | None:
    """The largest of all shapes that are known, those of the deployment among them; None without a strength."""
    bent = (result.get("bending") or {}).values()
    known = [entry["utilisation"] for entry in bent if isinstance(entry, dict) and entry.get("utilisation") is not None]
    return max(known, default=None)


def facts(result: Result) -> list[str]:
    """What was found, in sentences that judge nothing: gaps, supports, strength."""
    return [*_gaps(result), *_strength(result)]


def _shell_faults(result: Result, ends: str) -> Iterator[str]:
    """Why the shell with these ends cannot be built."""
    shell = result["pop_up"][ends]
    status = shell.get("status", "converged")
    if status != "converged":
        yield f"the pop-up with {ends} ends did not converge: {status}"
        return
    if shell.get("stable") is False:
        modes = shell.get("negative_modes")
        count = f" ({modes} buckling mode{'s' if modes != 1 else ''})" if modes else ""
        yield f"with {ends} ends the shell is unstable{count} and would snap to another shape"
    yield from _contact_faults(result, ends)
    yield from _fibre_faults(result, ends)


def _contact_faults(result: Result, shape: str) -> Iterator[str]:
    touching = entries(result, "contact").get(shape) or {}
    if not touching.get("pairs"):
        return
    first, second = touching["rods"]
    who = f"{first} and {second} overlap" if first != second else f"{first} runs into itself"
    worst = f"{touching['pairs']} pairs of rods touch or cross, worst: " if touching["pairs"] > 1 else "rods touch: "
    yield (
        f"{_shape(shape, touching)} {worst}{who} by {_mm(result, -touching['clearance'])} near "
        f"({place(touching['where'], rounding_of(result))}): use thinner rods (rod.section) or a larger spacing"
    )


def _fibre_faults(result: Result, shape: str) -> Iterator[str]:
    """Stress above the strength, strain beyond thin rods."""
    bent = entries(result, "bending").get(shape) or {}
    used, strain = bent.get("utilisation"), bent.get("max_bending_strain")
    where = f" in {bent['rod']}, {_mm(result, bent['at'])} from its start" if bent.get("rod") else ""
    if used is not None and used > 1:
        share = f"{max(101, round(100 * used))} % of their strength"  # never 100 % of what breaks
        yield f"{_shape(shape, bent)} the rods would break: {share}{where}"
    if strain is not None and strain > THIN:
        yield (
            f"{_shape(shape, bent)} bending strains the rods by {percent(strain)}: they are too thick for their bends, "
            f"the theory of thin rods holds up to some {percent(THIN)}; use thinner rods or a larger target"
        )


def _shape(shape: str, entry: Mapping[str, Any]) -> str:
    """Which shape a sentence is about."""
    if shape in ENDS:
        return f"with {shape} ends"
    share = entry.get("share")
    return "during deployment" if share is None else f"during deployment (at {stage(share)} of the way)"


def _best(result: Result, usable: list[str]) -> tuple[str, Mapping[str, Any]] | None:
    """Of the shells that can be used the one that is nearest to the target, and its gap; None without a target."""
    gaps = entries(result, "agreement")
    known = [(ends, gaps[ends]) for ends in usable if gaps.get(ends, {}).get("max_relative") is not None]
    return min(known, key=lambda pair: float(pair[1]["max_relative"]), default=None)


def _off_words(result: Result, best: tuple[str, Mapping[str, Any]]) -> str:
    """How far off the best shell is; with clamped ends a convex shell keeps to the target, and dips are the cause."""
    ends, gap = best
    where = f", near ({place(gap['where'], rounding_of(result))})" if gap.get("where") else ""
    drape = result.get("drape") or {}
    buckles = (drape.get("strong_bending") or {}).get("beyond", 0.0) > 0
    holds = (result.get("joint") or {}).get("kind", "ball") not in ("ball", "pin")  # against the net's shear
    dips = ends == "clamped" and drape.get("method") == "bound" and not buckles and not holds
    advice = ": dips and ridges need seams, graded stiffness or supports" if dips else ""
    return (
        f"with {ends} ends, the best that can be used, the shell is off the target by {_mm(result, gap['max'])} "
        f"({percent(gap['max_relative'])} of its size){where}{advice}"
    )


def _open_points(result: Result, usable: list[str]) -> Iterator[str]:
    """What has to be looked at although the shell can be built, and what is not known; more is among the warnings."""
    shells, warnings = entries(result, "pop_up"), [str(word) for word in result.get("warnings") or []]
    status = str(result.get("status", "converged"))
    stopped = any(shell.get("status", "converged") != "converged" for shell in shells.values())
    if status != "converged" and not stopped and not any(word in status for word in warnings):
        yield f"the job is not complete: {status}"
    if any(shells[ends].get("stable") is None for ends in usable):
        yield "whether the shell is stable was not checked"
    yield from _weight(result, usable)
    yield from _from_flat(result, usable, late=status != "converged")
    yield from _other_shapes(result, usable)
    yield from _rods(result, usable)
    if result.get("target") and not set(usable) <= set(entries(result, "agreement")):
        yield "how near the shell comes to the target was not checked"


def _rods(result: Result, usable: list[str]) -> Iterator[str]:
    """Whether rods hold and pass each other."""
    bent, met = result.get("bending") or {}, entries(result, "contact")
    if any(ends not in met or (bent.get(ends) or {}).get("max_bending_strain") is None for ends in usable):
        yield (
            "whether rods touch and are thin enough for their bends was not checked; a given section needs "
            "rod.section.fibre_distances for that"
        )
    if bent.get("strength") is None:
        if _width(result) > LARGE:
            yield "no strength was given, so it is not known whether the rods hold (checks.strength)"
        return
    name = bent.get("strength_of")
    used = max(((bent.get(ends) or {}).get("utilisation") or 0.0 for ends in usable), default=0.0)
    if name and used > RESERVED:
        yield (
            f"the rods permanently use {percent(used)} of {name}'s strength, which is characteristic and short-term: "
            "reduce it for duration and moisture and give what is left as checks.strength, or use thinner rods"
        )


def _weight(result: Result, usable: list[str]) -> Iterator[str]:
    """Shells that cannot stand; what is not known of them is among a result's warnings."""
    borne = {ends: entry for ends, entry in entries(result, "self_weight").items() if ends in usable}
    if set(borne) != set(usable):
        yield "whether it bears its own weight was not checked"
    factors = {ends: one["load_factor"] for ends, one in borne.items() if one.get("limit") != "not followed"}
    weak = {ends: factor for ends, factor in factors.items() if factor is not None and factor < 1}
    if weak:
        each = " and ".join(f"{percent(factor)} of its own weight with {ends} ends" for ends, factor in weak.items())
        yield f"it bears only {each}: it does not stand unless it is held, braced or made of stiffer rods"


def _from_flat(result: Result, usable: list[str], *, late: bool) -> Iterator[str]:
    """Whether it was looked at; what was found there is among a result's warnings."""
    shells, way = entries(result, "pop_up"), result.get("deployment")
    if not way:
        remedy = "" if late else ": that takes pinned ends (pop_up.ends) and checks.stages above 0"
        failed = shells.get("pinned", {}).get("status", "converged") != "converged"
        why = ", since the pinned shell was not found" if failed else remedy
        yield f"whether the shell is reached from flat was not checked{why}"
    elif (
        "clamped" in usable
        and way.get("reached_from_flat")
        and (way.get("clamped") or {}).get("reached_from_flat") is None
    ):
        yield "whether the clamped shape is reached from the pinned one by turning the ends is not known"


def _other_shapes(result: Result, usable: list[str]) -> Iterator[str]:
    for ends, searched in entries(result, "other_shapes").items():
        near = [
            one
            for one in searched.get("found") or []
            if not one.get("mirror") and one["distance"] < NEAR and one["energy"] < AKIN
        ]
        if ends in usable and near:
            first = min(near, key=lambda one: float(one["distance"]))
            yield (
                f"with {ends} ends the shell has another stable shape, {percent(first['distance'])} of its size away "
                f"at {rounded(first['energy'])} times the energy: make sure on site that it takes the right one"
            )


def _width(result: Result) -> float:
    """Longest side in plan [m] of what the shell stands on."""
    points = result.get("boundary") or []
    return max((max(column) - min(column) for column in list(zip(*points, strict=True))[:2]), default=0.0)


def _merits(result: Result, usable: list[str]) -> Iterator[str]:
    """Why a result is good."""
    borne = [entries(result, "self_weight")[ends]["load_factor"] for ends in usable]
    least = min((factor for factor in borne if factor is not None), default=None)
    weight = "over 100" if least is None else f"{'at least ' if len(usable) > 1 else ''}{rounded(least)}"
    best = _best(result, usable)
    near = (
        f"; with {best[0]} ends it keeps to the target within {percent(best[1]['max_relative'])} of its size"
        if best
        else ""
    )
    yield f"with {' and '.join(usable)} ends the shell is stable and bears {weight} times its own weight{near}"
    yield "no other load than its own weight was checked, neither snow, wind nor people; nor were imperfections"


def _mm(result: Result, metres: float) -> str:
    """A length as fine as on the drawings."""
    return millimetres(metres, rounding=rounding_of(result))


def _gaps(result: Result) -> Iterator[str]:
    """How near the converged shells come to the target, and what the better support is."""
    gaps = entries(result, "agreement")
    faults = {ends: [*_shell_faults(result, ends)] for ends in entries(result, "pop_up")}
    shells = entries(result, "pop_up")
    known = [
        ends
        for ends in ENDS
        if gaps.get(ends, {}).get("max") is not None and shells.get(ends, {}).get("status") == "converged"
    ]
    for ends in known:
        size = gaps[ends].get("max_relative")
        share = "" if size is None else f" ({percent(size)} of its size)"
        yield f"With {ends} ends the largest gap to the target is {_mm(result, gaps[ends]['max'])}{share}."
    if set(known) == set(ENDS) and not any(faults.values()):
        yield from _advice(gaps["clamped"], gaps["pinned"])
    elif faults and not result.get("target"):
        yield "There is no target in this result, so there is no gap to tell."


def _advice(clamped: Mapping[str, Any], pinned: Mapping[str, Any]) -> Iterator[str]:
    """Which support is worth it, of two that can both be used."""
    relative = pinned.get("max_relative")
    if clamped["max"] < MUCH_LESS * pinned["max"] and (relative is None or relative > NEGLIGIBLE):
        share = percent(clamped["max"] / pinned["max"])
        yield f"Supports that hold the rods' directions (clamped) leave {share} of the gap that pinned ones leave."
    elif relative is None or relative <= OFF:
        yield "Supports that hold the rods' directions (clamped) gain little here: pinned ones will do."


def _strength(result: Result) -> Iterator[str]:
    """How much of the strength is used, and in which shapes that is known."""
    used, unknown = utilisation(result), unknown_below(result)
    if used is not None:
        yield f"The rods use {percent(used)} of their strength at most, {_known(result, unknown)}"
    elif result.get("bending"):
        yield "No strength was given, so it is not known whether the rods hold (checks.strength)."


def _known(result: Result, unknown: float) -> str:
    """In which shapes; no more is said of the deployment than was followed."""
    if not result.get("deployment"):
        return "in the final shape; the deployment from flat was not followed."
    if unknown >= 1:
        return "in the final shape; nothing is known of the deployment, which could not be followed."
    if unknown:
        return f"in the final shape and above {stage(unknown)} of the deployment; below, nothing is known of it."
    way = result["deployment"]
    if way.get("guided"):
        low, high = (stage(share) for share in way["guided"])
        return (
            f"in the final shape and the stages of the deployment; what guiding the shell from {low} to {high} of the "
            "way asks of them is not known."
        )
    if way.get("snaps"):
        return "in the final shape and the stages of the deployment; what a snap asks of them is not known."
    return "deployment included."

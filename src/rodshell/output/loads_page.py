"""The report's part on a shell under loads, which an engineer can check by hand: assumptions, utilisation, deflections,
stability, modes, foundations and bracing."""

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from math import isnan
from typing import Any

import numpy as np
from markupsafe import Markup

from rodshell.arrays import largest_at
from rodshell.figures.loads import AfterYears, LoadedShell, UsedBeam, Utilisations
from rodshell.figures.records import Ends
from rodshell.output.pictures import mode_picture
from rodshell.output.svg import inline, picture_document
from rodshell.results import Archive, Results
from rodshell.results.judged.supports import share_of_span
from rodshell.results.wording import millimetres, percent, rounded, rounded_down, rounding_of, shown_factor, stress
from rodshell.units import percent_text

Row = dict[str, str]
Shells = Sequence[tuple[str, Ends, LoadedShell]]

CLOSE = 1.005  # both factors are found within 0.2 %: a larger ratio of theirs says something
_MOST_NAMES = 4  # of joints that slip
_MOST_MODES = 3  # pictures, of the combination that falls first
_BY = {
    "bending": "bending and axial force",
    "shear": "torsion and shear force",
    "slip": "slip of a joint",
    "permanent": "the erected shell, permanent",
    "slip_unloaded": "slip of a joint of the erected shell",
}
STATED = (
    "The erected shell is an equilibrium of elastic rods, without weight and held up until its bracing is fixed; the "
    "bracing is then stressed, joints that are to be locked are locked as they then stand, and all loads begin there.",
    "Loads are fixed forces on the areas of the surface that belong to each node. Wind does not turn with the shell.",
    "Large displacements and the rods' stresses from bending are in every figure; supports do not yield unless a load "
    "moves them.",
    "Stiffness is the mean one, not reduced by factors. Pressure at bolts, cladding, fatigue, fire and accidental "
    "loads are not checked.",
)
SEAMS = (
    "The seams between patches are held in place, as supports are: what carries them has to withstand the forces "
    "there, which are among those of the foundations, and its own stiffness is not in these figures."
)


def loads_page(archive: Archive) -> dict[str, Any] | None:
    """What the page shows; None where no loads were checked."""
    results = archive.results
    shells = list(results.loaded_shells())
    if not shells:
        return None
    pictures = [
        (caption, Markup(inline(picture_document(mode_picture(archive, ends, state)))))
        for caption, ends, state in _modes(archive, shells)
    ]
    return {
        "assumptions": [*_strengths(results), *STATED, *([SEAMS] if results.patches else [])],
        "strength": _rows(shells, partial(_strength, results)),
        "deflection": _rows(shells, partial(_deflection, results)),
        "stability": _rows(shells, _stability),
        "frequencies": list(_frequencies(shells)),
        "modes": pictures,
        "foundations": _rows(shells, partial(_foundation, results)),
        "joints": _rows([each for each in shells if len(each[2].joint_moments)], _joints),
        "edge_beams": [
            {"Combination": name, "Ends": ends, **_edge_beam(beam)}
            for name, ends, shell in shells
            for beam in shell.edge_beams
        ],
        "bracing": _rows([each for each in shells if each[2].bracing], partial(_bracing, results)),
    }


def _rows(shells: Shells, figures: Callable[[LoadedShell], Row]) -> list[Row]:
    """A row for each shell under loads: cells by their heads."""
    return [{"Combination": name, "Ends": ends, **figures(shell)} for name, ends, shell in shells]


def _strengths(results: Results) -> Iterator[str]:
    """What was judged by, in sentences."""
    used = results.strength
    if used is None:
        return
    each = {name: getattr(used, name) for name in ("permanent", "long", "medium", "short", "instantaneous")}
    known = ", ".join(f"{name} {stress(value)}" for name, value in each.items() if value is not None)
    if not known:
        yield "No design strength is known, and none was judged: give [strength]."
    else:
        along = percent(used.axial or 1.0)
        if used.compression is not None and used.compression != used.axial:
            along += f" and {percent(used.compression)}"
        yield (
            f"Design strengths in bending: {known}. In tension and compression {along}, in shear "
            f"{percent(used.shear or 0.0)} of that. From: {used.source}."
        )
    if used.code is not None:
        if len(used.depth):
            first, second = (f"{factor:.3g}" for factor in used.depth.tolist())
            yield (
                f"By their depth, strengths are {first} times these for bends out of the shell and {second} times "
                f"within it (k_h); of the smaller of the two shares {used.biaxial or 1.0:g} counts (k_m)."
            )
        if used.service_class is None:
            yield "No service class was given: 2 (covered) was taken."
        if used.relaxed:
            yield (
                f"Of the unloaded shell's stress {percent(used.relaxed)} is gone after months, as given: at "
                "first it is judged by the strength under short loads, then what is left by the permanent one."
            )
        if used.stiffness is not None:
            yield (
                f"Factors are those of the mean modulus; {used.code} asks for {percent(used.stiffness)} of it in "
                "stability, which lowers them by as much (with cables of steel by less, as long as these stiffen it)."
            )
    if used.erection_utilisation is not None:
        yield f"Erection uses at most {percent(used.erection_utilisation)} of {stress(used.erection or 0.0)}."
    if used.creep is not None:
        yield (
            f"After years under permanent loads the stiffness of rods, joints and laths counts divided by "
            f"{rounded(1 + used.creep)} (1 + k_def), that of cables whole. All else is the shell as erected."
        )
    else:
        yield "Creep is not in the figures; how large it is, is not known of this material (strength.creep)."


def _strength(results: Results, shell: LoadedShell) -> Row:
    place, parts = shell.governs, shell.utilisations or Utilisations()
    where = ""
    if place is not None:
        at = millimetres(place.at, rounding=rounding_of(results))
        where = f"{_BY.get(place.by or '', place.by or '')}: {place.rod}, {at} from its start"
    return {
        "Lasts": shell.duration or "",
        "Bending": _known(parts.bending, percent),
        "Shear": _known(parts.shear, percent),
        "Slip": _known(parts.slip, percent),
        "Permanent": _known(parts.permanent, percent),
        "Governs": where,
    }


def _known(value: float | None, show: Callable[[float], str]) -> str:
    return "not known" if value is None else show(value)


def _deflection(results: Results, shell: LoadedShell) -> Row:
    deflection, allowed = shell.max_deflection, shell.deflection_limit
    later = None if shell.after_years is None else shell.after_years.max_deflection
    return {
        "At factor": rounded_down(shell.at_factor or 0.0),
        "Deflection": millimetres(deflection, rounding=rounding_of(results)),
        "Span over it": share_of_span(results, deflection),
        "Allowed": "" if allowed is None else millimetres(allowed, rounding=rounding_of(results)),
        "After years": "" if later is None else millimetres(later, rounding=rounding_of(results)),
        "Largest stress": _known(shell.max_stress, stress),
        "Compression over Euler load": "" if shell.euler is None else percent(shell.euler),
        "in": "" if shell.euler_at is None else shell.euler_at.rod,
    }


def _stability(shell: LoadedShell) -> Row:
    """How far the shell carries the combination, what decides first."""
    imperfect, years = _imperfect(shell), shell.after_years
    above = (shell.imperfect_factor or np.inf) > CLOSE * (shell.limit_factor or np.inf)
    if above and shell.limit_kind == "bifurcation" and shell.imperfect_kind not in (None, "not followed"):
        imperfect += " (the bifurcation is stable)"
    later = "" if shell.duration != "permanent" else "not known" if years is None else _imperfect(years)
    if years is not None:
        later += f", perfect {shown_factor(years.limit_factor)} ({years.limit_kind})"
    return {
        "With imperfections": imperfect,
        "Path of the perfect shell": f"{shown_factor(shell.limit_factor)} ({shell.limit_kind})",
        "Linear buckling": shown_factor(shell.linear_factor),
        "After years, with imperfections": later,
        "Asked for": "" if shell.reserve is None else f"{shell.reserve:g}",
    }


def _imperfect(found: LoadedShell | AfterYears) -> str:
    """The factor of the shell with imperfections, in words."""
    factor = shown_factor(found.imperfect_factor)
    if found.imperfect_kind is None:
        return "not asked for"
    if found.imperfect_kind == "not followed":
        return "not known" + f" above {factor}" * (found.imperfect_factor is not None)
    return factor


def _frequencies(shells: Shells) -> Iterator[str]:
    """Natural frequencies with each kind of ends: they do not depend on the combination."""
    for ends, shell in {ends: shell for _, ends, shell in shells}.items():
        known = [rounded(value) for value in shell.frequencies.tolist() if not isnan(value)]
        if known:
            yield f"{ends} ends: {', '.join(known)} Hz"


def _modes(archive: Archive, shells: Shells) -> Iterator[tuple[str, Ends, str]]:
    """Caption, ends and state of the pictures: of the combination that falls first."""
    name, ends, shell = min(shells, key=lambda each: np.inf if each[2].limit_factor is None else each[2].limit_factor)
    for k, factor in enumerate(shell.mode_factors[:_MOST_MODES].tolist(), start=1):
        state = f"loaded_buckling_{ends}_{name}_{k}"
        if state in archive.states and not isnan(factor):
            at = f"at {shown_factor(factor)} times the loads"
            yield f"Linear buckling mode {k} under {name}, {ends} ends: {at}", ends, state
    if (state := f"loaded_mode_{ends}_{name}") in archive.states:
        yield f"How the shell gives way under {name}, {ends} ends: {shell.limit_kind}", ends, state


def _foundation(results: Results, shell: LoadedShell) -> Row:
    """Load and reactions, and the largest forces that the foundations carry."""
    forces = shell.support_forces
    sums = (shell.load_sum, shell.reaction_sum)
    load, held = (np.zeros(3) if total is None else np.nan_to_num(total) for total in sums)
    across = np.linalg.norm(forces[:, :2], axis=1)
    down = largest_at(forces[:, 2])
    names = results.rod_ends
    lifted = f"{_kilo(shell.uplift)} at {names[largest_at(-forces[:, 2])]}" if shell.uplift else "none"
    return {
        "Loads x, y, z": ", ".join(map(_kilo, load)),
        "Reactions x, y, z": ", ".join(map(_kilo, held)),
        "Largest vertical": f"{_kilo(forces[down, 2])} at {names[down]}",
        "Largest horizontal": f"{_kilo(across.max())} at {names[largest_at(across)]}",
        "Largest uplift": lifted,
    }


def _kilo(newtons: float) -> str:
    return f"{round(1e-3 * newtons, 2) + 0.0:.2f}"


def _joints(shell: LoadedShell) -> Row:
    """Moments of locked joints, and which joints slip."""
    largest = float(np.abs(np.nan_to_num(shell.joint_moments)).max(initial=0.0))
    slip = None if shell.utilisations is None else shell.utilisations.slip
    more = f" and {len(shell.slipping) - _MOST_NAMES} more" if len(shell.slipping) > _MOST_NAMES else ""
    slipping = ", ".join(shell.slipping[:_MOST_NAMES]) + more or "none"
    return {
        "Largest moment, N m": rounded(largest),
        "at": shell.joint_moment_at or "",
        "Of slip": _known(slip, percent),
        "Slipping": "not known" if slip is None else slipping,
    }


def _edge_beam(beam: UsedBeam) -> Row:
    return {
        "Beam": beam.name or "",
        "Tension": _kilo(beam.tension or 0.0),
        "Compression": _kilo(beam.compression or 0.0),
        "Stress": _known(beam.max_stress, stress),
        "near": beam.max_stress_at or "",
        "Utilisation": _known(beam.utilisation, percent),
        "Of Euler's load": _known(beam.euler, percent),
    }


def _bracing(results: Results, shell: LoadedShell) -> Row:
    forces = np.array([force for force in shell.bracing if force is not None])
    pull, push = max(0.0, float(forces.max(initial=0.0))), max(0.0, -float(forces.min(initial=0.0)))
    where = int(np.argmax([abs(force or 0.0) for force in shell.bracing]))
    most = f"{results.bracing[where].start} to {results.bracing[where].end}" if where < len(results.bracing) else ""
    before = [force for force in shell.bracing_unloaded if force is not None]
    return {
        "Braces": str(len(forces)),
        "Before loads": f"{_kilo(min(before))} to {_kilo(max(before))}" if before else "not known",
        "Largest tension": _kilo(pull),
        "Largest compression": _kilo(push),
        "Largest in": most,
        "Slack": percent_text(float(np.mean(forces == 0.0))),
        "Utilisation": _known(shell.bracing_utilisation, percent),
    }

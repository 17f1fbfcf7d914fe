"""How much of their strength the rods of a result use, and by which strength that is counted."""

from rodshell.figures.checks import OTHER_SHAPES, WorstBent
from rodshell.results.results import Results
from rodshell.results.wording import percent

THIN = 0.05  # bending strain up to which the theory of thin rods holds: radii of ten depths


def bent_of(results: Results, shape: str) -> WorstBent:
    """The worst bending of a shape, that on a support by its name or one of the deployment; one without figures where
    nothing is known."""
    return (results.bending.shapes() if results.bending else {}).get(shape) or WorstBent()


def strength_name(results: Results, shape: str) -> str:
    """By what the utilisation of a shape is counted: design strengths, if they are known."""
    preset = results.bending.strength_of if results.bending else None
    if preset is None:
        return "the given strength"
    if not by_design_strength(results):
        return f"{preset}'s strength, which is characteristic and short-term"
    what = "design strength for erection" if shape in OTHER_SHAPES else "permanent design strength"
    gone = results.strength.relaxed if results.strength and shape not in OTHER_SHAPES else None
    relaxed = f", once {percent(gone)} of the stress is gone" if gone else ""
    return f"{preset}'s {what}{by_code(results)}{relaxed}"


def by_code(results: Results) -> str:
    """By which building code strengths and how they go together are, in words; "": by none."""
    code = results.strength.code if results.strength else None
    return f" by {code}" if code else ""


def by_design_strength(results: Results) -> bool:
    """Whether utilisation is counted by design strengths."""
    return results.strength is not None and results.strength.permanent is not None


def holds_while_erected(results: Results, used: float) -> bool:
    """Whether a preset's rods that use so much of their design strength for erection stay below what breaks them."""
    bending, preset = results.bending, results.rod.preset if results.rod else None
    if bending is None or not bending.strength_of or not bending.erection_strength or preset is None:
        return False
    return used * bending.erection_strength <= (preset.bending_strength or 0.0)

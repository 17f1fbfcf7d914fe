"""Design to load: section, bracing and spacing, as far as a case leaves them open, so that the shell carries its loads.

The shape of a shell hardly depends on the size of its rods, and its strains are in proportion to their depth. So there
is a thickest size that is sold which the bends of a spacing allow, and each thinner one carries less: one section a
spacing counts, and what it does not carry is up to the bracing and to a closer spacing. From wide to close, without
bracing, with cables, with laths, the first that stands is taken.

A design is popped up from the one before, braced, and judged by its strength and by linear buckling, which takes a few
factorisations. Imperfections leave a share of the linear factor that differs little between designs of one bracing: it
says of which the path is followed, and all checks are made of those that stand then.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace
from math import inf

from rodshell.case import Case
from rodshell.case.load import changed_case
from rodshell.case.rod_tables import RodTable
from rodshell.case.stage_tables import DesignTable, LayoutTable
from rodshell.errors import ConvergenceError, InputError, NetLimitError, OutOfTimeError
from rodshell.figures.design import Design, DesignStep, KnownBy
from rodshell.form import Form
from rodshell.formfinding.finite_sections import CLOSE
from rodshell.loads.check import Estimate, check_shells, estimate
from rodshell.loads.stability import MOST
from rodshell.progress import Progress
from rodshell.results.judged.loads import least_carried
from rodshell.results.offers import bracing_keys
from rodshell.results.wording import percent, rounded, rounded_down
from rodshell.rods.materials import Material, PresetName
from rodshell.rods.section import TRADE_SIZES, GivenSection, Rod, Section, size_text
from rodshell.rods.supports import BOTH
from rodshell.schema import read

SPACINGS = (1.0, 0.85, 0.7, 0.6, 0.5, 0.42, 0.35, 0.3, 0.25)  # of the spacing that is taken where none is given
LEFT = {"none": 1.0, "cables": 0.42, "laths": 0.7, "laths both ways": 0.7}
"""The share of the linear factor that imperfections leave, at first; .28 to .49 of cables and .55 to .89 of laths were
found on domes of 6 and 12 m."""
NEAR = 1.1  # strains are in proportion to the depth, except those by the prestress of cables
GAIN = 1.5  # exponent of the spacing's inverse by which factors grow at most: .9 to 1.3 were measured
LIKELY = 1.15  # a path is followed if the reserve may be reached by so much more than is estimated
APART = 0.6  # of a spacing at which a bracing breaks the shell, or pulls it out of its shape: the next one to try
RISES = 1.1  # times the share of its own weight that a bare shell carried before: less has not helped
CREEP: dict[PresetName, float] = {"gfrp": 0.3}  # assumed, of pultruded profiles along their fibres: their makers know
OF_SIZE = ("strength", "too_thick", "strength_under_loads")
OF_SIZE_ERECTED = ("erection_strength", "erection_too_thick")  # but where a shell snaps, it is the way that breaks it
OF_STIFFNESS = (
    "falls_under_loads", "imperfect", "falls_after_years", "reserve_under_loads", "falls", "reserve", "needs_bracing",
    "strength_of_bracing", "linear_buckling", "low_stiffness", "deflection", "sinks", "unstable",
)  # fmt: skip
"""Findings that thinner rods may mend, and those that another bracing or a closer spacing may."""

Runs = Callable[[Case, Form | None], Form]


@dataclass(frozen=True)
class Candidate:
    """A design."""

    section: Section | GivenSection
    bracing: str
    spacing: float


@dataclass(frozen=True, eq=False)
class Tried:
    """A design that was popped up, and what is known of it."""

    candidate: Candidate
    form: Form
    known: Estimate

    @property
    def used(self) -> float:
        return self.known.used or 0.0

    @property
    def linear(self) -> float:
        return min(*self.known.linear.values(), MOST)


@dataclass(eq=False)
class Search:
    """The search for a design.

    Args:
        asked: the case, with what is open.
        run: runs a case up to its pop-up, from an earlier form.
        announce: called with a sentence for each step.
    """

    asked: Case
    run: Runs
    progress: Progress
    announce: Callable[[str], None]
    steps: list[DesignStep] = field(default_factory=list)
    left: dict[str, float] = field(default_factory=lambda: dict(LEFT))
    hope: dict[str, float] = field(default_factory=dict)
    deepest: float = inf
    bare: float = 0.0
    best: Tried | None = None
    best_factor: float = -1.0
    guessed: Tried | None = None
    guess: float = -1.0
    last: Form | None = None

    def __post_init__(self) -> None:
        self.base, self.material, self.sections, self.start = self._prepared()
        self.first = max(
            (k for k, each in enumerate(self.sections) if each.depth <= self.start.section.depth), default=0
        )
        loads = self.base.built_loads()
        assert loads is not None
        self.loads, self.reserve = loads, loads.stability.reserve

    def form(self) -> Form:
        """The first design that stands, or the one that comes nearest, with what limits it."""
        limits = ""
        try:
            for spacing, bracing in self._grids():
                if (found := self._stands(spacing, bracing)) is not None:
                    return self._made(found, "")
            self._follow_guess()
            limits = self._limits()
        except OutOfTimeError as late:
            self.best = self.best or self.guessed
            if self.best is None:
                raise
            limits = str(late)
        if self.best is None:
            raise InputError(f"no design could be popped up: {self.steps[-1].said if self.steps else limits}")
        self.announce(f"design: none that stands was found: {limits}")
        return self._made(self.best.form.finished(self.progress), limits)

    def _grids(self) -> Iterator[tuple[float, str]]:
        """Spacings, and how each is braced."""
        spacings: Iterable[float] = (self.start.spacing,)
        if "spacing" in self.asked.design.open:
            spacings = (float(f"{share * self.start.spacing:.2g}") for share in SPACINGS)
        bracings = tuple(LEFT) if "bracing" in self.asked.design.open else (self.asked.bracing.kind,)
        *_, closest = spacings = tuple(spacings)
        for spacing in spacings:
            yield from ((spacing, bracing) for bracing in bracings if spacing <= self.hope.get(bracing, inf))
        if max(self.hope.values(), default=0.0) and closest not in [
            step.spacing for step in self.steps
        ]:  # what cannot be is shown there
            yield closest, max(self.hope, key=lambda bracing: self.hope[bracing])

    def _stands(self, spacing: float, bracing: str) -> Form | None:
        """The design of this spacing and bracing with all checks, if it stands."""
        while (tried := self._thickest(spacing, bracing)) is not None:
            bare, guess = tried.known.bare, self.left[bracing] * tried.linear
            if bare < 1:
                closer = spacing * (bare * LIKELY) ** (1 / GAIN)
                closer *= bare > RISES * self.bare  # where it has not helped, closer ones do not either
                self.bare = bare
                self.hope |= {kind: min(closer, self.hope.get(kind, inf)) for kind in LEFT}
                self._keep(tried, 0.0)
                self._say(tried, "estimate", bare, "falls under its own weight before it is braced")
                return None
            if guess > self.guess:
                self.guessed, self.guess = tried, guess
            self._hope(spacing, bracing, guess)
            if guess * LIKELY < self.reserve:
                self._say(tried, "estimate", guess, f"may carry {rounded_down(guess)} times the loads")
                return None
            factor, used, braced = self._followed(tried)
            self.left[bracing] = factor / tried.linear
            self._keep(tried, factor)
            self._hope(spacing, bracing, factor)
            if factor < self.reserve or braced > 1:
                weak = f", and its bracing uses {percent(braced)} of its strength" if braced > 1 else ""
                self._say(tried, "path", factor, f"carries {rounded_down(factor)} times the loads{weak}", used)
                return None
            if used > 1:
                self._say(tried, "path", factor, f"uses {percent(used)} of its strength under the loads", used)
                self.deepest = tried.candidate.section.depth / used
                continue  # with a thinner one
            form = tried.form.finished(self.progress)
            codes = {finding.code: finding for finding in form.verdict.findings if finding.level != "good"}
            named = ", ".join(codes)
            of_size = OF_SIZE if "snaps" in codes else OF_SIZE + OF_SIZE_ERECTED
            if too_thick := [codes[code] for code in of_size if code in codes]:
                worst = max((each.figure or inf) / (each.limit or 1.0) for each in too_thick)
                self._say(tried, "checks", factor, f"is too thick for its bends ({named})", worst)
                self.deepest = tried.candidate.section.depth / max(worst, 1.01)
                continue  # with a thinner one
            if any(code in codes for code in OF_STIFFNESS):
                self._say(tried, "checks", factor, f"does not pass all checks ({named})", used)
                return None
            left = f"stands; to be checked: {named}" if codes else "stands"
            self._say(tried, "checks", factor, f"{left}, {rounded_down(factor)} times the loads", used)
            return form
        return None

    def _hope(self, spacing: float, bracing: str, factor: float) -> None:
        """Up to which spacing this bracing may reach the reserve, by the factor at another."""
        self.hope[bracing] = spacing * (factor * LIKELY / self.reserve) ** (1 / GAIN)

    def _thickest(self, spacing: float, bracing: str) -> Tried | None:
        """The thickest section that the bends allow; None: none, or the shell was not found."""
        most = min(CLOSE * spacing if "section" in self.asked.design.open else inf, self.deepest)
        allowed = [k for k, section in enumerate(self.sections) if section.depth <= most * (1 + 1e-9)]
        tried, k = dict[int, Tried | None](), min(self.first, max(allowed, default=0))
        while allowed and k not in tried:
            tried[k] = found = self._tried(Candidate(self.sections[k], bracing, spacing))
            if found is None:
                break
            depth = NEAR * self.sections[k].depth / (found.used or 1.0)
            broken = min(
                (j for j, each in tried.items() if each is not None and each.used > 1), default=len(self.sections)
            )
            thin = [j for j in allowed if j < broken and self.sections[j].depth <= depth]
            k = max(thin, default=allowed[0])
        fitting = [k for k, found in tried.items() if found is not None and found.used <= 1]
        if not fitting:
            self.hope[bracing] = APART * spacing
            for found in filter(None, tried.values()):
                self._keep(found, 0.0)
                self._say(found, "estimate", None, "is too thick for its sharpest bend")
            return None
        self.first = max(fitting)
        return tried[self.first]

    def _tried(self, candidate: Candidate) -> Tried | None:
        """A design popped up and braced, and the estimate of what it carries."""
        case = self._case(candidate)
        try:
            form = self.run(case, self.last)
            if form.status != "converged":
                raise ConvergenceError(form.status)
            form = replace(form, options=replace(form.options, rod_chosen=self.asked.rod.left_open))
            loads = case.built_loads()
            assert loads is not None
            found = Tried(
                candidate, form, estimate(form.stages, loads, limits=form.options.limits(form.rod, loads.strength))
            )
        except (InputError, ConvergenceError, NetLimitError) as reason:
            self._add(candidate, "estimate", f"was not found: {reason}")
            return None
        self.last = form
        return found

    def _followed(self, tried: Tried) -> tuple[float, float, float]:
        """How many times its worst combination a design carries with one mode as imperfection, and what of their
        strength rods and bracing use under it."""
        loads = tried.form.case.built_loads()
        assert loads is not None
        name = min(tried.known.linear, key=lambda each: tried.known.linear[each])
        few = replace(
            loads, combinations={name: loads.combinations[name]}, deflections={},
            stability=replace(loads.stability, modes=1),
        )  # fmt: skip
        form = tried.form
        limits = form.options.limits(form.rod, loads.strength)
        checks = check_shells(form.stages, few, limits=limits, progress=self.progress)
        if checks.stopped:
            raise OutOfTimeError(checks.stopped)
        shell = next(iter(checks.shells[name].values()))
        return min(least_carried(shell)[0], MOST), shell.utilisation or 0.0, shell.bracing_utilisation or 0.0

    def _keep(self, tried: Tried, factor: float) -> None:
        """Keep the design that carries most, as far as it is followed."""
        if factor > self.best_factor:
            self.best, self.best_factor = tried, factor

    def _follow_guess(self) -> None:
        """Follow the design of which most is guessed, where that is more than any that was followed carries."""
        if self.guessed is not None and self.guess > self.best_factor:
            factor, used, _ = self._followed(self.guessed)
            self._say(self.guessed, "path", factor, f"carries {rounded_down(factor)} times the loads", used)
            self._keep(self.guessed, factor)

    def _say(self, tried: Tried, known_by: KnownBy, factor: float | None, said: str, used: float | None = None) -> None:
        self._add(tried.candidate, known_by, said, factor, tried.known.used if used is None else used)

    def _add(
        self, tried: Candidate, known_by: KnownBy, said: str, factor: float | None = None, used: float | None = None
    ) -> None:
        """Keep a step and announce it."""
        step = DesignStep(
            section=_name(tried.section), bracing=tried.bracing, spacing=tried.spacing, known_by=known_by,
            factor=factor, used=used, said=said,
        )  # fmt: skip
        self.steps.append(step)
        share = "" if used is None else f", {percent(used)} of the strength"
        self.announce(f"design: {step.words}: {said}{share}")

    def _limits(self) -> str:
        """What limits the best design: what its strength allows, and the size that would carry the
        loads."""
        best = self.best
        if best is None:
            return self.steps[-1].said if self.steps else "nothing was tried"
        keys = {"section": "rod.section", "bracing": "bracing", "spacing": "layout.spacing"}
        given = [keys[part] for part in keys if part not in self.asked.design.open]
        also = f", or leave {' and '.join(given)} open" if given else ""
        size = _name(best.candidate.section)
        if best.used > 1:
            return f"strength: {_place(best)} is too sharp for {size}: {_flatter(best)}{also}"
        share, sharp = self.best_factor / best.linear, best
        for section in self.sections:
            if section.depth <= best.candidate.section.depth:
                continue
            if (found := self._tried(replace(best.candidate, section=section))) is None:
                break
            if found.used > 1 and sharp is best:
                sharp = found
            if share * found.linear < self.reserve:
                continue
            asked_for = f"stability asks for {_name(section)}"
            if found.used > 1:
                return f"strength: {_place(found)} allows {size}, {asked_for}: {_flatter(found)}{also}"
            if section.depth > self.deepest:
                return f"strength while it is erected allows {size}, {asked_for}: erect it in another way{also}"
            return f"room for joints, a tenth of the spacing, allows {size}, {asked_for}{also}"
        short = "falls under its own weight before it is braced"
        if self.best_factor > 0:
            most = rounded_down(self.best_factor)
            short = f"carries {most} of the {rounded(self.reserve)} times that are asked for"
        if sharp is best:
            return f"stability: {size} {short}{also}"
        thicker = "thicker ones that are sold would use more than their strength there"
        return f"strength: {_place(sharp)} allows {size}, which {short}, and {thicker}{also}"

    def _made(self, form: Form, limits: str) -> Form:
        """The form of the design, as one of the case that was asked for."""
        assumed = None if self.asked.strength == self.base.strength else self.base.strength.creep
        design = Design(
            open=self.asked.design.open, found=not limits, limits=limits, steps=tuple(self.steps), assumed_creep=assumed
        )
        return replace(form, asked=self.asked, design=design).knowing(
            checks=form.known_checks, fabrication=form.known_fabrication, loaded=form.known_loaded
        )

    def _case(self, candidate: Candidate) -> Case:
        """The case of a candidate, with nothing open."""
        case, asked = self.base, self.asked.design.open
        if "section" in asked:
            case = replace(case, rod=read(RodTable, Rod(candidate.section, self.material).parameters()))
        if "spacing" in asked:
            assert isinstance(case.layout, LayoutTable)
            case = replace(case, layout=replace(case.layout, spacing=(candidate.spacing,) * 2))
        if "bracing" in asked:
            case = changed_case(case, bracing_keys(candidate.bracing, candidate.section.depth))
        return case

    def _prepared(self) -> tuple[Case, Material | None, tuple[Section | GivenSection, ...], Candidate]:
        """The case with what the search decides at once; the material and the sections to choose from; where to
        begin."""
        asked = self.asked
        _require(asked)
        case = replace(asked, design=DesignTable())
        if case.pop_up.ends == BOTH and not case.supports and case.pop_up.held is None:
            case = replace(case, pop_up=replace(case.pop_up, ends="pinned"))
        built = case.build(progress=self.progress)
        rod, name = built.rod, built.rod.material.name if built.rod.material else None
        if case.strength.creep is None and name in CREEP:
            case = replace(case, strength=replace(case.strength, creep=CREEP[name]))
            self.announce(f"creep of {name} taken as {CREEP[name]:g}: ask its maker (strength.creep)")
        sections: tuple[Section | GivenSection, ...] = (rod.section,)
        if "section" in asked.design.open:
            sections = TRADE_SIZES[name] if name else ()
            if not sections:
                raise InputError(
                    "design.open has the section, and no sizes of this material are known: give rod.material.preset, "
                    "or rod.section"
                )
        return case, rod.material, sections, Candidate(rod.section, "none", built.layout.least_spacing)


def _name(section: Section | GivenSection) -> str:
    return "the given section" if isinstance(section, GivenSection) else size_text(section)


def _place(tried: Tried) -> str:
    """Where the rods use most of their strength."""
    x, y = (round(each, 3) + 0.0 for each in tried.known.place)
    return f"the radius of {rounded(tried.known.radius)} m at {x:g}, {y:g} m"


def _flatter(tried: Tried) -> str:
    return f"make it flatter than {rounded(tried.known.radius * tried.used)} m there"


def _require(asked: Case) -> None:
    """InputError where what is to be chosen is given, or there are no loads to choose it by."""
    if asked.built_loads() is None:
        raise InputError('design.open needs loads: give [[loads]] and [[combinations]], or --snow "0.5 kN/m2"')
    keys = {"section": "rod.section", "bracing": "bracing", "spacing": "layout.spacing"}
    for name in asked.design.open:
        if name not in asked.left_open:
            raise InputError(f"design.open has {name}, which the case gives ({keys[name]}): leave one of them out")


def designed(asked: Case, run: Runs, progress: Progress, announce: Callable[[str], None]) -> Form:
    """The form of a case whose `design.open` names what its loads decide, with all checks.

    Raises:
        InputError: it has no loads, or what is open is given; no design could be popped up.
    """
    return Search(asked, run, progress, announce).form()

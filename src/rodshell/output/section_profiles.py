"""A picture of how the sections of rods change along them: EI over the rods' length, a line for each profile."""

from collections.abc import Sequence

from rodshell.figures.form import Rod, Stiffness
from rodshell.output.svg import document, label, tag
from rodshell.results.wording import nice_ticks, rounded

WIDTH, HEIGHT = 640, 300
LEFT, RIGHT, TOP, BOTTOM = 64, 150, 24, 48
MOST = 8  # lines that are named
COLOURS = ("#1f5f8b", "#b3372c", "#2b7a4b", "#a86a08", "#6a4c93", "#0f7c85", "#8c564b", "#4a5560")


def profiles_svg(rods: Sequence[Rod]) -> str | None:
    """The picture, or None where no section changes."""
    alike = _alike(rods)
    if not alike:
        return None
    high = max(max(along.factors) for along, _ in alike)
    ticks = nice_ticks(0.0, 1.05 * high, 5)
    top = max(ticks[-1], 1.05 * high)

    def place(share: float, factor: float) -> tuple[float, float]:
        return LEFT + share * (WIDTH - LEFT - RIGHT), HEIGHT - BOTTOM - factor / top * (HEIGHT - TOP - BOTTOM)

    parts = [tag("rect", width=WIDTH, height=HEIGHT, fill="#fdfdfb")]

    def write(text: str, x: float, y: float, size: float = 12, fill: str = "#22282f", **look: str) -> None:
        parts.append(label(text, x, y, size, fill=fill, **look))

    for tick in ticks:
        (x, y), (end, _) = place(0.0, tick), place(1.0, tick)
        parts.append(tag("path", d=f"M{x:.1f} {y:.1f}H{end:.1f}", stroke="#dfdfd9"))
        write(rounded(tick), x - 8, y + 4, text_anchor="end")
    for share in (0.0, 0.25, 0.5, 0.75, 1.0):
        x, y = place(share, 0.0)
        write(f"{share:g}", x, y + 18, text_anchor="middle")
    x, y = place(0.5, 0.0)
    write("share of the rod's length", x, y + 38, text_anchor="middle")
    write("EI over that of the section", 8, TOP - 8)
    x = WIDTH - RIGHT + 16
    for k, (along, names) in enumerate(alike):
        colour = COLOURS[k] if k < MOST else "#c9c9c2"
        points = [place(at / along.at[-1], f) for at, f in zip(along.at, along.factors, strict=True)]
        line = "L".join(f"{x:.1f} {y:.1f}" for x, y in points)
        parts.append(tag("path", d=f"M{line}", fill="none", stroke=colour, stroke_width=2))
        if k < MOST:
            write(names, x, TOP + 12 + 30 * k, fill=colour, font_weight="bold")
            write(_range(along), x, TOP + 25 + 30 * k, 11, "#667079")
    if len(alike) > MOST:
        write(f"and {len(alike) - MOST} more", x, TOP + 12 + 30 * MOST, fill="#667079")
    return document((0, 0, WIDTH, HEIGHT), *parts)


def _alike(rods: Sequence[Rod]) -> list[tuple[Stiffness, str]]:
    """The profiles, each with the names of its rods."""
    found: dict[tuple[object, ...], tuple[Stiffness, list[str]]] = {}
    for rod in rods:
        along = rod.stiffness
        if along is not None:
            shares = tuple(round(at / along.at[-1], 6) for at in along.at)
            found.setdefault((shares, along.factors, along.varies), (along, []))[1].append(rod.id)
    return [(along, _names(names, len(rods))) for along, names in found.values()]


def _names(names: list[str], count: int) -> str:
    if len(names) == count:
        return "all rods"
    return ", ".join(names) if len(names) <= 2 else f"{names[0]} to {names[-1]} ({len(names)})"


def _range(along: Stiffness) -> str:
    """What changes, from the smallest to the largest."""
    what = f"axis {along.varies}" if along.varies in ("a", "b") else along.varies or ""
    if along.sizes:
        return f"{what} {rounded(1e3 * min(along.sizes))} to {rounded(1e3 * max(along.sizes))} mm"
    return f"{min(along.factors):g} to {max(along.factors):g} {what}"

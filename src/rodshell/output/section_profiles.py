"""A picture of how the sections of rods change along them: EI over the rods' length, a line for each profile."""

from collections.abc import Sequence
from html import escape

from rodshell.figures.form import Rod, Stiffness
from rodshell.results.wording import nice_ticks, rounded

WIDTH, HEIGHT = 640, 300
LEFT, RIGHT, TOP, BOTTOM = 64, 150, 24, 48
MOST = 8  # lines that are named
COLOURS = ("#1f5f8b", "#b3372c", "#2b7a4b", "#a86a08", "#6a4c93", "#0f7c85", "#8c564b", "#4a5560")
_WHAT = {
    "size": "size", "width": "width", "height": "height", "a": "axis a", "b": "axis b", "laths": "laths",
}  # fmt: skip


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

    parts = []
    for tick in ticks:
        (x, y), (end, _) = place(0.0, tick), place(1.0, tick)
        parts.append(f'<path d="M{x:.1f} {y:.1f}H{end:.1f}" stroke="#dfdfd9"/>')
        parts.append(f'<text x="{x - 8:.1f}" y="{y + 4:.1f}" text-anchor="end">{rounded(tick)}</text>')
    for share in (0.0, 0.25, 0.5, 0.75, 1.0):
        x, y = place(share, 0.0)
        parts.append(f'<text x="{x:.1f}" y="{y + 18:.1f}" text-anchor="middle">{share:g}</text>')
    x, y = place(0.5, 0.0)
    parts.append(f'<text x="{x:.1f}" y="{y + 38:.1f}" text-anchor="middle">share of the rod\'s length</text>')
    parts.append(f'<text x="8" y="{TOP - 8}">EI over that of the section</text>')
    for k, (along, names) in enumerate(alike):
        colour = COLOURS[k] if k < MOST else "#c9c9c2"
        points = [place(at / along.at[-1], f) for at, f in zip(along.at, along.factors, strict=True)]
        line = "L".join(f"{x:.1f} {y:.1f}" for x, y in points)
        parts.append(f'<path d="M{line}" fill="none" stroke="{colour}" stroke-width="2"/>')
        if k < MOST:
            y = TOP + 12 + 30 * k
            x = WIDTH - RIGHT + 16
            parts.append(
                f'<text x="{x}" y="{y}" fill="{colour}" font-weight="bold">{escape(names, quote=False)}</text>'
            )
            parts.append(
                f'<text x="{x}" y="{y + 13}" fill="#667079" font-size="11">{escape(_range(along), quote=False)}</text>'
            )
    if len(alike) > MOST:
        y = TOP + 12 + 30 * MOST
        parts.append(f'<text x="{WIDTH - RIGHT + 16}" y="{y}" fill="#667079">and {len(alike) - MOST} more</text>')
    body = "\n".join(parts)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" width="{WIDTH}" height="{HEIGHT}" '
        f'font-family="sans-serif" font-size="12" fill="#22282f">\n'
        f'<rect width="100%" height="100%" fill="#fdfdfb"/>\n{body}\n</svg>\n'
    )


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
    what = _WHAT.get(along.varies or "", along.varies or "")
    if along.sizes:
        return f"{what} {rounded(1e3 * min(along.sizes))} to {rounded(1e3 * max(along.sizes))} mm"
    return f"{min(along.factors):g} to {max(along.factors):g} {what}"

"""What would bring a fall to rest that was not when its time was over: a drag, a duration."""

from collections.abc import Sequence

import numpy as np

Seen = Sequence[tuple[float, float]]  # times [s] and kinetic energies [J]

LONGEST = 5.0  # usual durations: a longer fall is not worth the wait where a drag would do
CALM = 0.5  # of the usual duration, in which the drag suggested brings the grid to rest
SPARE = 1.5  # times as long as the decay seen asks for: the slowest swing comes to matter last


def calming(seen: Seen, still: float, force: float, usual: float, drag: float) -> str:
    """Words for a drag and a duration that would do.

    A drag c takes velocities down as exp(-c t / 2) where it is far from critical, so that energies fall as exp(-c t).

    Parameters
    ----------
    seen : of the fall that was too short.
    still : kinetic energy that counts as rest [J].
    force : out-of-balance force, of the one that counts as rest; energies go with its square.
    usual : duration of a fall on such a target [s]; drag : that there was [1/s].
    """
    words = []
    most = max((energy for _, energy in seen), default=0.0)
    enough = float(np.log(max(most / still, 1.0))) / (CALM * usual)
    if enough > drag:
        words.append(f"a drag of {enough:.1g} 1/s (drape.drag)")
    rate, swing = decay(seen)
    ended = seen[-1][0] if seen else 0.0
    more = np.log(max(swing / still, force**2, 1.0)) / rate if rate > 0 else np.inf
    duration = usual if ended < 0.5 * usual else ended + SPARE * more
    if duration < LONGEST * usual:
        words.append(f"some {np.ceil(duration):.0f} s (drape.duration)")
    return ", or ".join(words) or "friction (drape.friction)"


def decay(seen: Seen) -> tuple[float, float]:
    """Rate at which the kinetic energy died out over the last half of the time [1/s], and its last peak [J].

    Peaks are compared, for it swings; the rate is 0 where too little was seen.
    """
    times, energies = np.array(seen, dtype=float).reshape(-1, 2).T
    end = times[-1] if len(times) else 0.0
    before, last = (times > 0.5 * end) & (times <= 0.75 * end), times > 0.75 * end
    if not (before.any() and last.any() and energies[last].any()):
        return 0.0, 0.0
    peak = float(energies[last].max())
    return float(np.log(energies[before].max() / peak)) / (0.25 * end), peak

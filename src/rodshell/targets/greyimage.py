"""A grey image as heights; where it has few grey levels, its terraces are smoothed away within one level."""

import warnings
from pathlib import Path

import numpy as np

from rodshell.arrays import Floats
from rodshell.errors import InputError
from rodshell.targets.meshfile import MOST_HEIGHTS, cause, file_bytes, require_few_heights

COARSE = 1 / 300  # of white: an image whose levels lie further apart, as those of 8 bits do, has terraces
ROUNDING = 12**-0.5  # levels, rms: what rounding to whole levels adds to a smooth height
MOST = 1.0  # levels that a height may be moved
HALVINGS = 12


def read_image(path: Path) -> tuple[Floats, float | None]:
    """Heights (rows, columns), black being 0 and white 1; and the step between its levels where that is coarse.

    Raises
    ------
    InputError : no such file, damaged, too many pixels (which is known before they are decoded).
    """
    from PIL import Image

    file_bytes(path)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)  # there is a lower limit here
            opened = Image.open(path)
        with opened as image:
            require_few_heights(path, image.height, image.width)
            image.load()
            white = 65535.0 if image.mode.startswith("I") else 255.0  # 16 bits or 8
            grey = np.asarray(image if white > 255 else image.convert("F"), dtype=float) / white
    except InputError:
        raise
    except Image.DecompressionBombError:
        raise InputError(
            f"{path} has far too many pixels: scale it down to {MOST_HEIGHTS / 1e6:g} million or fewer"
        ) from None
    except Exception as reason:  # a damaged image can break a reader anywhere
        raise InputError(f"{path} cannot be read as an image ({cause(reason)}): save it anew") from None
    step = float(np.diff(np.unique(grey)).min(initial=1.0))
    return (smoothed(grey, step), step) if COARSE < step < 1.0 else (grey, None)


def smoothed(grey: Floats, step: float) -> Floats:
    """The smoothest heights that differ from `grey` (n, m) by no more than rounding to whole steps does.

    A smoothing spline along both axes [Eilers and Marx 1996]: it leaves planes alone; its weight is the largest that
    moves heights by what rounding does in the mean, and none by more than a step.
    """
    low, high = -3.0, 8.0  # powers of ten; at the largest a bend of a hundred pixels is still followed
    best = grey
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        tried = _splined(_splined(grey, 10**middle).T, 10**middle).T
        off = (tried - grey) / step
        if np.std(off) <= ROUNDING and np.abs(off).max() <= MOST:
            low, best = middle, tried
        else:
            high = middle
    return best


def _splined(values: Floats, weight: float) -> Floats:
    """The z (n, m) that minimise |z - values|^2 + weight |second differences of z along the columns|^2."""
    from scipy.linalg import solveh_banded

    count = len(values)
    bands = np.zeros((3, count))  # of weight D^T D, D the second differences; the upper ones
    for k, factor in enumerate((1.0, -2.0, 1.0)):
        bands[2, k : count - 2 + k] += factor**2
    bands[1, 1:-1] -= 2.0
    bands[1, 2:] -= 2.0
    bands[0, 2:] += 1.0
    bands *= weight
    bands[2] += 1.0
    return np.asarray(solveh_banded(bands, values))

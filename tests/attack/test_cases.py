"""Hostile cases: bombs of a few bytes, numbers at the edges, texts changed letter by letter.

Each is a case, or refused in one sentence.
"""

import random
import resource
import time
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from fractions import Fraction
from os import environ
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import rodshell as rs
from rodshell.case import case_keys
from rodshell.case.keys import keys_of_kinds
from rodshell.schema import written

pytestmark = pytest.mark.attack

FACTOR = int(environ.get("RODSHELL_ATTACK", "1"))
LONGEST = 800  # characters of a sentence
MEMORY, SECONDS = 1.5e9, 10.0  # more than before, and of the processor, for a bomb

ITSELF: list[Any] = []
ITSELF.append(ITSELF)
LOOP: dict[str, Any] = {}
LOOP["target"] = LOOP
DEEP: dict[str, Any] = {}
for _ in range(5000):
    DEEP = {"target": DEEP}
DOTS = "a." * 50_000 + "a"

BOMBS: dict[str, Any] = {
    "dots": f"{DOTS} = 1\n",
    "quotes in quoted dots": '"a\\"b".' * 50_000 + "a = 1\n",
    "many keys of some dots": "".join(f"k{n}.{'a.' * 90}a = {n}\n" for n in range(5000)),
    "quoted dots": '"a".' * 50_000 + "a = 1\n",
    "dots and spaces": "a . " * 50_000 + "a = 1\n",
    "dots of a table": f"[{DOTS}]\nb = 1\n",
    "a long word before dots": "a" * 500_000 + f".{DOTS} = 1\n",
    "lists in lists": "a = " + "[" * 900 + "]" * 900 + "\n",
    "tables in tables": "a = " + "{a = " * 300 + "1" + "}" * 300 + "\n",
    "an integer": "[target]\nradius = " + "1" * 100_000 + "\n",
    "a hexadecimal integer": "[target]\nradius = 0x" + "f" * 100_000 + "\n",
    "a quantity": '[target]\nradius = "' + "1" * 500_000 + '"\n',
    "a quantity of spaces": '[target]\nradius = "1 a' + " " * 500_000 + 'b"\n',
    "a unit": '[target]\nradius = "1 ' + "m" * 500_000 + '"\n',
    "a million keys": "".join(f"a{k} = 1\n" for k in range(1_000_000)),
    "many keys": "".join(f"a{k} = 1\n" for k in range(50_000)),
    "a long key": "a" * 500_000 + " = 1\n",
    "a long word": 'drape.method = "' + "b" * 500_000 + '"\n',
    "a long list": "layout.rods = [" + "1, " * 100_000 + "]\n",
    "many loads": "[[loads]]\n" * 10_000,
    "a formula": 'target.kind = "heightfield"\ntarget.formula = "' + "(" * 100_000 + '"\n',
    "only comments": "# a " * 200_000,
    "tables": DEEP,
    "tables in themselves": LOOP,
    "a list in itself": {"layout": {"rods": ITSELF}},
    "a key of dots": {DOTS: 1},
    "keys": {f"a{k}": 1 for k in range(300_000)},
    "bytes as a key": {b"a": 1},
    "a huge integer": {"target.radius": 10**5000},
    "a huge fraction": {"target.radius": Fraction(10**5000, 3)},
    "a huge count": {"checks.stages": 10**5000},
    "huge counts": {"layout.rods": [10**400, 3]},
    "an array": {"layout.spacing": np.zeros((3, 3))},
    "a generator": {"layout.rods": (count for count in range(3))},
    "an object": {"target": object()},
    "a name of 5,000 characters": "a" * 5000,
    "a name with NUL": "a\0b",
    "a radius of 1e9 m": {"target.radius": 1e9},
    "rods by the million": {"layout.rods": "1000000x1000000", "layout.spacing": "1 um"},
    "a spacing of 1 um": {"layout.spacing": "1 um", "layout.edge": "auto"},
    "an edge of 1 um": {"layout.edge": "1 um"},
}
"""Source of a case, or its keys."""


@contextmanager
def within(memory: float, seconds: float) -> Iterator[None]:
    """At most so much more memory [B] and time of the processor [s]."""
    now = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    soft, hard = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (int(now + memory), hard))
    begun = time.process_time()
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, (soft, hard))
    assert time.process_time() - begun < seconds


def refused(error: rs.RodshellError) -> None:
    """One sentence was said, in print."""
    said = str(error)
    assert 0 < len(said) < LONGEST
    assert "\n" not in said


@pytest.mark.parametrize("what", BOMBS)
def test_a_bomb_costs_little_and_is_refused_in_a_sentence(what: str) -> None:
    bomb = BOMBS[what]
    for given in ((bomb,), *([] if isinstance(bomb, str) else [("hemisphere", bomb)])):
        with within(MEMORY, SECONDS), pytest.raises(rs.InputError) as caught:
            rs.Job.load(*given).run(until="drape")
        refused(caught.value)


def test_a_bomb_in_a_file_is_refused_and_a_pipe_is_read(tmp_path: Path) -> None:
    (tmp_path / "case.toml").write_text(BOMBS["dots"])
    with pytest.raises(rs.InputError, match=r"case.toml has a key of more than twenty tables"):
        rs.Job.load(tmp_path / "case.toml")
    for path in ("/dev/zero", tmp_path / "a\0b", "~nobody-of-this-name/case.toml"):
        with pytest.raises(rs.InputError):
            rs.Job.load(path)


VALUES: list[Any] = [
    *("", "x", "auto", "\u202e", "1 mm", "1e-300", "1e300", "nan", "inf", "-1", "0", "1", "1, 2", "1, 2, 3", "a\0b"),
    *(True, 0, -1, 2, 0.5, 1e-300, 1e300, float("nan"), float("inf"), 10**400, None, [], [1], ["1 mm", 2], {}),
    *([[0, 0], [1, 1]], [[[0, 0], [1, 1]]], np.array(0.5), np.zeros(3), b"x", ITSELF, object(), {"x": 1}, "x" * 5000),
]  # fmt: skip
KINDS: dict[str, tuple[str, ...]] = {
    "target.kind": ("hemisphere", "cap", "paraboloid", "ellipsoid"),
    "rod.section.kind": ("auto", "circle", "rectangle", "given"),
    "joint.kind": ("ball", "pin", "spring", "linker", "rigid"),
    "drape.method": ("bound", "gravity", "paper"),
    "bracing.kind": ("none", "cables", "laths"),
}
SMALL = {"layout.spacing": "80 mm", "pop_up.ends": "pinned", "checks.stages": 1}


def some_case(chance: random.Random) -> dict[str, Any]:
    """A few keys with values of any kind; some are good."""
    kinds = {key: chance.choice(words) for key, words in KINDS.items() if chance.random() < 0.3}
    return kinds | {key: chance.choice(VALUES) for key in chance.sample(list(case_keys()), chance.choice([1, 1, 2, 3]))}


def test_wrong_values_are_refused_in_a_sentence() -> None:
    chance, tries, taken = random.Random(1), 2000 * FACTOR, 0
    for _ in range(tries):
        given = some_case(chance)
        try:
            job = rs.Job.load("hemisphere", given)
            job.case.build()
            assert rs.Job.load(job.to_toml()) == job
            taken += 1
        except rs.RodshellError as error:
            refused(error)
    print(f"{tries} cases, {taken} of them good")


def test_numbers_of_any_size_give_a_form_or_a_sentence() -> None:
    """From 1e-30 to 1e18, one or two at a time, on a grid of five rods each way."""
    chance, tries = random.Random(2), 12 * FACTOR
    numeric = [key for key in keys_of_kinds(written(rs.Job.load("hemisphere").case)) if _takes_numbers(key)]
    assert len(numeric) > 25
    for _ in range(tries):
        sizes = {key: f"{10 ** chance.uniform(-9, 6):.3g}" for key in chance.sample(numeric, chance.choice([1, 2]))}
        sizes |= {chance.choice(numeric): f"{10 ** chance.uniform(-30, 18):.3g}"}
        with suppress(rs.RodshellError):
            form = rs.Job.load("hemisphere", SMALL | sizes).run(time_limit=2.0)
            assert form.results().plain()  # which is finite, or null


def _takes_numbers(key: str) -> bool:
    try:
        rs.Job.load("hemisphere", {key: "0.0312"})
    except rs.InputError as error:
        return "must be at" in str(error)
    return True


def test_a_text_that_was_changed_is_a_case_or_is_refused_in_a_sentence() -> None:
    chance, tries = random.Random(3), 400 * FACTOR
    whole = [rs.Job.load(name).to_toml() for name in ("hemisphere", "pavilion")]
    for _ in range(tries):
        text = chance.choice(whole)
        for _ in range(chance.choice([1, 1, 3, 20])):
            at, letter = chance.randrange(len(text)), chance.choice("=[]{}\"'.,#\n0e-\0\u2028é\\")
            text = (
                text[:at]
                + chance.choice([letter, letter * 3, "", text[at : at + 30]])
                + text[at + chance.choice([0, 1, 9]) :]
            )
        try:
            rs.Job.load(f"\n{text}").case.build()
        except rs.RodshellError as error:
            refused(error)


def test_rods_of_micrometres_and_shells_of_kilometres_are_solved() -> None:
    for size in (1e-6, 1e6):
        keys = {
            "target.radius": size,
            "layout.spacing": 0.3 * size,
            "rod.section.radius": 0.005 * size,
            "pop_up.ends": "pinned",
        }
        form = rs.Job.load({"target.kind": "hemisphere", "rod.material.youngs_modulus": 1e6}, keys).run(until="pop-up")
        assert form.status == "converged"
        assert form.agreement["pinned"].rms < 0.05 * size


def test_the_text_of_a_case_is_never_too_large_for_tomllib() -> None:
    text = "seams.lines = [" + "[[0, 0], [1, 1]], " * 5_000 + "]\n"
    assert len(tomllib.loads(text)["seams"]["lines"]) == len(rs.Job.load(text).case.seams.lines) == 5_000

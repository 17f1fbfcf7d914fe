"""What is printed: what a terminal would obey is shown, and a stream that takes nothing stops nothing."""

import io
import os
import subprocess
import sys
from pathlib import Path

import pytest

from rodshell.cli import main
from rodshell.printed import LONGEST, Printed, printed_streams, say, visible

CLIPBOARD = "\x1b]52;c;cm0gLXJmIH4=\x07"


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        (CLIPBOARD, r"\u001b]52;c;cm0gLXJmIH4=\u0007"),
        ("\x1b]0;title\x1b\\\x9b2J\r\b\x7f", r"\u001b]0;title\u001b\\u009b2J\u000d\u0008\u007f"),
        ("a\u202etxt.exe\u2066\u200b\u2028\U000e0041", r"a\u202etxt.exe\u2066\u200b\u2028\U000e0041"),
        ("\ud800", r"\ud800"),
        ("two\n\tlines, Höhe 3 mm, 屋根\u3000一, 4\u00a0%", "two\n\tlines, Höhe 3 mm, 屋根\u3000一, 4\u00a0%"),
    ],
)
def test_what_a_terminal_would_obey_is_escaped_and_all_else_stays(text: str, shown: str) -> None:
    assert visible(text) == shown


def test_a_sentence_is_one_line_of_a_bounded_length(capsys: pytest.CaptureFixture[str]) -> None:
    say("a name\nrodshell: error: " + "x" * 10_000)
    err = capsys.readouterr().err
    assert err.startswith("rodshell: a name rodshell: error: xxx")
    assert err.endswith(" ...\n")
    assert len(err) < LONGEST + 20


def test_names_of_a_stranger_reach_the_terminal_as_escapes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Through errors, warnings, prints and click's own messages: all of them pass the same stream."""
    for arguments in (
        ["form", f"{CLIPBOARD}.obj"], ["form", "hemisphere", f"--{CLIPBOARD}"], ["form", "hemisphere", CLIPBOARD],
        [CLIPBOARD], ["export", f"{tmp_path}/{CLIPBOARD}"], ["paper", CLIPBOARD], ["sweep", CLIPBOARD],
        ["form", "hemisphere", "--rods", CLIPBOARD], ["form", "hemisphere", "--only", CLIPBOARD],
    ):  # fmt: skip
        assert main(arguments) == 2
        said = capsys.readouterr().err
        assert "\x1b" not in said
        assert "\x07" not in said
        assert said.count("\n") == 1
    with printed_streams():
        print(CLIPBOARD)
    assert capsys.readouterr().out == visible(CLIPBOARD) + "\n"


def test_letters_that_a_terminal_does_not_have_are_escaped() -> None:
    behind = io.TextIOWrapper(io.BytesIO(), encoding="ascii", newline="")
    Printed(behind).write("Höhe – 屋\n")
    assert behind.buffer.getvalue() == rb"H\xf6he \u2013 \u5c4b" + b"\n"  # type: ignore[attr-defined]


class Full(io.StringIO):
    def write(self, text: str, /) -> int:
        raise OSError(28, "No space left on device")


class Gone(io.StringIO):
    def write(self, text: str, /) -> int:
        raise BrokenPipeError(32, "Broken pipe")


def closed() -> io.StringIO:
    stream = io.StringIO()
    stream.close()
    return stream


@pytest.mark.parametrize("stream", [None, Full(), Gone(), closed()])
def test_a_stream_that_is_full_or_closed_stops_nothing(
    stream: io.StringIO | None, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "stdout", stream)
    assert main(["--version"]) == 0
    said = capsys.readouterr().err
    assert ("not all could be printed: No space left on device" in said) == isinstance(stream, Full)
    monkeypatch.setattr(sys, "stderr", stream)
    assert main(["form", "nowhere"]) == 2


def test_a_live_line_is_replaced_by_what_is_printed_and_stays_on_its_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "12")
    behind = io.StringIO()
    stream = Printed(behind)
    stream.live("drape:\x1b[2J iteration 3")
    stream.write("done\n")
    stream.live("")
    assert behind.getvalue() == "drape:\\u001" + "\r" + 11 * " " + "\rdone\n"


@pytest.mark.skipif(sys.platform == "win32", reason="needs file descriptors that can be closed")
def test_no_file_takes_the_number_of_a_closed_stream(tmp_path: Path) -> None:
    """Else what libraries write to stderr goes into it."""
    code = (
        "import os; from rodshell.printed import hold_closed_descriptors as hold; hold(); "
        f"file = os.open({str(tmp_path / 'file')!r}, os.O_CREAT | os.O_WRONLY); os._exit(file)"
    )

    def close() -> None:
        for number in range(3):
            os.close(number)

    assert subprocess.run([sys.executable, "-c", code], preexec_fn=close, check=False).returncode > 2

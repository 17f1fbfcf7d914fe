"""Tables and images of heights: however the same surface is written down, the same surface is read."""

import struct
import warnings
import zlib

import numpy as np
import pytest
from PIL import Image

import rodshell as rs
from rodshell.targets.from_file import read_heights, read_image, read_table, smoothed

SIZE = (12.0, 8.0)
X, Y = np.meshgrid(np.linspace(-6, 6, 13), np.linspace(4, -4, 9))
Z = np.round(3 - 0.05 * X**2 - 0.04 * Y**2 + 0.02 * X * Y + 0.1 * Y, 4)
HOLED = np.where(Y * X < -20, np.nan, Z)


def rows(table, separator=",", point=".", number="{:.4f}"):
    return "\n".join(separator.join(number.format(z).replace(".", point) for z in row) for row in table)


def points(order, header=""):
    return header + rows(np.column_stack([X.ravel(), Y.ravel(), Z.ravel()])[order])


SHUFFLED = np.random.default_rng(0).permutation(X.size)
WRITTEN = {
    "commas": rows(Z),
    "semicolons": rows(Z, ";"),
    "semicolons and decimal commas": rows(Z, ";", ","),
    "tabs and decimal commas": rows(Z, "\t", ","),
    "blanks": rows(Z, "  "),
    "a comment and empty lines": "# heights\n\n" + rows(Z) + "\n\n",
    "points": points(np.arange(X.size)),
    "points with a header": points(np.arange(X.size), "x,y,z\n"),
    "points in any order, by semicolons": points(SHUFFLED, "X,Y,Z\n").replace(",", ";"),
    "points by columns": points(np.arange(X.size).reshape(X.shape).T.ravel()),
}


@pytest.mark.parametrize("how", WRITTEN)
def test_a_lattice_is_the_same_however_it_is_written(how, tmp_path):
    (tmp_path / "roof.csv").write_text(WRITTEN[how])
    heights, x, y = read_table(tmp_path / "roof.csv", SIZE)
    np.testing.assert_array_equal(heights, Z)
    np.testing.assert_allclose(np.meshgrid(x, y), [X, Y], atol=1e-15)


def test_points_lie_where_they_say_in_unequal_steps_scaled_and_centred(tmp_path):
    x, y = np.array([100.0, 101.0, 103.0, 104.0, 108.0]), np.array([0.0, 1.0, 3.0, 4.0])
    table = np.array([(a, b, a - 10 * b) for a in x for b in y])
    (tmp_path / "roof.csv").write_text(rows(table))
    vertices, _, notes, *_ = read_heights(tmp_path / "roof.csv", (16.0, 8.0), 2.0)
    assert notes == ()
    expected = np.array([(2 * (a - 104), 2 * (b - 2), 2 * (a - 10 * b)) for b in y[::-1] for a in x])
    np.testing.assert_allclose(vertices, expected, atol=1e-14)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (points(np.arange(X.size - 1)), "seems to have points x, y, z: 116 with 13 different x and 9 different y"),
        (points([*range(X.size - 1), 0]), "not a complete lattice: sample one height"),
        ("0,0,1\n1,0,1\n,1,1\n1,1,1\n", "some lack x or y"),
        (rows([(0, 0, 1), (1, 0, 1), (0, 1, np.nan), (1, 1, 1)]), 'row 3, column 3 is "nan", not a number'),
        (rows(HOLED, ";"), r'row \d+, column \d+ is "nan", not a number'),
        (rows(np.vstack([X[0], Z])), r"its first row seems to hold coordinates \(-5 to 6 in equal steps\) and not"),
        (rows(np.column_stack([Y[:, 0], Z])), r"its first column seems to hold coordinates \(3 to -4 in"),
        ("\n".join([rows([np.r_[-6.0, X[0]]]).replace("-6.0000", "", 1), rows(np.column_stack([Y[:, 0], Z]))]),
         r"its first row seems to hold coordinates \(-6 to 6 in"),
        (",".join("abcdefghijklm") + "\n" + rows(Z), r"its first row is a header \(a, b, c, .*\): delete it"),
        ("1,2,3\n1,2\n", "its rows have 2 to 3 heights"),
        (rows(Z).replace("2", "x", 1), "is not a table of numbers"),
        (rows(Z, ";", ",").replace(",", ".,", 1), "is not a table of numbers"),
    ],
)  # fmt: skip
def test_what_is_no_lattice_of_heights_is_refused_in_one_sentence(text, message, tmp_path):
    (tmp_path / "roof.csv").write_text(text)
    with pytest.raises(rs.InputError, match=message) as caught:
        read_table(tmp_path / "roof.csv", SIZE)
    assert "\n" not in str(caught.value)


def test_points_in_another_proportion_than_the_size_are_refused(tmp_path):
    (tmp_path / "roof.csv").write_text(WRITTEN["points"])
    with pytest.raises(rs.InputError, match=r"its points span 12 x 8, which is not in the proportion of .* 8 x 12 m"):
        read_table(tmp_path / "roof.csv", SIZE[::-1])


def test_an_empty_cell_and_between_blanks_nan_is_a_hole(tmp_path):
    for text in (rows(HOLED).replace("nan", ""), rows(HOLED, ";", ",").replace("nan", ""), rows(HOLED, "  ")):
        (tmp_path / "roof.csv").write_text(text)
        np.testing.assert_array_equal(read_table(tmp_path / "roof.csv", SIZE)[0], HOLED)


EVEN = {
    "planes": X + 2 * Y,
    "level": 0 * X,
    "saddle": X * Y,
    "conoid": X * (16 - Y**2),
    "parapet": np.where(Y > 3.5, 5 - 0.1 * X**2, 1 + 0.05 * Y),
    "cliff": np.where(X > -5.5, 1.0, 0.0),
}


@pytest.mark.parametrize("surface", EVEN)
def test_heights_in_equal_steps_are_no_coordinates(surface, tmp_path):
    """Ruled surfaces have rows in equal steps too, but they follow each other; a parapet is far off, but curved."""
    table = EVEN[surface]
    (tmp_path / "roof.csv").write_text(rows(table))
    assert read_table(tmp_path / "roof.csv", SIZE)[0] == pytest.approx(table, abs=1e-4)


LEVEL = 1 / 255


def dome(count):
    x, y = np.meshgrid(np.linspace(-1, 1, 3 * count // 2), np.linspace(1, -1, count))
    return 0.95 * np.cos(x) * np.cos(0.8 * y) - 0.1 * x


def test_terraces_of_8_bits_are_smoothed_to_the_surface_below_them():
    true = dome(80)
    for read in (np.round, np.floor):  # programs do either; the surface's height is all that differs
        terraced = read(255 * true) * LEVEL
        found = smoothed(terraced, LEVEL)
        assert np.abs(found - terraced).max() <= LEVEL
        assert np.std(found - terraced) <= 12**-0.5 * LEVEL * 1.001  # of numbers rounded to whole levels
        assert np.std(found - true) < 0.12 * LEVEL  # 0.06 measured; the terraces are 0.29
        bends = [np.abs(np.diff(z, 2, axis=k)).max() for z in (found, true) for k in (0, 1)]
        assert bends[0] < 1.5 * bends[2]  # of the terraces: 10 times
        assert bends[1] < 1.5 * bends[3]


def test_planes_and_what_is_no_terrace_are_left_alone():
    x, y = np.meshgrid(np.linspace(0, 1, 30), np.linspace(0, 1, 20))
    for plane in (0.5 + 0 * x, 0.2 + 0.5 * x - 0.3 * y):
        np.testing.assert_allclose(smoothed(plane, LEVEL), plane, atol=1e-4 * LEVEL)  # round-off of the largest weight
    cliff = np.where(x > 0.5, 1.0, 0.0)
    assert np.abs(smoothed(cliff, LEVEL) - cliff).max() <= LEVEL


@pytest.mark.parametrize(("mode", "white", "coarse"), [("L", 255, True), ("RGB", 255, True), ("I;16", 65535, False)])
def test_an_image_of_8_bits_is_told_and_one_of_16_bits_is_taken_as_it_is(mode, white, coarse, tmp_path):
    true = dome(40)
    stored = np.round(white * true).astype(np.uint16 if white > 255 else np.uint8)
    Image.fromarray(np.repeat(stored[:, :, None], 3, axis=2) if mode == "RGB" else stored).save(tmp_path / "roof.png")
    heights, step = read_image(tmp_path / "roof.png")
    assert (step is not None) == coarse
    vertices, _, notes, *_ = read_heights(tmp_path / "roof.png", SIZE, 3.0)
    np.testing.assert_allclose(vertices[:, 2], 3 * heights.ravel(), rtol=1e-15)
    if coarse:
        assert step == pytest.approx(LEVEL, rel=1e-3)
        assert notes[0].startswith("roof.png has 256 grey levels, steps of 11.8 mm: its heights were smoothed")
        target = rs.heights_from(tmp_path / "roof.png", size=SIZE, height=3.0)
        assert notes[0] in target.warnings
    else:
        assert notes == ()
        np.testing.assert_array_equal(heights, stored / 65535)


def test_a_grid_forms_on_an_image_of_8_bits(tmp_path):
    """Its terraces had no drape without smoothing."""
    Image.fromarray(np.round(255 * dome(80)).astype(np.uint8)).save(tmp_path / "roof.png")
    target = rs.heights_from(tmp_path / "roof.png", size=SIZE, height=3.0)
    rod = rs.Rod(rs.Circle(radius=0.03), rs.Material(youngs_modulus=1e6, density=1e3))
    draped = rs.drape(rs.GridLayout.orthogonal(spacing=1.0), rod, target)
    assert draped.report.converged
    assert draped.report.negative_modes == 0


@pytest.mark.parametrize(("width", "height"), [(1501, 1000), (5000, 4000), (12000, 12000), (60000, 60000)])
def test_an_image_of_too_many_pixels_is_refused_before_they_are_decoded(width, height, tmp_path):
    """There are none: only the header."""
    head = b"IHDR" + struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    chunks = head, b"IDAT" + zlib.compress(b""), b"IEND"
    data = b"".join(struct.pack(">I", len(c) - 4) + c + struct.pack(">I", zlib.crc32(c)) for c in chunks)
    (tmp_path / "roof.png").write_bytes(b"\x89PNG\r\n\x1a\n" + data)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(rs.InputError, match=r"(x \d+ heights|far too many pixels): scale it down to 1.5 million"):
            read_image(tmp_path / "roof.png")


@pytest.mark.parametrize("line", ["0," * 1300 + "0", "0,0,0"])
def test_a_table_of_too_many_heights_is_refused_before_its_numbers_are_read(line, tmp_path):
    rows = 1_500_001 // (line.count(",") + 1 if len(line) > 5 else 1) + 1
    (tmp_path / "roof.csv").write_text("\n".join([line, *["x"] * rows]))
    with pytest.raises(rs.InputError, match=r"heights: scale it down to 1.5 million or fewer"):
        read_table(tmp_path / "roof.csv", SIZE)

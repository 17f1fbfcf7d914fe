"""The site's pages that follow from the source have all that the source has."""

import re
import tomllib
from pathlib import Path

import click
import pytest

import rodshell
from docs.generators import api, case_file, commands, examples, findings, repository, verification
from rodshell.case import case_keys
from rodshell.case.case import Case
from rodshell.case.keys import case_tables
from rodshell.cli.app import COMMANDS, app
from rodshell.figures.findings import CODES
from rodshell.schema import fields_of
from tests.acceptance import rows

KEYS = set(case_keys()) | set(case_tables())


def sections(page: str) -> dict[str, str]:
    """The text below each heading, by its heading."""
    parts = re.split(r"^#+ (.+)\n", page, flags=re.M)
    return {head.strip("`[]"): text for head, text in zip(parts[1::2], parts[2::2], strict=True)}


def test_every_finding_has_a_section_with_what_to_do() -> None:
    found = sections(findings.page())
    for code, meaning in CODES.items():
        assert meaning[1:] in found[code]
        assert len(found[code].partition("**What to do.**")[2]) > 30, code


def test_what_to_do_names_keys_that_exist() -> None:
    tables = {path.split(".")[0] for path in KEYS}
    for code, text in findings.WHAT_TO_DO.items():
        for word in re.findall(r"`(\w+(?:\.\w+)+)`", text):
            assert word in KEYS or word.split(".")[0] not in tables or word == "bracing.csv", (code, word)


def test_every_public_name_is_on_one_page_of_the_reference() -> None:
    listed = [name for part in api.PARTS for name in re.findall(r"rodshell\.(\w+)\n", api.page(part))]
    assert sorted(listed) == sorted(rodshell.__all__)


def test_every_key_of_a_case_is_in_its_table_of_the_reference() -> None:
    found = sections(case_file.page())
    for path in KEYS - {"loads", "combinations", "supports", "seams.patches"}:
        table, _, key = path.rpartition(".")
        if path in case_tables():
            assert path in found or f"bracing.{key}" == path
        elif key == "kind":
            assert "kind = " in found[table]
        elif not table.startswith("bracing."):  # a rod like that of the grid
            assert f"| `{key}` |" in found[table], path
    for field in fields_of(Case):
        for kind in field.tables if field.rows else ():
            for inner in fields_of(kind):
                assert inner.inline or f"| `{inner.name}` |" in found[field.name], (field.name, inner.name)


@pytest.mark.parametrize(
    ("key", "words"),
    [
        ("radius", 'a length such as "200 mm", or a plain number in m, above 0'),
        ("paper", '`"A4"` or `"A3"`'),
        ("stages", "a whole number of at least 0"),
        ("kerf", "not negative"),
    ],
)
def test_a_key_of_the_reference_has_its_unit_and_its_bound(key: str, words: str) -> None:
    row = next(line for line in case_file.page().splitlines() if line.startswith(f"| `{key}` |"))
    assert words in row


def test_every_command_is_in_the_reference_with_its_options() -> None:
    found = sections(commands.page())
    for name in COMMANDS:
        command = app.get_command(click.Context(app), name)
        assert command is not None
        for option in command.params:
            if isinstance(option, click.Option) and not option.hidden and not hasattr(option, "key"):
                assert option.opts[-1] in found[f"rodshell {name}"], (name, option.opts)


def test_the_extra_of_the_site_has_what_its_settings_load() -> None:
    root = Path(__file__).parents[2]
    extra = " ".join(tomllib.loads((root / "pyproject.toml").read_text())["project"]["optional-dependencies"]["docs"])
    for module in ("latex2mathml", "myst_parser", "pydata_sphinx_theme"):
        assert module in (root / "docs" / "conf.py").read_text()
        assert module.replace("_", "-") in extra


def test_every_example_is_in_the_gallery_with_a_title_of_its_own(tmp_path: Path) -> None:
    """And the program in it is the example's, but for the title."""
    examples.write_examples(tmp_path)
    titles = examples.titles()
    assert len(set(titles.values())) == len(titles)
    for path in examples.EXAMPLES.glob("*.py"):
        text = (tmp_path / path.name).read_text()
        head = f"{titles[path.stem]}\n{'=' * len(titles[path.stem])}\n\n"
        assert text.startswith('"""\n' + head)
        assert text.replace("\n" + head, "", 1) == path.read_text()


def test_links_of_the_readme_lead_to_pages_of_the_site() -> None:
    root = Path(__file__).parents[2]
    for target in re.findall(r"\]\(([^)\s#]+)", repository.page("README.md")):
        if target.startswith("gallery/"):
            assert target[8:-4] in {"index", *examples.titles()}, target
        elif target.startswith("../"):
            assert (root / "docs" / "generated" / target).resolve().is_relative_to(root / "docs"), target


def test_every_row_of_the_acceptance_tables_is_on_the_page_of_verification_and_missed_ones_say_so(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(rows, "FOLDER", tmp_path / "accept")
    rows.print_table("rods", [rows.Row("bow", "thrust | off", 0.01, 0.02, "N"), rows.Row("arch", "rise", 3.0, 2.0)])
    (tmp_path / "Makefile").write_text("accept-rods: ## print the table of the rod alone (a minute)\n")
    monkeypatch.setattr(verification, "ROOT", tmp_path)
    page = verification.page()
    assert re.search(
        r"^## rods: the rod alone\n\n\d{4}-\d\d-\d\d, commit `\S+`: 2 figures, 1 of them missed\.$", page, re.M
    )
    assert "| bow | thrust \\| off | 0.01 N | 0.02 N |" in page
    assert "| arch | rise | 3 (missed) | 2 |" in page


THEORY = sorted((Path(__file__).parents[2] / "docs" / "theory").glob("*.md"))
LABELLED = re.compile(r"^\$\$\n(.+?)\n\$\$ \(([a-z0-9-]+)\)$", re.MULTILINE | re.DOTALL)


@pytest.mark.parametrize("page", THEORY, ids=lambda page: page.stem)
def test_every_displayed_equation_of_the_theory_has_the_label_by_which_it_is_numbered(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    found = LABELLED.findall(text)
    assert text.count("$$") == 2 * len(found)
    assert found or page.stem == "index"


@pytest.mark.parametrize("page", THEORY, ids=lambda page: page.stem)
def test_no_formula_of_the_theory_has_a_command_that_mathml_does_not_know(page: Path) -> None:
    convert = pytest.importorskip("latex2mathml.converter", reason="needs the extra [docs]").convert
    text = page.read_text(encoding="utf-8")
    inline = re.findall(r"\$([^$]+)\$", re.sub(r"\$\$.*?\$\$", "", text, flags=re.DOTALL))
    for formula in [*(formula for formula, _ in LABELLED.findall(text)), *inline]:
        assert not re.search(r"\\|<mi>&</mi>", convert(formula)), formula


def test_labels_of_equations_are_unique_and_those_referred_to_exist() -> None:
    labels = [label for page in THEORY for _, label in LABELLED.findall(page.read_text(encoding="utf-8"))]
    assert len(labels) == len(set(labels)) > 100
    docs = THEORY[0].parents[1]
    for page in docs.rglob("*.md"):
        for label in re.findall(r"\{eq\}`([^`]+)`", page.read_text(encoding="utf-8")):
            assert label in labels, (page.name, label)


def test_every_chapter_of_the_theory_is_in_its_index() -> None:
    index = next(page for page in THEORY if page.stem == "index").read_text(encoding="utf-8")
    for page in THEORY:
        assert page.stem == "index" or (f"]({page.name})" in index and f"\n{page.stem}\n" in index), page.name

"""Words that the project does not use, and what it says instead: `python .ci/words.py`; exit 1 where one is used.

Identifiers are looked for in the syntax trees of src/ and examples/, phrases in their texts and comments, and in
README.md, docs/*.md and docs/theory/*.md. A line that quotes a retired word on purpose ends with the comment
`# retired word`.
"""

import ast
import io
import re
import sys
import tokenize
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
QUOTES = re.compile(r"^#+|^[rbfuRBFU]*(\"{3}|'{3}|\"|')|(\"{3}|'{3}|\"|')$")
EXEMPT = "retired word"
FUNCTIONS = ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef

# Names anywhere in code: of variables, parameters, functions, classes, attributes and keywords.
NAMES = {
    "told": "progress",
    "Takeaway": "OutputOptions",
    "takeaway": "output_options",
    "Popped": "PopUp",
    "PoppedUp": "Form",
    "PoppedTable": "Form",
    "FoundForm": "Form",
    "Sewn": "Form, patches",
    "SewnForm": "Form, patches",
    "sewn": "patches",
    "sew": "form_patches",
    "Rise": "DynamicPopUpSettings",
    "Risen": "DynamicPopUp",
    "pop_up_in_time": "dynamic_pop_up",
    "Moment": "Sample",
    "SLID_OFF": "LOST_CONTACT",
    "workshop": "checks and fabrication",
    "carried": "warm_start",
    "places": "flat_coordinates",
    "way_up": "deployment",
}
# Names of variables, parameters and functions only: as attributes they are NumPy's, or words of their own.
VARIABLES = {
    "own": "overrides, or the noun",
    "which": "index",
    "one": "the noun: rod, patch, shell",
    "ones": "the noun",
}
MODULES = {
    "of": "from_objects",
    "overhead": "initial_placement",
    "rising": "dynamic_pop_up",
    "standing": "the wall below the rim",
    "footing": "the wall below the rim",
    "nearby": "net_refinement",
    "reach": "net_extent",
    "summed": "newton_matrix",
    "roll": "section_rotation",
    "sewn": "patches",
    "workshop": "checks, fabrication",
    "joined": "merge",
    "calming": "rest_advice",
    "carried": "warm_start",
    "given": "validation",
    "sharing": "symbolic",
    "tiles": "simd_kernels",
    "takeaway": "output options",
    "utils": "what it does",
    "helpers": "what it does",
    "common": "what it holds",
    "core": "what it holds",
}
# Regular expressions, read without regard to case, a blank standing for any white space.
PHRASES = {
    r"\bnumerics\.md\b": "docs/theory/, docs/equations.md or the published source",
    r"\bways? up\b": "deployment",
    r"\b(tell|tells|told)\b(?! (the|a|you|us|him|her) )": "says, shows, distinguishes; passed",
    r"\b(bear|bears|bearing|borne)\b": "carries, withstands, allows",
    r"\bglad\b": "useful for",
    r"\bwholly\b": "fully, completely",
    r"\bof a table's\b": "in a table",
    r"\b(beside|besides)\b": "next to, with, in addition to",
    r"(?<!\bthere\s)\b(is|are) no (?!longer\b|more\b|need\b|reason\b|doubt\b|\w+er than\b)": "is not a",
    r"(?<!\bthere\s)\b(is|are) none\b": "does not exist, is empty",
    r"\bfor want of\b": "without, not enough",
    r"\b(will|would) do\b": "is enough, works",
    r"\bbut for\b": "except",
    r"\banew\b": "again",
    r"\bonce more\b": "again",
    r"\b(go|goes|going|went|gone) on\b": "continue",
    r"\bstands? (twice|good|alone)\b": "occurs twice, is valid, by itself",
    r"\b(sew|sews|sewn|sewing)\b": "joined at seams, in patches",
    r"\bat the door\b|\bfront door\b": "on entry; public interface",
    r"\bpeople take away\b": "outputs",
    r"\bpart sheets\b": "separate sheets",
    r"\bas [\w.'/]+( [\w.'/]+)? (has|have) (it|them)\b": "as in, according to",
    r"\bprint the version and end\b": "print the version and exit",
    r"\bown rod ends within\b": "drape against net, rod ends",
    r"\bname, of several\b|\bor its layer\b": "object or layer name, if the file has several",
    r"\bcannot be on\b": "unknown paper size",
    r"\bslid(es|ing)? off\b": "lost contact",
    r"\b(thereof|therein|thereby|therefrom|whereof|wherein|whence|hence|aright|lest|upon|nought|amidst|whilst)\b":
        "a present-day word",
    r"\b(twofold|threefold|fourfold|manifoldly)\b": "twice, three times",
    r"\bin a form's way\b|\bstands? in (the|its|their) way\b": "conflicts with",
    r"\bof (its|their|his) own accord\b": "without help",
    r"\bnone of its business\b": "does not apply",
    r"\bcomes? about\b": "arises",
    r"\bgoes with the (root|square|cube)\b": "is proportional to",
    r"\bto be had\b|\bcan be had\b": "is available",
    r"\bsays? (all|both|so) (its|them)?sel(f|ves)\b": "defines",
}  # fmt: skip


def names_in(tree: ast.AST) -> Iterator[tuple[int, str, bool]]:
    """Line and name of every identifier, and whether it is an attribute of something else."""
    for node in ast.walk(tree):
        line = getattr(node, "lineno", 1)
        if isinstance(node, ast.Name):
            yield line, node.id, False
        elif isinstance(node, ast.Attribute):
            yield line, node.attr, True
        elif isinstance(node, FUNCTIONS):
            yield line, node.name, False
        elif isinstance(node, ast.arg) or (isinstance(node, ast.keyword) and node.arg):
            yield line, str(node.arg), isinstance(node, ast.keyword)
        elif isinstance(node, ast.alias):
            yield line, (node.asname or node.name).rpartition(".")[2], True


def texts_in(source: str) -> Iterator[tuple[int, str]]:
    """First line and text of every string and comment; those that follow each other as one text."""
    run: list[tokenize.TokenInfo] = []
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.NL:
            continue
        if run and token.type != run[0].type:
            yield run[0].start[0], _joined(run)
            run = []
        if token.type in (tokenize.STRING, tokenize.COMMENT):
            run.append(token)


def _joined(run: list[tokenize.TokenInfo]) -> str:
    """The text without quotes or signs of comments, on as many lines as in the file."""
    text = ""
    for before, token in zip([run[0], *run], run, strict=False):
        text += "\n" * (token.start[0] - before.end[0]) + QUOTES.sub("", token.string)
    return text


PATTERNS = [(re.compile(phrase.replace(" ", r"\s+"), re.IGNORECASE), said) for phrase, said in PHRASES.items()]


def phrases_in(line: int, text: str) -> Iterator[tuple[int, str, str]]:
    """Line, phrase and replacement of every retired phrase in a text that begins at `line`."""
    for pattern, said in PATTERNS:
        for found in pattern.finditer(text):
            yield line + text.count("\n", 0, found.start()), " ".join(found.group().split()), said


def words_in(path: Path) -> Iterator[tuple[int, str, str]]:
    """Line, word and replacement of every retired word of a file."""
    source = path.read_text()
    if path.suffix != ".py":
        yield from phrases_in(1, source)
        return
    if path.stem in MODULES:
        yield 1, f"{path.name}, a file", MODULES[path.stem]
    retired = NAMES | VARIABLES
    for line, name, attribute in names_in(ast.parse(source)):
        if name in NAMES if attribute else name in retired:
            yield line, name, retired[name]
    for line, text in texts_in(source):
        yield from phrases_in(line, text)


def files() -> list[Path]:
    code = [path for folder in ("src", "examples") for path in sorted((ROOT / folder).rglob("*.py"))]
    templates = sorted((ROOT / "src").rglob("*.j2"))
    pages = [page for folder in ("docs", "docs/theory") for page in sorted((ROOT / folder).glob("*.md"))]
    return [*code, *templates, ROOT / "README.md", *pages]


def room(path: Path) -> str:
    parts = path.relative_to(ROOT).parts
    return "/".join(parts[2:3] if parts[0] == "src" else parts[:1])


def main() -> int:
    counts: Counter[str] = Counter()
    for path in files():
        lines = path.read_text().splitlines()
        for line, word, said in sorted(set(words_in(path))):
            if EXEMPT in lines[line - 1]:
                continue
            counts[room(path)] += 1
            print(f'{path.relative_to(ROOT)}:{line}: "{word}" -> {said}')
    for name, count in sorted(counts.items(), key=lambda entry: -entry[1]):
        print(f"{count:5d} in {name}")
    return 1 if counts else 0


if __name__ == "__main__":
    sys.exit(main())

"""The paper's figures, made again with their errors [HQK]. A figure is a module with `make(progress)`."""

FIGURES = {
    "fig1": "three shells popped up, and the boundaries between which their rods' ends move",
    "fig4": "two rods at one joint, of which one is twisted or turned: does the other follow?",
    "fig6": "the three targets from the flat grid to G0, by the paper's method, gravity statics and the bound drape",
    "fig7": "the hemisphere at spacings of 4 and 5 cm, by the same three",
    "fig8": "computing time against time step and number of unknowns, the paper's scheme and ours",
    "genetic": "a genetic algorithm's G0 and popped-up shape beside those of the direct method",
    "studies": "G0 when H, E, r, g, C1 or C2 changes over decades: two claims of the text",
}

_MORE = {"fig4": ["angles-?.csv"], "genetic": ["hemisphere.json", "paraboloid.json", "ellipsoid.json"]}


def reserved(figure: str) -> list[str]:
    """Patterns (of `Path.glob`) of the names that a figure's files may have."""
    own = [f"{figure}{end}" for end in (".svg", "-*.svg")]
    return ["result.json", "table.txt", "table.csv", *own, *_MORE.get(figure, [])]

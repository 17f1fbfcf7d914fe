"""The paper's figures, made again with their errors [HQK]. A figure is a module with `make(progress)`."""

FIGURES = {
    "fig4": "two rods at one joint, of which one is twisted or turned: does the other follow?",
}

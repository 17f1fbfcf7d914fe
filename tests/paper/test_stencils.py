"""Figs 2, 3 and 5: what is counted and drawn is what the elements have."""

from xml.etree import ElementTree

from rodshell.paper import stencils


def test_the_unknowns_are_those_that_the_paper_counts() -> None:
    """4N - 1 of a rod; at the joint four nodes are one, and so are pairs of neighbours and of edges."""
    figure = stencils.make(lambda *told: None)
    rod, shared, separate, contact = figure.rows()
    assert int(rod[2]) == 4 * 5 - 1
    linker = 3 * 3 + 2  # three nodes, two edges
    assert int(separate[2]) == 2 * (4 * 5 - 1) + 2 * linker
    tied = int(separate[4]), int(separate[5])
    assert tied == (8, 4)  # Eq 6 for both linkers: twice two ties with each rod, and one of angles
    assert int(separate[2]) - int(shared[2]) == 3 * (4 + 4 - 1) + 4  # as many positions and angles as are the same
    assert contact[2] == "2 of 3"


def test_the_drawing_has_a_line_for_every_rod_linker_and_tie() -> None:
    root = ElementTree.fromstring(stencils.make(lambda *told: None).pictures()["stencils"])
    lines = root.findall(".//{http://www.w3.org/2000/svg}polyline")
    dashed = [line for line in lines if line.get("stroke-dasharray") == "3 2"]
    assert len(dashed) == 8 + 4
    assert len(root.findall(".//{http://www.w3.org/2000/svg}circle")) > 30

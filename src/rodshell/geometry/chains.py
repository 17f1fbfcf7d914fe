"""Points along a curve, put in their order."""

import numpy as np
from scipy.sparse.csgraph import breadth_first_order, minimum_spanning_tree
from scipy.spatial.distance import cdist

from rodshell.arrays import Floats, Ints


def along_curve(points: Floats) -> Ints | None:
    """The order of `points` (m, 3) along the curve on which they lie, however they are numbered.

    Their shortest tree is the curve where it is sampled densely enough for its bends. Of a closed curve its longest
    gap is left out.

    Returns:
        (m,) their numbers from one end of the curve to the other; None: the tree has branches.
    """
    tree = minimum_spanning_tree(cdist(points, points))
    neighbours = np.bincount(np.concatenate(tree.nonzero()), minlength=len(points))
    if neighbours.max() > 2 or tree.nnz < len(points) - 1:
        return None
    first = int(np.flatnonzero(neighbours == 1)[0])
    return np.asarray(breadth_first_order(tree, first, directed=False, return_predecessors=False), dtype=np.intp)

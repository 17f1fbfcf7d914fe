#! python3
# r: rodshell-client
"""Find the gridshell of a mesh, by the rodshell studio on this machine.

Inputs (right-click: type hint): address (str), mesh (Mesh), spacing (float), rods (int), radius (float), base (float),
all in metres. Outputs: rods, flat (trees, a branch for each family), joints (list), verdict, findings (lists of text).
"""

import Grasshopper
import Rhino.Geometry as rg
from rodshell_client import Client, ServerError, obj_text


def tree_of(families):
    """A branch for each family of rods."""
    tree = Grasshopper.DataTree[object]()
    for number, lines in enumerate(families):
        path = Grasshopper.Kernel.Data.GH_Path(number)
        for points in lines:
            tree.Add(rg.PolylineCurve([rg.Point3d(*point) for point in points]), path)
    return tree


corners = [(point.X, point.Y, point.Z) for point in mesh.Vertices]  # noqa: F821
faces = [(f.A, f.B, f.C, f.D) if f.IsQuad else (f.A, f.B, f.C) for f in mesh.Faces]  # noqa: F821
case = {
    "target": {"kind": "mesh", "file": "upload:roof.obj", "unit": "m", "base": base},  # noqa: F821
    "layout": {"rods": [rods, rods], "spacing": spacing},  # noqa: F821
    "rod": {"section": {"kind": "circle", "radius": radius}, "material": {"preset": "gfrp"}},  # noqa: F821
    "pop_up": {"ends": "pinned"},
}
try:
    form = Client(address).find(case, {"roof.obj": obj_text(corners, faces)})  # noqa: F821
    verdict, findings = form.verdict, form.reasons
    rods, flat = tree_of(form.tree()), tree_of(form.tree(form.flat))
    joints = [rg.Point3d(*place) for place in form.joints.values()]
except ServerError as error:
    rods = flat = joints = None
    verdict, findings = "unknown", [str(error)]

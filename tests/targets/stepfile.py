"""STEP files written by hand: a face on a B-spline surface, a cap of a sphere, a disc, several faces."""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

HEAD = """ISO-10303-21;
HEADER;
FILE_DESCRIPTION(('a surface'),'2;1');
FILE_NAME('roof','2026-01-01T00:00:00',(''),(''),'','','');
FILE_SCHEMA(('AUTOMOTIVE_DESIGN { 1 0 10303 214 1 1 1 1 }'));
ENDSEC;
DATA;
"""
UNITS = {"mm": ".MILLI.", "m": "$"}


class StepFile:
    """Faces are added one by one; `text` is the file."""

    def __init__(self, unit: str = "mm") -> None:
        self._lines, self._faces = list[str](), list[str]()
        self._unit = unit

    def add(self, entity: str) -> str:
        self._lines.append(f"#{len(self._lines) + 1}={entity};")
        return f"#{len(self._lines)}"

    def point(self, x: Floats) -> str:
        return self.add(f"CARTESIAN_POINT('',({','.join(f'{value:.12E}' for value in x)}))")

    def patch(self, controls: Floats, degree: int, knots: list[float], name: str = "") -> None:
        """A face all over a surface with control points (m, m, 3) and distinct knots, the same both ways."""
        points = np.array([[self.point(p) for p in row] for row in controls])
        # as many control points as knots with multiplicity, less degree + 1; inner knots are simple
        often = [degree + 1] + [1] * (len(knots) - 2) + [degree + 1]
        multiplicities, values = ",".join(map(str, often)), ",".join(f"{knot:.6E}" for knot in knots)

        def splines(kind: str, degrees: str, rows: str, ways: int) -> str:
            flags = ".F.," * (ways + 1)
            twice = ",".join([f"({multiplicities})"] * ways + [f"({values})"] * ways)
            return self.add(
                f"B_SPLINE_{kind}_WITH_KNOTS('',{degrees},{rows},.UNSPECIFIED.,{flags}{twice},.UNSPECIFIED.)"
            )

        rows = ",".join("(" + ",".join(row) + ")" for row in points)
        surface = splines("SURFACE", f"{degree},{degree}", f"({rows})", 2)
        borders = [points[:, 0], points[-1], points[::-1, -1], points[0, ::-1]]
        corners = [self.add(f"VERTEX_POINT('',{border[0]})") for border in borders]
        edges = []
        for border, (first, last) in zip(borders, pairwise([*corners, corners[0]]), strict=True):
            curve = splines("CURVE", str(degree), "(" + ",".join(border) + ")", 1)
            edges.append(self.add(f"EDGE_CURVE('',{first},{last},{curve},.T.)"))
        self._face(surface, edges, name)

    def cap(self, radius: float, base: float, name: str = "") -> None:
        """A face on a sphere around the origin, above z = base."""
        axes = self._axes(np.zeros(3))
        surface = self.add(f"SPHERICAL_SURFACE('',{axes},{radius:.12E})")
        rim = np.sqrt(radius**2 - base**2)
        vertex = self.add(f"VERTEX_POINT('',{self.point(np.array([rim, 0.0, base]))})")
        circle = self.add(f"CIRCLE('',{self._axes(np.array([0.0, 0.0, base]))},{rim:.12E})")
        self._face(surface, [self.add(f"EDGE_CURVE('',{vertex},{vertex},{circle},.T.)")], name)

    def disc(self, radius: float, name: str = "") -> None:
        """A face cut out of the plane z = 0 by a circle around the origin."""
        surface = self.add(f"PLANE('',{self._axes(np.zeros(3))})")
        vertex = self.add(f"VERTEX_POINT('',{self.point(np.array([radius, 0.0, 0.0]))})")
        circle = self.add(f"CIRCLE('',{self._axes(np.zeros(3))},{radius:.12E})")
        self._face(surface, [self.add(f"EDGE_CURVE('',{vertex},{vertex},{circle},.T.)")], name)

    def _axes(self, origin: Floats) -> str:
        up, ahead = self.add("DIRECTION('',(0.,0.,1.))"), self.add("DIRECTION('',(1.,0.,0.))")
        return self.add(f"AXIS2_PLACEMENT_3D('',{self.point(origin)},{up},{ahead})")

    def _face(self, surface: str, edges: list[str], name: str) -> None:
        oriented = ",".join(self.add(f"ORIENTED_EDGE('',*,*,{edge},.T.)") for edge in edges)
        loop = self.add(f"EDGE_LOOP('',({oriented}))")
        bound = self.add(f"FACE_OUTER_BOUND('',{loop},.T.)")
        self._faces.append(self.add(f"ADVANCED_FACE('{name}',({bound}),{surface},.T.)"))

    def text(self) -> bytes:
        shells = [self.add(f"OPEN_SHELL('',({face}))") for face in self._faces]
        models = [self.add(f"SHELL_BASED_SURFACE_MODEL('',({shell}))") for shell in shells]
        length = self.add(f"(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT({UNITS[self._unit]},.METRE.))")
        angle = self.add("(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.))")
        solid = self.add("(NAMED_UNIT(*)SI_UNIT($,.STERADIAN.)SOLID_ANGLE_UNIT())")
        exact = self.add(f"UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE(1.E-6),{length},'distance_accuracy_value','')")
        context = self.add(
            f"(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT(({exact}))"
            f"GLOBAL_UNIT_ASSIGNED_CONTEXT(({length},{angle},{solid}))REPRESENTATION_CONTEXT('',''))"
        )
        whole = self.add(f"MANIFOLD_SURFACE_SHAPE_REPRESENTATION('',({','.join(models)}),{context})")
        design = self.add("APPLICATION_CONTEXT('automotive design')")
        self.add(f"APPLICATION_PROTOCOL_DEFINITION('international standard','automotive_design',2000,{design})")
        trade = self.add(f"PRODUCT_CONTEXT('',{design},'mechanical')")
        product = self.add(f"PRODUCT('roof','roof','',({trade}))")
        formation = self.add(f"PRODUCT_DEFINITION_FORMATION('','',{product})")
        part = self.add(f"PRODUCT_DEFINITION_CONTEXT('part definition',{design},'design')")
        definition = self.add(f"PRODUCT_DEFINITION('design','',{formation},{part})")
        shape = self.add(f"PRODUCT_DEFINITION_SHAPE('','',{definition})")
        self.add(f"SHAPE_DEFINITION_REPRESENTATION({shape},{whole})")
        return (HEAD + "\n".join(self._lines) + "\nENDSEC;\nEND-ISO-10303-21;\n").encode()

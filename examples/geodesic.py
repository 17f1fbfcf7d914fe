"""Wide laths on a dome: along an inextensible net they buckle, along geodesics they stand.

Laths 2 x 40 mm have EI2/EI1 = 400. Prints whether each lattice stands, how near it comes to the target, and whether its
grid lies flat.
"""

import rodshell as rs

TARGET = rs.Cap(radius=2.0, base=1.0)
LATH = rs.Rod(rs.RectangularSection(width=0.002, height=0.040), rs.Material.preset("gfrp"))


def main() -> None:
    for layout in (
        rs.GridLayout.orthogonal(spacing=0.3),
        rs.Geodesic(spacing=0.3),
        rs.Geodesic(spacing=0.3, families=3),
    ):
        form = rs.find_form(TARGET, layout, LATH, joint=rs.Pin(), ends="pinned")
        name = f"{layout.kind}, {len(form.footprint.rods)} laths"
        if form.status != "converged":
            print(f"{name}: does not stand: {form.status}")
            continue
        flat = form.flat_state
        where = "lies flat" if flat is None or flat.lies_flat else "is assembled in place"
        print(f"{name}: {form.agreement['pinned']}; {where}")


if __name__ == "__main__":
    main()

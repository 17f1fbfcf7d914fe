"""Three families of laths along geodesics of a dome, at 60 degrees: triangles, which carry more than squares."""

import rodshell as rs

target = rs.Cap(radius=2.0, base=1.0)
lath = rs.Rod(rs.RectangularSection(width=0.002, height=0.020), rs.Material.preset("gfrp"))
factors = []
for families in (2, 3):
    layout = rs.Geodesic(spacing=0.3, families=families)
    form = rs.find_form(target, layout, lath, joint=rs.Pin(), ends="pinned")
    factor = form.checks.self_weight["pinned"].load_factor or 0.0
    factors.append(factor)
    print(f"{len(form.footprint.rods)} laths carry {factor:.1f} times their weight: {form.agreement['pinned']}")
    assert form.popped["pinned"].report.stable
assert factors[1] > 1.3 * factors[0]

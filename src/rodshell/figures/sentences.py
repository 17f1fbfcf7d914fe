"""All sentences that judge: what is said of a finding, by its code, and its variants by what follows a colon.

`ends` is the finding's support, `place` its place; the other words are given where it is judged (`findings.said`).
"""

LOADS = "with {ends} ends {what} under {place}{at}{where}"
UNLOADED = "with {ends} ends {what}{where}"

SENTENCES = {
    "assumed_class": (
        "strengths and creep are those of service class 2 (covered), which was taken as none was given: give "
        "strength.service_class (1 inside, 3 in the weather)"
    ),
    "assumed_creep": (
        "by creep, which was not given, deflections under permanent loads were taken to grow by {creep} of what they "
        "are at first: ask the rods' maker (strength.creep)"
    ),
    "cables_short": (
        "cables are shortened by only {short}: one that is {scatter} too long {slack}, one {scatter} too short has up "
        "to {times} times its force; stress them to their forces (bracing.csv), not to their lengths"
    ),
    "contact": "{shape} {worst}{rods} by {depth}{where}: use thinner rods (rod.section), or set them further apart",
    "creep_unknown": (
        "creep of these rods is not known, and how far the shell carries permanent loads after years is not either: "
        "give by how much its deflections grow (strength.creep)"
    ),
    "deflection": (
        "under {place} with {ends} ends the shell moves by up to {moved}{years}, and {allowed} are allowed "
        "(combinations.deflection)"
    ),
    "designed": "{what} chosen to carry the loads: {design}; {count} designs were tried (design in result.json)",
    "ends_in_the_air": (
        "{count} of {all} rod ends lie up to {high} above the lowest: where they do not stand on the ground, an edge "
        "beam, an arch or a ring has to hold them{against}; it was taken as {stiff} here and has to be designed"
    ),
    "falls": "{alone}the shell does not stand under its own weight{bracing}: it carries only {parts}{others}{advice}",
    "falls_after_years": (
        "under {place} with {ends} ends{imperfections} the shell falls after years at {factor} times these loads, as "
        "deflections grow by {creep} times what they are at first (creep)"
    ),
    "falls_under_loads": "with {ends} ends the shell falls under {place}: it {how} at {factor} times these loads",
    "flat": "the target is flat, nothing pops up",
    "guided": (
        "lifted from flat and driven by its ends alone, the shell comes to rest in another shape{where}: it has to be "
        "guided into its final shape"
    ),
    "imperfect": "under {place} with {ends} ends and imperfections the shell falls at {factor} times these loads",
    "imperfect: unloaded": "with {ends} ends and imperfections the shell is unstable before the loads of {place} act",
    "imperfect_unknown": (
        "under {place} with {ends} ends and imperfections nothing is known above {factor} times the loads"
    ),
    "imperfect_unknown: no equilibrium": (
        "under {place} with {ends} ends and imperfections no equilibrium was found, and nothing is known of it"
    ),
    "in_place": (
        "the rods cannot be laid out flat: there they would bend within the plane by up to {bent}, and withstand "
        "{withstood} during erection; bring rod by rod to its place over a scaffold, by the joints on its strip"
    ),
    "in_place: unstable": (
        "no stable state of the rods in the plane was found, in which they could be laid out flat; bring rod by rod to "
        "its place over a scaffold, by the joints on its strip"
    ),
    "lies_flat": (
        "the rods can be laid out flat: there they bend within the plane by up to {bent}, and withstand {withstood} "
        "during erection"
    ),
    "linear_buckling": (
        "under {place} with {ends} ends linear buckling is at {factor} times these loads: the shell carries them only "
        "in another shape, its nodes having moved by {moved}"
    ),
    "low_stiffness": ("under {place} with {ends} ends the shell falls at {factor} times these loads with {share}"),
    "lost": (
        "the deployment could not be followed all the way: {how}; stages are missing, and whether the shell reaches "
        "its final shape from flat is not known"
    ),
    "needs_bracing": "{alone}the shell {carries} {weight} without its bracing: support it until that is in place",
    "no_design": "no design was found that carries the loads with its reserve ({count} tried); {limits}",
    "no_imperfections": (
        "imperfections were left out, and the factors on the loads are those of the perfect shell: have them "
        'looked at (--stability.imperfection "span/500")'
    ),
    "no_loads": (
        "stresses and support forces are those of the unloaded shell{snow}; other loads (wind, drifts, people) and "
        "imperfections were not checked{creep}"
    ),
    "no_mass": (
        "no mass was given, so that it is not known what share of its own weight the shell carries: give "
        "rod.section.mass"
    ),
    "no_room": (
        "{who} pass each other with {room} between them {where}: that leaves hardly any room for joints; use thinner "
        "rods (rod.section), or set them further apart"
    ),
    "no_shear_strength": (
        "torsion shears the rods by up to {stress}, counted by von Mises as in isotropic materials; timber and fibre "
        "composites withstand less shear along the fibres: give checks.shear_strength"
    ),
    "no_strength": "no strength was given, so it is not known whether the rods hold (checks.strength)",
    "no_strength: others": (
        "the design strength of {what} is not known, so that whether it breaks was not judged: "
        "compare its largest forces, which stand with the loads, with what it can carry"
    ),
    "no_strength: durations": "the design strength for {durations} loads is not known and was not judged",
    "no_strength: rods": (
        "the design strength of the rods is not known, so that whether they break under the loads was not judged: "
        "give strength.permanent and strength.short"
    ),
    "none_stands": (
        "no support that was asked for is shown to hold the shell up: with {falls} ends it falls under its own "
        "weight{bracing}, and {unknown}; take stiffer rods, or brace it, and check it again"
    ),
    "not_checked: clamped": (
        "whether the {ends} shape is reached from the {pinned} one by turning the ends is not known"
    ),
    "not_checked: contact": (
        "whether rods touch and are thin enough for their curvature was not checked; a given section needs "
        "rod.section.fibre_distances for that"
    ),
    "not_checked: deployment": "whether the shell is reached from flat was not checked{why}",
    "not_checked: gap": "the gap to the target was not checked",
    "not_checked: late": "{when}; not checked: {missing}",
    "not_checked: loads": "{place} with {ends} ends was not checked",
    "not_checked: refused": "the loads were not checked: {why}",
    "not_checked: stability": "whether the shell is stable was not checked",
    "not_checked: weight": "whether it carries its own weight{bracing} was not checked",
    "not_computed": "the computation did not converge, which says nothing about the shell itself: {status}",
    "not_computed: job": "the job is not complete: {status}",
    "not_computed: pop-up": "the pop-up with {ends} ends did not converge: {status}",
    "not_computed: nothing": "there is no pop-up in this result",
    "not_followed": (
        "whether the shell stands under {place} with {ends} ends is not known: it could be followed only up to "
        "{factor} times these loads"
    ),
    "not_followed: above": (
        "under {place} with {ends} ends the shell could not be followed beyond {factor} times the loads, and nothing "
        "is known above"
    ),
    "not_followed: years": (
        "under {place} with {ends} ends the shell after years of creep could not be followed beyond {factor} times "
        "these loads, and nothing is known above"
    ),
    "not_followed: weight": (
        "{alone}it is not known whether the shell stands under its own weight{bracing}: it could be followed only up "
        "to {parts}"
    ),
    "not_followed: reserve": (
        "with {ends} ends the shell{bracing} carries {times} its own weight; above, it could not be followed, and "
        "nothing is known"
    ),
    "not_nested": (
        "rods that are curved at rest are cut from boards, whose sizes are in the schedule of rods: no plan of cutting "
        "them from bars was made"
    ),
    "not_refined": "the form is not refined: {why}",
    "not_refined: late": "{when}: the refinement was stopped at what it had found",
    "not_sold": "the chosen section is {thin}: have it made, or choose another material or a larger target",
    "not_spliced": "{rods} cannot be spliced between joints from stock of {stock}: give longer stock",
    "off_target": (
        "with {ends} ends, the nearest that can be used, the shell deviates from the target by up to {gap} ({share} "
        "of its size){where}{advice}"
    ),
    "other_shape": (
        "with {ends} ends the shell has another stable shape, {distance} of its size away at {energy} times the "
        "energy: check on site that it takes the intended one"
    ),
    "relaxed": (
        "permanent strength counts on {share} of the unloaded shell's stress to be gone after months, as given "
        "(strength.relaxed), which wood and moisture decide"
    ),
    "reserve": "the shell{bracing} carries only {weights}, and {asked}{others}{advice}",
    "reserve_under_loads": (
        "under {place} with {ends} ends the shell carries {factor} times these loads {what}, and {asked} times are "
        "asked for (stability.reserve)"
    ),
    "sinks": (
        "with {ends} ends the shell moves by {depth} ({share} of its size) under its own weight{further}, so that it "
        "does not keep the shape whose gap to the target is given: use stiffer rods, or brace it"
    ),
    "slip": LOADS,
    "slip: unloaded": UNLOADED,
    "slots": (
        "where strips meet at {angle}, slots are {width} wide, and on {place} only {left} remain next to one, less "
        "than its depth of {depth}: use thinner or lower strips (rod.section), or set them further apart"
    ),
    "slots_weaken": (
        "at their slots strips keep half of their height: stresses there are twice as large as shown, and four times "
        "those of bends within the surface, which was not judged; compare them with the strength, or bolt the strips "
        'side by side (joint.kind "pin")'
    ),
    "snaps": "{where} of the deployment from flat the shell snaps forward by itself, by up to {by}{continues}{other}",
    "stands": (
        "with {all} ends the shell{bracing} is stable and carries {weight} times its own weight, {asked} being asked "
        "for{near}"
    ),
    "stands_under_loads": "it carries {place} {factor} times {what}{stiffness}",
    "strength": "{shape} the rods use {share} of {whose}{where}",
    "strength: given": "{shape} the rods would break: {share} of their strength{where}",
    "strength: unloaded": UNLOADED,
    "strength_not_reduced": (
        "the rods permanently use {share} of {whose}: reduce it for duration and moisture and give the reduced value "
        "as checks.strength, or use thinner rods"
    ),
    "reserve_under_loads: beam": (
        "with {ends} ends a span of the beam {beam} along the edge carries {share} of its Euler load {under}, and with "
        "a reserve of {asked} it may carry {most}: take a stiffer beam, or set rod ends closer"
    ),
    "strength_of_beam": (
        "with {ends} ends the beam {beam} along the edge uses {share} of its design strength {under}, near the rod end "
        "{place}: give it a larger section in the case file"
    ),
    "strength_of_beam: buckles": (
        "with {ends} ends a span of the beam {beam} along the edge has to carry {share} of its Euler load {under}, and "
        "buckles between two rod ends: take a stiffer beam, or set rod ends closer"
    ),
    "strength_of_bracing": "with {ends} ends the bracing uses {share} of its design strength under {place}",
    "strength_under_loads": LOADS,
    "too_thick": (
        "{shape} bending strains the rods by {strain}: they are too thick for this curvature, and the theory of thin "
        "rods is valid up to about {valid}; use thinner rods or a larger target"
    ),
    "turned": "turned into their clamps after deployment, the ends lead to another than the {ends} shape",
    "unstable": "with {ends} ends the shell is unstable{count} and would snap to another shape",
    "unstable: unloaded": "with {ends} ends the shell is unstable before the loads of {place} act",
}

ANOTHER_WAY = (
    "; this is on one way, all ends moved evenly: erect it in another way that is checked, such as rod by rod over a "
    "scaffold, lifted at its middle, or one family's ends first"
)

USES = {
    "bending": "the rods use {} of their design strength{}",
    "shear": "the rods use {} of their design strength in shear{}",
    "slip": "a joint has to transfer {} of the force at which it slips",
    "permanent": "the erected shell, before loads act, uses {} of the rods' permanent design strength{}",
    "slip_unloaded": "before loads act a joint of the erected shell has to transfer {} of the force at which it slips",
}
"""What is used too much, in the sentences on loads, and by which code."""

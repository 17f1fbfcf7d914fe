"""Replay a rodshell structure in OpenSees: `python replay.py popped_pinned.json` (pip install openseespy numpy).

The flat grid is free of stress. Its nodes are moved through the stages of the deployment; then all but the supports are
let go, so that the shell finds its own equilibrium with its bending prestress in it. Printed are the distance from
the shape in the file, the lowest frequencies, and for each combination of loads the factor up to which it is stable.
Import it and use `Replay` for loads of your own. Units: m, N, kg, s.
"""

import json
import sys
from itertools import pairwise

import numpy as np
import openseespy.opensees as ops

FIRM = 1e3  # times the stiffness of an edge of rod: members that stand for pins and clamps
LIMP = 1e-6  # the same of what must be free, but not singular
PIN = 0.05  # length of a pin of rods without eccentricity, over that of an edge
CLOSE = 1e-8  # of the size: by how much the last iteration moves a node
ENDS, GUIDE, LOADS, STEPS = 1, 2, 3, 12  # patterns; the most halvings of a step
NEAR = 2e-3  # of a factor: as near as the loss of stability is located
FIRST, MOST = 0.1, 100.0  # times the loads: the first step, and the largest factor
NEAREST = 8  # eigenvalues nearest to 0 that are looked at, among which those below it must be
CABLES = 10**6  # tag of the first


class Replay:
    """A structure in OpenSees' one model, which a second Replay replaces."""

    def __init__(self, structure):
        if (structure.get("format"), structure.get("version")) != ("rodshell-structure", 1):
            raise SystemExit("this script reads rodshell-structure, version 1: export the result again")
        self.given = structure
        self.stages = np.array(structure["stages"])
        flat = self.stages[0]
        self.size = float(np.ptp(self.stages[-1], axis=0).max())
        self.elements = []
        self.count = len(flat)  # of tags of nodes, which are the numbers of the file and 1
        section = structure["section"]
        self.bends = section["EI_out_of_grid"], section["EI_within_grid"]
        ops.wipe()
        ops.model("basic", "-ndm", 3, "-ndf", 6)
        for k, (at, mass) in enumerate(zip(flat.tolist(), structure["mass"], strict=True)):
            ops.node(k + 1, *at, "-mass", mass, mass, mass, 0.0, 0.0, 0.0)
        ops.geomTransf("Corotational", 1, 0.0, 0.0, 1.0)  # rods: local z is the grid's normal
        ops.geomTransf("Corotational", 2, 1.0, 0.0, 0.0)  # pins, along the normal
        for rod in structure["rods"]:
            for a, b in pairwise(rod["nodes"]):
                self._beam(a + 1, b + 1, section["EA"], section["GJ"], *self.bends)
        self.edge = float(np.median([np.linalg.norm(flat[i] - flat[i - 1]) for i, _ in self.elements]))
        held, self.tops = set(), {}
        for joint in structure["joints"]:
            held |= self._join(*(node + 1 for node in joint["nodes"]), joint["kind"])
        self.ends = {}  # the tag of each node that is moved, and its path
        for support in structure["supports"]:
            self._support(support)
        for rod in structure["rods"]:
            self._hold_spin(rod["nodes"], held)
        self.series = set()

    def _beam(self, a, b, EA, GJ, out, within, transform=1):
        self.elements.append((a, b))
        ops.element("elasticBeamColumn", len(self.elements), a, b, EA, 1.0, 1.0, GJ, out, within, transform)

    def _node(self, at):
        self.count += 1
        ops.node(self.count, *np.asarray(at).tolist())
        return self.count

    def _join(self, a, b, kind):
        """Tie two rods where they cross; the nodes (tags) whose rods the joint keeps from spinning."""
        apart = abs(ops.nodeCoord(b, 3) - ops.nodeCoord(a, 3))
        if kind == "rigid" and not apart:
            ops.equalDOF(a, b, 1, 2, 3, 4, 5, 6)
            return {a, b}
        if kind == "ball":
            ops.equalDOF(a, b, 1, 2, 3)
            return set()
        bend, axial = FIRM * max(self.bends), FIRM * self.given["section"]["EA"]
        free = LIMP * min(self.bends) if kind == "pin" else bend
        if apart:
            scale = apart / self.edge
            self._beam(a, b, axial * scale, free * scale, bend * scale, bend * scale, 2)
            return {a, b}
        path = self.stages[:, a - 1] + PIN * self.edge * self._normals(a - 1, b - 1)
        top = self._node(path[0])
        self.tops[top] = path
        self._beam(a, top, PIN * axial, PIN * free, PIN * bend, PIN * bend, 2)
        self._beam(b, top, PIN * axial, PIN * bend, PIN * bend, PIN * bend, 2)
        ops.equalDOF(a, b, 1, 2, 3)
        return {a, b}

    def _normals(self, a, b):
        """(s, 3) at each stage, of the two rods that cross at nodes."""
        along = []
        for node in (a, b):
            rod = next(rod["nodes"] for rod in self.given["rods"] if node in rod["nodes"])
            k = rod.index(node)
            before, after = rod[max(k - 1, 0)], rod[min(k + 1, len(rod) - 1)]
            along.append(self.stages[:, after] - self.stages[:, before])
        normals = np.cross(*along)
        normals *= np.sign(normals[0, 2]) / np.linalg.norm(normals, axis=1)[:, None]
        return normals

    def _support(self, support):
        """Held in place; a clamp holds its direction by a firm member along it, in which the rod may spin."""
        k = support["node"]
        self.ends[k + 1] = self.stages[:, k]
        if "tangent" not in support:
            return
        rod = next(rod["nodes"] for rod in self.given["rods"] if k in (rod["nodes"][0], rod["nodes"][-1]))
        before = self.stages[0, k] - self.stages[0, rod[1] if k == rod[0] else rod[-2]]
        before, after = before / np.linalg.norm(before), np.array(support["tangent"])
        share = np.linspace(0.0, 1.0, len(self.stages))[:, None]
        along = (1 - share) * before + share * after
        path = self.stages[:, k] + self.edge * along / np.linalg.norm(along, axis=1)[:, None]
        ghost = self._node(path[0])
        bend = FIRM * max(self.bends)
        self._beam(k + 1, ghost, FIRM * self.given["section"]["EA"], bend, bend, bend)
        self.ends[ghost] = path

    def _hold_spin(self, nodes, held):
        """Keep a round rod that nothing else holds from spinning about itself: at its middle, about the axis of the
        plane nearest to it, where that takes no moment."""
        tags = [node + 1 for node in nodes]
        if self.bends[0] != self.bends[1] or not held.isdisjoint(tags):
            return
        middle = tags[len(tags) // 2]
        along = np.abs(np.subtract(ops.nodeCoord(middle), ops.nodeCoord(tags[0])))
        ops.fix(middle, 0, 0, 0, int(along[0] >= along[1]), int(along[0] < along[1]), 0)

    # Solving

    def _solver(self):
        ops.wipeAnalysis()
        ops.constraints("Transformation")
        ops.numberer("RCM")
        ops.system("UmfPack")
        ops.test("NormDispIncr", CLOSE * self.size, 40)
        ops.algorithm("Newton")
        ops.integrator("LoadControl", 1.0)
        ops.analysis("Static", "-noWarnings")

    def _pattern(self, tag, series="Constant"):
        if tag in self.series:
            ops.remove("loadPattern", tag)
        else:
            ops.timeSeries(series, tag)
        self.series.add(tag)
        ops.pattern("Plain", tag, tag)

    def _move(self, tag, nodes, positions):
        """Prescribe where nodes (tags) are [m]."""
        self._pattern(tag)
        for node, place in zip(nodes, positions, strict=True):
            for axis in range(3):
                ops.sp(node, axis + 1, float(place[axis] - ops.nodeCoord(node, axis + 1)))

    def deploy(self):
        """From flat through the stages, all nodes guided; then all but the supports are let go."""
        inner = [k for k in range(1, len(self.stages[0]) + 1) if k not in self.ends]
        slaves = {joint["nodes"][1] + 1 for joint in self.given["joints"] if not self._apart(joint)}
        inner = [k for k in inner if k not in slaves]
        self._solver()
        at, step = 0.0, 0.25
        last = len(self.stages) - 1
        while at < last:
            to = min(at + step, last)
            k = min(int(to), last - 1)
            share = to - k
            ends = [(1 - share) * path[k] + share * path[k + 1] for path in self.ends.values()]
            guided = (1 - share) * self.stages[k] + share * self.stages[k + 1]
            self._move(ENDS, self.ends, ends)
            tops = [(1 - share) * path[k] + share * path[k + 1] for path in self.tops.values()]
            self._move(GUIDE, [*inner, *self.tops], [*(guided[node - 1] for node in inner), *tops])
            if ops.analyze(1) == 0:
                at, step = to, min(2 * step, 1.0)
            else:
                step *= 0.5
                if step < 2.0**-STEPS:
                    raise SystemExit(f"the deployment does not converge at stage {at:g} of {last}")
        ops.remove("loadPattern", GUIDE)
        self._settle("its nodes are let go")

    def _settle(self, when):
        self._solver()
        if ops.analyze(1) != 0:
            raise SystemExit(f"the shell finds no equilibrium when {when}")

    def brace(self):
        """Put the cables in, which carry tension alone.

        They are shortened against the shell as it stands here by as much as against the shape in the file. OpenSees
        counts their strain from their length in the flat grid: it is shifted to the length at which they are free of
        stress, and stiffness scaled to it.
        """
        here, there = self.positions(), self.stages[-1]
        for k, cable in enumerate(self.given["cables"]):
            a, b = cable["nodes"]
            flat, stands, given = (float(np.linalg.norm(at[a] - at[b])) for at in (self.stages[0], here, there))
            free = cable["length"] * stands / given
            elastic, tag = 2 * k + 1, 2 * k + 2
            ops.uniaxialMaterial("Elastic", elastic, cable["EA"] * flat / free, 0.0, 0.0)
            ops.uniaxialMaterial("InitStrainMaterial", tag, elastic, 1.0 - free / flat)
            ops.element("corotTruss", CABLES + k, a + 1, b + 1, 1.0, tag)
        self._settle("its cables are stressed")

    def cable_forces(self):
        """Of each cable [N]."""
        return np.array([ops.basicForce(CABLES + k)[0] for k in range(len(self.given["cables"]))])

    def _apart(self, joint):
        a, b = (self.stages[0][node] for node in joint["nodes"])
        return bool(np.any(a != b))

    def positions(self):
        """(n, 3) of the file's nodes [m]."""
        return np.array([np.add(ops.nodeCoord(k + 1), ops.nodeDisp(k + 1)[:3]) for k in range(len(self.stages[0]))])

    def forces(self):
        """(e, 8) of each edge of the rods: its two nodes, axial force [N], bending moments within the grid at both, out
        of the grid at both, and the twisting moment [N m]."""
        edges = len(self.given["mass"]) - len(self.given["rods"])
        return np.array([[a - 1, b - 1, *ops.basicForce(tag + 1)] for tag, (a, b) in enumerate(self.elements[:edges])])

    def frequencies(self, count=3):
        """The lowest [Hz]; those of an unstable shape are negative."""
        found = np.array(ops.eigen("-genBandArpack", count))
        return np.sign(found) * np.sqrt(np.abs(found)) / (2 * np.pi)

    # Loads

    def own_weight(self):
        """Rows of node and force [N], as those of the file's combinations."""
        return [[k, 0.0, 0.0, -9.81 * mass] for k, mass in enumerate(self.given["mass"])]

    def limit(self, forces):
        """The factor of some forces up to which the deployed shell is stable; the shell is unloaded again.

        The lowest eigenvalue falls with the factor: each step goes part of the way to where it would be 0, so that the
        shell stays on its path and the limit is approached from below.
        """
        self._solver()
        self._pattern(LOADS, "Linear")
        for node, *force in forces:
            ops.load(node + 1, *force, 0.0, 0.0, 0.0)
        ops.setTime(0.0)
        at, value, step, bad, zero = 0.0, self._lowest(), FIRST, MOST, MOST
        while at < MOST and min(bad, zero) - at > NEAR * max(at, FIRST):
            step = min(step, 0.5 * (bad - at))
            if self._load(step):
                found = self._lowest()
                if found > 0:
                    zero = at + step * value / (value - found) if found < value else MOST
                    at, value = at + step, found
                    step = min(max(0.4 * (zero - at), NEAR * at), 4.0 * step)
                    continue
                self._load(-step)
            bad, step = at + step, 0.5 * step
        self._load(-at)
        ops.remove("loadPattern", LOADS)
        return min(zero, bad)

    def _load(self, step):
        ops.integrator("LoadControl", step)
        return ops.analyze(1) == 0

    def _lowest(self):
        return min(ops.eigen("-genBandArpack", NEAREST))


def main():
    """Replay the file that is named."""
    with open(sys.argv[1] if sys.argv[1:] else "popped_pinned.json", encoding="utf-8") as file:
        shell = Replay(json.load(file))
    shell.deploy()
    off = np.linalg.norm(shell.positions() - shell.stages[-1], axis=1).max()
    print(f"off the shape in the file: {1e3 * off:.3g} mm, {off / shell.size:.3%} of its size")
    forces = shell.forces()
    print(f"axial force {forces[:, 2].min():.4g} to {forces[:, 2].max():.4g} N")
    print(f"bending moment up to {np.abs(forces[:, 3:7]).max():.4g} N m")
    if shell.given["cables"]:
        shell.brace()
        print(f"cables pull up to {shell.cable_forces().max():.4g} N")
    print("frequencies:", ", ".join(f"{value:.4g}" for value in shell.frequencies()), "Hz")
    for name, acting in {"own weight": shell.own_weight(), **shell.given["loads"]}.items():
        print(f"{name}: stable up to {shell.limit(acting):.4g} times")


if __name__ == "__main__":
    main()

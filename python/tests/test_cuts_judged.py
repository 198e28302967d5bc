"""Random sets of strokes in flat bodies, at rest and hanging: what comes apart is what plane geometry says, and nothing else.

KERF_FUZZ_SECONDS=n in the environment: so long for each way and body, KERF_FUZZ_SEED=s from another seed. What goes wrong is then printed as a call
of rerun(), not failed on.
"""

import functools
import os
import time
from collections import Counter
from dataclasses import dataclass, field

import numpy as np
import pytest

import kerf

shapely = pytest.importorskip("shapely", minversion="2.1")

from plane_judge import CUT_MARGIN, Expectation, Sections, borders, extruded, pieces_of, shortened, volumes  # noqa: E402

SETS = {"rest": 10, "hang": 2, "swing": 2}  # of each body, with the fixed seeds
POSES = [1, 2, 3, 8, 40, 200]
MOST_POSES = 600  # of a set
HANGING_REACH = 5  # of a blade to both sides of z = 0, sizes of the body: what has come off falls out of it
TOLERATED = ("crumb", "unsure")
CRUMB = CUT_MARGIN**2  # square mean edges: a repeated stroke may leave less at a lip (docs/cutting.md, Limits)


# --- Bodies ---


def polygon(corners, radius, inner=None, first=0.0):
    """Of so many corners; with an inner radius every other one is nearer. Metres."""
    angles = first + 2 * np.pi * np.arange(corners) / corners
    radii = np.where(np.arange(corners) % 2, inner or radius, radius)
    return shapely.Polygon(np.stack([radii * np.cos(angles), radii * np.sin(angles)], 1))


PLATES = {  # outline, thickness, spacing of the mesh, Young's modulus under which it hangs without folding
    "rectangle": (shapely.box(-0.06, -0.04, 0.06, 0.04), 0.006, 0.006, 1e6),
    "disc": (polygon(48, 0.05), 0.004, 0.006, 2e6),
    "star": (polygon(10, 0.06, 0.03, 0.1), 0.005, 0.004, 2e6),
    "washer": (polygon(48, 0.05) - polygon(24, 0.02), 0.004, 0.005, 2e6),
    "frame": (shapely.box(-0.05, -0.05, 0.05, 0.05) - shapely.box(-0.021, -0.0113, 0.0307, 0.0291), 0.004, 0.005, 2e6),
}
MODELS = {"sheet": (None, 5e6, 6656), "closed-sheet": (0.1, 5e6, 2500)}  # thickness, Young's modulus, visual triangles
BODIES = [*MODELS, *PLATES]


class Flat:
    """A flat body in a session that can be made whole, and what the judge has to know of it."""

    def __init__(self, name, hangs):
        if name in MODELS:
            self.thickness, young, count = MODELS[name]
            body = {"model": name, "options": {"visual_triangles": count}}
        else:
            outline, self.thickness, spacing, young = PLATES[name]
            body = {"bound": bound(name)}
        scene = {"body": body, "cut": {"dust": 0}, "simulation": {"time_step": 0.004}}
        if hangs:
            scene["material"] = {"young": young, "damping_mass": 0.5}
            rim = PLATES[name][0].bounds[3] if name in PLATES else 0.5
            scene["fix"] = [{"half_space": {"point": [0, 0.7 * rim, 0], "normal": [0, 1, 0]}}]
        else:
            scene["simulation"]["gravity"] = [0, 0, 0]
        self.session = session = kerf.Session(scene)
        self.whole = session.snapshot()
        self.vertices, self.triangles = session.collision_rest_positions[:, :2], session.collision_triangles
        corners = self.vertices[self.triangles]
        self.outline = shapely.unary_union(shapely.polygons(corners), grid_size=1e-12)
        self.size = float(np.ptp(self.vertices, axis=0).max())
        self.edge = float(np.linalg.norm(corners - np.roll(corners, 1, 1), axis=2).mean())
        self.margin = CUT_MARGIN * self.edge
        self.area = self.top()[3].sum()

    def middle(self):
        """Points at rest, triangles, pieces of these, area of each piece: of the collision mesh."""
        points, triangles = self.session.collision_rest_positions, self.session.collision_triangles
        piece, count = pieces_of(triangles)
        return points, triangles, piece, np.bincount(piece, plane_areas(points, triangles), count)

    def top(self):
        """The same of the upper side that is drawn, and the volumes of closed pieces."""
        points, triangles = self.session.rest_positions, self.session.triangles
        piece, count = pieces_of(triangles)
        volume = None if self.thickness is None else volumes(points, triangles, piece, count)
        a, b = (points[triangles[:, k]] - points[triangles[:, 0]] for k in (1, 2))
        normal = np.cross(a, b)
        up = (normal[:, 2] > 0.5 * np.linalg.norm(normal, axis=1)) & ~self.session.walls
        return points, triangles[up], piece[up], np.bincount(piece[up], plane_areas(points, triangles[up]), count), volume

    def lines(self):
        """Rim and lips as they are, at rest."""
        return list(shapely.linestrings(self.session.collision_rest_positions[borders(self.session.collision_triangles)][:, :, :2]))


def plane_areas(points, triangles):
    a, b = (points[triangles[:, k]] - points[triangles[:, 0]] for k in (1, 2))
    return np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / 2


@functools.cache
def bound(name):
    outline, thickness, spacing, _ = PLATES[name]
    return kerf.bind(*extruded(outline, thickness, spacing))


@functools.cache
def flat(name, hangs=False):
    return Flat(name, hangs)


# --- Sets of strokes ---


class Strokes:
    """What hands draw, and what is hard: polylines in the body's plane, metres."""

    def __init__(self, body, random):
        self.body, self.random, self.size, self.edge = body, random, body.size, body.edge

    def make(self, kind):
        return [[tuple(map(float, p)) for p in stroke] for stroke in getattr(self, kind)()]

    def anywhere(self, share=0.65):
        return self.random.uniform(-share, share, 2) * self.size

    def heading(self, angle):
        return np.array([np.cos(angle), np.sin(angle)])

    def angle(self):
        return self.random.uniform(0, 2 * np.pi)

    def little(self):
        """A billionth to a tenth of an edge either way, or nothing; both coordinates."""
        return self.random.choice([-1, 0, 1, 1], 2) * self.edge * 10 ** self.random.uniform(-9, -1, 2)

    def vertex(self):
        return self.random.choice(self.body.vertices)

    def count(self, most, least=1):
        return int(self.random.integers(least, most + 1))

    def lines(self):
        return [[self.anywhere(), self.anywhere()] for _ in range(self.count(5))]

    def turns(self):
        strokes = []
        for _ in range(self.count(2)):
            corner, first, inner = self.anywhere(0.4), self.angle(), np.radians(self.random.uniform(5, 170))
            strokes.append([corner + 1.5 * self.size * self.heading(first), corner, corner + 1.5 * self.size * self.heading(first + inner)])
        return strokes

    def stars(self):
        middle = self.vertex() if self.count(2) == 1 else self.anywhere(0.3)
        lines, first = self.count(5, 2), self.angle()
        spread = self.random.uniform(0.5, 1) * np.pi / lines
        return [[at - way, at + way] for at, way in ((middle + self.little(), 1.5 * self.size * self.heading(first + i * spread)) for i in range(lines))]

    def zigzags(self):
        strokes = []
        for _ in range(self.count(2)):
            along, step, wide = self.heading(self.angle()), self.edge * self.random.uniform(0.2, 2), self.edge * self.random.uniform(0.2, 3)
            across, start = np.array([-along[1], along[0]]), self.anywhere(0.2) - 0.8 * self.size * along
            strokes.append([start + i * step * along + (i % 2) * wide * across for i in range(int(1.6 * self.size / step))])
        return strokes

    def spirals(self):
        middle, gap, first = self.anywhere(0.1), self.edge * self.random.uniform(0.3, 1.5), self.angle()
        radii = 0.2 * self.edge + gap * 0.3 * np.arange(120) / (2 * np.pi)
        stroke = [middle + r * self.heading(first + 0.3 * i) for i, r in enumerate(radii) if r < 0.45 * self.size]
        return [stroke[:: self.random.choice([-1, 1])]]

    def dice(self):
        x = self.heading(self.angle() if self.count(3) > 1 else 0)
        y, off, strokes = np.array([-x[1], x[0]]), self.little()[0], []
        for a, b in ((x, y), (y, x)):
            n = self.count(7)
            for i in range(1, n + 1):
                at = (self.size * (i / (n + 1) - 0.5) + off) * a
                strokes.append([at - 0.9 * self.size * b, at + 0.9 * self.size * b][:: self.random.choice([-1, 1])])
        return strokes

    def loops(self):
        middle, shrink, radius, strokes = self.anywhere(0.15), self.random.uniform(0.5, 0.85), self.random.uniform(0.1, 0.33) * self.size, []
        for _ in range(self.count(4)):
            if radius < 0.3 * self.edge:
                break
            corners, first, way = self.count(32, 3), self.angle(), self.random.choice([-1, 1])
            stroke = [middle + radius * self.heading(first + way * 2 * np.pi * k / corners) for k in range(corners)]
            strokes.append([*stroke, stroke[0]])
            radius *= shrink
        return strokes

    def combs(self):
        y = self.heading(self.angle())
        x, middle, lines, gap = np.array([y[1], -y[0]]), self.anywhere(0.15), self.count(7, 2), self.edge * 10 ** self.random.uniform(-1.5, 0.2)
        far = self.random.choice([0.9, self.random.uniform(-0.3, 0.3)])
        ends = [(middle + (i - lines / 2) * gap * x - 0.9 * self.size * y, middle + (i - lines / 2) * gap * x + far * self.size * y) for i in range(lines)]
        return [list(e)[:: self.random.choice([-1, 1]) if far == 0.9 else 1] for e in ends]

    def teeth(self):
        """A comb of one stroke: teeth that stay on, each with a back."""
        y = self.heading(self.angle())
        x, at, gap, long = np.array([y[1], -y[0]]), self.anywhere(0.3), self.edge * self.random.uniform(0.3, 1.5), self.edge * self.random.uniform(0.5, 3)
        return [[at + (i // 2) * gap * x + ((i + 1) // 2 % 2) * long * y for i in range(self.count(16, 6))]]

    def vertices(self):
        return [[self.vertex() + self.little() for _ in range(self.count(5, 2))] for _ in range(self.count(3))]

    def edges(self):
        strokes = []
        for _ in range(self.count(3)):
            at = self.count(len(self.body.vertices)) - 1
            stroke = [self.body.vertices[at]]
            for _ in range(self.count(9)):
                beside = np.unique(self.body.triangles[(self.body.triangles == at).any(1)])
                at = self.random.choice(beside[beside != at])
                stroke.append(self.body.vertices[at])
            strokes.append(np.array(stroke) + self.little())
        return strokes

    def polylines(self):
        return [[self.anywhere() for _ in range(self.count(6, 2))] for _ in range(self.count(4))]

    def back(self):
        return [[*s, *s[-2::-1]] for s in self.polylines()[:2]]

    def again(self):
        strokes = getattr(self, self.random.choice(["lines", "turns", "loops", "polylines", "dice", "zigzags"]))()
        return [s for s in strokes for _ in range(2)] if self.count(2) == 1 else strokes + [list(s) for s in strokes]

    def mixed(self):
        kinds = self.random.choice(["lines", "turns", "loops", "polylines", "stars", "combs", "spirals", "vertices"], 2, replace=False)
        return [s for kind in kinds for s in getattr(self, kind)()]


KINDS = ["lines", "turns", "stars", "zigzags", "spirals", "dice", "loops", "combs", "teeth", "vertices", "edges", "polylines", "back", "again", "mixed"]

HANGING_KINDS = ["lines", "turns", "stars", "dice", "loops", "polylines", "again"]


@dataclass
class Case:
    """way: rest, hang (strokes through the body as it hangs, between steps) or swing (steps between the poses of a stroke). poses: of a segment.

    steps: before each stroke; in a swing between poses.
    """

    way: str
    body: str
    seed: int
    kind: str
    poses: int
    strokes: list
    steps: list = field(default_factory=list)


def case_of(way, name, seed):
    random = np.random.default_rng([seed, BODIES.index(name), list(SETS).index(way)])
    body = flat(name, way != "rest")
    strokes = Strokes(body, random)
    kind = KINDS[(seed + 4 * BODIES.index(name)) % len(KINDS)] if way == "rest" else str(random.choice(HANGING_KINDS))
    if way == "swing":
        middle, along = strokes.anywhere(0.25), 1.5 * body.size * strokes.heading(random.uniform(0, 2 * np.pi))
        ends = [tuple(map(float, middle + way * along)) for way in (-1, 1)]
        return Case("swing", name, seed, "across", int(random.choice([10, 30, 100])), [ends], [int(random.integers(1, 80)), 1])
    made = strokes.make(kind)
    steps = [] if way == "rest" else [int(n) for n in random.integers(0, 60, len(made))]
    segments = sum(len(stroke) - 1 for stroke in made)
    return Case(way, name, seed, kind, int(random.choice([n for n in POSES if n == 1 or n * segments <= MOST_POSES])), made, steps)


# --- Trials ---


def edges_of(stroke, poses, reach):
    """Base and tip of an upright blade along a polyline: (n, 2, 3)."""
    stroke = np.asarray(stroke, float)
    share = np.arange(1, poses + 1)[:, None] / poses
    path = np.concatenate([stroke[:1], *(a + share * (b - a) for a, b in zip(stroke, stroke[1:]))])
    both = np.repeat(np.hstack([path, np.zeros((len(path), 1))])[:, None], 2, axis=1)
    both[:, 0, 2], both[:, 1, 2] = reach, -reach
    return both


def cores_cut(body, lines, before):
    """Length of a stroke in what is far from the rim and from all that was cut, metres."""
    free = body.outline.buffer(-body.margin)
    if before:
        free = free.difference(shapely.union_all(before).buffer(body.margin))
    return sum(line.intersection(free).length for line in lines)


def whole_checks(body):
    """What holds after any cut."""
    session, wrong = body.session, []
    try:
        session.validate()
    except kerf.Error as error:
        wrong.append(f"validate: {error}")
    counts, masses = session.counts["pieces"], session.piece_masses
    _, _, piece, areas = body.middle()
    if counts != len(areas) or counts != len(masses):
        wrong.append(f"count: {counts} pieces, {len(areas)} by the collision mesh, {len(masses)} masses")
    if abs(masses.sum() - session.uncut_mass) > 1e-9 * session.uncut_mass or masses.min() <= 0:
        wrong.append(f"mass: {masses.sum()!r} of {session.uncut_mass!r}, the least {masses.min()!r}")
    volume = body.top()[4]
    if volume is not None:
        if len(volume) != counts:
            wrong.append(f"count: {counts} pieces, {len(volume)} drawn")
        if abs(volume.sum() - body.thickness * body.area) > 1e-6 * body.thickness * body.area or volume.min() < 0:
            wrong.append(f"volume: {volume.sum()!r} of {body.thickness * body.area!r}, the least {volume.min()!r}")
    refused = sum(cut["refused_steps"] for cut in session.report()["cuts"] if not cut["undone"])
    return wrong + [f"refused: {refused} steps"] * (refused > 0)


def judged_middle(body, expected):
    points, triangles, piece, areas = body.middle()
    return ["middle: " + text for text in expected.judge(points, triangles, piece, [("area", areas, body.outline.area)])]


def judged_drawn(body, expected):
    points, triangles, piece, areas, volume = body.top()
    sizes = [("area", areas, body.area)] + ([("volume / thickness", volume / body.thickness, body.area)] if volume is not None else [])
    return ["drawn: " + text for text in expected.judge(points, triangles, piece, sizes)]


def at_rest(case, told=None):
    """Cuts all strokes, then judges what has come of them. told: the strokes that the judge is told of, in their place; None for none."""
    body = flat(case.body)
    session, wrong, before = body.session, [], []
    session.restore(body.whole)
    start = body.lines()
    for stroke in case.strokes:
        line = shapely.LineString(stroke)
        has_cut = session.cut(edges_of(stroke, case.poses, 0.25 * body.size))
        if not has_cut and cores_cut(body, [line], before) > 2 * body.margin:
            wrong.append("reported: nothing cut")
        if has_cut and line.distance(body.outline) > body.margin:
            wrong.append("reported: cut in the air")
        before.append(line)
    strokes = [s for s in told or case.strokes if s is not None]
    sure = [line for line in (shortened(s, body.margin) for s in strokes) if line is not None]
    expected = Expectation(body.outline, start, sure, [shapely.LineString(s) for s in strokes], body.margin)
    wrong += whole_checks(body) + judged_middle(body, expected) + judged_drawn(body, expected)
    if case.kind == "again" and not told:
        once = pieces_once(case, body)
        twice = body.middle()[3] / body.edge**2
        if (twice > CRUMB).sum() > (once > CRUMB).sum():
            wrong.append(f"again: {(twice > CRUMB).sum()} pieces instead of {(once > CRUMB).sum()}")
        elif len(twice) > len(once):
            wrong.append(f"crumb: {len(twice) - len(once)} more pieces, of {np.sort(twice)[:len(twice) - len(once)]} square edges at most")
    return wrong


def pieces_once(case, body):
    """Areas of the pieces when no stroke is drawn twice, square metres over square mean edges."""
    after = body.session.snapshot()
    body.session.restore(body.whole)
    drawn = []
    for stroke in case.strokes:
        if stroke not in drawn:
            drawn.append(stroke)
            body.session.cut(edges_of(stroke, case.poses, 0.25 * body.size))
    areas = body.middle()[3] / body.edge**2
    body.session.restore(after)
    return areas


def hanging(case, told=None):
    """Strokes through the body as it is at that moment: judged at rest, one by one, from the cuts that were there."""
    body = flat(case.body, True)
    session, wrong, reach = body.session, [], HANGING_REACH * body.size
    session.restore(body.whole)
    for k, (stroke, steps) in enumerate(zip(case.strokes, case.steps)):
        session.step(steps)
        lines = body.lines()
        sections = Sections(session.collision_positions, session.collision_rest_positions, session.collision_triangles, reach)
        known = told[k] if told else stroke
        sure = known and shortened(known, 2 * body.margin)
        whole, sure = sections.of(known) if known else [], sections.of(shapely.get_coordinates(sure)) if sure else []
        has_cut = session.cut(edges_of(stroke, case.poses, reach), frame="world", through=True)
        if sections.steepest > 0.8 or sections.straddles:
            return [f"unsure: from stroke {k} on the blade lies along the sheet, or ends in it"]
        if not has_cut and cores_cut(body, whole, lines) > 2 * body.margin:
            wrong.append(f"stroke {k}: reported: nothing cut")
        expected = Expectation(body.outline, lines, sure, whole, body.margin)
        wrong += [f"stroke {k}: {text}" for text in judged_middle(body, expected)]
        if wrong:
            return wrong
        # The lips that were there are those of the collision mesh, and what is drawn may stray from both.
        if k == len(case.strokes) - 1:
            wrong = [f"stroke {k}: {text}" for text in judged_drawn(body, Expectation(body.outline, lines, sure, whole, 2 * body.margin))]
    return wrong + whole_checks(body)


def swinging(case, told=None):
    """A blade goes straight across a body that swings. What was on one side of it all the time is in no piece with what was on the other."""
    body = flat(case.body, True)
    session = body.session
    session.restore(body.whole)
    (stroke,), (steps, between) = case.strokes, case.steps
    session.step(steps)
    known = told[0] if told else stroke
    along = np.subtract(known[1], known[0]) / np.linalg.norm(np.subtract(known[1], known[0]))
    n = 48
    x, y = (np.linspace(a, b, n) for a, b in zip(body.vertices.min(0), body.vertices.max(0)))
    grid = np.stack(np.meshgrid(x, y, [0.0], indexing="ij"), -1).reshape(-1, 3)
    inside = shapely.contains_xy(body.outline.buffer(-0.05 * body.edge), grid[:, :2])
    least, most = np.full(len(grid), np.inf), np.full(len(grid), -np.inf)

    def look():
        now = session.to_world(grid[inside])[:, :2] - known[0]
        side = along[0] * now[:, 1] - along[1] * now[:, 0]
        least[inside], most[inside] = np.minimum(least[inside], side), np.maximum(most[inside], side)

    with session.stroke(frame="world", through=True) as blade:
        for base, tip in edges_of(stroke, case.poses, HANGING_REACH * body.size):
            look()
            blade.move(base, tip)
            look()
            session.step(between)
    look()
    clear = 0.3 * body.edge
    side = np.where(least > clear, 1, np.where(most < -clear, -1, 0)) * inside
    points, triangles, piece, _ = body.middle()
    tree = shapely.STRtree(shapely.polygons(points[triangles][:, :, :2]))
    which = np.full(len(grid), -1)
    found = tree.query(shapely.points(grid[:, :2]), predicate="within")
    which[found[0]] = piece[found[1]]
    wrong = []
    if both := set(which[side > 0]) & set(which[side < 0]) - {-1}:
        wrong.append(f"bridge: {len(both)} pieces on both sides")
    square_side, square_piece = side.reshape(n, n), which.reshape(n, n)
    for a, b in ((np.s_[1:], np.s_[:-1]), (np.s_[:, 1:], np.s_[:, :-1])):
        apart = (square_side[a] != 0) & (square_side[a] == square_side[b]) & (square_piece[a] != square_piece[b])
        if (apart & (square_piece[a] >= 0) & (square_piece[b] >= 0)).any():
            wrong.append("severed: neighbours on one side of the blade")
            break
    return wrong + whole_checks(body)


def trial(case, told=None):
    try:
        return {"rest": at_rest, "hang": hanging, "swing": swinging}[case.way](case, told)
    except kerf.Error as error:
        return [f"error: {error}"]


def rerun(*arguments, **words):
    """Prints what is wrong with a case: python -c 'from test_cuts_judged import *; rerun(...)' in this folder."""
    print(*trial(Case(*arguments, **words)), sep="\n")


def sort_of(text):
    """bridge, severed, nothing, area, volume / thickness, count, mass, volume, validate, refused, reported, again, crumb, unsure or error."""
    return next(word.split(" at ")[0] for word in text.split(": ") if word not in ("middle", "drawn") and not word.startswith("stroke "))


def print_case(case, wrong):
    print(f"\nrerun({', '.join(repr(getattr(case, name)) for name in Case.__dataclass_fields__)})  # {'; '.join(wrong)}", flush=True)


# --- Tests ---


@pytest.mark.parametrize("name", BODIES)
@pytest.mark.parametrize("way", SETS)
def test_strokes_part_what_they_go_around(way, name):
    seconds, first = os.environ.get("KERF_FUZZ_SECONDS"), int(os.environ.get("KERF_FUZZ_SEED", 1))
    ends, seed, faults, sets = time.monotonic() + float(seconds or 0), first, Counter(), 0
    while time.monotonic() < ends if seconds else seed < first + SETS[way]:
        case = case_of(way, name, seed)
        wrong = trial(case)
        sets += 1
        faults.update({sort_of(text) for text in wrong})
        if seconds and any(sort_of(text) != "unsure" for text in wrong):
            print_case(case, wrong)
        if not seconds:
            assert not [text for text in wrong if sort_of(text) not in TOLERATED], (case, wrong)
        seed += 1
    print(f"\n{way} {name}: {sets} sets, {dict(faults)}")


# Body, poses, strokes, pieces that come out of a right cut.
SMALL = {
    "a turn, drawn twice": ("sheet", 1, [[(-0.388, 0.695), (-0.344, 0.403), (-0.071, 0.288)]] * 2, 1),
    "a closed stroke, drawn twice": (
        "rectangle", 1, [[(-0.001, -0.001), (0.003, 0.004), (0.01, 0.005), (0.013, 0.005), (-0.001, -0.001)]] * 2, 2),
    "a closed stroke that begins beside the rim and comes back over it": (
        "sheet", 3, [[(0.0321, -0.4845), (-0.117, -0.241), (0.282, -0.1), (0.144, -0.599), (0.0321, -0.4845)]], 2),
}


@pytest.mark.parametrize("what", SMALL)
def test_small_strokes(what):
    name, poses, strokes, pieces = SMALL[what]
    body = flat(name)
    body.session.restore(body.whole)
    for stroke in strokes:
        body.session.cut(edges_of(stroke, poses, 0.25 * body.size))
    assert body.session.counts["pieces"] == pieces


def test_a_turn_is_cut_where_it_is():
    """The corner lies on a lip, to within the path tolerance and the minimum feature. A lip farther off lets a second stroke cut a crumb."""
    body, stroke = flat("sheet"), [(-0.388, 0.695), (-0.344, 0.403), (-0.071, 0.288)]
    body.session.restore(body.whole)
    body.session.cut(edges_of(stroke, 1, 0.25))
    assert shapely.Point(stroke[1]).distance(shapely.union_all(body.lines())) < (0.024 + 0.024) * body.edge


@pytest.mark.parametrize("name", ["closed-sheet", "washer"])
@pytest.mark.parametrize("way", SETS)
def test_the_judge_sees_what_is_wrong(way, name):
    """Told of another stroke than was cut, it finds the body severed where that was, and bridges where it was not."""
    size = flat(name, way != "rest").size
    across, along, beside = ([(-size, at), (size, at)] for at in (0.2 * size, -0.3 * size, 0.1 * size))
    case = Case(way, name, 0, "lines", 3, [across], [5, 1] if way == "swing" else [5])
    assert trial(case) == []
    for other in (along, beside):
        found = " ".join(trial(case, [other]))
        assert "severed" in found or "bridge" in found
        assert way == "swing" or "severed" in found and "bridge" in found
    if way != "swing":
        assert "severed" in " ".join(trial(case, [None]))


def test_the_judge_weighs():
    """A strip of two squares with a line between them: areas count to within the margin, and pieces are counted by faces."""
    points = np.array([[x, y, 0.0] for x in (0, 1, 2) for y in (0, 1)])
    triangles = np.array([[0, 2, 1], [2, 3, 1], [2, 4, 3], [4, 5, 3]])
    body, line = shapely.box(0, 0, 2, 1), shapely.LineString([(1, -1), (1, 2)])
    expected = Expectation(body, [body.exterior], [line], [line], 0.05)
    apart, as_one = np.array([0, 0, 1, 1]), np.zeros(4, int)
    assert len(expected.faces) == len(expected.cores) == 2
    assert expected.judge(points, triangles, apart, [("area", np.array([1.1, 0.9]), 2)]) == []
    assert [text.split(":")[0] for text in expected.judge(points, triangles, apart, [("area", np.array([1.5, 0.5]), 2)])] == ["area", "area"]
    assert [text.split(":")[0] for text in expected.judge(points, triangles, as_one)] == ["bridge"]
    assert [text.split(" ")[0] for text in expected.judge(points, triangles, np.array([0, 1, 2, 2]))] == ["severed"]
    assert [text.split(" ")[0] for text in expected.judge(points, triangles[:2], apart[:2])] == ["nothing"]
    assert [text.split(" ")[0] for text in Expectation(body, [body.exterior], [], [], 0.05).judge(points, triangles, apart)] == ["severed"]


def test_pieces_and_volumes_of_meshes():
    vertices, triangles = extruded(*PLATES["washer"][:3])
    piece, count = pieces_of(np.concatenate([triangles, triangles[::-1] + len(vertices)]))
    assert count == 2 and (piece[: len(triangles)] == 0).all() and (piece[len(triangles):] == 1).all()
    outline, thickness = PLATES["washer"][:2]
    assert volumes(vertices, triangles, piece[: len(triangles)], 1) == pytest.approx([outline.area * thickness])

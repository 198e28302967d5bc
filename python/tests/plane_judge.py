"""What strokes must part in a flat body, by plane geometry alone: shapely knows no collision mesh, no rounding and no journal."""

import numpy as np
import shapely
from shapely import ops

CUT_MARGIN = 0.12  # mean collision edges: nearer to a stroke, cuts may snap


# --- Bodies ---


def extruded(outline, thickness, spacing, seed=1):
    """Vertices and triangles of a plane polygon between z = -thickness / 2 and +thickness / 2, closed. All in metres."""
    random = np.random.default_rng(seed)
    rings = [outline.exterior, *outline.interiors]
    rim = np.concatenate([_along(ring, spacing) for ring in rings])
    x0, y0, x1, y1 = outline.bounds
    x, y = np.meshgrid(np.arange(x0, x1, spacing), np.arange(y0, y1, 0.87 * spacing))
    x[1::2] += spacing / 2
    inside = np.stack([x.ravel(), y.ravel()], 1) + random.uniform(-0.1, 0.1, (x.size, 2)) * spacing
    inside = inside[shapely.contains_xy(outline.buffer(-0.7 * spacing), inside)]
    plane = np.concatenate([rim, inside])
    number = {tuple(p): i for i, p in enumerate(plane.tolist())}
    around = shapely.get_coordinates(outline.centroid.buffer(3 * max(x1 - x0, y1 - y0), quad_segs=2))[:-1]
    found = [t for t in shapely.delaunay_triangles(shapely.MultiPoint(np.concatenate([plane, around]))).geoms
             if t.area > 1e-3 * spacing**2 and outline.contains(t.representative_point())]
    assert np.isclose(sum(t.area for t in found), outline.area, rtol=1e-9), "the rim is too coarse for its triangles"
    top = np.array([[number[tuple(p)] for p in shapely.get_coordinates(shapely.orient_polygons(t))[:3].tolist()] for t in found])
    n = len(plane)
    sides = borders(top)
    walls = np.concatenate([np.stack([sides[:, 0] + n, sides[:, 1] + n, sides[:, 1]], 1), np.stack([sides[:, 0] + n, sides[:, 1], sides[:, 0]], 1)])
    half = np.full((n, 1), thickness / 2)
    return np.concatenate([np.hstack([plane, half]), np.hstack([plane, -half])]), np.concatenate([top, top[:, ::-1] + n, walls])


def _along(ring, spacing):
    corners = shapely.get_coordinates(ring)
    parts = [np.linspace(a, b, max(1, round(np.linalg.norm(b - a) / spacing)), endpoint=False) for a, b in zip(corners, corners[1:])]
    return np.concatenate(parts)


def borders(triangles):
    """Directed edges that one triangle has alone: (k, 2)."""
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]).astype(np.int64)
    size = edges.max() + 1
    return edges[~np.isin(edges[:, 0] * size + edges[:, 1], edges[:, 1] * size + edges[:, 0])]


def pieces_of(triangles):
    """Number of the piece of each triangle, by vertices in common, and how many there are."""
    label = np.arange(triangles.max() + 1)
    while True:
        a, b, c = label[triangles].T
        least = np.minimum(np.minimum(a, b), c)
        hooked = np.flatnonzero((a != least) | (b != least) | (c != least))
        if not len(hooked):
            break
        for root in (a, b, c):
            np.minimum.at(label, root[hooked], least[hooked])
        while (label != label[label]).any():
            label = label[label]
    names, of_triangle = np.unique(label[triangles[:, 0]], return_inverse=True)
    return of_triangle, len(names)


def volumes(points, triangles, piece, count):
    """Of the pieces of a closed surface, m3."""
    a, b, c = (points[triangles[:, k]] for k in range(3))
    return np.bincount(piece, np.einsum("ij,ij->i", a, np.cross(b, c)) / 6, count)


# --- Expectations ---


def shortened(stroke, length):
    """A stroke without so much of its open ends, or None."""
    line = shapely.LineString(stroke)
    if tuple(stroke[0]) == tuple(stroke[-1]) and len(stroke) > 2:
        return line
    return ops.substring(line, length, line.length - length) if line.length > 2 * length else None


class Expectation:
    """Faces between borders and strokes, and what of them is far from both.

    body: the polygon that was uncut. lines: its borders and lips. sure: strokes without their open ends. whole: all of the strokes.
    margin: metres. Cores are what remains of the body beyond the margin of every line. One core is in one piece. Cores of two faces are in two.
    """

    def __init__(self, body, lines, sure, whole, margin):
        self.margin, self.body = margin, body
        unit = 1e-9 * max(np.ptp(np.reshape(body.bounds, (2, 2)), axis=0))
        noded = shapely.unary_union([*lines, *sure], grid_size=unit)
        self.faces = [face for face in ops.polygonize(noded) if body.contains(face.representative_point())]
        self.strokes = shapely.unary_union(whole) if whole else shapely.LineString()
        left = body.difference(shapely.line_merge(shapely.unary_union([*lines, *whole], grid_size=unit)).buffer(margin, quad_segs=6))
        self.cores = [part for part in getattr(left, "geoms", [left]) if part.area > 1e-4 * margin**2]
        places = shapely.STRtree(self.faces)
        inside = places.query([core.representative_point() for core in self.cores], predicate="within")
        self.face_of = dict(inside.T.tolist())
        assert len(self.face_of) == len(self.cores), "a core lies in no face"

    def tolerance(self, face):
        """Of a face's area, m2: cuts may stray by the margin, and a slit that ends near a line may reach it."""
        return self.margin * (face.length + 2 * face.intersection(self.strokes).length)

    def judge(self, points, triangles, piece, sizes=()):
        """What is wrong with the pieces of a triangulation of the plane: sentences.

        sizes: (what, of each piece in m2, of the whole uncut body in m2), compared with the areas of faces.
        """
        wrong = []
        corners = points[triangles][:, [0, 1, 2, 0], :2]
        area = _areas(corners)
        solid = area > 1e-12 * self.body.area
        shapes = shapely.polygons(corners[solid])
        touched = shapely.STRtree(shapes).query(self.cores, predicate="intersects")
        of_core = [set() for _ in self.cores]
        for core, k in zip(touched[0], piece[solid][touched[1]]):
            of_core[core].add(int(k))
        faces_of = {}
        pieces_of_face = {}
        for core, found in enumerate(of_core):
            where = self.cores[core].representative_point().coords[0]
            at = f"at ({where[0]:.5g}, {where[1]:.5g})"
            if not found:
                wrong.append(f"nothing {at}")
            if len(found) > 1:
                least = min(area[piece == k].sum() for k in found)
                wrong.append(f"severed {at}: {len(found)} pieces in one core, the least of {least:.3g} m2")
            for k in found:
                faces_of.setdefault(k, {}).setdefault(self.face_of[core], at)
                pieces_of_face.setdefault(self.face_of[core], set()).add(k)
        wrong += [f"bridge: one piece {' and '.join(found.values())}" for found in faces_of.values() if len(found) > 1]
        if wrong:
            return wrong
        for face, found in pieces_of_face.items():
            shape = self.faces[face]
            for what, of_piece, whole in sizes:
                got, slack = sum(of_piece[k] for k in found), self.tolerance(shape) + abs(whole - self.body.area)
                if abs(got - shape.area) > slack:
                    wrong.append(f"{what}: {got:.6g} instead of {shape.area:.6g} m2 +- {slack:.2g}, {len(found)} pieces")
        return wrong


def _areas(corners):
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    return np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / 2


# --- Strokes through a body that is not at rest ---


class Sections:
    """Where an upright blade, from z = -reach to +reach, meets the triangles of a deformed sheet, as segments at rest. Metres."""

    def __init__(self, deformed, rest, triangles, reach):
        low, high = (bound(deformed[triangles][:, :, 2], 1) for bound in (np.min, np.max))
        within = (high > -reach) & (low < reach)
        self.straddles = bool((within & ((low < -reach) | (high > reach))).any())  # a triangle goes past an end of the blade
        triangles = triangles[within]
        self.deformed, self.rest, self.triangles = deformed, rest[:, :2], triangles
        normal = np.cross(*(deformed[triangles[:, k]] - deformed[triangles[:, 0]] for k in (1, 2)))
        self.normal = normal / np.maximum(np.linalg.norm(normal, axis=1), 1e-300)[:, None]
        self.steepest = 0.0  # |cosine| between blade strip and sheet, of all triangles met

    def of(self, stroke):
        """Segments at rest that a polyline in the world meets, each a little longer than it is."""
        stroke = np.asarray(stroke, float)
        return [line for a, b in zip(stroke, stroke[1:]) for line in self._of_segment(a, b)]

    def _of_segment(self, a, b):
        length = np.linalg.norm(b - a)
        along = (b - a) / length
        across = np.array([-along[1], along[0]])
        relative = self.deformed[:, :2] - a
        height, way = relative @ across, relative @ along
        corners = height[self.triangles]
        met = np.flatnonzero((corners.min(1) < 0) & (corners.max(1) >= 0))
        lines = []
        for t in met:
            ends = []
            for i, j in ((0, 1), (1, 2), (2, 0)):
                v, w = self.triangles[t, i], self.triangles[t, j]
                if (height[v] < 0) != (height[w] < 0):
                    s = height[v] / (height[v] - height[w])
                    ends.append((way[v] + s * (way[w] - way[v]), self.rest[v] + s * (self.rest[w] - self.rest[v])))
            (s0, p0), (s1, p1) = sorted(ends, key=lambda end: end[0])
            if s1 < 0 or s0 > length or s1 == s0:
                continue
            self.steepest = max(self.steepest, abs(self.normal[t, :2] @ across))
            from_, to = (max(0.0, -s0 / (s1 - s0)), min(1.0, (length - s0) / (s1 - s0)))
            lines.append(shapely.LineString([p0 + (from_ - 1e-6) * (p1 - p0), p0 + (to + 1e-6) * (p1 - p0)]))
        return lines

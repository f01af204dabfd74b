"""A hand as others make them: coarse, uneven, made by collapsing edges of a fine one."""

import heapq

import numpy


def read_obj(path):
    lines = [line.split() for line in path.read_text().splitlines()]
    return (numpy.array([line[1:4] for line in lines if line and line[0] == "v"], dtype=float),
            numpy.array([line[1:4] for line in lines if line and line[0] == "f"], dtype=int) - 1)


def write_obj(path, vertices, triangles):
    path.write_text("".join([*("v {} {} {}\n".format(*map(float, vertex)) for vertex in vertices),
                             *("f {} {} {}\n".format(*(triangle + 1)) for triangle in triangles)]))


def edge_lengths(vertices, triangles):
    ends = numpy.unique(numpy.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1), axis=0)
    return numpy.linalg.norm(vertices[ends[:, 1]] - vertices[ends[:, 0]], axis=1)


def normal(a, b, c):
    """Along the normal of a face, twice its area long; and that length. Plain tuples: arrays of three are slow."""
    u = [q - p for p, q in zip(a, b)]
    v = [q - p for p, q in zip(a, c)]
    n = (u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0])
    return n, (n[0] ** 2 + n[1] ** 2 + n[2] ** 2) ** 0.5


def collapsed(vertices, triangles, wanted, faces):
    """The closed mesh with edges collapsed into one of their ends, those first that are shortest against wanted(x),
    until only so many faces are left. A collapse that would fold the skin or pinch it is left out."""
    place = [tuple(map(float, vertex)) for vertex in vertices]
    sizes = wanted(vertices)
    corners = {f: list(map(int, triangle)) for f, triangle in enumerate(triangles)}
    around = [set() for _ in place]
    for f, triangle in corners.items():
        for v in triangle:
            around[v].add(f)

    def length(a, b):
        return sum((p - q) ** 2 for p, q in zip(place[a], place[b])) ** 0.5

    def neighbours(v):
        return {u for f in around[v] for u in corners[f]} - {v}

    def may_go(a, b):
        if len(neighbours(a) & neighbours(b)) != 2 or len(around[a]) + len(around[b]) > 16:
            return False
        for f in around[a] - around[b]:
            old, old_size = normal(*(place[v] for v in corners[f]))
            new, new_size = normal(*(place[b if v == a else v] for v in corners[f]))
            longest = max(length(b, v) for v in corners[f] if v != a)
            turns = sum(p * q for p, q in zip(old, new)) < 0.9 * old_size * new_size
            if turns or new_size < 0.05 * longest**2:
                return False
        return True

    queue = []

    def push(a, b):
        heapq.heappush(queue, (length(a, b) / min(sizes[a], sizes[b]), a, b))

    for triangle in corners.values():
        for c in range(3):
            push(triangle[c], triangle[(c + 1) % 3])
    while len(corners) > faces and queue:
        _, a, b = heapq.heappop(queue)
        if not around[a] or b not in neighbours(a) or not may_go(a, b):
            continue
        for f in list(around[a]):
            if b in corners[f]:
                for v in corners.pop(f):
                    around[v].discard(f)
            else:
                corners[f][corners[f].index(a)] = b
                around[a].discard(f)
                around[b].add(f)
        for v in neighbours(b):
            push(v, b)
            push(b, v)
    used, left = numpy.unique(numpy.array(list(corners.values())), return_inverse=True)
    return vertices[used], left.reshape(-1, 3)


def foreign_hand(vertices, triangles, fingertip, faces=2300):
    """Of a fine hand [mm]: edges of about 1 mm at a fingertip and centimetres on the palm, so many faces."""
    def wanted(x):
        return numpy.clip(0.05 * numpy.linalg.norm(x - fingertip, axis=1) ** 1.3, 0.7, 30)
    return collapsed(vertices, triangles, wanted, faces)

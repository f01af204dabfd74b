"""Closed meshes that tests write to files: vertices [V, 3], triangles [M, 3] counter-clockwise seen from outside."""

import itertools

import numpy


def volume(vertices, triangles):
    return numpy.linalg.det(vertices[triangles]).sum() / 6


def split(vertices, triangles):
    """Every face in four by the middles of its edges: face f's corners become 4f to 4f + 2, its middle 4f + 3."""
    corner = [triangles[:, c] for c in range(3)]
    edges = numpy.sort(numpy.stack([numpy.stack([corner[c], corner[(c + 1) % 3]], axis=1) for c in range(3)]), axis=2)
    ends, number = numpy.unique(edges.reshape(-1, 2), axis=0, return_inverse=True)
    middle = len(vertices) + number.reshape(3, -1)
    children = [[corner[0], middle[0], middle[2]], [middle[0], corner[1], middle[1]],
                [middle[2], middle[1], corner[2]], [middle[0], middle[1], middle[2]]]
    return (numpy.concatenate([vertices, vertices[ends].mean(axis=1)]),
            numpy.stack([numpy.stack(child, axis=1) for child in children], axis=1).reshape(-1, 3))


def icosphere(times, radius):
    """An icosahedron split so many times (20 x 4^times faces), of the volume of the sphere."""
    golden = (1 + 5**0.5) / 2
    corners = [numpy.roll([0, a, b * golden], turn) for a in (-1, 1) for b in (-1, 1) for turn in range(3)]
    vertices = numpy.array(corners, dtype=float)
    triangles = numpy.array([
        three if numpy.linalg.det(vertices[list(three)]) > 0 else three[::-1]
        for three in itertools.combinations(range(12), 3)
        if all(numpy.linalg.norm(vertices[i] - vertices[j]) < 2.1 for i, j in itertools.combinations(three, 2))])
    for _ in range(times):
        vertices, triangles = split(vertices, triangles)
        vertices /= numpy.linalg.norm(vertices, axis=1)[:, None]
    vertices /= numpy.linalg.norm(vertices, axis=1)[:, None]
    return vertices * radius * (4 / 3 * numpy.pi / volume(vertices, triangles)) ** (1 / 3), triangles


def together(*meshes):
    """Several meshes as one, each (vertices, triangles)."""
    first = numpy.cumsum([0] + [len(vertices) for vertices, _ in meshes])
    return (numpy.concatenate([vertices for vertices, _ in meshes]),
            numpy.concatenate([triangles + start for (_, triangles), start in zip(meshes, first)]))


def write_ply(path, vertices, triangles):
    path.write_text("\n".join([
        "ply", "format ascii 1.0", f"element vertex {len(vertices)}", "property double x", "property double y",
        "property double z", f"element face {len(triangles)}", "property list uchar int vertex_indices", "end_header",
        *(" ".join(map(repr, map(float, vertex))) for vertex in vertices),
        *("3 " + " ".join(map(str, triangle)) for triangle in triangles), ""]))


def write_stl(path, vertices, triangles):
    facet = numpy.dtype([("normal", "<f4", 3), ("corner", "<f4", (3, 3)), ("unused", "<u2")])
    facets = numpy.zeros(len(triangles), dtype=facet)
    facets["corner"] = vertices[triangles]
    path.write_bytes(b"sphere".ljust(80) + numpy.uint32(len(triangles)).tobytes() + facets.tobytes())

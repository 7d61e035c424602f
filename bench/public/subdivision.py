"""Subdivision surfaces as meshes (Loop, "Smooth Subdivision Surfaces Based on Triangles", 1987)."""

import numpy

from meshes import Mesh


class Topology:
    """The edges of a mesh, and which of them are boundaries."""

    def __init__(self, triangles: numpy.ndarray, count: int):
        self.triangles = triangles
        self.count = count
        # The edges of each triangle, opposite to its corners: 1 to 2, 2 to 0, 0 to 1.
        ends = triangles[:, [[1, 2], [2, 0], [0, 1]]].reshape(-1, 2)
        opposite = triangles.reshape(-1)
        self.edges, of_triangle = numpy.unique(
            numpy.sort(ends, axis=1), axis=0, return_inverse=True
        )
        of_triangle = of_triangle.reshape(-1)
        self.edge_of = of_triangle.reshape(-1, 3)
        self.is_boundary = numpy.bincount(of_triangle, minlength=len(self.edges)) == 1
        # The sum of the corners that are opposite to an edge is taken over these pairs.
        self.opposite = opposite, of_triangle
        self.valence = numpy.bincount(self.edges.ravel(), minlength=count)
        self.on_boundary = numpy.zeros(count, bool)
        self.on_boundary[self.edges[self.is_boundary].ravel()] = True

    def neighbours(self, points: numpy.ndarray, edges: numpy.ndarray) -> numpy.ndarray:
        """The sum of the points at the other ends of edges, for each point."""
        sums = numpy.zeros_like(points)
        numpy.add.at(sums, edges[:, 0], points[edges[:, 1]])
        numpy.add.at(sums, edges[:, 1], points[edges[:, 0]])
        return sums

    def smoothed(self, points: numpy.ndarray, weight: numpy.ndarray, edge_weight: float):
        """Points with a weight of each neighbour; on boundaries, of both neighbours along them."""
        inner = self.neighbours(points, self.edges)
        inner = (1 - self.valence * weight)[:, None] * points + weight[:, None] * inner
        along = self.neighbours(points, self.edges[self.is_boundary])
        border = (1 - 2 * edge_weight) * points + edge_weight * along
        return numpy.where(self.on_boundary[:, None], border, inner)

    def edge_points(self, points: numpy.ndarray) -> numpy.ndarray:
        ends = points[self.edges].sum(axis=1)
        opposite = numpy.zeros_like(ends)
        numpy.add.at(opposite, self.opposite[1], points[self.opposite[0]])
        inner = 3 / 8 * ends + 1 / 8 * opposite
        return numpy.where(self.is_boundary[:, None], 0.5 * ends, inner)

    def refined(self) -> numpy.ndarray:
        """Four triangles for each; new points follow the old ones, in the order of edges."""
        a, b, c = self.triangles.T
        across_a, across_b, across_c = (self.count + self.edge_of).T
        parts = (a, across_c, across_b), (b, across_a, across_c), (c, across_b, across_a)
        parts = *parts, (across_a, across_b, across_c)
        return numpy.concatenate([numpy.stack(part, axis=1) for part in parts])


def weights(valence: numpy.ndarray) -> numpy.ndarray:
    """The weight of each neighbour of an inner point."""
    return numpy.where(valence == 3, 3 / 16, 3 / (8 * numpy.maximum(valence, 1)))


def vertex_normals(points: numpy.ndarray, triangles: numpy.ndarray) -> numpy.ndarray:
    """The means of the normals of faces by their areas, in the place of the limit's tangents."""
    corners = points[triangles]
    faces = numpy.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals = numpy.zeros_like(points)
    for corner in range(3):
        numpy.add.at(normals, triangles[:, corner], faces)
    return normals / numpy.maximum(numpy.linalg.norm(normals, axis=1, keepdims=True), 1e-30)


def subdivided(mesh: Mesh, levels: int) -> Mesh:
    """The mesh after some steps, with its points moved to the limit."""
    points, triangles = mesh.points, mesh.triangles
    for _ in range(levels):
        topology = Topology(triangles, len(points))
        even = topology.smoothed(points, weights(topology.valence), 1 / 8)
        points = numpy.concatenate([even, topology.edge_points(points)])
        triangles = topology.refined()
    topology = Topology(triangles, len(points))
    limit = 1 / (topology.valence + 3 / (8 * weights(topology.valence)))
    points = topology.smoothed(points, limit, 1 / 5)
    return Mesh(points, triangles, vertex_normals(points, triangles))

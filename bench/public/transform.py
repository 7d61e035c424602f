"""Transforms as matrices with four rows, which multiply columns."""

import numpy

Matrix = numpy.ndarray


def translate(offset) -> Matrix:
    matrix = numpy.eye(4)
    matrix[:3, 3] = offset
    return matrix


def scale(factors) -> Matrix:
    return numpy.diag([*factors, 1.0])


def rotate(degrees: float, axis) -> Matrix:
    """The rotation about an axis by Rodrigues' formula."""
    x, y, z = numpy.asarray(axis, float) / numpy.linalg.norm(axis)
    cross = numpy.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    angle = numpy.radians(degrees)
    matrix = numpy.eye(4)
    matrix[:3, :3] += numpy.sin(angle) * cross + (1 - numpy.cos(angle)) * cross @ cross
    return matrix


def look_at(eye, target, up) -> Matrix:
    """From the world to a camera that looks along z, with x to the right."""
    forward = numpy.subtract(target, eye).astype(float)
    forward /= numpy.linalg.norm(forward)
    right = numpy.cross(numpy.divide(up, numpy.linalg.norm(up)), forward)
    right /= numpy.linalg.norm(right)
    to_world = numpy.eye(4)
    to_world[:3, 0] = right
    to_world[:3, 1] = numpy.cross(forward, right)
    to_world[:3, 2] = forward
    to_world[:3, 3] = eye
    return numpy.linalg.inv(to_world)


def from_columns(numbers) -> Matrix:
    """The matrix of 16 numbers, column after column."""
    return numpy.array(numbers, float).reshape(4, 4).T


def is_mirrored(matrix: Matrix) -> bool:
    return bool(numpy.linalg.det(matrix[:3, :3]) < 0)


def scales(matrix: Matrix) -> numpy.ndarray:
    """The lengths of the images of the three axes."""
    return numpy.linalg.norm(matrix[:3, :3], axis=0)


def is_similarity(matrix: Matrix) -> bool:
    """True if shapes keep their proportions."""
    gram = matrix[:3, :3].T @ matrix[:3, :3]
    mean = numpy.trace(gram) / 3
    return bool(numpy.allclose(gram, mean * numpy.eye(3), atol=1e-4 * mean))


def without_scale(matrix: Matrix) -> Matrix:
    result = matrix.copy()
    result[:3, :3] /= scales(matrix)
    return result


def point(matrix: Matrix, place) -> numpy.ndarray:
    return matrix[:3, :3] @ numpy.asarray(place, float) + matrix[:3, 3]


def vector(matrix: Matrix, direction) -> numpy.ndarray:
    return matrix[:3, :3] @ numpy.asarray(direction, float)

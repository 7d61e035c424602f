"""Pictures: reading for conversion, maps of the sky, and sheets that show two renders."""

import struct
from pathlib import Path

import mitsuba
import numpy

from pbrt_file import SceneError

# Rows of a sky as a latitude-longitude map.
SKY_ROWS = 512


def read(path: Path, is_linear: bool = False) -> numpy.ndarray:
    """Returns an image as linear colours, with alpha if it has one, rows from the top."""
    if not path.is_file():
        raise SceneError(f"there is no `{path}`: complete the scene's files")
    try:
        bitmap = mitsuba.Bitmap(read_tga(path)) if is_tga(path) else mitsuba.Bitmap(str(path))
    except (RuntimeError, ValueError, struct.error, IndexError) as error:
        raise SceneError(f"{path}: not a readable image: complete the scene's files") from error
    if is_tga(path):
        bitmap.set_srgb_gamma(True)
    if is_linear:
        bitmap.set_srgb_gamma(False)
    formats = mitsuba.Bitmap.PixelFormat
    has_alpha = bitmap.pixel_format() in (formats.RGBA, formats.YA)
    target = formats.RGBA if has_alpha else formats.RGB
    return numpy.array(bitmap.convert(target, mitsuba.Struct.Type.Float32, False))


def is_tga(path: Path) -> bool:
    return path.suffix.lower() == ".tga"


def read_tga(path: Path) -> numpy.ndarray:
    """Returns the bytes of a TGA picture of greys or colours, compressed by runs or not."""
    content = path.read_bytes()
    skipped, _, kind = struct.unpack_from("<BBB", content)
    width, height, depth, flags = struct.unpack_from("<HHBB", content, 12)
    channels = depth // 8
    if kind not in (2, 3, 10, 11) or channels not in (1, 3, 4):
        raise SceneError(f"{path}: a TGA file of another kind: convert it to a PNG")
    data = content[18 + skipped :]
    if kind >= 10:
        data = expand_runs(data, channels, width * height)
    pixels = numpy.frombuffer(data, numpy.uint8, width * height * channels)
    pixels = pixels.reshape(height, width, channels)
    rows = pixels if flags & 0x20 else pixels[::-1]
    order = {1: [0, 0, 0], 3: [2, 1, 0], 4: [2, 1, 0, 3]}[channels]
    return numpy.ascontiguousarray(rows[..., order])


def expand_runs(data: bytes, channels: int, count: int) -> bytes:
    """Decodes packets, each of which repeats a pixel or has several."""
    parts, done, place = [], 0, 0
    while done < count:
        length = (data[place] & 0x7F) + 1
        is_run = data[place] >= 0x80
        size = channels if is_run else channels * length
        part = data[place + 1 : place + 1 + size]
        parts.append(part * length if is_run else part)
        done += length
        place += 1 + size
    return b"".join(parts)


def write_exr(pixels: numpy.ndarray, path: Path) -> None:
    mitsuba.Bitmap(numpy.ascontiguousarray(pixels, dtype=numpy.float32)).write(str(path))


def write_png(pixels: numpy.ndarray, path: Path) -> None:
    """Writes linear colours as sRGB with 8 bits."""
    bitmap = mitsuba.Bitmap(numpy.ascontiguousarray(pixels, dtype=numpy.float32))
    target = mitsuba.Bitmap.PixelFormat.RGB
    bitmap.convert(target, mitsuba.Struct.Type.UInt8, True).write(str(path))


def sphere_directions(rows: int) -> numpy.ndarray:
    """The directions of the texels of a latitude-longitude map of Mitsuba's, with y up."""
    down, around = numpy.meshgrid(
        (numpy.arange(rows) + 0.5) / rows * numpy.pi,
        (numpy.arange(2 * rows) + 0.5) / rows * numpy.pi,
        indexing="ij",
    )
    sine = numpy.sin(down)
    return numpy.stack(
        [numpy.sin(around) * sine, numpy.cos(down), -numpy.cos(around) * sine], axis=-1
    )


def octahedral_places(directions: numpy.ndarray) -> numpy.ndarray:
    """The places in [0,1]² of directions with z up in an equal-area map (Clarberg, "Fast Equal-Area
    Mapping of the (Hemi)Sphere using SIMD", 2008)."""
    x, y, z = numpy.moveaxis(directions, -1, 0)
    across, along = numpy.abs(x), numpy.abs(y)
    radius = numpy.sqrt(numpy.maximum(1 - numpy.abs(z), 0))
    angle = numpy.arctan2(along, across) * 2 / numpy.pi
    v = angle * radius
    u = radius - v
    u, v = numpy.where(z < 0, 1 - v, u), numpy.where(z < 0, 1 - u, v)
    places = numpy.stack([numpy.copysign(u, x), numpy.copysign(v, y)], axis=-1)
    return 0.5 * (places + 1)


def resample_sky(image: numpy.ndarray) -> numpy.ndarray:
    """Converts a square equal-area map, whose axis is z, to a latitude-longitude map for Mitsuba,
    whose axis y is that of z."""
    rows = min(SKY_ROWS, max(64, image.shape[0] // 2))
    # Each texel is the mean of 2 by 2 places.
    directions = sphere_directions(2 * rows)
    x, y, z = numpy.moveaxis(directions, -1, 0)
    places = octahedral_places(numpy.stack([x, -z, y], axis=-1))
    size = image.shape[0]
    columns, lines = numpy.moveaxis(numpy.minimum((places * size).astype(int), size - 1), -1, 0)
    fine = image[lines, columns, :3]
    return fine.reshape(rows, 2, 2 * rows, 2, 3).mean(axis=(1, 3))


def turn_sky(image: numpy.ndarray) -> numpy.ndarray:
    """Converts a latitude-longitude map, whose columns go around z from x to y, to one for Mitsuba,
    whose axis y is that of z: columns go the other way, from a quarter of the turn."""
    columns = image.shape[1]
    return image[:, (columns // 4 - 1 - numpy.arange(columns)) % columns]


def luminance(picture: numpy.ndarray) -> float:
    """The mean luminance."""
    return float(picture.mean(axis=(0, 1)) @ numpy.array([0.2126, 0.7152, 0.0722]))


def write_sheet(renders: list[numpy.ndarray], path: Path) -> None:
    """Shows renders side by side, with the exposure by which the first has a usual brightness."""
    bright = numpy.percentile(renders[0].mean(axis=-1), 95)
    exposure = 0.8 / max(float(bright), 1e-6)
    write_png(numpy.concatenate([exposure * render for render in renders], axis=1), path)

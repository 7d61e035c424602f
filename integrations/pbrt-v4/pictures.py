"""Pictures as arrays: read from PFM files, written as PNG files."""

import struct
import zlib
from pathlib import Path

import numpy


def read_pfm(path: Path) -> numpy.ndarray:
    """Linear colours, rows from the top."""
    kind, size, scale, data = path.read_bytes().split(b"\n", 3)
    width, height = (int(number) for number in size.split())
    channels = {b"PF": 3, b"Pf": 1}[kind]
    order = "<f4" if float(scale) < 0 else ">f4"
    pixels = numpy.frombuffer(data, dtype=order).reshape(height, width, channels)
    return numpy.repeat(pixels, 3 // channels, axis=2)[::-1].astype(numpy.float64)


def to_bytes(linear: numpy.ndarray) -> numpy.ndarray:
    """As sRGB has it."""
    clipped = numpy.clip(linear, 0, 1)
    curve = numpy.where(clipped <= 0.0031308, 12.92 * clipped, 1.055 * clipped ** (1 / 2.4) - 0.055)
    return (255 * curve + 0.5).astype(numpy.uint8)


def difference_bytes(difference: numpy.ndarray, gain: float) -> numpy.ndarray:
    """Grey where there is none."""
    return (255 * numpy.clip(0.5 + 0.5 * gain * difference, 0, 1) + 0.5).astype(numpy.uint8)


def write_png(path: Path, pixels: numpy.ndarray, effort: int = 9) -> None:
    """8-bit colours, rows from the top, compressed with an effort from 0 to 9."""
    height, width, _ = pixels.shape

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    rows = b"".join(b"\0" + row.tobytes() for row in pixels)
    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    parts = [chunk(b"IHDR", header), chunk(b"IDAT", zlib.compress(rows, effort)), chunk(b"IEND", b"")]
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + b"".join(parts))

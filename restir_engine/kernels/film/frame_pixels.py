"""The pixels of a frame in progress: they begin at 0, gather what its kernels contribute, and end in the film."""

from ..core.jit import inlined
from ..core.memory import load_f32, store_f32
from .contribute import add1


@inlined
def clear_pixel(pixel, channels):
    """Set the floats of a pixel to 0."""
    for k in range(channels):
        store_f32(pixel, k, 0.0)


@inlined
def add_pixels(film, pixels, x0, y0, x1, y1):
    """Add a tile of `pixels` (float32, as large as the film's) to the film."""
    for y in range(y0, y1):
        for k in range((y * film.width + x0) * film.channels, (y * film.width + x1) * film.channels):
            add1(film.pixels, k, load_f32(pixels, k))

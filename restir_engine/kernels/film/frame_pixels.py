"""The pixels of a frame in progress: they begin at 0, gather what its kernels contribute, and end in the film.

And which of them are sampled at all.
"""

from ..core.jit import device, inlined
from ..core.memory import load_f32, load_u8, store_f32
from .contribute import add1
from .cryptomatte import merge_slots


@inlined
def is_active(film, x, y):
    """Whether a pixel of the film is to be sampled: adaptive sampling is not done with it."""
    return film.active == 0 or load_u8(film.active, y * film.width + x) != 0


@inlined
def clear_pixel(pixel, channels):
    """Set the floats of a pixel to 0."""
    for k in range(channels):
        store_f32(pixel, k, 0.0)


@inlined
def add_pixels(film, pixels, width, x0, y0, x1, y1):
    """Add a tile of `pixels` to the film: float32, in rows of so many pixels, by the film's coordinates."""
    if film.crypto_slots > 0:
        _merge_mattes(film, pixels, width, x0, y0, x1, y1)
    for y in range(y0, y1):
        for x in range(x0, x1):
            start = (y * film.width + x) * film.channels
            own = (y * width + x) * film.channels
            for k in range(film.summed):
                add1(film.pixels, start + k, load_f32(pixels, own + k))


@device
def _merge_mattes(film, pixels, width, x0, y0, x1, y1):
    """Add the slots of a tile's pixels to those of the film."""
    for y in range(y0, y1):
        for x in range(x0, x1):
            pixel = 4 * film.channels * (y * film.width + x)
            own = 4 * film.channels * (y * width + x)
            for offset in (film.crypto_object, film.crypto_material, film.crypto_asset):
                if offset >= 0:
                    merge_slots(film.pixels + pixel + 4 * offset, pixels + own + 4 * offset, film.crypto_slots)

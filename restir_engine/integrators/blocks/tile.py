"""The kernel: path tracing where the pixels of a block share their exits from below surfaces."""

from ...kernels.core import rng
from ...kernels.core.jit import device, inlined, kernel
from ...kernels.core.records import CAMERA, FILM, INTEGRATOR, SCENE, path_in, tile_camera, tile_point, tile_scene
from ...kernels.core.vec import add, mul, store3_f32, vec
from ...kernels.film.contribute import NOT_FOUND, contribute, contribute_to_groups, lit_at_exit
from ...kernels.film.frame_pixels import is_active
from ...kernels.lights import light_is_sampled
from ...kernels.lobes.classes import Lobes
from ...kernels.path.direct import direct_light
from ...kernels.path.state import SHADES, start_path
from ..path.first_vertex import first_vertex, scatters_below
from ..path.trace import trace_path
from .block import begin_block, block_at, groups_of, light_of, path_of
from .exits import enter_block
from .gather import gather

_EVENTS = 2  # what scatters twice and more is one


@device
def _light(integrator, film, block):
    """Light the pixels of a block."""
    gather(block)
    b = block_at(block, 0)
    black = (0.0, 0.0, 0.0)
    for lane in range(b.domains):
        path = path_of(block, lane)
        light = light_of(block, lane, 0)
        for k in range(b.groups):
            of_group = light_of(block, lane, 1 + k)
            light = add(light, of_group)
            store3_f32(groups_of(block), k, of_group)
        what = lit_at_exit(path, Lobes(light, black, black), _EVENTS, NOT_FOUND, -1)
        value = mul(light, vec(path.throughput))
        contribute(integrator, film, path, value, what)
        if b.groups > 0:
            contribute_to_groups(integrator, film, path, value, groups_of(block))


@inlined
def _pixel_of(seed, column, row, spread, member):
    """The pixel (x, y) that a block has of a cell of `spread` pixels along each side; member: which block it is.

    spread is a power of two. The pixels of a cell belong to as many blocks, which of them to which is left to chance.
    """
    if spread == 1:
        return column, row
    index = member ^ (rng.hash_combine(rng.hash_combine(seed, column), row) & (spread * spread - 1))
    return spread * column + index % spread, spread * row + index // spread


@kernel
def blocks_tile(
    scene: SCENE, camera: CAMERA, integrator: INTEGRATOR, film: FILM, scratch, block, medium, burley,
    side, spread, seed, left, below,
    x0, y0, x1, y1, first_sample, samples,
):  # fmt: skip
    """Add so many samples to each pixel of a tile.

    A block has a pixel of each of side × side cells of `spread` × `spread` pixels. The first cells begin `left` and
    `below` before the film; seed: of who belongs to which block. block: working memory, see `block_bytes`; medium,
    burley: code of kernels.subsurface.methods.EXITS for media and for materials that ask for BURLEY, 0: they are not
    served.
    """
    whole = scene
    scene, camera = tile_scene(whole, scratch, 0), tile_camera(camera, scratch, 0)
    path, sp = path_in(scratch), tile_point(scratch)
    b = block_at(block, 0)
    sampled = light_is_sampled(scene)
    wide = side * spread
    for row in range((y0 + below) // wide, (y1 - 1 + below) // wide + 1):
        for column in range((x0 + left) // wide, (x1 - 1 + left) // wide + 1):
            for turn in range(samples * spread * spread):
                sample, member = first_sample + turn // (spread * spread), turn % (spread * spread)
                begin_block(block)
                for place_y in range(row * side, row * side + side):
                    for place_x in range(column * side, column * side + side):
                        x, y = _pixel_of(seed, place_x, place_y, spread, member)
                        x, y = x - left, y - below
                        if x < x0 or x >= x1 or y < y0 or y >= y1 or not is_active(film, x, y):
                            continue
                        pixel = film.pixels + 4 * film.channels * (y * film.width + x)
                        key = rng.key(integrator.seed, x, y, 0)
                        if whole.caught != 0:
                            scene = tile_scene(whole, scratch, 0)
                        event = start_path(scene, camera, integrator, scratch, pixel, key, sample, x, y)
                        if first_vertex(scene, camera, integrator, film, scratch, path, sp, event):
                            event = SHADES
                            if sampled and scatters_below(sp):
                                direct_light(scene, integrator, film, scratch, path, sp, 1)
                                event = enter_block(scene, integrator, film, scratch, block, path, sp, medium, burley)
                            trace_path(scene, camera, integrator, film, scratch, event, 1)
                if b.domains > 0:
                    _light(integrator, film, block)

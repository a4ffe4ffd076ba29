"""Texture nodes as instructions of shader programs; a scene without Voronoi never compiles it."""

from ...core.jit import Entry
from . import opcodes as ops
from .environment import environment_op
from .gabor import gabor_op
from .ies import ies_op
from .image import image_box_op, image_op, image_tiles_op
from .mapping import texture_mapping_op
from .noise import noise_op
from .patterns import brick_op, checker_op, gradient_op, magic_op
from .radial import radial_tiling_op
from .sky import sky_op
from .voronoi import voronoi_op
from .wave import wave_op
from .white_noise import white_noise_op

TEXTURE_ENTRIES: dict[int, Entry] = {
    ops.NOISE: noise_op,
    ops.VORONOI: voronoi_op,
    ops.WAVE: wave_op,
    ops.BRICK: brick_op,
    ops.CHECKER: checker_op,
    ops.GRADIENT: gradient_op,
    ops.MAGIC: magic_op,
    ops.WHITE_NOISE: white_noise_op,
    ops.GABOR: gabor_op,
    ops.RADIAL_TILING: radial_tiling_op,
    ops.IMAGE: image_op,
    ops.IMAGE_BOX: image_box_op,
    ops.IMAGE_TILES: image_tiles_op,
    ops.ENVIRONMENT: environment_op,
    ops.SKY: sky_op,
    ops.IES: ies_op,
    ops.TEXTURE_MAPPING: texture_mapping_op,
}

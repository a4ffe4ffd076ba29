"""Opcodes of texture instructions; the comments list operand words as in `shading.opcodes`: `!` marks immediates."""

NOISE = 100  # out (value, rgb), vector, w, scale, detail, roughness, lacunarity, offset, gain, distortion, flags!
# out (RESULTS + WORK), vector, w, scale, detail, roughness, lacunarity, smoothness, exponent, randomness, flags!
VORONOI = 101
WAVE = 102  # out, vector, scale, distortion, detail, detail scale, detail roughness, phase, flags!
# out (rgb, factor), vector, colour 1, colour 2, mortar, scale, mortar size, mortar smooth, bias, brick width,
# row height, offset, squash, offset frequency!, squash frequency!
BRICK = 103
CHECKER = 104  # out (rgb, factor), vector, colour 1, colour 2, scale
GRADIENT = 105  # out, vector, kind!
MAGIC = 106  # out (rgb, factor), vector, scale, distortion, depth!, scale first!
WHITE_NOISE = 107  # out (value, rgb), vector, w, dimensions!
GABOR = 108  # out (value, phase, intensity), vector, scale, frequency, anisotropy, angle, orientation, dimensions!
# out (coordinates, segment, width, rotation), vector, sides, roundness, normalize!
RADIAL_TILING = 109

IMAGE = 120  # out (rgb, alpha), vector, image!, flags!
IMAGE_BOX = 121  # out (rgb, alpha), vector, image!, flags!, blend
IMAGE_TILES = 122  # out (rgb, alpha), vector, table of tiles!, flags!
ENVIRONMENT = 123  # out (rgb, alpha), direction, image!, flags!, projection!
SKY = 124  # out (rgb), direction, image!, table of parameters!, kind!

IES = 125  # out, direction, strength, table!: see ies

TEXTURE_MAPPING = 130  # out (vector), vector, table of the matrix!, normalize!

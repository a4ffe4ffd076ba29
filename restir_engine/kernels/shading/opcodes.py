"""The opcodes of shader programs: one table for the compiler (`sync.nodes`) and the `interpreter`.

The comment beside an opcode lists its operand words: registers unless marked `!`, which are immediate integers. A
register operand is the first of three where a vector or colour is meant. Who has which numbers is listed in
docs/architecture.md.
"""

END = 0

# Flow and closures: interpreter -----------------------------------------------------------------------------
JUMP_ZERO = 1  # weight, distance!: skips `distance` words when the weight is 0
MIX_WEIGHTS = 2  # first_out, second_out, weight, factor
EMISSION = 3  # weight, colour, strength
HOLDOUT = 4  # weight
SET_NORMAL = 5  # normal: the shading normal from here on
JUMP_SHADOW = 6  # distance!: skips `distance` words for shadow rays, whose own program stands there
AOV = 7  # channel!, components!, value: adds to sp.aovs; of a colour the fourth channel counts
DISPLACE = 8  # vector: to sp.emission, by which the program of a displacement is asked

# Conversions and what most programs do with numbers: interpreter ----------------------------------------------
LUMINANCE = 10  # out, colour
AVERAGE = 11  # out, vector
SPLAT = 12  # out, value
COMBINE = 13  # out, x, y, z
ADD = 14  # out, components!, a, b
SUBTRACT = 15  # out, components!, a, b
MULTIPLY = 16  # out, components!, a, b
MIX = 17  # out, components!, a, b, factor: a + (b - a) · factor

# Numbers and vectors: math_ops -------------------------------------------------------------------------------
MATH = 20  # out, index into MATH_OPERATIONS!, a, b, c
CLAMP = 21  # out, value, minimum, maximum, by range!
MAP_RANGE = 22  # out, index into MAP_RANGE_MODES!, of vector!, value, from min, from max, to min, to max, steps
MATH3 = 23  # out, index into MATH_OPERATIONS!, a, b, c: by component of vectors
VECTOR_MATH = 24  # out, index into VECTOR_OPERATIONS!, a, b, c, scale; numbers are left in the first register
AFFINE = 25  # out, point, matrix (12 registers, rows of 4)
MAPPING = 26  # out, index into MAPPING_TYPES!, vector, location, rotation, scale
NORMALIZE = 27  # out, vector
ROTATE_AXIS = 28  # out, vector, centre, axis, angle
ROTATE_EULER = 29  # out, inverse!, vector, centre, rotation

# Operations of Math nodes, in the order of the immediates that stand for them, by Blender's identifiers.
MATH_OPERATIONS = (
    "ADD", "SUBTRACT", "MULTIPLY", "DIVIDE", "MULTIPLY_ADD", "POWER", "LOGARITHM", "SQRT",
    "INVERSE_SQRT", "ABSOLUTE", "EXPONENT", "MINIMUM", "MAXIMUM", "LESS_THAN", "GREATER_THAN", "SIGN",
    "COMPARE", "SMOOTH_MIN", "SMOOTH_MAX", "ROUND", "FLOOR", "CEIL", "TRUNC", "FRACT",
    "MODULO", "FLOORED_MODULO", "WRAP", "SNAP", "PINGPONG", "SINE", "COSINE", "TANGENT",
    "ARCSINE", "ARCCOSINE", "ARCTANGENT", "ARCTAN2", "SINH", "COSH", "TANH", "RADIANS",
    "DEGREES",
)  # fmt: skip
VECTOR_OPERATIONS = (
    "CROSS_PRODUCT", "PROJECT", "REFLECT", "REFRACT", "FACEFORWARD", "DOT_PRODUCT", "DISTANCE", "LENGTH", "NORMALIZE",
)  # fmt: skip
MAP_RANGE_MODES = ("LINEAR", "STEPPED", "SMOOTHSTEP", "SMOOTHERSTEP")
MAPPING_TYPES = ("POINT", "TEXTURE", "VECTOR", "NORMAL")

# Colours: color_ops ------------------------------------------------------------------------------------------
MIX_COLOR = 40  # out, index into BLEND_MODES!, factor, a, b
HUE_SATURATION = 41  # out, hue, saturation, value, factor, colour
BRIGHT_CONTRAST = 42  # out, colour, brightness, contrast
GAMMA = 43  # out, colour, gamma
INVERT = 44  # out, factor, colour
SEPARATE_COLOR = 45  # out, index into COLOR_MODES!, colour
COMBINE_COLOR = 46  # out, index into COLOR_MODES!, components
RAMP = 47  # out (4), table!, size!, interpolated!, factor
CURVES = 48  # out, table!, size!, extrapolated!, factor, colour, low, high: three curves over low … high
CURVE = 49  # out, table!, size!, extrapolated!, factor, value, low, high
BLACKBODY = 50  # out, table!, temperature in kelvin
CLAMP_COLOR = 51  # out, colour: to 0 … 1

BLEND_MODES = (
    "MIX", "DARKEN", "MULTIPLY", "BURN", "LIGHTEN", "SCREEN", "DODGE", "ADD",
    "OVERLAY", "SOFT_LIGHT", "LINEAR_LIGHT", "DIFFERENCE", "EXCLUSION", "SUBTRACT", "DIVIDE", "HUE",
    "SATURATION", "COLOR", "VALUE",
)  # fmt: skip
COLOR_MODES = ("RGB", "HSV", "HSL")

# The shading point: input_ops ---------------------------------------------------------------------------------
# `offset` (0, 1, 2) and `width` (how far away, in ray footprints) name the point itself or one shifted for a bump.
GEOMETRY = 60  # out, POINT_*!, offset!, width
ATTRIBUTE = 61  # out (4: x, y, z, alpha), name!, offset!, width
OBJECT_INFO = 62  # out (12: location, colour, alpha, object index, material index, random, particle random, unused)
LIGHT_PATH = 63  # out, index into LIGHT_PATH_OUTPUTS!
FRESNEL = 64  # out, ior, normal or -1!
LAYER_WEIGHT = 65  # out (2: fresnel, facing), blend, normal or -1!
LIGHT_FALLOFF = 66  # out (3: quadratic, linear, constant), strength, smooth
CAMERA_DATA = 67  # out (5: view vector, depth, distance)
VECTOR_TRANSFORM = 68  # out, index into TRANSFORM_TYPES!, from space!, to space!, vector
WIREFRAME = 69  # out, in pixels!, offset!, width, size
ATTRIBUTE_FACTOR = 70  # out, name!, offset!, width: x of two components, else the mean of x, y and z

(
    POINT_POSITION,
    POINT_NORMAL,
    POINT_TRUE_NORMAL,
    POINT_INCOMING,
    POINT_PARAMETRIC,
    POINT_TANGENT,
    POINT_OBJECT,
    POINT_GENERATED,
    POINT_OBJECT_NORMAL,
    POINT_CAMERA,
    POINT_WINDOW,
    POINT_REFLECTION,
    POINT_INSTANCER_GENERATED,
    POINT_INSTANCER_UV,
) = range(14)
LIGHT_PATH_OUTPUTS = (
    "Is Camera Ray", "Is Shadow Ray", "Is Diffuse Ray", "Is Glossy Ray", "Is Singular Ray", "Is Reflection Ray",
    "Is Transmission Ray", "Is Volume Scatter Ray", "Ray Length", "Ray Depth", "Diffuse Depth", "Glossy Depth",
    "Transparent Depth", "Transmission Depth", "Backfacing",
)  # fmt: skip
TRANSFORM_TYPES = ("POINT", "VECTOR", "NORMAL")
SPACES = ("WORLD", "OBJECT", "CAMERA")

# Normals: bump_ops ---------------------------------------------------------------------------------------------
# Where the gradient of a bump's height is taken: in the world, or, of displacement that has moved vertices, in the
# object's space along the places that they had, the name of which stands there.
BUMP_IN_WORLD = -1
BUMP = 80  # out, normal or -1!, height, height 1, height 2, strength, distance, width, BUMP_IN_WORLD or a name!
NORMAL_MAP = 81  # out, index into NORMAL_SPACES!, name of the tangent!, colour, strength, unit normal!
RADIAL_TANGENT = 82  # out, axis! (0, 1, 2)
UV_TANGENT = 83  # out, name of the tangent!
DISPLACEMENT = 84  # out, in object space!, height, midlevel, scale, normal or -1!
VECTOR_DISPLACEMENT = 85  # out, index into NORMAL_SPACES!, name of the tangent!, vector, midlevel, scale

NORMAL_SPACES = ("TANGENT", "OBJECT", "WORLD", "BLENDER_OBJECT", "BLENDER_WORLD")

# Rays of the program's own: ray_ops ------------------------------------------------------------------------------
AMBIENT_OCCLUSION = 192  # out, distance, rays!, inside!, own object alone!, normal or -1!
RAYCAST = 193  # out (9: hit, hit itself, distance, position, normal), position, direction, length, own object alone!
BEVEL = 194  # out, radius, probes!, normal or -1!

# Strands and spheres: shape_ops -------------------------------------------------------------------------------------
# shape: SHAPE_STRANDS or SHAPE_SPHERES. Of strands the normal nearest to the ray and the thickness, of spheres centre
# and radius, in the world; zeros on all else.
SHAPE_INFO = 195  # out (5: vector, size, whether it is such a shape), shape!

# Media, in the programs of the Volume socket: volume.program -----------------------------------------------------
# `phase` is a PHASE_* of volume.phase; its inputs are g, nothing, g and α, IOR and backscatter, the diameter in µm.
VOLUME_SCATTER = 300  # weight, colour, density, phase!, first input, second input
VOLUME_ABSORPTION = 301  # weight, colour, density
VOLUME_COEFFICIENTS = 302  # weight, absorption, scattering, emission, phase!, first input, second input
VOLUME_PRINCIPLED = 303  # weight, colour, density, anisotropy, absorption colour, emission strength, emission colour,
# blackbody intensity, blackbody tint, temperature, colour of a black body
VOLUME_SUBSURFACE = 304  # weight, share, colour, radius, scale, anisotropy, IOR, method!, sign!; subsurface.parameters
VOLUME_ATTRIBUTE = 305  # out (4), name!: an attribute of the grids, ones where there is none

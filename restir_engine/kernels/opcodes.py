"""The opcodes of shader programs: one table for the compiler (`sync.nodes`) and the interpreter (`shader_vm`).

The comment beside an opcode lists its operand words: registers unless marked `!`, which are immediate integers. A
register operand is the first of three where a vector or colour is meant. 100–199 belong to `textures`, 200–299 to `lobes`.
"""

END = 0

# Flow and closures: shader_vm -----------------------------------------------------------------------------
JUMP_ZERO = 1  # weight, distance!: skips `distance` words when the weight is 0
MIX_WEIGHTS = 2  # first_out, second_out, weight, factor
EMISSION = 3  # weight, colour, strength
HOLDOUT = 4  # weight
SET_NORMAL = 5  # normal: the shading normal from here on

# Values: vm_math ------------------------------------------------------------------------------------------
LUMINANCE = 10  # out, colour
AVERAGE = 11  # out, vector
SPLAT = 12  # out, value
COMBINE = 13  # out, x, y, z
MATH = 14  # out, index into MATH_OPERATIONS!, a, b, c
MATH3 = 15  # out, index into MATH_OPERATIONS!, a, b, c: by component of vectors
CLAMP = 16  # out, value, minimum, maximum, by range!
MIX = 17  # out, factor, a, b: numbers
VECTOR_MATH = 18  # out, index into VECTOR_OPERATIONS!, a, b, c, scale; numbers are left in the first register
MAP_RANGE = 19  # out, index into MAP_RANGE_MODES!, of vector!, value, from min, from max, to min, to max, steps
AFFINE = 20  # out, point, matrix (12 registers, rows of 4)
MAPPING = 21  # out, index into MAPPING_TYPES!, vector, location, rotation, scale
ROTATE_AXIS = 22  # out, vector, centre, axis, angle
ROTATE_EULER = 23  # out, inverse!, vector, centre, rotation
NORMALIZE = 24  # out, vector

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

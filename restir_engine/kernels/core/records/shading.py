"""Materials, images, closures, and the point that a program runs at."""

from ..memory import record_at
from .layout import record

MATERIAL = record(
    "code",  # start of the surface program in `code`, -1: none (black, no emission)
    "constants",  # start of its constants in `constants` (float64)
    "n_constants",  # copied to registers 0 … n_constants before the program runs
    "flags",  # MATERIAL_* bits
    "pass_index",
    ("crypto_material", 1),  # its id, see scene.cryptomatte
    "emission_sampling",  # 0 none, 1 auto, 2 front, 3 back, 4 both
    "medium",  # start of the program of the medium inside in `code`, -1: none; it uses the same constants
    "medium_priority",  # where media overlap, those of the highest priority count
    "displacement",  # start of the program that displaces vertices in `code`, -1: none; it uses the same constants
    "aovs",  # start of the program of its AOV Output nodes in `code`, -1: none; it uses the same constants
    ("emission_estimate", 3),  # radiance; only about right with MATERIAL_VARYING_EMISSION; 0: does not emit
    ("lambert", 3),  # weight of the one lobe of MATERIAL_LAMBERT
)
material_at = record_at(MATERIAL)
MATERIAL_EMITS = 1
MATERIAL_LAMBERT = 8  # nothing but a Lambert lobe of weight `lambert`: the program need not run
MATERIAL_TRANSPARENT = 2  # may let shadow rays through
MATERIAL_VARYING_EMISSION = 4  # emission depends on the point or the direction (a texture, a coat)
MATERIAL_SUBSURFACE = 16  # may make a LOBE_SUBSURFACE: its meshes have a bottom-level scene
MATERIAL_BUMPED_EXIT = 32  # its subsurface lobes have normals of their own: light leaves by these
MATERIAL_MEDIUM = 64  # has a medium inside
MATERIAL_BUMP_UNCORRECTED = 256  # its bumped normals are taken as they are
MATERIAL_MEDIUM_VARIES = 512  # and that medium varies in space: its program runs at points inside
MATERIAL_MEDIUM_TEXTURED = 1024  # and not by grids of voxels alone
MATERIAL_DISPLACED_NORMALS = 2048  # vertices that it displaces get normals anew: nothing else bends them
MATERIAL_BURLEY = 4096  # light below its surface is asked to follow Christensen and Burley's profile
MATERIAL_BOUNDARY = 128  # nothing but the invisible boundary of a medium: rays pass without a bounce

IMAGE = record(
    "pixels",  # float32 or uint8 [height, width, 4] rows bottom to top, alpha associated
    "width",
    "height",
    "flags",  # IMAGE_* bits
    "decode",  # float32 [IMAGE_DECODE + 1]: encoded colour in [0, 1] to scene linear, after filtering; 0: linear
)
image_at = record_at(IMAGE)
IMAGE_BYTES = 1  # pixels are uint8
IMAGE_DECODE = 1024

CLOSURE = record(
    "kind",  # LOBE_* of kernels.lobes
    ("weight", 3),
    ("sample_weight", 1),
    ("n", 3),
    ("t", 3),
    ("alpha_x", 1),
    ("alpha_y", 1),
    ("ior", 1),
    ("p", 16),  # what else the lobe needs; each lobe module names its own
    # Of microfacets under a thin film (lobes.thin_film):
    "film",  # address of the code that gives their reflectance, 0: no film
    "film_table",  # of Huang's hair, which has no film, the albedo tables
    ("film_thickness", 1),  # nm
    ("film_ior", 1),  # relative to the medium on the outside
    ("film_cosine", 1),  # what that code is asked, and its answer
    ("film_reflectance", 3),
    # Of lobes whose code is called by address (lobes.fibre):
    "code",  # that address
    ("asked", 3),
    ("answer", 4),
    ("albedo", 3),
)
closure_at = record_at(CLOSURE)
MAX_CLOSURES = 64  # as many as Cycles
MAX_REGISTERS = 2048

SHADING_POINT = record(
    "instance",  # -1: none (world or light)
    "primitive",
    "mesh",
    "shape",  # SHAPE_* of the mesh
    "material",  # index into materials: the program that runs
    "light",  # index into lights when a light's program runs, else -1
    "light_set",  # of the instance, see kernels.lights.linking
    "receiver_set",  # of what the path's ray comes from, as `receiver` below
    "backfacing",
    "ray_flags",  # RAY_* bits of the path that arrives
    "depth",
    "diffuse_depth",
    "glossy_depth",
    "transmission_depth",
    "transparent_depth",
    "closures",  # address of CLOSURE [MAX_CLOSURES]
    "n_closures",
    "scatterer",  # the closure that bsdf_sample chose with LABEL_SUBSURFACE
    "bump_uncorrected",  # 1: MATERIAL_BUMP_UNCORRECTED
    "aovs",  # address of float32: where a program's AOVs are added up
    "registers",  # address of float64 [MAX_REGISTERS], and of two rays behind them
    ("t", 1),  # length of the ray that arrived
    # Barycentric weights of corners 1 and 2 on a triangle; on a strand the place along its segment, and across, on
    # ribbons from -1 to 1, else an angle; on a sphere the direction from its centre (warp.octahedral); on a light
    # parametric.
    ("u", 1),
    ("v", 1),
    ("time", 1),
    ("terminator_frequency", 1),  # of the INSTANCE
    ("sampled_alpha_squared", 1),  # of the closure that bsdf_sample chose, α_x α_y; inf: it has no α
    ("p", 3),
    "touches",  # 1: it touches the surface that the path has come out of
    "from_inside",  # 1: light has come here from inside of the object, and ng is on the other side
    ("error", 1),  # what p and a ray from p may be wrong by in single precision
    ("n", 3),  # shading normal, on the side of wo's geometric side
    ("ng", 3),  # geometric normal, flipped to the side of wo
    ("wo", 3),  # unit, towards where the ray came from
    ("dpdu", 3),  # by barycentric u and v, world space; on strands dpdu leads along, as long as the segment about
    ("dpdv", 3),
    ("dp", 1),  # radius of the ray's footprint at p
    ("dd", 1),  # its growth by unit of distance
    # How light sampling chose where this path's ray began (lights.choice): the normal by which it weighed lights, zero
    # for none; the probabilities of a lamp, an emissive triangle, the world.
    ("receiver", 3),
    ("light_shares", 3),
    # What the program wrote:
    ("emission", 3),
    ("transparent", 3),  # weight of transparent closures
    ("holdout", 1),
)
shading_point_at = record_at(SHADING_POINT)

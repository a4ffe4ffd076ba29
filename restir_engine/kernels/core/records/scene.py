"""The camera, and the scene as one record."""

from ..memory import record_at
from .layout import record

CAMERA = record(
    "kind",  # CAMERA_*
    "width",  # of the whole frame, whatever part of it the film shows
    "height",
    "blades",
    ("to_world", 12),  # the camera looks along -z, y up
    ("to_camera", 12),
    "region_x",  # where the film begins in the whole frame, pixels from the lower left corner
    "region_y",
    ("screen", 4),  # left, right, bottom, top of the image plane at distance 1 (perspective) or in units
    ("clip_start", 1),
    ("clip_end", 1),
    ("aperture", 1),  # lens radius, 0: pinhole
    ("focus_distance", 1),
    ("blade_rotation", 1),
    ("aperture_ratio", 1),
    "projection",  # of a panorama: PANORAMA_*
    ("panorama", 4),  # from and to in x, and in y: longitude and latitude, or longitude and height (cylindrical)
    ("fisheye", 4),  # field of view (radians); lens, width and height of the sensor (mm)
    ("polynomial", 5),  # of a fisheye lens: angle to the axis by mm from the sensor's middle, negated
    ("eye", 1),  # of spherical stereo: how far an eye is from the camera, to the right; 0: there is none
    ("convergence", 1),  # distance at which the rays of both eyes meet, 0: they are parallel
    ("pole_merge", 2),  # latitudes between which the eyes draw together; the latter 0: they do not
    "n_steps",  # of `steps`, at even distances from the shutter's opening to its closing; 0: the camera stands still
    "steps",  # CAMERA_STEP [n_steps]
    "around",  # CAMERA [2]: a frame before and after, for the pass Vector; 0: it stands still
    "texels",  # TEXELS: pixels are points of a surface, which is baked; 0: they are what the camera sees
)
camera_at = record_at(CAMERA)
CAMERA_PERSPECTIVE, CAMERA_ORTHOGRAPHIC, CAMERA_PANORAMA = 0, 1, 2
PANORAMA_EQUIRECTANGULAR, PANORAMA_CYLINDRICAL, PANORAMA_MIRROR_BALL, PANORAMA_CUBE_FACE = 0, 1, 2, 3
PANORAMA_EQUIDISTANT, PANORAMA_EQUISOLID, PANORAMA_POLYNOMIAL = 4, 5, 6  # fisheye lenses

CAMERA_STEP = record(  # what of a camera changes while the shutter is open
    ("to_world", 12),
    ("screen", 4),
    ("aperture", 1),
    ("focus_distance", 1),
)
camera_step_at = record_at(CAMERA_STEP)

TEXELS = record(  # the points of one instance's surface that the pixels of a film stand for
    "instance",
    "width",
    "primitives",  # int32 [height, width], triangles; below 0: none
    "places",  # float32 [height, width, 6]: barycentrics u and v, their derivatives du/dx, du/dy, dv/dx, dv/dy by pixel
    "seeds",  # int32 [height, width] for the random numbers of each pixel
    "jittered",  # 1: samples lie all over a texel; 0: in its centre
    "from_camera",  # 1: surfaces are seen from the camera; 0: along their normals
)
texels_at = record_at(TEXELS)

SHUTTER = record(
    "table",  # float32 [SHUTTER_TABLE_SIZE]: times by the share of light that has come in before
    "rolling",  # 1: lines are read one after the other, from the top to the bottom
    ("duration", 1),  # of a line, by that of all of them
    "place",  # code, see kernels.geometry.placed
    "aim",  # code, see kernels.path.shutter
)
shutter_at = record_at(SHUTTER)
SHUTTER_TABLE_SIZE = 257

VECTORS = record(  # of the frames before and after, for the pass Vector
    "code",  # of kernels.film.vectors
    "rows",  # int32 [n_instances], where an instance's matrices stand, -1: it does not move
    "matrices",  # MATRIX [rows, 2], object to world
    "shapes",  # int64 [n_meshes]: addresses of float32 [2, vertices, 3], 0: it does not deform
)
vectors_at = record_at(VECTORS)
MATRIX = record(("m", 12))
matrix_at = record_at(MATRIX)

SCENE = record(
    "embree",  # RTCScene, top level
    "meshes",
    "n_meshes",
    "instances",
    "n_instances",
    "materials",
    "n_materials",
    "material_slots",  # int32, indices into materials
    "code",  # int32, all programs
    "constants",  # float64
    "tables",  # float32: colour ramps, curves
    "images",
    "n_images",
    "own_filter",  # code: kernels.geometry.leaving.own_filter
    "shape_entries",  # int64: addresses of what only some shapes need, see kernels.geometry.shapes
    "shader_entries",  # int64: addresses of what runs programs by opcode, see kernels.shading.interpreter
    "lobe_tables",  # float32: albedo tables, see kernels.lobes
    "lights",
    "n_lights",
    "light_table",  # owned by scene.lights: everything that selection and sampling need (its own record)
    "world_material",  # program of the world, -1: black
    "world_majorants",  # MAJORANTS of its medium, 0: it varies not
    "world_table",  # owned by scene.world: importance map
    "world_seen_by",
    "flags",
    ("bounds", 6),  # min and max of all instances
    # What belongs to a frame; see context.FrameContext.
    "camera",  # CAMERA, for nodes that read camera coordinates
    "camera_in_media",  # 1: camera rays may start inside a medium
    "shutter",  # SHUTTER; 0: what is seen is one moment
    "vectors",  # VECTORS; 0: the pass Vector is not asked for
    "caught",  # the SCENE in which paths go on that a shadow catcher has caught; 0: this one
    # What belongs to a path, in the copy of this record that a tile has (records.scratch.tile_scene).
    ("time", 1),  # 0: the shutter opens, 1: it closes
    "placed",  # address of PLACED [PLACES]: instances that move, as they are at some time; 0: all are at their middle
)
scene_at = record_at(SCENE)
SCENE_HAS_TRANSPARENT = 1
SCENE_HAS_SUBSURFACE = 2
SCENE_HAS_MEDIA = 4
SCENE_HAS_VARYING_MEDIA = 8
SCENE_HAS_PIVOTS = 32  # media, and lamps with a place beside their segments: see kernels.volume.equiangular
SCENE_WORLD_MEDIUM = 16  # the world has a medium, which is everywhere

"""Kinds of rays: the bits of Cycles' Light Path node, and what a path asks of the programs that it runs."""

# Ray types, the same bits as path flags of Light Path and as `seen_by` of instances and lights.
RAY_CAMERA = 1
RAY_REFLECT = 2
RAY_TRANSMIT = 4
RAY_DIFFUSE = 8
RAY_GLOSSY = 16
RAY_SINGULAR = 32
RAY_TRANSPARENT = 64
RAY_VOLUME = 128
RAY_SHADOW_OPAQUE = 256  # shadow rays against instances none of whose materials lets light through
RAY_SHADOW_TRANSPARENT = 512  # shadow rays against the others
RAY_SHADOW = RAY_SHADOW_OPAQUE | RAY_SHADOW_TRANSPARENT
RAY_EMISSION = 1024  # a program is run for its emission only (a light sampled by next event estimation)
RAY_LAST = 2048  # the path ends here: only emission and transparency are wanted
RAY_NO_LOBES = RAY_SHADOW | RAY_EMISSION | RAY_LAST  # programs make no BSDF closures when one of these is set
RAY_NO_REFLECTION = 4096  # caustics are off, and the ray comes from a diffuse bounce: no lobes that mirror
RAY_NO_REFRACTION = 8192  # nor any that refract
RAY_SUBSURFACE_DIFFUSE = 16384  # subsurface scattering of every method is rendered as diffuse
RAY_BURLEY_DIFFUSE = 32768  # that of BURLEY is
RAY_ALL = 1023
# Shadow rays and what they meet go by sets of blockers (kernels.lights.linking): set 0 has the bits above, set k a bit
# each of these.
BLOCKER_SETS = 8
BLOCKERS_OPAQUE, BLOCKERS_TRANSPARENT = 127 << 16, 127 << 23

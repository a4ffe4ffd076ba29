"""What INTEGRATOR.scatter points to: int64 by these indices, made by `methods.scatter_entries`."""

MEDIUM, BURLEY = 0, 1  # code of the methods, for media and for materials that ask for BURLEY
NOTE_HIT = 2  # code of the probe's filter
ALBEDOS = 3  # float32: the albedos of half spaces and slabs, see `slabs`
FLAGS = 4
OVERFLOWS = 5  # counts probes that met more surfaces than there is room for
LIGHT_FROM_CACHE = 6  # code and data of `irradiance_cache`; 0: there is none
CACHE = 7
SIZE = 8

# Bits of FLAGS.
CYCLES_BURLEY = 1  # BURLEY with the kernel that Cycles integrates
ANALOG_ESCAPE = 2  # HYBRID's scattered light leaves or not by chance, rather than with its transmittance
EXACT_WALKS = 4  # random walks without Cycles' approximations, see `walk`
THICKNESS_AWARE = 8  # HYBRID's diffusion knows how thick the object is

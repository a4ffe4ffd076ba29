"""PATH, the reference: unidirectional path tracing with next event estimation and multiple importance sampling.

Read downwards: `trace` holds the loop, `vertex` what a ray meets, `emission`, `surface` and `scatter` its events; light
samples are `kernels.path.direct`, media `kernels.volume.segment`, what goes on below a surface
`kernels.subsurface.methods`. Behaviour follows Cycles where both have a choice: power heuristic, bounce limits by lobe
class, transparency that does not count as a bounce, Russian roulette by the square root of the throughput.
"""

from .integrator import PathIntegrator

__all__ = ["PathIntegrator"]

"""Subsurface scattering by diffusion profiles, alone (DIFFUSION) and below traced single scattering (HYBRID).

`profile` is the mathematics of Burley's profile, `probe` finds points of the surface with a density like it, and the
methods themselves are entries of `kernels.scatter`.
"""

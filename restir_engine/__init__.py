"""The ReSTIR render engine: depsgraph to arrays (`sync`), arrays to pixels (`kernels`, `integrators`).

Layers, each importing only what stands to its left; nothing left of `properties` imports bpy:
embree, kernels, scene, settings/film/denoise, integrators, session, properties/sync/engine.
"""

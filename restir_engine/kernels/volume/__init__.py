"""Media that paths cross: what is inside closed meshes with a Volume, and light that is scattered and absorbed there.

`calls` is what integrators use; all else is compiled when a scene has media (docs/media.md).
"""

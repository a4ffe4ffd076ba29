"""Scenes without Blender, by what they are made of."""

"""Texture nodes as instructions of shader programs."""

from .dispatch import texture_entries, texture_op

__all__ = ["texture_entries", "texture_op"]

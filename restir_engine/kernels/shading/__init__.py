"""Shader programs: the interpreter, its instructions by family, textures."""

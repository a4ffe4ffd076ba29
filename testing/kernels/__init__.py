"""Compiled loops around single kernels, called from Python."""

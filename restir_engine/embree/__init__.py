"""Embree, from the library inside the embreex wheel: building scenes by ctypes, queries by symbol from kernels."""

"""Whole paths (ReSTIR PT): a path is kept by its seed and a vertex or light that others reconnect to."""

"""Resampling in space and time, written once for all techniques: reservoirs, MIS weights, neighbours, motion."""

"""RESTIR: frames of one sample a pixel whose direct light is resampled in space and time; one module a step."""

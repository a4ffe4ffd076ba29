"""Rays against surfaces, what a surface is like where they meet it, and the cameras that rays start from."""

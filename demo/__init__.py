"""The demo scene and the command that renders it."""

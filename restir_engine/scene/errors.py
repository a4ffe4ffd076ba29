"""What stops a render, said so that the artist knows what to do."""


class SceneError(RuntimeError):
    """The scene cannot be rendered; the message is shown to the artist as it is."""

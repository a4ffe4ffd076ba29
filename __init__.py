"""The extension as Blender sees it: `register` and `unregister`.

Imports stand inside the functions, so that reading this file costs nothing; neither function imports Numba or
compiles anything.
"""


def register() -> None:
    """Add the engine, its properties, operators and panels. A second call changes nothing."""
    from . import operators, ui
    from .restir_engine import engine

    engine.register()
    operators.register()
    ui.register()


def unregister() -> None:
    """Take away everything that `register` added."""
    from . import operators, ui
    from .restir_engine import engine

    ui.unregister()
    operators.unregister()
    engine.unregister()

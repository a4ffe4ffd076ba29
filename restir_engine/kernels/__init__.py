"""Everything compiled. Plain functions on numbers and addresses; no bpy, no classes, no globals that change."""

"""What needs Blender as a module: scenes, pictures by Cycles and by this engine, nodes' values."""

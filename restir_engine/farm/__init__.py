"""A picture by many machines: ranges of its samples, and the merging of what they are rendered to."""

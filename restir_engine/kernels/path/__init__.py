"""A path in progress, its shadow rays, and the direct light where it stands."""

"""A render farm: frames and ranges of samples as tasks, rendered by Blenders on any number of machines."""

"""A render farm: frames and ranges of samples, rendered on any number of machines, and what is made of them."""

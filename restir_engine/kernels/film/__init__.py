"""What reaches the film: light by one function, and passes that describe the first surface."""

"""Direct light at first surfaces (ReSTIR DI): the sample is a point of a light, its shift has the Jacobian 1."""

"""Light that diffuses below first surfaces (ReSTIR SSS): the sample is an exit and a point of a light."""

"""Light below surfaces: random walks, diffusion profiles and their probe, HYBRID; `methods` chooses among them."""

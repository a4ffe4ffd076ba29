"""Random walks that the pixels of a block share, by the balance heuristic over where each of them scatters first."""

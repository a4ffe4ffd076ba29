"""What all compiled code stands on: decorators, the cache on disk, memory, records, vectors, random numbers."""

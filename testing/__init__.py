"""What tests and benchmarks stand on: scenes, measures, compiled loops. It imports no test, and the engine not it."""

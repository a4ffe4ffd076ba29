"""What is resampled: each technique has a sample, its candidates, a target and a shift."""

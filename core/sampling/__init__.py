"""seed, pixel, sample, dimension -> numbers.  Everything random, as pure functions."""

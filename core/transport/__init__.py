"""plan, paths -> radiance.  The loop that follows paths."""

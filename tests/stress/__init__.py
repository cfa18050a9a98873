"""scenes, transformations, extremes -> what breaks.  Numerical stability under stress."""

"""scenes -> seconds and errors.  Penumbra measured beside Cycles, on the same machine, in turn."""

"""scenes -> verdicts.  Whether Penumbra's picture is that of Cycles, one feature at a time."""

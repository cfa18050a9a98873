"""points -> numbers.  The procedural textures: functions of coordinates alone, batch by batch.

Their values are Blender's, to the rounding of float32: patterns are made of hashes of integers
or of the bits of floats, which are the same here.  Points are (D, N), the parameters (1,) or (N,).
"""

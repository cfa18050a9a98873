"""scene -> triangles, hits, points.  Where rays meet surfaces."""

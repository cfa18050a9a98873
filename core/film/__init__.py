"""radiance -> picture.  Where samples end."""

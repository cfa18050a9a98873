"""checkout -> environments, pictures, zips.  What `dev.py` is made of; Blender never sees it."""

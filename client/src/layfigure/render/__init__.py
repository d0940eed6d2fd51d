"""A small ray tracer on Embree: pictures of meshes without a GPU, a display or a graphics library."""

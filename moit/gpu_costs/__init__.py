"""What shaders cost on GPUs that are not here: a driver's own compiler, and a model of a frame."""

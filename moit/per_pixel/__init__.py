"""A technique for every pixel: prediction, certificates, the engine of PerPixel."""

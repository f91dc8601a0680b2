"""Which technique a scene, or a pixel, needs."""

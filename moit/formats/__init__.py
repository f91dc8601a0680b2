"""Files: deep OpenEXR, images, .npz."""

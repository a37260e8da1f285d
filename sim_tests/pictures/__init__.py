"""The picture world and the camera: drawing, culling, noise, blur, timing."""

"""Makes the worker meshes that the simulation draws: ``python -m training.workers``.

A parametric body model gives the naked body, its joints and its keypoints; everything that a
warehouse worker wears is made here as geometry, painted texel by texel and packed into the files
that ``sim_tests`` loads.
"""

"""Slow, exact answers in mpmath, written from the papers and sharing nothing with the core.

`power` and `trigonometric` reconstruct from moments (Muenstermann et al. 2018), `rays` says what
lists of fragments do without any approximation, `hard_rays` makes lists that are hard to get
right. `python -m tests.oracle` prints how far the core is from all of it.
"""

"""Techniques compared: scenes, errors, times, and the report of them."""

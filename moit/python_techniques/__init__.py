"""The engine of techniques that are Python functions."""

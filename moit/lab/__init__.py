"""Stability on hard cases, and the bias that a scene needs."""

"""The process and its machine: threads, progress, files written whole, version."""

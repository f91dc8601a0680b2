"""Neural transparency: networks as files, and what they see of fragments."""

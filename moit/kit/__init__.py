"""Techniques as texts that engines take home: `moit.export`."""

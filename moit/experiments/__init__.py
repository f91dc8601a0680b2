"""Figures and tables of papers as commands: descriptions, one runner, one document."""

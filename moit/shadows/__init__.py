"""What light reaches through transparent casters: maps of them, and lights that throw shadows."""

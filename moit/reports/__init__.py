"""What reports are drawn with: tables, charts, pictures, colours."""

"""How techniques do in numbers of limited precision: hard cases, stability, bias."""

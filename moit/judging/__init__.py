"""`moit.frontier`: techniques on draws that none was tuned on, and which is best for its bytes."""

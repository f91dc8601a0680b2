"""`moit bench`: rates, rivals, and how far both are from what a machine can do."""

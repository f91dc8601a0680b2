"""Pictures some of whose meshes are drawn small: which, how they are seen, how all is joined."""

"""Questions put to the C core, and the protocol that every engine answers."""

"""Tables of a bench."""

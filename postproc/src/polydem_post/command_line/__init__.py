"""The verbs of this package, their options and help texts."""

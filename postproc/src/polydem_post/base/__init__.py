"""Geometry of polygons, files that are read and written, errors in sentences, tables of text."""

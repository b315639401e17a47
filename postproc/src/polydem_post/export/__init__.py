"""Results in the file formats of other programs: ParaView, OVITO, spreadsheets."""

from .exporting import FORMATS, export_result

__all__ = ["FORMATS", "export_result"]

"""The report: one HTML file that works offline, prints well, and says first whether to trust the result."""

from opencsp_calib.report.fleet_page import write_fleet
from opencsp_calib.report.page import write_report
from opencsp_calib.report.plots import plot_difference
from opencsp_calib.report.validation_page import validation_sections, write_validation

__all__ = ["plot_difference", "validation_sections", "write_fleet", "write_report", "write_validation"]

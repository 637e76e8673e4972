"""The ways to print a report. Each module has `render(report) -> str`."""

"""The whole comparison with the paper: its plan, runs, report and publication."""

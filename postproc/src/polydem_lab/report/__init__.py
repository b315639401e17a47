"""All tables, figures and verdicts of a bench in one folder."""

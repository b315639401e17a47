"""Prediction of the scaling over MPI ranks from counted exchanges."""

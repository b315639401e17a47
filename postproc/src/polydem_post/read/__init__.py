"""Results of runs: trajectories, frames, contacts, settings, and the folder that holds them."""

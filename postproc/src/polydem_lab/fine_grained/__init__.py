"""The model of sweeps whose lists are sorted in parallel parts."""

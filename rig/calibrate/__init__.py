"""From an instrument's readings beside a reference to its calibration: fits, nothing else."""

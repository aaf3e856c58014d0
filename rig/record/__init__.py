"""Run folders: MCAP writing, reading, recovery and tables."""

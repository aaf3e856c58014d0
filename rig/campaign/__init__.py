"""The fault campaign: whole runs on a bench that breaks, and a judgement of each."""

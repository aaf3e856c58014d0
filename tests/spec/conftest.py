"""Property tests here have no deadline: the first quantity of a process loads pint."""

from hypothesis import settings

settings.register_profile("unhurried", deadline=None)
settings.load_profile("unhurried")

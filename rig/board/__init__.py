"""What sits at the other end of the link: the native firmware on the virtual bench, or a serial Mega."""

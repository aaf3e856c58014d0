"""What sits at the other end of the link: native firmware on the virtual bench, or a Mega."""

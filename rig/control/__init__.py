"""Step-response metrics of the pressure loop."""

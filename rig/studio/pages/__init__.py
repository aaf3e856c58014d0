"""Pages: what is shown, and which view model a press of a button asks."""

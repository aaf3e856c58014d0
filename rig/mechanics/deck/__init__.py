"""Input decks: the finite element model as a file for Abaqus and CalculiX."""

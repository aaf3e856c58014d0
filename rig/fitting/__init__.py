"""From test data to material parameters: readers, fits with uncertainty, comparison of energies."""

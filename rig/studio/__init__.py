"""The bench, the designs and the runs in a browser: view models here, thin pages above them."""

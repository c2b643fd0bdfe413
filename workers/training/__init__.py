"""Learning kernels and banks: pairs and variants in, models out."""

"""Networks, their training samples, training, metrics and stored models."""

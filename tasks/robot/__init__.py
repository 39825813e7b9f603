"""The simulated Panda: model, motion, contacts."""

"""What one may look at besides the controls, one view at a time for each browser."""

"""Views beside the controls, one at a time for each browser."""

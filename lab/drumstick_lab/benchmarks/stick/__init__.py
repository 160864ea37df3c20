"""Cost and error of the stick's motion, on the paper's stick and on a sampled arm."""

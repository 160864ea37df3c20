"""What the stick's motion costs and how true it is, on paper's stick and on a sampled arm."""

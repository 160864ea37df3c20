"""What the technician's page costs, how soon it acts, and what an attack on it does."""

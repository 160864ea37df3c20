"""How late the force loop is, what a tick costs, and a month of them."""

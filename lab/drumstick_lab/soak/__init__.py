"""`drumstick soak`: does anything grow, wrap or drift while a rig plays for weeks without anybody."""

"""The stick as the paper has it: contact law, effects, exact motion and fixed steps."""

"""What train-field and its sub-commands do; fields.cli reads their options."""

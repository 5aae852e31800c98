"""What a person does with a rig: jog it, look at its plan, test it."""

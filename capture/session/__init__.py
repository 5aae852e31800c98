"""A session: its folder and journal, the engine that carries it out, its data set."""
